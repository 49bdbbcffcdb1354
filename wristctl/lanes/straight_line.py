"""Functions of lanes as straight-line code: each operation once, in order, with the line of Python it comes from.

Functions of lanes have no branches and loops of known length only. So a function that runs once on symbols, which
remember what is done to them, leaves a program without loops or branches that computes the same for any numbers. Other
languages are written from that (`wristctl.commands.export.written_code`). What has no such program, as a branch on a
lane, is refused at its own line.
"""

import inspect
import math
from collections.abc import Callable, Mapping, Sequence
from types import CellType, FunctionType, ModuleType
from typing import Any, NamedTuple

from numba.core.registry import CPUDispatcher
from numba.extending import _Intrinsic

from wristctl.errors import UserError
from wristctl.lanes import compiled as compiling
from wristctl.lanes import functions, lane, rows, space
from wristctl.lanes.lane import polynomial
from wristctl.lanes.named_tuples import replacing, tuple_of
from wristctl.lanes.symbols import Line, Symbol, SymbolRows, Vector, line_of_python, refuse

# Operations of a program beyond which nobody would put it on a microcontroller.
MOST_OPERATIONS = 60_000


class Operation(NamedTuple):
    """One operation: its name, its operands (numbers of operations before it), and its value or name, if it has one.

    `const` has a number, `input` a name; all others have operands: add, sub, mul, div, neg, abs, lt, le, gt, ge, and,
    or, where, and functions of <math.h> by their names.
    """

    name: str
    operands: tuple[int, ...]
    value: Any
    line: Line | None


class Program(NamedTuple):
    """Operations in order; `outputs` has the number of the operation that gives each result."""

    operations: list[Operation]
    outputs: dict[str, int]

    @property
    def used(self) -> list[int]:
        """Numbers of the operations that the outputs need, in order."""
        needed, waiting = set[int](), list(self.outputs.values())
        while waiting:
            number = waiting.pop()
            if number not in needed:
                needed.add(number)
                waiting += self.operations[number].operands
        return sorted(needed)


