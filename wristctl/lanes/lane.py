"""Arithmetic of lanes and of planar vectors, as numba lowers it. Its functions run in compiled code only."""

from __future__ import annotations

import operator
from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba.core import cgutils
from numba.core.typing.templates import signature
from numba.extending import intrinsic

from wristctl.lanes.types import FAST, LANES, PAIR, VECTOR, define, lane, mask, plane

define(operator.add, (lane, lane), lane, lambda b, x, y: b.fadd(x, y, flags=FAST))
define(operator.sub, (lane, lane), lane, lambda b, x, y: b.fsub(x, y, flags=FAST))
define(operator.mul, (lane, lane), lane, lambda b, x, y: b.fmul(x, y, flags=FAST))
define(operator.truediv, (lane, lane), lane, lambda b, x, y: b.fdiv(x, y, flags=FAST))
define(operator.neg, (lane,), lane, lambda b, x: b.fneg(x, flags=FAST))
define(operator.lt, (lane, lane), mask, lambda b, x, y: b.fcmp_ordered("<", x, y))
define(operator.le, (lane, lane), mask, lambda b, x, y: b.fcmp_ordered("<=", x, y))
define(operator.gt, (lane, lane), mask, lambda b, x, y: b.fcmp_ordered(">", x, y))
define(operator.ge, (lane, lane), mask, lambda b, x, y: b.fcmp_ordered(">=", x, y))
define(operator.and_, (mask, mask), mask, lambda b, x, y: b.and_(x, y))
define(operator.or_, (mask, mask), mask, lambda b, x, y: b.or_(x, y))


def _instruction(name: str) -> Callable[..., Any]:
    def emit(builder: Any, *values: Any) -> Any:
        kind = ir.FunctionType(VECTOR, [VECTOR] * len(values))
        return builder.call(cgutils.get_or_insert_function(builder.module, kind, f"llvm.{name}.v{LANES}f64"), values)

    return emit


def where(condition: Any, yes: Any, no: Any) -> Any:
    """`yes` where the condition holds, else `no`."""
    raise NotImplementedError("compiled code only")


def sqrt(x: Any) -> Any:
    """Square root."""
    raise NotImplementedError("compiled code only")


def floor(x: Any) -> Any:
    """Largest whole number not above x."""
    raise NotImplementedError("compiled code only")


def exp2i(k: Any) -> Any:
    """2^k for whole k between -1022 and 1023."""
    raise NotImplementedError("compiled code only")


def _exp2i(builder: Any, k: Any) -> Any:
    integers = ir.VectorType(ir.IntType(64), LANES)
    biased = builder.add(builder.fptosi(k, integers), ir.Constant(integers, [1023] * LANES))
    return builder.bitcast(builder.shl(biased, ir.Constant(integers, [52] * LANES)), VECTOR)


define(where, (mask, lane, lane), lane, lambda b, c, x, y: b.select(c, x, y))
define(sqrt, (lane,), lane, _instruction("sqrt"))
define(floor, (lane,), lane, _instruction("floor"))
define(abs, (lane,), lane, _instruction("fabs"))
define(exp2i, (lane,), lane, _exp2i)


def polynomial(coefficients: tuple[float, ...]) -> Any:
    """The polynomial with these coefficients, highest power first, as a function of compiled code (Horner)."""

    def emit(context: Any, builder: Any, sig: Any, args: list[Any]) -> Any:
        total = ir.Constant(VECTOR, [coefficients[0]] * LANES)
        for coefficient in coefficients[1:]:
            product = builder.fmul(total, args[0], flags=FAST)
            total = builder.fadd(product, ir.Constant(VECTOR, [coefficient] * LANES), flags=FAST)
        return total

    @intrinsic
    def p(typingctx: Any, x: Any) -> Any:
        """Value at x."""
        return signature(lane, lane), emit

    return p


def planar(x: Any, y: Any) -> Any:
    """The planar vector x + i y."""
    raise NotImplementedError("compiled code only")


def turn(v: Any) -> Any:
    """i v: the vector turned by +90 degrees."""
    raise NotImplementedError("compiled code only")


def dot(u: Any, v: Any) -> Any:
    """Inner product of two planar vectors, a lane."""
    raise NotImplementedError("compiled code only")


def _xy(builder: Any, v: Any) -> tuple[Any, Any]:
    return builder.extract_value(v, 0), builder.extract_value(v, 1)


def _planar(builder: Any, x: Any, y: Any) -> Any:
    return builder.insert_value(builder.insert_value(ir.Constant(PAIR, ir.Undefined), x, 0), y, 1)


def _each(name: str) -> Callable[..., Any]:
    def emit(builder: Any, u: Any, v: Any) -> Any:
        parts = zip(_xy(builder, u), _xy(builder, v), strict=True)
        return _planar(builder, *(getattr(builder, name)(a, b, flags=FAST) for a, b in parts))

    return emit


def _scaled(builder: Any, s: Any, v: Any) -> Any:
    return _planar(builder, *(builder.fmul(s, a, flags=FAST) for a in _xy(builder, v)))


def _dot(builder: Any, u: Any, v: Any) -> Any:
    (a, b), (c, d) = _xy(builder, u), _xy(builder, v)
    return builder.fadd(builder.fmul(a, c, flags=FAST), builder.fmul(b, d, flags=FAST), flags=FAST)


def _complex_product(builder: Any, u: Any, v: Any) -> Any:
    (a, b), (c, d) = _xy(builder, u), _xy(builder, v)
    real = builder.fsub(builder.fmul(a, c, flags=FAST), builder.fmul(b, d, flags=FAST), flags=FAST)
    imaginary = builder.fadd(builder.fmul(a, d, flags=FAST), builder.fmul(b, c, flags=FAST), flags=FAST)
    return _planar(builder, real, imaginary)


def _turn(builder: Any, v: Any) -> Any:
    x, y = _xy(builder, v)
    return _planar(builder, builder.fneg(y, flags=FAST), x)


define(planar, (lane, lane), plane, _planar)
define(turn, (plane,), plane, _turn)
define(dot, (plane, plane), lane, _dot)
define(operator.add, (plane, plane), plane, _each("fadd"))
define(operator.sub, (plane, plane), plane, _each("fsub"))
define(operator.mul, (lane, plane), plane, _scaled)
define(operator.mul, (plane, plane), plane, _complex_product)
