"""Numba's types of lanes: a number, a comparison, a planar vector, each a block of rollouts wide, and rows of them.

A lane is an LLVM vector of doubles, as wide as a block of rollouts or, where there is only one, of width one.
Arithmetic on it is vertical and without fast-math; a product and a sum fuse where they are written next to each other
(`wristctl.lanes.lane`), not where a compiler finds it convenient. So what a rollout computes cannot depend, bit for
bit, on its neighbours, on the batch, on the thread count or on the processor's registers.
"""

from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba.core import types
from numba.core.imputils import lower_builtin, lower_cast
from numba.core.typeconv import Conversion
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import models, register_model

# Rollouts of one block: a register of AVX-512, two of AVX2. Sixteen are a quarter faster with one segment, where what
# a step works on fits the registers, and a fifth slower with four, where it does not.
LANES = 8

# A rollout alone, and a block of rollouts.
WIDTHS = (1, LANES)


class WideType(types.Type):
    """What is a block of rollouts wide."""

    def __init__(self, width: int) -> None:
        self.width = width
        super().__init__(name=f"{type(self).__name__}({width})")


class LaneType(WideType):
    """A number; Python's numbers convert to it by repetition."""

    @property
    def llvm(self) -> ir.VectorType:
        """A double for each rollout."""
        return ir.VectorType(ir.DoubleType(), self.width)

    def can_convert_from(self, typingctx: Any, other: types.Type) -> Conversion | None:
        """Numbers become lanes by repetition."""
        return Conversion.safe if isinstance(other, types.Number) else None


class MaskType(WideType):
    """The result of comparing two lanes."""

    @property
    def llvm(self) -> ir.Type:
        """A bit for each rollout."""
        return ir.VectorType(ir.IntType(1), self.width)


class PlaneType(WideType):
    """A planar vector, written as a complex number: x + i y."""

    @property
    def llvm(self) -> ir.Type:
        """x and y."""
        return ir.ArrayType(LaneType(self.width).llvm, 2)


class RowsType(types.Type):
    """A sequence of lanes or planar vectors in memory; `size` is None where only the array knows it.

    Rows may name their first entries: with `fields`, `rows.theta` is `rows[fields.index("theta")]`.
    """

    def __init__(self, element: Any, size: int | None, columns: int = 1, fields: tuple[str, ...] = ()) -> None:
        self.element, self.size, self.columns, self.fields = element, size, columns, fields
        super().__init__(name=f"rows({element}, {size}, {columns}, {','.join(fields)})")

    @property
    def llvm(self) -> ir.Type:
        """A pointer, which does not say to what: loads and stores name the element.

        In a structure, since numba's variables cannot hold such a pointer itself.
        """
        return ir.LiteralStructType([ir.PointerType()])

    @property
    def entries(self) -> int:
        """Number of elements, of rows whose size is known."""
        assert self.size is not None
        return self.size * self.columns


@register_model(LaneType)
@register_model(MaskType)
@register_model(PlaneType)
@register_model(RowsType)
class _AsInLLVM(models.PrimitiveModel):
    def __init__(self, dmm: Any, fe_type: Any) -> None:
        super().__init__(dmm, fe_type, fe_type.llvm)


def repeat(builder: Any, scalar: Any, vector: ir.VectorType) -> Any:
    """The vector of a double repeated over the lanes."""
    one = builder.insert_element(ir.Constant(vector, ir.Undefined), scalar, ir.Constant(ir.IntType(32), 0))
    zeros = ir.Constant(ir.VectorType(ir.IntType(32), vector.count), [0] * vector.count)
    return builder.shuffle_vector(one, ir.Constant(vector, ir.Undefined), zeros)


@lower_cast(types.Float, LaneType)
@lower_cast(types.Integer, LaneType)
def _number_to_lane(context: Any, builder: Any, fromty: types.Type, toty: LaneType, value: Any) -> Any:
    return repeat(builder, context.cast(builder, value, fromty, types.float64), toty.llvm)


def define(
    function: Any, arguments: tuple[type[WideType], ...], result: type[WideType], emit: Callable[..., Any]
) -> None:
    """Teach numba `function` on these types by `emit(builder, *values)`; numbers among the lanes are repeated."""

    def lowered(context: Any, builder: Any, sig: Any, args: list[Any]) -> Any:
        return emit(builder, *args)

    for width in WIDTHS:
        _teach(function, tuple(kind(width) for kind in arguments), result(width), lowered)


def _teach(function: Any, arguments: tuple[WideType, ...], result: WideType, lowered: Callable[..., Any]) -> None:
    class Signature(AbstractTemplate):
        def generic(self, args: tuple[types.Type, ...], kws: dict[str, Any]) -> Any:
            if len(args) != len(arguments) or all(isinstance(argument, types.Number) for argument in args):
                return None
            fits = all(
                argument == wanted or (isinstance(wanted, LaneType) and isinstance(argument, types.Number))
                for argument, wanted in zip(args, arguments, strict=True)
            )
            return signature(result, *arguments) if fits else None

    infer_global(function)(Signature)
    lower_builtin(function, *arguments)(lowered)