class Tracer:
    """Gathers the operations of functions that run on its symbols."""

    def __init__(self) -> None:
        self._operations: list[Operation] = []
        self._numbers: dict[tuple[Any, ...], int] = {}
        self._lifted: dict[int, tuple[Any, Any]] = {}

    def input(self, name: str) -> Symbol:
        """A value that is given by name."""
        return self._add("input", (), name)

    def inputs(self, names: Sequence[str], fields: Sequence[str] = (), columns: int = 1) -> SymbolRows:
        """Rows of values that are given by these names."""
        return SymbolRows(self, [self.input(name) for name in names], fields=tuple(fields), columns=columns)

    def scratch(self, count: int) -> SymbolRows:
        """Rows that hold nothing yet."""
        return SymbolRows(self, [None] * count)

    def symbol(self, value: Any) -> Symbol:
        """A symbol as it is, or a number as one."""
        if isinstance(value, Symbol):
            return value
        return self._add("const", (), float(value))

    def program(self, outputs: Mapping[str, Any]) -> Program:
        """The program that gives these values by name. Raises UserError where it is too long."""
        numbers = {name: self.symbol(value).number for name, value in outputs.items()}
        made = Program(self._operations, numbers)
        if (count := len(made.used)) > MOST_OPERATIONS:
            problem = (
                f"this controller takes {count} operations a tick, more than the {MOST_OPERATIONS} that are written out"
            )
            raise UserError(problem, "", "another controller, or fewer turns of its loops")
        return made

    def runs(self, function: Any, *arguments: Any) -> Any:
        """What a function of lanes returns for symbols."""
        return self.lifted(function)(*arguments)

    def apply(self, name: str, *operands: Any) -> Symbol:
        """One operation on symbols and numbers; of numbers alone it is worked out."""
        symbols = [self.symbol(operand) for operand in operands]
        values = [self._operations[symbol.number] for symbol in symbols]
        if all(value.name == "const" for value in values):
            known = _worked_out(name, [value.value for value in values])
            if known is not None:
                return self._add("const", (), known)
        if name == "where" and symbols[1].number == symbols[2].number:
            return symbols[1]
        if (plain := self._neutral(name, symbols, values)) is not None:
            return plain
        return self._add(name, tuple(symbol.number for symbol in symbols), None)

    @staticmethod
    def _neutral(name: str, symbols: Sequence[Symbol], values: Sequence[Operation]) -> Symbol | None:
        """The operand that adding 0, or multiplying by 1, leaves as it is."""
        neutral = {"add": 0.0, "sub": 0.0, "mul": 1.0, "div": 1.0}.get(name)
        if name == "mul" and (nothing := [k for k in (0, 1) if values[k].name == "const" and values[k].value == 0.0]):
            return symbols[nothing[0]]  # of finite numbers
        if neutral is None:
            return None
        if values[1].name == "const" and values[1].value == neutral:
            return symbols[0]
        if name in ("add", "mul") and values[0].name == "const" and values[0].value == neutral:
            return symbols[1]
        return None

    def _add(self, name: str, operands: tuple[int, ...], value: Any) -> Symbol:
        key = (name, operands, repr(value))
        if key not in self._numbers:
            self._numbers[key] = len(self._operations)
            self._operations.append(Operation(name, operands, value, line_of_python() if operands else None))
            if len(self._operations) > 8 * MOST_OPERATIONS:
                raise UserError(
                    "this controller takes too many operations a tick to be written out", "", "another controller"
                )
        return Symbol(self, self._numbers[key])

    def lifted(self, value: Any) -> Any:
        """A value as functions on symbols are to see it: what is compiled in compiled code runs on symbols."""
        if isinstance(value, (int, float, str, type)) or value is None:
            return value
        if isinstance(value, tuple) and type(value) is tuple:
            return tuple(self.lifted(entry) for entry in value)
        if id(value) in self._lifted:
            return self._lifted[id(value)][1]
        made = self._made(value)
        self._lifted.setdefault(id(value), (value, made))  # which keeps the value, and so its id
        return self._lifted[id(value)][1]

    def _made(self, value: Any) -> Any:
        if isinstance(value, ModuleType):
            return _Module(self, value)
        if isinstance(value, _Intrinsic):
            return self._intrinsic(value)
        if isinstance(value, CPUDispatcher):
            given = _ELEMENTARY.get(id(value))
            return (lambda *operands: self.apply(given, *operands)) if given else self._copied(value.py_func)
        if not isinstance(value, FunctionType):
            return value
        if id(value) in _OF_LANES:
            return lambda *arguments: _OF_LANES[id(value)](self, *arguments)
        if any(declared is value for declared, _ in compiling._BODIES):
            return lambda part, *others: self._by_type(value, part)(part, *others)
        return self._copied(value)

    def _by_type(self, declared: Any, part: Any) -> Any:
        return self.lifted(compiling._BODIES.get((declared, type(part))) or compiling._BODIES[declared, None])

    def _copied(self, function: FunctionType) -> Any:
        """The function with what it reaches lifted."""
        world: dict[str, Any] = {"__builtins__": __builtins__, "__name__": function.__module__}
        closure = tuple(CellType() for _ in function.__closure__ or ())
        made = FunctionType(function.__code__, world, function.__name__, function.__defaults__, closure or None)
        made.__kwdefaults__ = function.__kwdefaults__
        self._lifted[id(function)] = (function, made)
        for code in compiling._codes(function.__code__):
            for name in code.co_names:
                if name in function.__globals__ and name not in world:
                    world[name] = self.lifted(function.__globals__[name])
        for cell, original in zip(closure, function.__closure__ or (), strict=True):
            cell.cell_contents = self.lifted(original.cell_contents)
        return made

    def _intrinsic(self, value: Any) -> Any:
        maker, held = value._defn.__qualname__.partition(".")[0], inspect.getclosurevars(value._defn).nonlocals
        if maker == polynomial.__name__:
            coefficients = inspect.getclosurevars(held["emit"]).nonlocals["coefficients"]
            return lambda x: _horner(coefficients, x)
        if maker == tuple_of.__name__:
            return lambda of: held["kind"](*(of[k] for k in range(len(held["kind"]._fields))))
        if maker == replacing.__name__:
            return lambda record, values: record._replace(**dict(zip(held["names"], values, strict=True)))
        name = value._defn.__name__
        if name not in _OF_ROWS:
            return lambda *_: refuse(f"{name} has no straight-line form")
        return _OF_ROWS[name]


class _Module:
    def __init__(self, tracer: Tracer, module: ModuleType) -> None:
        self._tracer, self._module = tracer, module

    def __getattr__(self, name: str) -> Any:
        return self._tracer.lifted(getattr(self._module, name))


def _horner(coefficients: Sequence[float], x: Any) -> Any:
    total: Any = coefficients[-1]
    for coefficient in coefficients[-2::-1]:
        total = total * x + coefficient
    return total


