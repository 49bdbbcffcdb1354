"""Rows of the rankings of a study: their groups, and how pages show them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

Row = Mapping[Any, Any]
Rankings = Mapping[str, Sequence[Row]]


def group(row: Row) -> int | None:
    """Number of the row's group; None for what must not be used."""
    return None if math.isnan(row["group"]) else round(row["group"])


def first_group(rows: Sequence[Row]) -> list[Row]:
    """Rows that nothing is told apart from for the better; the one of the lowest RMSE comes first."""
    return sorted((row for row in rows if group(row) == 1), key=lambda row: float(row["rmse"]))


def short(label: str) -> str:
    """A label without what most have: tuned gains."""
    return label.removesuffix("/tuned")


def interval(row: Row) -> str:
    """RMSE of a row [deg] with its interval; without one where its tunings tell none."""
    if not row["rmse_high"] < math.inf:
        return deg(row["rmse"])
    return f"{deg(row['rmse'])} [{deg(row['rmse_low'])}, {deg(row['rmse_high'])}]"


def three(value: float) -> str:
    """Three digits, without a power of ten."""
    return f"{float(f'{value:.3g}'):,.0f}" if value >= 1000.0 else f"{value:.3g}"


def deg(value: float) -> str:
    return f"{math.degrees(value):.3g}"
