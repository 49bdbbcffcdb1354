"""Arithmetic of lanes and of planar vectors, as numba lowers it. Its functions run in compiled code only.

A product next to a sum becomes one fused multiply-add, rounded once; of two products the first fuses.
"""

import operator
from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba.core import cgutils, types
from numba.core.typing.templates import signature
from numba.extending import intrinsic, overload

from wristctl.lanes.types import LaneType, MaskType, PlaneType, define


def _instruction(name: str) -> Callable[..., Any]:
    def emit(builder: Any, *values: Any) -> Any:
        vector = values[0].type
        kind = ir.FunctionType(vector, [vector] * len(values))
        function = cgutils.get_or_insert_function(builder.module, kind, f"llvm.{name}.v{vector.count}f64")
        return builder.call(function, values)

    return emit


_fma = _instruction("fma")


def _factors(value: Any) -> Any:
    return value.operands if getattr(value, "opname", None) == "fmul" else None


def add_lanes(builder: Any, x: Any, y: Any) -> Any:
    """Emit x + y, fused with a product next to it."""
    if product := _factors(x):
        return _fma(builder, *product, y)
    if product := _factors(y):
        return _fma(builder, *product, x)
    return builder.fadd(x, y)


def subtract_lanes(builder: Any, x: Any, y: Any) -> Any:
    """Emit x - y, fused with a product next to it."""
    if product := _factors(x):
        return _fma(builder, *product, builder.fneg(y))
    if product := _factors(y):
        return _fma(builder, builder.fneg(product[0]), product[1], x)
    return builder.fsub(x, y)


_TWO = (LaneType, LaneType)
define(operator.add, _TWO, LaneType, add_lanes)
define(operator.sub, _TWO, LaneType, subtract_lanes)
define(operator.mul, _TWO, LaneType, lambda b, x, y: b.fmul(x, y))
define(operator.truediv, _TWO, LaneType, lambda b, x, y: b.fdiv(x, y))
define(operator.neg, (LaneType,), LaneType, lambda b, x: b.fneg(x))
define(operator.lt, _TWO, MaskType, lambda b, x, y: b.fcmp_ordered("<", x, y))
define(operator.le, _TWO, MaskType, lambda b, x, y: b.fcmp_ordered("<=", x, y))
define(operator.gt, _TWO, MaskType, lambda b, x, y: b.fcmp_ordered(">", x, y))
define(operator.ge, _TWO, MaskType, lambda b, x, y: b.fcmp_ordered(">=", x, y))
define(operator.and_, (MaskType, MaskType), MaskType, lambda b, x, y: b.and_(x, y))
define(operator.or_, (MaskType, MaskType), MaskType, lambda b, x, y: b.or_(x, y))


def where(condition: Any, yes: Any, no: Any) -> Any:
    """`yes` where the condition holds, else `no`."""
    raise NotImplementedError("compiled code only")


def zero_like(x: Any) -> Any:
    """0 in each lane of x, whatever x is: a lane from the start, as a sum over lanes needs it."""
    raise NotImplementedError("compiled code only")


def sqrt(x: Any) -> Any:
    """Square root."""
    raise NotImplementedError("compiled code only")


def floor(x: Any) -> Any:
    """Largest whole number not above x."""
    raise NotImplementedError("compiled code only")


def rounded(x: Any) -> Any:
    """x as it is rounded: a product that does not fuse with the sum it stands in."""
    raise NotImplementedError("compiled code only")


def exp2i(k: Any) -> Any:
    """2^k for whole k between -1022 and 1023."""
    raise NotImplementedError("compiled code only")


def exponent(x: Any) -> Any:
    """The whole k of x = m 2^k with 1 <= m < 2, for x of at least 2^-1022."""
    raise NotImplementedError("compiled code only")


def _exp2i(builder: Any, k: Any) -> Any:
    width = k.type.count
    integers = ir.VectorType(ir.IntType(64), width)
    biased = builder.add(builder.fptosi(k, integers), ir.Constant(integers, [1023] * width))
    return builder.bitcast(builder.shl(biased, ir.Constant(integers, [52] * width)), k.type)


def _exponent(builder: Any, x: Any) -> Any:
    width = x.type.count
    integers = ir.VectorType(ir.IntType(64), width)
    biased = builder.lshr(builder.bitcast(x, integers), ir.Constant(integers, [52] * width))
    return builder.sitofp(builder.sub(biased, ir.Constant(integers, [1023] * width)), x.type)