_ARITHMETIC: dict[str, Callable[..., Any]] = {
    "add": lambda a, b: a + b, "sub": lambda a, b: a - b, "mul": lambda a, b: a * b, "neg": lambda a: -a,
    "lt": lambda a, b: a < b, "le": lambda a, b: a <= b, "gt": lambda a, b: a > b, "ge": lambda a, b: a >= b,
    "and": lambda a, b: a and b, "or": lambda a, b: a or b, "where": lambda c, a, b: a if c else b,
    "div": lambda a, b: a / b, "fabs": abs, "sqrt": math.sqrt, "floor": math.floor,
}  # fmt: skip


def _worked_out(name: str, values: Sequence[float]) -> float | None:
    """An operation of numbers, where it has a finite value; comparisons are 1 and 0."""
    if name not in _ARITHMETIC:
        return None
    try:
        return float(_ARITHMETIC[name](*values))
    except (ArithmeticError, ValueError):
        return None


def _norm(tracer: Tracer, of: Any) -> Any:
    if len(of) == 1:
        return abs(of[0])
    squared: Any = 0.0
    for value in of:
        squared = squared + value * value
    return tracer.apply("sqrt", squared)


def _dot(tracer: Tracer, u: Any, v: Any) -> Any:
    total: Any = u[0] * v[0]
    for a, b in zip(u[1:], v[1:], strict=True):
        total = total + a * b
    return total


def _cross(tracer: Tracer, u: Any, v: Any) -> Any:
    return Vector(u[i] * v[j] - u[j] * v[i] for i, j in ((1, 2), (2, 0), (0, 1)))


def _where(tracer: Tracer, condition: Any, yes: Any, no: Any) -> Any:
    return tracer.apply("where", condition, yes, no)


# Functions that have no body in Python, by their id.
_OF_LANES: dict[int, Callable[..., Any]] = {
    id(lane.where): _where,
    id(lane.zero_like): lambda tracer, x: tracer.symbol(0.0),
    id(lane.sqrt): lambda tracer, x: tracer.apply("sqrt", x),
    id(lane.floor): lambda tracer, x: tracer.apply("floor", x),
    id(lane.rounded): lambda tracer, x: x,
    id(lane.exp2i): lambda tracer, k: tracer.apply("exp2", k),
    id(lane.exponent): lambda tracer, x: tracer.apply("logb", x),
    id(lane.planar): lambda tracer, x, y: Vector((x, y)),
    id(lane.turn): lambda tracer, v: Vector((-v[1], v[0])),
    id(lane.dot): _dot,
    id(space.space): lambda tracer, x, y, z: Vector((x, y, z)),
    id(space.cross): _cross,
    id(functions.norm): _norm,
}  # fmt: skip

# Elementary functions that <math.h> has, by their id.
_ELEMENTARY = {
    id(getattr(functions, name)): {"expm1_of_negative": "expm1", "power": "pow"}.get(name, name)
    for name in ("sin", "cos", "tan", "atan2", "exp", "log", "tanh", "expm1_of_negative", "power")
}


def _like(of: SymbolRows) -> SymbolRows:
    made: SymbolRows = of.tracer.scratch(len(of))
    return made


def _stacked(of: SymbolRows, size: int, count: tuple[int, ...]) -> tuple[SymbolRows, ...]:
    return tuple(_named(of.part(size * k, size), of.fields) for k in range(len(count)))


def _named(of: SymbolRows, fields: tuple[str, ...]) -> SymbolRows:
    of.fields = fields
    return of


# Views and scratch, by the names of their intrinsics.
_OF_ROWS: dict[str, Callable[..., Any]] = {
    rows.rows_of._defn.__name__: lambda of: of,
    rows.rows_at._defn.__name__: lambda stack, index: stack.arrays[index],
    "view": lambda stack, index=None: stack if index is None else stack.arrays[index],
    "part": lambda of, start, count: of.part(start, len(count)),
    "beyond": lambda of, start: of.part(start),
    "stacked": _stacked,
    "lanes_like": _like,
    "planes_like": _like,
    "spaces_like": _like,
    "square_like": lambda of: SymbolRows(of.tracer, [None] * len(of) ** 2, columns=len(of)),
    "entries": lambda of: tuple(of),
    "first_half": lambda of: of.part(0, len(of) // 2),
    "first_third": lambda of: of.part(0, len(of) // 3),
    "common_integer": lambda of: refuse("an index or the number of turns of a loop is known while it runs only"),
}
