"""Tables as LaTeX."""

from __future__ import annotations

from typing import Any

from wristctl.config.printable import printable
from wristctl.report.printed_table import Table, number


def latex_table(table: Table) -> str:
    """A table for the packages booktabs and caption, numbers to four digits and aligned to the right."""
    import pandas as pd

    columns = [printable(each) for each in table.columns]
    cells = [[_cell(value) for value in row] for row in table.rows]
    numeric = [not any(isinstance(row[at], str | bool) for row in table.rows) for at in range(len(columns))]
    styled = pd.DataFrame(cells, columns=columns).style.hide(axis="index").format(escape="latex")
    styled = styled.format_index(escape="latex", axis="columns")
    aligned = "".join("r" if each else "l" for each in numeric)
    text: str = styled.to_latex(column_format=aligned, hrules=True, caption=escaped(printable(table.title)) or None)
    return text.rstrip()


def _cell(value: Any) -> str:
    if value is None:
        return "-"
    if isinstance(value, bool):
        return "yes" if value else "no"
    return printable(value) if isinstance(value, str) else number(float(value))


_ESCAPED = {each: f"\\{each}" for each in "&%$#_{}"} | {
    "~": r"\textasciitilde{}", "^": r"\textasciicircum{}", "\\": r"\textbackslash{}",
}  # fmt: skip


def escaped(text: str) -> str:
    """Text with what LaTeX reads as its own written out."""
    return "".join(_ESCAPED.get(each, each) for each in text)
