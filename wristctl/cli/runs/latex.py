"""Tables of a run as LaTeX for a paper's column, and its BibTeX entries."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import NamedTuple

from wristctl.commands.printed_table import Table, escaped
from wristctl.escape import printable
from wristctl.records.manifest import Manifest
from wristctl.study_files.keys import command_of
from wristctl.version import __version__

# Characters that fit into a column of 3.5 in at the size of a footnote; longest text in one line of a cell.
_COLUMN, _LINE = 56, 24
# Characters of the columns that stand in every part of a table, at most.
_NAMES = 38
_NUMBER = r"[<>]?-?\d+(?:\.\d+)?(?:e[-+]?\d+)?"
_CELL = re.compile(
    rf"(?:(?P<rank>\d+): )?(?P<value>{_NUMBER})(?: \[(?P<low>{_NUMBER}), (?P<high>{_NUMBER})\])?(?: (?P<mark>[*=]))?"
)
_UNIT = re.compile(r"(?P<words>.*\S) \[(?P<unit>[^\[\]]+)\]")
_POWER = re.compile(r"\\textasciicircum\{\}(-?[\d.]+)")
_UNITS = {"deg": r"\degree", "%": r"\percent"}


# Packages that a paper needs for the tables.
PACKAGES = ("array", "booktabs", "graphicx", "siunitx")


class _Column(NamedTuple):
    """A column of one quantity: its head over the columns that share it, its own head, and its cells as text."""

    above: str
    head: str
    cells: Sequence[str]

    @property
    def is_number(self) -> bool:
        return any(re.fullmatch(_NUMBER, cell) for cell in self.cells) and "e" not in "".join(
            cell for cell in self.cells if re.fullmatch(_NUMBER, cell)
        )

    @property
    def width(self) -> int:
        """Characters, at most those of a line of text."""
        return 2 + min(max(map(len, (self.head, *self.cells))), _LINE + 4)


def latex_table(table: Table, label: str = "", caption: str = "") -> str:
    """A table for booktabs, siunitx and graphicx, as wide as a column at most, with one quantity in each cell.

    Parameters
    ----------
    table
        What is printed; of a cell such as `3: 0.05 [0.04, 0.06] *` rank, value, interval and mark have columns each.
    label
        Name for references, without `tab:`; none where it is empty.
    caption
        In place of its title.

    Columns that do not fit beside the others stand below, with those that name the rows; what is still too wide is
    scaled.
    """
    heads, rows = table.cells()
    columns = [part for at, head in enumerate(heads) for part in _parted([row[at] for row in rows], head)]
    lines = [r"\begin{table}[!t]", r"\centering", r"\footnotesize", rf"\caption{{{_text(caption or table.title)}}}"]
    lines += [rf"\label{{tab:{label}}}"] * bool(label)
    for block in _blocks(columns):
        lines += [r"\resizebox{\ifdim\width>\columnwidth\columnwidth\else\width\fi}{!}{%", *_tabular(block)]
        lines += [r"}\par\smallskip"]
    return "\n".join([*lines, r"\end{table}"])


def _parted(cells: Sequence[str], head: str) -> list[_Column]:
    parts = [_CELL.fullmatch(cell) for cell in cells]
    kinds = [kind for kind in ("rank", "value", "low", "high", "mark") if any(part and part[kind] for part in parts)]
    if len(kinds) < 2:
        return [_Column("", head, cells)]
    return [
        _Column(head, "" if kind == "value" else kind, [
            (part[kind] or "" if part else cell if kind == "value" else "")
            for part, cell in zip(parts, cells, strict=True)
        ])
        for kind in kinds
    ]  # fmt: skip


def _blocks(columns: Sequence[_Column]) -> list[list[_Column]]:
    """Columns in blocks that fit into a column of the page, parts of one column together."""
    groups: list[list[_Column]] = []
    for column in columns:
        if groups and column.above and groups[-1][0].above == column.above:
            groups[-1].append(column)
        else:
            groups.append([column])
    naming = _naming(groups)
    first = [column for group in groups[:naming] for column in group]
    blocks = [list(first)]
    for group in groups[naming:]:
        wide = sum(column.width for column in (*blocks[-1], *group))
        if wide > _COLUMN and len(blocks[-1]) > len(first):
            blocks.append(list(first))
        blocks[-1] += group
    return blocks


def _naming(groups: Sequence[Sequence[_Column]]) -> int:
    """Number of columns, from the first, whose words tell rows apart and stand in every block, as far as they fit."""
    count = min(1, len(groups))
    while count < len(groups) and not groups[count][0].is_number:
        names = list(zip(*(column.cells for group in groups[:count] for column in group), strict=True))
        wide = sum(column.width for group in groups[: count + 1] for column in group)
        if len(set(names)) == len(names) or wide > _NAMES:
            break
        count += 1
    return count


def _tabular(columns: Sequence[_Column]) -> list[str]:
    layout = "".join(_layout(column) for column in columns)
    rows = [" & ".join(_set(column, cell) for column, cell in zip(columns, row, strict=True))
            for row in zip(*(column.cells for column in columns), strict=True)]  # fmt: skip
    above = list[str]()
    if any(column.above for column in columns):
        spans = list[tuple[str, int]]()
        for column in columns:
            if spans and column.above and spans[-1][0] == column.above:
                spans[-1] = column.above, spans[-1][1] + 1
            else:
                spans.append((column.above, 1))
        above = [" & ".join(rf"\multicolumn{{{n}}}{{c}}{{{_head(words)}}}" for words, n in spans) + r" \\"]
    heads = " & ".join(f"{{{_head(column.head)}}}" for column in columns)
    body = [rf"{row} \\" for row in rows]
    return [
        rf"\begin{{tabular}}{{@{{}}{layout}@{{}}}}", r"\toprule", *above, rf"{heads} \\", r"\midrule", *body,
        r"\bottomrule", r"\end{tabular}%",
    ]  # fmt: skip


def _layout(column: _Column) -> str:
    if column.is_number:
        found = [cell for cell in column.cells if re.fullmatch(_NUMBER, cell)]
        whole, _, part = zip(*(cell.lstrip("<>-").partition(".") for cell in found), strict=True)
        compared, signed = "<" * any(cell[0] in "<>" for cell in found), "-" * any("-" in cell for cell in found)
        return f"S[table-format={compared}{signed}{max(map(len, whole))}.{max(map(len, part))}]"
    if max(map(len, column.cells), default=0) > _LINE:
        return r">{\raggedright\arraybackslash}p{0.45\columnwidth}"
    return "l"


def _set(column: _Column, cell: str) -> str:
    if re.fullmatch(_NUMBER, cell):
        return cell if column.is_number else rf"\num{{{cell}}}"
    return f"{{{_text(cell)}}}" if column.is_number or cell[:1] in ("[", "*") else _text(cell)


def _head(words: str) -> str:
    """A head with its unit as siunitx sets it."""
    found = _UNIT.fullmatch(words)
    if found is None:
        return _text(words)
    unit = _UNITS.get(found["unit"]) or _POWER.sub(r"^{\1}", _text(found["unit"].replace(" ", ".")))
    return rf"{_text(found['words'])} [\unit{{{unit}}}]"


def _text(words: str) -> str:
    return escaped(printable(words))


SOFTWARE = f"""@software{{wristctl,
  author = {{{{the wristctl authors}}}},
  title = {{wristctl: experiments with tendon-driven soft prosthetic wrists}},
  version = {{{__version__}}},
  year = {{2026}},
}}"""


def bibtex(manifest: Manifest) -> str:
    """Entries of a run, by its id and the hash of its result, and of wristctl, which made it."""
    about = f" of {manifest.about}" if manifest.about else ""
    commit = f", commit {manifest.code.commit[:12]}" if manifest.code.commit else ""
    result = f", result SHA-256 {manifest.result_sha256}" if manifest.result_sha256 else ""
    run = f"""@misc{{{manifest.id},
  key = {{{manifest.id}}},
  title = {{{_text(f"{command_of(manifest.kind)}{about}: run {manifest.id}")}}},
  year = {{{manifest.timing.started[:4]}}},
  note = {{Made with wristctl {_text(manifest.code.version + commit)}{result}}},
}}"""
    return f"{run}\n{SOFTWARE}"
