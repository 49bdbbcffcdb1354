"""Vectors of lanes in space and rows of them, as numba lowers them; their functions run in compiled code only.

Written as planar vectors are (`wristctl.lanes.lane`): a product next to a sum becomes one fused multiply-add.
"""

import operator
from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba.core import types
from numba.core.imputils import lower_builtin, lower_getattr_generic
from numba.core.typing.templates import AttributeTemplate, infer_getattr, signature
from numba.extending import intrinsic, models, register_model

from wristctl.lanes.lane import add_lanes, dot, subtract_lanes
from wristctl.lanes.rows import INDEX_TYPES, scratch_rows, store_row
from wristctl.lanes.types import LaneType, RowsType, WideType, define

_AXES = "xyz"


class SpaceType(WideType):
    """A vector in space; its components are `v.x`, `v.y` and `v.z`."""

    @property
    def llvm(self) -> ir.Type:
        """x, y and z."""
        return ir.ArrayType(LaneType(self.width).llvm, 3)


@register_model(SpaceType)
class _AsInLLVM(models.PrimitiveModel):
    def __init__(self, dmm: Any, fe_type: Any) -> None:
        super().__init__(dmm, fe_type, fe_type.llvm)


def space(x: Any, y: Any, z: Any) -> Any:
    """The vector with these components."""
    raise NotImplementedError("compiled code only")


def cross(u: Any, v: Any) -> Any:
    """Vector product."""
    raise NotImplementedError("compiled code only")


def _xyz(builder: Any, v: Any) -> list[Any]:
    fresh = []
    while getattr(v, "opname", None) == "insertvalue":  # from _space: its products may still fuse
        fresh.append(v.operands[1])
        v = v.operands[0]
    return fresh[::-1] if len(fresh) == 3 else [builder.extract_value(v, axis) for axis in range(3)]


def _space(builder: Any, x: Any, y: Any, z: Any) -> Any:
    vector = ir.Constant(ir.ArrayType(x.type, 3), ir.Undefined)
    for axis, part in enumerate((x, y, z)):
        vector = builder.insert_value(vector, part, axis)
    return vector


def _by_axis(emit_part: Callable[..., Any]) -> Callable[..., Any]:
    def emit(builder: Any, u: Any, v: Any) -> Any:
        parts = zip(_xyz(builder, u), _xyz(builder, v), strict=True)
        return _space(builder, *(emit_part(builder, a, b) for a, b in parts))

    return emit


def _scaled(builder: Any, s: Any, v: Any) -> Any:
    return _space(builder, *(builder.fmul(s, part) for part in _xyz(builder, v)))


def _dot(builder: Any, u: Any, v: Any) -> Any:
    first, *others = zip(_xyz(builder, u), _xyz(builder, v), strict=True)
    total = builder.fmul(*first)
    for a, b in others:
        total = add_lanes(builder, builder.fmul(a, b), total)
    return total


def _cross(builder: Any, u: Any, v: Any) -> Any:
    a, b = _xyz(builder, u), _xyz(builder, v)
    return _space(
        builder,
        *(
            subtract_lanes(builder, builder.fmul(a[i], b[j]), builder.fmul(a[j], b[i]))
            for i, j in ((1, 2), (2, 0), (0, 1))
        ),
    )


_VECTORS = (SpaceType, SpaceType)
define(space, (LaneType, LaneType, LaneType), SpaceType, _space)
define(cross, _VECTORS, SpaceType, _cross)
define(dot, _VECTORS, LaneType, _dot)
define(operator.add, _VECTORS, SpaceType, _by_axis(add_lanes))
define(operator.sub, _VECTORS, SpaceType, _by_axis(subtract_lanes))
define(operator.mul, (LaneType, SpaceType), SpaceType, _scaled)

for _index in INDEX_TYPES:
    lower_builtin(operator.setitem, RowsType, _index, SpaceType)(store_row)


@infer_getattr
class _Component(AttributeTemplate):
    key = SpaceType

    def generic_resolve(self, vector: SpaceType, name: str) -> types.Type | None:
        return LaneType(vector.width) if name in _AXES else None


@lower_getattr_generic(SpaceType)
def _component(context: Any, builder: Any, vector: SpaceType, value: Any, name: str) -> Any:
    return builder.extract_value(value, _AXES.index(name))


@intrinsic
def spaces_like(typingctx: Any, rows: RowsType) -> Any:
    """Scratch vectors in space, uninitialised, as many as `rows`."""
    return scratch_rows(RowsType(SpaceType(rows.element.width), rows.size), rows)


def _first(rows: RowsType, parts: int) -> Any:
    """Signature and lowering of a view of the first rows of so many equal parts."""

    def codegen(context: Any, builder: Any, sig: Any, args: list[Any]) -> Any:
        return args[0]

    assert rows.size is not None and rows.size % parts == 0
    return signature(RowsType(rows.element, rows.size // parts), rows), codegen


@intrinsic
def first_half(typingctx: Any, rows: RowsType) -> Any:
    """The first half of the rows: one for each segment, of rows of two coordinates a segment."""
    return _first(rows, 2)


@intrinsic
def first_third(typingctx: Any, rows: RowsType) -> Any:
    """The first third of the rows: one for each tendon, of rows of three values a tendon."""
    return _first(rows, 3)