define(where, (MaskType, LaneType, LaneType), LaneType, lambda b, c, x, y: b.select(c, x, y))
define(zero_like, (LaneType,), LaneType, lambda b, x: ir.Constant(x.type, [0.0] * x.type.count))
define(sqrt, (LaneType,), LaneType, _instruction("sqrt"))
define(floor, (LaneType,), LaneType, _instruction("floor"))
define(abs, (LaneType,), LaneType, _instruction("fabs"))
define(exp2i, (LaneType,), LaneType, _exp2i)
define(exponent, (LaneType,), LaneType, _exponent)
define(rounded, (LaneType,), LaneType, lambda b, x: b.fadd(x, ir.Constant(x.type, [-0.0] * x.type.count)))


@intrinsic
def common_integer(typingctx: Any, x: Any) -> Any:
    """The whole number that all lanes of x hold, as an integer: an index, or a number of turns of a loop."""

    def codegen(context: Any, builder: Any, sig: Any, args: list[Any]) -> Any:
        first = builder.extract_element(args[0], ir.Constant(ir.IntType(32), 0))
        return builder.fptosi(first, ir.IntType(64))

    return (signature(types.intp, x), codegen) if isinstance(x, LaneType) else None


@overload(rounded, strict=False)
def _rounded_number(x: Any) -> Any:
    return (lambda x: x) if isinstance(x, types.Float) else None


@overload(where, strict=False)
def _where_number(condition: Any, yes: Any, no: Any) -> Any:
    return (lambda condition, yes, no: yes if condition else no) if isinstance(condition, types.Boolean) else None


@overload(zero_like, strict=False)
def _zero_like_number(x: Any) -> Any:
    return (lambda x: 0.0) if isinstance(x, types.Number) else None


def polynomial(coefficients: tuple[float, ...]) -> Any:
    """The polynomial with these coefficients, lowest power first, as a function of compiled code.

    Estrin's scheme: neighbours pair up again and again, so that a lane alone does not wait as it does with Horner's.
    """

    def emit(context: Any, builder: Any, sig: Any, args: list[Any]) -> Any:
        power = args[0]
        terms = [ir.Constant(power.type, [coefficient] * power.type.count) for coefficient in coefficients]
        while len(terms) > 1:
            pairs = [_fma(builder, odd, power, even) for even, odd in zip(terms[::2], terms[1::2], strict=False)]
            terms = pairs + terms[2 * len(pairs) :]
            power = builder.fmul(power, power)
        return terms[0]

    @intrinsic
    def p(typingctx: Any, x: Any) -> Any:
        """Value at x."""
        return signature(x, x) if isinstance(x, LaneType) else None, emit

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
    if getattr(v, "opname", None) == "insertvalue":  # fresh from _planar: its products may still fuse
        return v.operands[0].operands[1], v.operands[1]
    return builder.extract_value(v, 0), builder.extract_value(v, 1)


def _planar(builder: Any, x: Any, y: Any) -> Any:
    empty = ir.Constant(ir.ArrayType(x.type, 2), ir.Undefined)
    return builder.insert_value(builder.insert_value(empty, x, 0), y, 1)


def _each(emit_part: Callable[..., Any]) -> Callable[..., Any]:
    def emit(builder: Any, u: Any, v: Any) -> Any:
        parts = zip(_xy(builder, u), _xy(builder, v), strict=True)
        return _planar(builder, *(emit_part(builder, a, b) for a, b in parts))

    return emit


def _scaled(builder: Any, s: Any, v: Any) -> Any:
    return _planar(builder, *(builder.fmul(s, a) for a in _xy(builder, v)))


def _dot(builder: Any, u: Any, v: Any) -> Any:
    (a, b), (c, d) = _xy(builder, u), _xy(builder, v)
    return add_lanes(builder, builder.fmul(a, c), builder.fmul(b, d))


def _complex_product(builder: Any, u: Any, v: Any) -> Any:
    (a, b), (c, d) = _xy(builder, u), _xy(builder, v)
    real = subtract_lanes(builder, builder.fmul(a, c), builder.fmul(b, d))
    imaginary = add_lanes(builder, builder.fmul(a, d), builder.fmul(b, c))
    return _planar(builder, real, imaginary)


def _turn(builder: Any, v: Any) -> Any:
    x, y = _xy(builder, v)
    return _planar(builder, builder.fneg(y), x)


_VECTORS = (PlaneType, PlaneType)
define(planar, _TWO, PlaneType, _planar)
define(turn, (PlaneType,), PlaneType, _turn)
define(dot, _VECTORS, LaneType, _dot)
define(operator.add, _VECTORS, PlaneType, _each(add_lanes))
define(operator.sub, _VECTORS, PlaneType, _each(subtract_lanes))
define(operator.mul, (LaneType, PlaneType), PlaneType, _scaled)
define(operator.mul, _VECTORS, PlaneType, _complex_product)
