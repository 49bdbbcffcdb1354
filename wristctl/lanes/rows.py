"""Rows: sequences of lanes or planar vectors, indexed like a list or, where they form a matrix, by [i, j].

Rows are views of an array, [row, lane] of a block or [row] of a rollout alone, or scratch memory on the stack. Their
length is part of their type where it is the number of segments, so that loops over segments unroll. Scratch lives as
long as the function that asks for it.
"""

import operator
from typing import Any

import numba
from llvmlite import ir
from numba.core import cgutils, types
from numba.core.imputils import lower_builtin, lower_getattr_generic
from numba.core.typing.templates import AbstractTemplate, AttributeTemplate, infer_getattr, infer_global, signature
from numba.extending import intrinsic

import wristctl.lanes.lane  # noqa: F401 teaches numba what lanes do
from wristctl.lanes.types import WIDTHS, LaneType, PlaneType, RowsType

_PAIR_OF_INDICES = numba.types.UniTuple(numba.types.intp, 2)
# Types of an index of rows: one number, or [i, j].
INDEX_TYPES = (types.intp, _PAIR_OF_INDICES)


def _index_type(index: types.Type) -> types.Type:
    return _PAIR_OF_INDICES if isinstance(index, numba.types.BaseTuple) else types.intp


@infer_global(operator.getitem)
class _Get(AbstractTemplate):
    def generic(self, args: tuple[types.Type, ...], kws: dict[str, Any]) -> Any:
        rows, index = args
        return signature(rows.element, rows, _index_type(index)) if isinstance(rows, RowsType) else None


@infer_global(operator.setitem)
class _Set(AbstractTemplate):
    def generic(self, args: tuple[types.Type, ...], kws: dict[str, Any]) -> Any:
        rows, index, _ = args
        if not isinstance(rows, RowsType):
            return None
        return signature(types.none, rows, _index_type(index), rows.element)


@infer_global(len)
class _Length(AbstractTemplate):
    def generic(self, args: tuple[types.Type, ...], kws: dict[str, Any]) -> Any:
        return signature(types.intp, args[0]) if isinstance(args[0], RowsType) else None


def _address(builder: Any, rows: RowsType, value: Any, index: Any) -> Any:
    pointer = builder.extract_value(value, 0)
    if isinstance(index.type, ir.ArrayType):
        row, column = cgutils.unpack_tuple(builder, index)
        index = builder.add(builder.mul(row, ir.Constant(row.type, rows.columns)), column)
    return builder.gep(pointer, [index], inbounds=True, source_etype=rows.element.llvm)


def load_row(builder: Any, rows: RowsType, value: Any, index: Any) -> Any:
    """The element at an index, while code is generated."""
    return builder.load(_address(builder, rows, value, index), align=8, typ=rows.element.llvm)


def _load(context: Any, builder: Any, sig: Any, args: list[Any]) -> Any:
    return load_row(builder, sig.args[0], *args)


def store_row(context: Any, builder: Any, sig: Any, args: list[Any]) -> Any:
    """Lowering of rows[index] = value."""
    builder.store(args[2], _address(builder, sig.args[0], *args[:2]), align=8)
    return context.get_dummy_value()


for _index in INDEX_TYPES:
    lower_builtin(operator.getitem, RowsType, _index)(_load)
    for _element in (LaneType, PlaneType):
        lower_builtin(operator.setitem, RowsType, _index, _element)(store_row)


@lower_builtin(len, RowsType)
def _length(context: Any, builder: Any, sig: Any, args: list[Any]) -> Any:
    return context.get_constant(types.intp, sig.args[0].size)


@infer_getattr
class _Field(AttributeTemplate):
    key = RowsType

    def generic_resolve(self, rows: RowsType, name: str) -> types.Type | None:
        return rows.element if name in rows.fields else None


@lower_getattr_generic(RowsType)
def _field(context: Any, builder: Any, rows: RowsType, value: Any, name: str) -> Any:
    return load_row(builder, rows, value, context.get_constant(types.intp, rows.fields.index(name)))


def rows_named(fields: tuple[str, ...]) -> Any:
    """An intrinsic that views an array as `rows_of` does, its first rows by these names."""

    @intrinsic
    def view(typingctx: Any, array: types.Array) -> Any:
        return _view(array, fields)

    return view


def stack_named(fields: tuple[str, ...]) -> Any:
    """An intrinsic that views one array of a stack as `rows_at` does, its first rows by these names."""

    @intrinsic
    def view(typingctx: Any, stack: types.Array, index: types.Integer) -> Any:
        return _slab(stack, index, fields)

    return view


def _rows(builder: Any, rows: RowsType, pointer: Any) -> Any:
    return builder.insert_value(ir.Constant(rows.llvm, ir.Undefined), pointer, 0)


def _opaque(builder: Any, pointer: Any, kind: ir.Type) -> Any:
    """The pointer without its pointee, which llvmlite still gives to pointers of numba's own."""
    same = builder.gep(pointer, [ir.Constant(ir.IntType(64), 0)], inbounds=True, source_etype=kind)
    same.type = ir.PointerType()
    return same


