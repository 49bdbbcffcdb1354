"""Lanes as symbols, which remember what is done to them (`wristctl.lanes.straight_line`), and rows of them."""

import linecache
import sys
from pathlib import Path
from typing import Any, NamedTuple

from wristctl.errors import UserError

_PACKAGE = Path(__file__).resolve().parents[1]
_HERE = {__file__, str(Path(__file__).with_name("straight_line.py"))}


class Line(NamedTuple):
    """Line of Python that an operation comes from: its file as shown, its number and its text."""

    file: str
    number: int
    text: str


class Symbol:
    """A lane that remembers what is done to it."""

    __slots__ = ("number", "tracer")

    def __init__(self, tracer: Any, number: int) -> None:
        self.tracer, self.number = tracer, number

    def __add__(self, other: Any) -> Any:
        return self._with("add", other)

    def __radd__(self, other: Any) -> Any:
        return self.tracer.apply("add", other, self)

    def __sub__(self, other: Any) -> Any:
        return self._with("sub", other)

    def __rsub__(self, other: Any) -> Any:
        return self.tracer.apply("sub", other, self)

    def __mul__(self, other: Any) -> Any:
        return other * self if isinstance(other, Vector) else self._with("mul", other)

    def __rmul__(self, other: Any) -> Any:
        return self.tracer.apply("mul", other, self)

    def __truediv__(self, other: Any) -> Any:
        return self._with("div", other)

    def __rtruediv__(self, other: Any) -> Any:
        return self.tracer.apply("div", other, self)

    def __pow__(self, other: Any) -> Any:
        if not isinstance(other, int) or not 0 <= other <= 64:
            return self._with("pow", other)
        result = self.tracer.symbol(1.0)
        for _ in range(other):
            result = result * self
        return result

    def __rpow__(self, other: Any) -> Any:
        return self.tracer.apply("pow", other, self)

    def __neg__(self) -> Any:
        return self.tracer.apply("neg", self)

    def __abs__(self) -> Any:
        return self.tracer.apply("fabs", self)

    def __lt__(self, other: Any) -> Any:
        return self._with("lt", other)

    def __le__(self, other: Any) -> Any:
        return self._with("le", other)

    def __gt__(self, other: Any) -> Any:
        return self._with("gt", other)

    def __ge__(self, other: Any) -> Any:
        return self._with("ge", other)

    def __and__(self, other: Any) -> Any:
        return self._with("and", other)

    def __or__(self, other: Any) -> Any:
        return self._with("or", other)

    def __bool__(self) -> bool:
        return bool(refuse("it branches on a value that is known while it runs only"))

    def __index__(self) -> int:
        return int(refuse("an index or the number of turns of a loop is known while it runs only"))

    def __float__(self) -> float:
        return float(self.__index__())

    __int__ = __index__

    def _with(self, name: str, other: Any) -> Any:
        return self.tracer.apply(name, self, other)


class Vector(tuple[Any, ...]):
    """A vector of symbols: planar, of which a product is that of complex numbers, or in space."""

    def __add__(self, other: Any) -> Any:
        return Vector(a + b for a, b in zip(self, other, strict=True))

    def __sub__(self, other: Any) -> Any:
        return Vector(a - b for a, b in zip(self, other, strict=True))

    def __mul__(self, other: Any) -> Any:
        if not isinstance(other, Vector):
            return Vector(other * a for a in self)
        (a, b), (c, d) = self, other
        return Vector((a * c - b * d, a * d + b * c))

    def __rmul__(self, other: Any) -> Any:
        return Vector(other * a for a in self)

    @property
    def x(self) -> Any:
        """First component."""
        return self[0]

    @property
    def y(self) -> Any:
        """Second component."""
        return self[1]

    @property
    def z(self) -> Any:
        """Third component."""
        return self[2]


class SymbolRows:
    """Rows of symbols or vectors, or a view of some of them; as rows of lanes are, indexed by [k] or [i, j]."""

    def __init__(
        self, tracer: Any, values: list[Any], first: int = 0, size: int | None = None,
        fields: tuple[str, ...] = (), columns: int = 1,
    ) -> None:  # fmt: skip
        self.tracer, self.values, self.first, self.fields, self.columns = tracer, values, first, fields, columns
        self.size = len(values) - first if size is None else size

    def __len__(self) -> int:
        return self.size // self.columns

    def __iter__(self) -> Any:
        return (self[k] for k in range(len(self)))

    def __getitem__(self, index: Any) -> Any:
        return self.values[self._place(index)]

    def __setitem__(self, index: Any, value: Any) -> None:
        self.values[self._place(index)] = value if isinstance(value, Vector) else self.tracer.symbol(value)

    def __getattr__(self, name: str) -> Any:
        if name not in self.fields:
            raise AttributeError(f"there is no '{name}' among {', '.join(self.fields)}")
        return self[self.fields.index(name)]

    def _place(self, index: Any) -> int:
        place = index[0] * self.columns + index[1] if isinstance(index, tuple) else index
        return self.first + int(place)

    def part(self, start: int, size: int | None = None) -> "SymbolRows":
        """View of so many of the rows from `start` on, or of all of them."""
        return SymbolRows(self.tracer, self.values, self.first + start, size)


class Stack(NamedTuple):
    """Arrays of symbols beside each other, of which compiled code takes one by its number."""

    arrays: tuple[SymbolRows, ...]


def refuse(problem: str) -> Any:
    """Raise UserError at the line of Python that asks for what has no straight-line form."""
    found = line_of_python()
    fix = "where(condition, yes, no) for a branch; or write it by hand (documentation: A controller for your firmware)"
    raise UserError(f"this controller cannot be exported: {problem}", f"{found.file}:{found.number}", fix)


def line_of_python() -> Line:
    """The line that runs on symbols now."""
    frame: Any = sys._getframe(2)
    while frame is not None and frame.f_code.co_filename in _HERE:
        frame = frame.f_back
    file = Path(frame.f_code.co_filename)
    shown = f"wristctl/{file.relative_to(_PACKAGE)}" if file.is_relative_to(_PACKAGE) else file.name
    return Line(shown, frame.f_lineno, linecache.getline(str(file), frame.f_lineno).strip())
