"""Layout of each message in its bytes, little-endian, no padding, values scaled to whole counts; what it belongs to."""

import struct
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Any, TypeVar

from wristctl.board import messages
from wristctl.board.dictionary import BITS, CODES, PROSE, STRUCT_CODE, load
from wristctl.board.messages import Command, Fault, Reset, Result

M = TypeVar("M")
K = TypeVar("K", bound=Enum)


@dataclass(frozen=True)
class Field:
    """One field: `count` values of one struct code; the wire carries round(value * scale); the range is in `unit`."""

    name: str
    code: str
    count: int
    scale: int
    unit: str
    lowest: float | None
    highest: float | None
    kind: Callable[[int], Any] | None  # the enumeration the value belongs to

    def to_wire(self, value: Any) -> list[int]:
        """Return the wire counts of `value` (a sequence where count > 1). ValueError names field, value and range."""
        values = [value] if self.count == 1 else list(value)
        if len(values) != self.count:
            raise ValueError(f"{self.name} needs {self.count} values, got {len(values)}")
        for item in values:
            if self.lowest is not None and self.highest is not None and not self.lowest <= item <= self.highest:
                raise ValueError(f"{self.name} = {item} {self.unit} is outside {self.lowest} to {self.highest}")
        return [round(item * self.scale) for item in values]

    def from_wire(self, counts: tuple[int, ...]) -> Any:
        """Return the value, or the tuple of values, that these wire counts mean."""
        read: Callable[[int], Any] = self.kind or ((lambda n: n / self.scale) if self.scale > 1 else int)
        return read(counts[0]) if self.count == 1 else tuple(read(n) for n in counts)


class Layout:
    """The fields of one message in order; packs its named tuple into bytes and back."""

    def __init__(self, *fields: Field) -> None:
        self.fields = fields
        self.struct = struct.Struct("<" + "".join(f"{f.count}{f.code}" for f in fields))

    def pack(self, message: tuple[Any, ...]) -> bytes:
        """Return the payload. ValueError where a value is out of its range."""
        return self.struct.pack(*(n for f, value in zip(self.fields, message, strict=True) for n in f.to_wire(value)))

    def unpack(self, message: Callable[..., M], payload: bytes) -> M:
        """Return the message in this payload. struct.error where the length is wrong."""
        counts, values, position = self.struct.unpack(payload), [], 0
        for field in self.fields:
            values.append(field.from_wire(counts[position : position + field.count]))
            position += field.count
        return message(*values)


_TABLE = load()


def _prose(kind: type[K], prose: str) -> dict[K, str]:
    return {kind[name]: entry[prose] for name, entry in _TABLE[(CODES | BITS)[kind.__name__]].items()}


RESULT_MEANING, RESULT_FIX = (_prose(Result, prose) for prose in PROSE)
FAULT_MEANING, FAULT_FIX = (_prose(Fault, prose) for prose in PROSE)
RESET_MEANING = _prose(Reset, "meaning")


def _layout(entry: Mapping[str, Any]) -> Layout:
    fields = []
    for name, (code, count, scale, unit, *span) in entry["fields"].items():
        lowest, highest = span or (None, None)
        kind = getattr(messages, unit, None)
        fields.append(Field(name, STRUCT_CODE[code], count, scale, unit, lowest, highest, kind))
    return Layout(*fields)


_COMMANDS = {Command[name]: entry for name, entry in _TABLE["commands"].items()}
COMMAND_OF: dict[type, Command] = {
    getattr(messages, command.name.title()): command for command, entry in _COMMANDS.items() if entry["fields"]
}
ANSWER_TO: dict[Command, type] = {
    command: getattr(messages, entry["answer"]) for command, entry in _COMMANDS.items() if "answer" in entry
}
LAYOUTS: dict[type, Layout] = {kind: _layout(_COMMANDS[command]) for kind, command in COMMAND_OF.items()} | {
    getattr(messages, name): _layout(entry) for name, entry in _TABLE["answers"].items()
}
BOUND, FEEDS_WATCHDOG = (
    frozenset(command for command, entry in _COMMANDS.items() if entry[mark]) for mark in ("bound", "feeds")
)
