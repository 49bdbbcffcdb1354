"""Straight-line programs as C and as NumPy: a statement for each value that is used more than once, by source lines."""

import math
from collections import Counter
from collections.abc import Sequence
from typing import Literal, NamedTuple

from wristctl.commands.export.law_programs import Function, LawPrograms
from wristctl.lanes.straight_line import Operation
from wristctl.lanes.symbols import Line

Language = Literal["c", "numpy"]
# Longest expression that stands within another.
_LONGEST = 80
_INFIX = {"add": "+", "sub": "-", "mul": "*", "div": "/", "lt": "<", "le": "<=", "gt": ">", "ge": ">="}
_LOGIC = {"c": {"and": "&&", "or": "||"}, "numpy": {"and": "&", "or": "|"}}
_BINDING = {"add": 1, "sub": 1, "mul": 2, "div": 2}
_MASKS = ("lt", "le", "gt", "ge", "and", "or")
# NumPy's names of functions that <math.h> calls otherwise.
_NUMPY = {"fabs": "np.abs", "atan2": "np.arctan2", "pow": "np.power", "logb": "_logb"}
_ATOM, _LOOSE = 3, 0


class _Expression(NamedTuple):
    text: str
    binding: int
    """How closely it holds together: an atom, a product, a sum, or a comparison."""


def number(value: float, language: Language) -> str:
    """A number as the language reads it, to the last bit."""
    if math.isfinite(value):
        return repr(float(value))
    name = "NAN" if math.isnan(value) else "INFINITY"
    name = name if language == "c" else {"NAN": "np.nan", "INFINITY": "np.inf"}[name]
    return f"-{name}" if value < 0.0 else name


def listed(values: Sequence[float]) -> str:
    """Numbers with commas between them, as both languages read them."""
    return ", ".join(repr(float(value)) for value in values)


def shared_words(programs: LawPrograms) -> dict[str, str]:
    """Words of both languages' templates: names, sizes and numbers of a law."""
    return {
        "name": programs.name, "planes": str(programs.planes), "places": str(programs.places),
        "reference": str(programs.of_a_plane * programs.planes), "period": repr(programs.period),
        "of_a_plane": str(programs.of_a_plane), "memory": str(programs.memory),
        "motor_start": listed(programs.motors), "withheld": str(2 * programs.places), "alike": listed(programs.alike),
        "driven": programs.driven, "expected": str(programs.inputs),
    }  # fmt: skip


class _Writer:
    """Statements of a function: all values, by the lines of Python that they come from, and then what it writes."""

    def __init__(self, function: Function, language: Language) -> None:
        self._language: Language = language
        self._operations, self._outputs = function.program.operations, function.program.outputs
        self._used = function.program.used
        self._uses = Counter(operand for k in self._used for operand in self._operations[k].operands)
        self._users = {operand: k for k in self._used for operand in self._operations[k].operands}
        self._given = set(self._outputs.values())
        self._expressions = dict[int, _Expression]()

    def statements(self) -> list[str]:
        """All statements, without indentation."""
        lines, last, in_c = list[str](), None, self._language == "c"
        end = ";" * in_c
        for k in self._used:
            operation = self._operations[k]
            expression = self._expression(operation)
            if not self._stands_alone(k, expression):
                self._expressions[k] = expression
                continue
            if operation.line != last:
                last = operation.line
                lines.append(self._comment(last))
            kind = f"const {'int' if operation.name in _MASKS else 'double'} " if in_c else ""
            lines.append(f"{kind}t{k} = {expression.text}{end}")
            self._expressions[k] = _Expression(f"t{k}", _ATOM)
        # what is passed on unchanged needs no statement
        written = {name: self._expressions[k].text for name, k in self._outputs.items()}
        return lines + [f"{name} = {text}{end}" for name, text in written.items() if text != name]

    def _stands_alone(self, k: int, expression: _Expression) -> bool:
        operation = self._operations[k]
        if operation.name == "const":
            return False
        if operation.name == "input":  # an entry of an array that is written before another result that needs it
            value, others = operation.value, self._outputs.items()
            return "[" in value and k in self._given and any(name != value and at == k for name, at in others)
        if self._uses[k] != 1 or k in self._given or len(expression.text) > _LONGEST:
            return True
        return self._operations[self._users[k]].line != operation.line

    def _comment(self, line: Line | None) -> str:
        words = f"{line.file}:{line.number}: {line.text}" if line else "as it was"
        return f"/* {words.replace('*/', '* /')} */" if self._language == "c" else f"# {words}"

    def _expression(self, operation: Operation) -> _Expression:
        name, language = operation.name, self._language
        if name == "const":
            text = number(operation.value, language)
            return _Expression(f"({text})" if text.startswith("-") else text, _ATOM)
        if name == "input":
            return _Expression(operation.value, _ATOM)
        parts = [self._expressions[k] for k in operation.operands]
        if name == "neg":
            return _Expression(f"(-{self._bound(parts[0], _ATOM)})", _ATOM)
        if name == "where":
            yes, no = (self._bound(part, _LOOSE) for part in parts[1:])
            if language == "c":
                return _Expression(f"({self._bound(parts[0], 1)} ? {yes} : {no})", _ATOM)
            return _Expression(f"np.where({parts[0].text}, {yes}, {no})", _ATOM)
        if name in _LOGIC[language]:
            sign = _LOGIC[language][name]
            return _Expression(f"{self._bound(parts[0], 1)} {sign} {self._bound(parts[1], 1)}", _LOOSE)
        if name in _INFIX:
            binding = _BINDING.get(name, _LOOSE)
            left, right = self._bound(parts[0], binding or 1), self._bound(parts[1], binding + 1)
            return _Expression(f"{left} {_INFIX[name]} {right}", binding)
        called = name if language == "c" else _NUMPY.get(name, f"np.{name}")
        return _Expression(f"{called}({', '.join(part.text for part in parts)})", _ATOM)

    @staticmethod
    def _bound(part: _Expression, binding: int) -> str:
        return part.text if part.binding >= binding else f"({part.text})"


def c_function(name: str, function: Function) -> str:
    """A static function of C with this name; arrays that it only reads are const."""
    parameters = [f"{'' if array in function.written else 'const '}double *{array}" for array in function.arrays]
    lines = _Writer(function, "c").statements()
    lines += [f"(void){array};" for array in function.arrays if not any(f"{array}[" in line for line in lines)]
    return "\n".join([f"static void {name}({', '.join(parameters)})", "{", *(f"    {line}" for line in lines), "}"])


def numpy_function(name: str, function: Function) -> str:
    """A function of Python with this name, which writes into the arrays that are its results."""
    lines = _Writer(function, "numpy").statements() or ["pass"]
    return "\n".join([f"def {name}({', '.join(function.arrays)}):", *(f"    {line}" for line in lines)])
