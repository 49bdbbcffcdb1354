"""Small wrong changes to a source file: signs, units, windows, orders, defaults, off by one.

Each is what somebody might have typed. Left out is what no behaviour rests on: texts, annotations, logging, looks and
paces (EXEMPT says which and why).
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple


class Change(NamedTuple):
    """Replace the text between two offsets of a file."""

    file: str
    line: int
    kind: str
    start: int
    end: int
    old: str
    new: str

    def apply(self, source: str) -> str:
        """The source with the change."""
        return source[: self.start] + self.new + source[self.end :]

    @property
    def told(self) -> str:
        """In one line."""
        return f"{self.file}:{self.line} {self.kind}: {self.old!r} -> {self.new!r}"


EXEMPT = {
    "plotting/style.py": "colours, sizes and line widths are taste",
    "commands/calibrate/print_sheet.py": "the drawing of a sheet; its sizes are measured in the printed file",
    "vision/scene_parts.py": "the looks of the rendered wrist and of a hand; where its markers are is tested",
    "board/messages.py": "generated from messages.toml, and compared with what is generated",
    "cli/progress.py": "how often a line is drawn",
    "cli/trial_panel.py": "the looks of a panel",
    "processes.py": "the processor's",
}
"""Files in which a change is no bug, and why."""

_LOOKS = {
    "linewidth", "fontsize", "markersize", "alpha", "figsize", "color", "facecolor", "edgecolor", "zorder", "hatch",
    "width", "height", "height_ratios", "width_ratios", "pad", "labelpad", "rotation", "ha", "va", "loc", "ncols",
    "dpi", "indent", "refresh_per_second", "padding", "aspect", "markevery", "thickness", "stacklevel", "timeout",
    "maxsize", "max_workers", "min_length", "bbox_to_anchor", "rasterized", "clip_on", "capsize", "s", "marker",
    "strict", "allow_nan", "missing_ok", "follow_imports", "sort_keys", "ensure_ascii", "validate", "frozen",
    "align", "fused", "dont_inherit", "do_compression", "include_url", "inbounds", "kw_only", "repr", "nogil", "wspace",
    "hspace", "bins",
}  # fmt: skip
"""Keywords that say how something looks, how long somebody is waited for, how fast it is, or what is never so."""

_DRAWN = {
    "plot", "text", "annotate", "set", "set_xlim", "set_ylim", "set_xticks", "set_yticks", "legend", "colorbar",
    "figure", "add_patch", "tick_params", "Circle", "Polygon", "Rectangle", "axvspan", "axhspan", "axhline", "axvline",
    "Normalize", "subplots_adjust", "pcolormesh", "fill_between", "scatter", "step", "legend_below", "margins",
    "set_box_aspect", "_panels",
}  # fmt: skip
"""Calls in report/ whose numbers are places on a page."""

_PACES = (
    "_SLICE",
    "_SHARES",
    "_TOGETHER",
    "_KEPT",
    "_PULSE",
    "_PAUSE",
    "_LINGER",
    "_EVERY",
    "_PATIENCE",
    "_RESERVE",
    "_POLL",
    "_LOOK",
    "_ANSWERS",
)
"""Beginnings of names of constants that only decide how fast something goes or how long it is kept."""

_SIZES = ("_WIDTH", "_HEIGHT", "_GAP", "_ROW", "_LINE", "_SMOOTH")
"""Beginnings of names of constants that are sizes in a picture, or how finely a curve is drawn."""

_OPERATORS: dict[type[ast.AST], tuple[str, str]] = {
    ast.Add: ("+", "-"), ast.Sub: ("-", "+"), ast.Mult: ("*", "/"), ast.Div: ("/", "*"), ast.FloorDiv: ("//", "%"),
    ast.Mod: ("%", "//"), ast.Pow: ("**", "*"), ast.BitAnd: ("&", "|"), ast.BitOr: ("|", "&"),
    ast.LShift: ("<<", ">>"), ast.RShift: (">>", "<<"),
    ast.Lt: ("<", "<="), ast.LtE: ("<=", "<"), ast.Gt: (">", ">="), ast.GtE: (">=", ">"), ast.Eq: ("==", "!="),
    ast.NotEq: ("!=", "=="), ast.Is: ("is", "is not"), ast.IsNot: ("is not", "is"), ast.In: ("in", "not in"),
    ast.NotIn: ("not in", "in"), ast.And: ("and", "or"), ast.Or: ("or", "and"),
}  # fmt: skip
_TURNED = {"<": ">", "<=": ">=", ">": "<", ">=": "<="}
_TWINS = {
    "min": "max", "max": "min", "minimum": "maximum", "maximum": "minimum", "sin": "cos", "cos": "sin", "any": "all",
    "all": "any", "ceil": "floor", "floor": "ceil", "deg2rad": "rad2deg", "rad2deg": "deg2rad", "radians": "degrees",
    "degrees": "radians", "argmin": "argmax", "argmax": "argmin", "mean": "sum", "median": "mean", "first": "last",
    "sorted": "list", "arctan2": "hypot", "diff": "cumsum", "plus": "minus", "low": "high", "high": "low",
}  # fmt: skip


_SYMMETRIC = {"min", "max", "minimum", "maximum", "dot", "fmul", "hypot", "suppress", "gcd", "isclose", "array_equal"}
"""Functions of two that give the same for both orders."""

_ROUNDING = 1e-6
"""Numbers up to this that something is compared with, or that are added to it, stand for rounding."""


def _rounds(parent: ast.AST, node: ast.AST) -> bool:
    """Whether it is a constant that allows for rounding, and no factor."""
    small = isinstance(node, ast.Constant) and isinstance(node.value, float) and 0.0 < node.value <= _ROUNDING
    added = isinstance(parent, ast.BinOp) and isinstance(parent.op, ast.Add | ast.Sub)
    return small and (added or isinstance(parent, ast.Compare))


def _counts(node: ast.expr) -> bool:
    """Whether a side of a comparison is a whole number: among real ones < and <= differ nowhere to be noticed."""
    if isinstance(node, ast.Call):
        return getattr(node.func, "id", "") in ("len", "round", "int")
    return isinstance(node, ast.Constant) and isinstance(node.value, int)


def _is_any_of(parent: ast.AST, node: ast.AST) -> bool:
    """Whether it is a tuple that stands for any of its parts, in whatever order."""
    if not isinstance(node, ast.Tuple):
        return False
    if isinstance(parent, ast.Compare):
        return node in parent.comparators and isinstance(parent.ops[0], ast.In | ast.NotIn)
    called = ast.unparse(parent.func).rpartition(".")[2] if isinstance(parent, ast.Call) else ""
    return called in ("isinstance", "issubclass", "startswith", "endswith")


def changes(package: Path, file: Path) -> list[Change]:
    """Every change there is to a file of the package, in its order."""
    name = file.relative_to(package).as_posix()
    if name in EXEMPT:
        return []
    source = file.read_text(encoding="utf-8")
    return [each for each in _Finder(name, source).found() if each.new != each.old]


class _Finder:
    def __init__(self, name: str, source: str) -> None:
        self._name, self._source, self._tree = name, source, ast.parse(source)
        starts = [0]
        for line in source.splitlines(keepends=True):
            starts.append(starts[-1] + len(line))
        self._starts, self._lines = starts, source.splitlines(keepends=True)

    def found(self) -> Iterator[Change]:
        yield from self._below(self._tree)

    def _below(self, node: ast.AST) -> Iterator[Change]:
        for child in ast.iter_child_nodes(node):
            if not self._exempt(node, child):
                if not _is_any_of(node, child):
                    yield from self._of(child)
                yield from self._below(child)

    def _exempt(self, parent: ast.AST, node: ast.AST) -> bool:
        if isinstance(node, ast.JoinedStr | ast.Raise | ast.Import | ast.ImportFrom | ast.Assert):
            return True
        if isinstance(node, ast.BinOp) and isinstance(node.left, ast.Constant) and node.left.value == 0.0:
            return isinstance(node.op, ast.Mult)  # 0.0 * x is a zero with x's lanes, whatever x is
        if isinstance(parent, ast.AnnAssign | ast.arg) and node is parent.annotation:
            return True
        if isinstance(parent, ast.ExceptHandler) and node is parent.type:
            return True  # in whatever order they stand
        if isinstance(parent, ast.FunctionDef) and (node is parent.returns or node in parent.decorator_list):
            return True
        if isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING":
            return True
        if isinstance(node, ast.keyword) and node.arg in _LOOKS:
            return True
        if _rounds(parent, node):
            return True
        if (
            isinstance(node, ast.Constant | ast.Tuple)
            and isinstance(parent, ast.Call | ast.keyword)
            and self._drawn(parent)
        ):
            return True
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Call):
            called = ast.unparse(node.value.func)
            return called.startswith(("log.", "print", "warnings.", "session.log")) or called.endswith(".console")
        if isinstance(node, ast.Assign | ast.AnnAssign):
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            names = [each.id for target in targets for each in ast.walk(target) if isinstance(each, ast.Name)]
            return any(name.startswith((*_PACES, *_SIZES)) or name == "__all__" for name in names)
        return isinstance(node, ast.Call) and ast.unparse(node.func) == "UserError"

    def _drawn(self, parent: ast.Call | ast.keyword) -> bool:
        if not (self._name.startswith("plotting/") or self._name.endswith("figures.py")):
            return False
        if isinstance(parent, ast.keyword):
            return True
        return (ast.unparse(parent.func).rpartition(".")[2]) in _DRAWN

    def _of(self, node: ast.AST) -> Iterator[Change]:
        if isinstance(node, ast.BinOp):
            text = any(
                isinstance(each, ast.Constant) and isinstance(each.value, str) for each in (node.left, node.right)
            )
            if not text and not isinstance(node.left, ast.JoinedStr) and not isinstance(node.right, ast.JoinedStr):
                yield from self._operator("sign" if isinstance(node.op, ast.Add | ast.Sub) else "operator", node)
        elif isinstance(node, ast.Compare) and len(node.ops) == 1:
            yield from self._comparison(node)
        elif isinstance(node, ast.BoolOp):
            first, second = node.values[:2]
            old, new = _OPERATORS[type(node.op)]
            yield from self._between("logic", first, second, old, new)
        elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not | ast.USub):
            start, end = self._span(node.operand)
            yield self._change("sign" if isinstance(node.op, ast.USub) else "logic", node, self._source[start:end])
        elif isinstance(node, ast.Constant):
            yield from self._constant(node)
        elif isinstance(node, ast.Call):
            yield from self._call(node)
        elif isinstance(node, ast.Tuple) and len(node.elts) == 2 and isinstance(node.ctx, ast.Load):
            yield from self._exchanged("order", *node.elts)

    def _constant(self, node: ast.Constant) -> Iterator[Change]:
        value = node.value
        if isinstance(value, bool):
            yield self._change("default", node, str(not value))
        elif isinstance(value, int):
            for other in (value + 1, value - 1):
                yield self._change("off by one", node, str(other))
        elif isinstance(value, float) and value:
            for factor in (2.0, 0.1):
                yield self._change("number", node, repr(factor * value))

    def _call(self, node: ast.Call) -> Iterator[Change]:
        name = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
        if name in _TWINS:
            _, end = self._span(node.func)
            yield Change(self._name, node.lineno, "twin", end - len(name), end, name, _TWINS[name])
        plain = [each for each in node.args if isinstance(each, ast.Name | ast.Attribute)]
        if len(node.args) >= 2 and len(plain) >= 2 and name not in _SYMMETRIC:
            yield from self._exchanged("order", plain[0], plain[1])

    def _exchanged(self, kind: str, one: ast.expr, other: ast.expr) -> Iterator[Change]:
        (a, b), (c, d) = self._span(one), self._span(other)
        old, first, second = self._source[a:d], self._source[a:b], self._source[c:d]
        if first != second and not {type(one), type(other)} & {ast.Constant, ast.Starred}:
            yield Change(self._name, one.lineno, kind, a, d, old, second + self._source[b:c] + first)

    def _comparison(self, node: ast.Compare) -> Iterator[Change]:
        old, new = _OPERATORS[type(node.ops[0])]
        if old not in _TURNED or _counts(node.left) or _counts(node.comparators[0]):
            yield from self._between("window", node.left, node.comparators[0], old, new)
        if old in _TURNED:
            yield from self._between("window", node.left, node.comparators[0], old, _TURNED[old])

    def _operator(self, kind: str, node: ast.BinOp) -> Iterator[Change]:
        if type(node.op) in _OPERATORS:
            yield from self._between(kind, node.left, node.right, *_OPERATORS[type(node.op)])

    def _between(self, kind: str, left: ast.expr, right: ast.expr, old: str, new: str) -> Iterator[Change]:
        """Change the operator that stands between two expressions, parentheses aside."""
        (_, a), (b, _) = self._span(left), self._span(right)
        at = self._source.find(old, a, b)
        if at >= 0:
            yield Change(self._name, left.lineno, kind, at, at + len(old), old, new)

    def _change(self, kind: str, node: ast.expr, new: str) -> Change:
        start, end = self._span(node)
        return Change(self._name, node.lineno, kind, start, end, self._source[start:end], new)

    def _span(self, node: ast.expr) -> tuple[int, int]:
        assert node.end_lineno is not None and node.end_col_offset is not None
        return self._offset(node.lineno, node.col_offset), self._offset(node.end_lineno, node.end_col_offset)

    def _offset(self, line: int, column: int) -> int:
        """Columns count bytes."""
        return self._starts[line - 1] + len(self._lines[line - 1].encode()[:column].decode())
