"""NamedTuples in compiled code: read from rows, changed by name, and taken one block at a time.

What a NamedTuple holds is listed once, in its class; everything here goes by that list.
"""

from typing import Any

import numba
from llvmlite import ir
from numba.core import cgutils
from numba.core.typing.templates import signature
from numba.extending import intrinsic

from wristctl.lanes.rows import load_row
from wristctl.lanes.types import RowsType


def tuple_of(kind: Any) -> Any:
    """An intrinsic that reads the first rows into the NamedTuple `kind`, in the order of its fields."""
    count = len(kind._fields)

    @intrinsic
    def read(typingctx: Any, rows: RowsType) -> Any:
        def codegen(context: Any, builder: Any, sig: Any, args: list[Any]) -> Any:
            numbers = [ir.Constant(ir.IntType(64), number) for number in range(count)]
            return context.make_tuple(
                builder, sig.return_type, [load_row(builder, rows, args[0], number) for number in numbers]
            )

        return signature(numba.types.NamedUniTuple(rows.element, count, kind), rows), codegen

    return read


def replacing(*names: str) -> Any:
    """An intrinsic (record, values): the NamedTuple with these fields replaced by as many values of their types."""

    @intrinsic
    def replaced(typingctx: Any, record: numba.types.BaseNamedTuple, values: numba.types.BaseTuple) -> Any:
        places = [record.fields.index(name) for name in names]
        wanted = numba.types.Tuple(tuple(record.types[place] for place in places))

        def codegen(context: Any, builder: Any, sig: Any, args: list[Any]) -> Any:
            changed, result = args
            for number, place in enumerate(places):
                value = builder.extract_value(result, number)
                changed = builder.insert_value(changed, value, place)
            return changed

        return signature(record, record, wanted), codegen

    return replaced


def _own(array: Any, block: Any) -> Any:
    return array[min(block, len(array) - 1)]


@intrinsic
def block_of(typingctx: Any, parts: Any, block: numba.types.Integer) -> Any:
    """One block's part of a NamedTuple of arrays [block, ...], `borrowed`: an array of one block is every block's.

    Numbers and functions stay as they are, NamedTuples within are taken apart likewise.
    """
    if not isinstance(parts, numba.types.BaseNamedTuple):
        return None
    kinds = [_block_type(kind) for kind in parts.types]
    result = numba.types.NamedTuple(kinds, parts.instance_class)

    def codegen(context: Any, builder: Any, sig: Any, args: list[Any]) -> Any:
        record, index = args
        taken = _taken(context, builder, sig.args, record, index)
        context.nrt.decref(builder, result, taken)
        return _without_owners(context, builder, result, taken)

    return signature(result, parts, block), codegen


@intrinsic
def borrowed(typingctx: Any, parts: Any) -> Any:
    """A NamedTuple of arrays without their owners, who outlive the kernel: what is not owned is not counted.

    Counting costs as much as a control law, wherever compiled code reads an array of a tuple within a tick.
    """
    if not isinstance(parts, numba.types.BaseNamedTuple):
        return None

    def codegen(context: Any, builder: Any, sig: Any, args: list[Any]) -> Any:
        return _without_owners(context, builder, parts, args[0])

    return signature(parts, parts), codegen


def _without_owners(context: Any, builder: Any, kind: Any, value: Any) -> Any:
    if isinstance(kind, numba.types.BaseNamedTuple):
        parts = [
            _without_owners(context, builder, part, builder.extract_value(value, number))
            for number, part in enumerate(kind.types)
        ]
        return context.make_tuple(builder, kind, parts)
    if not isinstance(kind, numba.types.Array):
        return value
    array = cgutils.create_struct_proxy(kind)(context, builder, value)
    array.meminfo, array.parent = (cgutils.get_null_value(part.type) for part in (array.meminfo, array.parent))
    return array._getvalue()


def _block_type(kind: Any) -> Any:
    if isinstance(kind, numba.types.Array):
        return kind.copy(ndim=kind.ndim - 1) if kind.ndim > 1 else kind.dtype
    if isinstance(kind, numba.types.BaseNamedTuple):
        return numba.types.NamedTuple([_block_type(part) for part in kind.types], kind.instance_class)
    return kind


def _taken(context: Any, builder: Any, kinds: Any, record: Any, block: Any) -> Any:
    parts, index = kinds
    values = []
    for number, kind in enumerate(parts.types):
        value = builder.extract_value(record, number)
        if isinstance(kind, numba.types.Array):
            value = context.compile_internal(builder, _own, signature(_block_type(kind), kind, index), [value, block])
        elif isinstance(kind, numba.types.BaseNamedTuple):
            value = _taken(context, builder, (kind, index), value, block)
        values.append(value)
    return context.make_tuple(builder, _block_type(parts), values)
