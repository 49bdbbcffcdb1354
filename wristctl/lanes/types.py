"""Numba's types of lanes: a number, a comparison, a planar vector, each a block of rollouts wide, and rows of them.

A lane is an LLVM vector of doubles. Arithmetic on it is vertical, so what one rollout computes cannot depend on its
neighbours, on the batch or on the thread count, bit for bit; of fast-math only `contract` (fused multiply-add) is on.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba.core import types
from numba.core.imputils import lower_builtin, lower_cast
from numba.core.typeconv import Conversion
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import models, register_model

LANES = 16
"""Rollouts of one block: two registers of AVX-512, four of AVX2, so that independent operations fill the waits of
others. Where a product and a sum fuse may change with the width, so it is the same on every machine."""

FAST = ("contract",)
VECTOR = ir.VectorType(ir.DoubleType(), LANES)
PAIR = ir.ArrayType(VECTOR, 2)


class LaneType(types.Type):
    """A number; Python's numbers convert to it by repetition."""

    llvm = VECTOR

    def __init__(self) -> None:
        super().__init__(name=f"lane{LANES}")

    def can_convert_from(self, typingctx: Any, other: types.Type) -> Conversion | None:
        """Numbers become lanes by repetition."""
        return Conversion.safe if isinstance(other, types.Number) else None


class MaskType(types.Type):
    """The result of comparing two lanes."""

    llvm = ir.VectorType(ir.IntType(1), LANES)

    def __init__(self) -> None:
        super().__init__(name=f"mask{LANES}")


class PlaneType(types.Type):
    """A planar vector, written as a complex number: x + i y."""

    llvm = PAIR

    def __init__(self) -> None:
        super().__init__(name=f"plane{LANES}")


class RowsType(types.Type):
    """A sequence of lanes or planar vectors in memory; `size` is None where only the array knows it.

    Rows may name their first entries: with `fields`, `rows.theta` is `rows[fields.index("theta")]`.
    """

    def __init__(
        self, element: Any, size: int | None, columns: int = 1, fields: tuple[str, ...] = ()
    ) -> None:
        self.element, self.size, self.columns, self.fields = element, size, columns, fields
        super().__init__(name=f"rows({element}, {size}, {columns}, {','.join(fields)})")

    @property
    def llvm(self) -> ir.Type:
        """A pointer to the first element."""
        return self.element.llvm.as_pointer()

    @property
    def entries(self) -> int:
        """Number of elements, of rows whose size is known."""
        assert self.size is not None
        return self.size * self.columns


lane = LaneType()
mask = MaskType()
plane = PlaneType()


@register_model(LaneType)
@register_model(MaskType)
@register_model(PlaneType)
@register_model(RowsType)
class _AsInLLVM(models.PrimitiveModel):
    def __init__(self, dmm: Any, fe_type: Any) -> None:
        super().__init__(dmm, fe_type, fe_type.llvm)


def repeat(builder: Any, scalar: Any) -> Any:
    """The vector of a double repeated over the lanes."""
    one = builder.insert_element(ir.Constant(VECTOR, ir.Undefined), scalar, ir.Constant(ir.IntType(32), 0))
    zeros = ir.Constant(ir.VectorType(ir.IntType(32), LANES), [0] * LANES)
    return builder.shuffle_vector(one, ir.Constant(VECTOR, ir.Undefined), zeros)


@lower_cast(types.Float, LaneType)
@lower_cast(types.Integer, LaneType)
def _number_to_lane(context: Any, builder: Any, fromty: types.Type, toty: types.Type, value: Any) -> Any:
    return repeat(builder, context.cast(builder, value, fromty, types.float64))


def define(function: Any, arguments: tuple[types.Type, ...], result: types.Type, emit: Callable[..., Any]) -> None:
    """Teach numba `function` on these types by `emit(builder, *values)`; numbers among them are repeated."""

    class Signature(AbstractTemplate):
        def generic(self, args: tuple[types.Type, ...], kws: dict[str, Any]) -> Any:
            if len(args) != len(arguments) or all(isinstance(given, types.Number) for given in args):
                return None
            fits = all(
                given == wanted or (wanted == lane and isinstance(given, types.Number))
                for given, wanted in zip(args, arguments, strict=True)
            )
            return signature(result, *arguments) if fits else None

    infer_global(function)(Signature)

    def lowered(context: Any, builder: Any, sig: Any, args: list[Any]) -> Any:
        return emit(builder, *args)

    lower_builtin(function, *arguments)(lowered)