def _view(array: types.Array, fields: tuple[str, ...] = ()) -> Any:
    if array.dtype != types.float64 or array.layout != "C" or array.ndim not in (1, 2):
        return None
    result = RowsType(LaneType(WIDTHS[array.ndim - 1]), None, fields=fields)

    def codegen(context: Any, builder: Any, sig: Any, args: list[Any]) -> Any:
        struct = cgutils.create_struct_proxy(sig.args[0])(context, builder, args[0])
        return _rows(builder, sig.return_type, _opaque(builder, struct.data, ir.DoubleType()))

    return signature(result, array), codegen


@intrinsic
def rows_of(typingctx: Any, array: types.Array) -> Any:
    """View a contiguous float64 array, [row, lane] of a block or [row] of a rollout alone, as rows of lanes."""
    return _view(array)


def _slab(stack: types.Array, index: types.Integer, fields: tuple[str, ...] = ()) -> Any:
    if stack.dtype != types.float64 or stack.layout != "C" or stack.ndim not in (2, 3):
        return None
    result = RowsType(LaneType(WIDTHS[stack.ndim - 2]), None, fields=fields)

    def codegen(context: Any, builder: Any, sig: Any, args: list[Any]) -> Any:
        struct = cgutils.create_struct_proxy(sig.args[0])(context, builder, args[0])
        size = builder.extract_value(struct.shape, 1)
        if sig.args[0].ndim == 3:
            size = builder.mul(size, builder.extract_value(struct.shape, 2))
        first = _opaque(builder, struct.data, ir.DoubleType())
        pointer = builder.gep(first, [builder.mul(args[1], size)], inbounds=True, source_etype=ir.DoubleType())
        return _rows(builder, sig.return_type, pointer)

    return signature(result, stack, types.intp), codegen


@intrinsic
def rows_at(typingctx: Any, stack: types.Array, index: types.Integer) -> Any:
    """View one array of a stack, [index, row, lane] or [index, row] of a rollout alone, as `rows_of` does."""
    return _slab(stack, index)


def _beyond(context: Any, builder: Any, sig: Any, args: list[Any]) -> Any:
    return _rows(builder, sig.return_type, _address(builder, sig.args[0], args[0], args[1]))


@intrinsic
def part(typingctx: Any, rows: RowsType, start: types.Integer, segments: Any) -> Any:
    """The rows from `start` on, as many as the tuple `segments` has entries."""

    return signature(RowsType(rows.element, len(segments)), rows, types.intp, segments), _beyond


@intrinsic
def beyond(typingctx: Any, rows: RowsType, start: types.Integer) -> Any:
    """The rows from `start` on."""

    return signature(RowsType(rows.element, None), rows, types.intp), _beyond


@intrinsic
def stacked(typingctx: Any, rows: RowsType, size: types.Integer, count: Any) -> Any:
    """Views, as many as the tuple `count` has entries, each of `size` rows after the other and with their names."""

    def codegen(context: Any, builder: Any, sig: Any, args: list[Any]) -> Any:
        starts = [builder.mul(args[1], context.get_constant(types.intp, number)) for number in range(len(count))]
        views = [_rows(builder, rows, _address(builder, rows, args[0], start)) for start in starts]
        return context.make_tuple(builder, sig.return_type, views)

    return signature(types.UniTuple(rows, len(count)), rows, types.intp, count), codegen


def scratch_rows(result: RowsType, rows: RowsType) -> Any:
    """Signature and lowering of a function of `rows` that gives memory for rows of the type `result`."""

    def codegen(context: Any, builder: Any, sig: Any, args: list[Any]) -> Any:
        memory = ir.ArrayType(result.element.llvm, result.entries)
        with builder.goto_entry_block():  # cgutils.alloca_once would set it to 0 wherever the function is inlined
            pointer = builder.alloca(memory)
        return _rows(builder, result, _opaque(builder, pointer, memory))

    return signature(result, rows), codegen


@intrinsic
def lanes_like(typingctx: Any, rows: RowsType) -> Any:
    """Scratch lanes, uninitialised, as many as `rows`."""
    return scratch_rows(RowsType(LaneType(rows.element.width), rows.size), rows)


@intrinsic
def planes_like(typingctx: Any, rows: RowsType) -> Any:
    """Scratch planar vectors, uninitialised, as many as `rows`."""
    return scratch_rows(RowsType(PlaneType(rows.element.width), rows.size), rows)


@intrinsic
def square_like(typingctx: Any, rows: RowsType) -> Any:
    """A scratch matrix of lanes, uninitialised, with a row and a column for each of `rows`."""
    return scratch_rows(RowsType(LaneType(rows.element.width), rows.size, columns=rows.size or 1), rows)


@intrinsic
def entries(typingctx: Any, rows: RowsType) -> Any:
    """The rows' lanes as a tuple; how many they are is part of their type."""

    assert rows.size is not None
    size = rows.size

    def codegen(context: Any, builder: Any, sig: Any, args: list[Any]) -> Any:
        numbers = [context.get_constant(types.intp, number) for number in range(size)]
        return context.make_tuple(builder, sig.return_type, [load_row(builder, rows, args[0], n) for n in numbers])

    return signature(types.UniTuple(rows.element, size), rows), codegen
