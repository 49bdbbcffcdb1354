"""What a search tried and what it judged anew, as tables, and back."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from wristctl.tuning.search import Search, Tried


def history(found: Search) -> pd.DataFrame:
    """Every candidate of every search: restart, iteration, candidate, objective and gains."""
    iterations, candidates = found.tried.values.shape
    each = -(-iterations // found.restarts)
    at = np.repeat(np.arange(iterations), candidates)
    columns = {
        "restart": at // each,
        "iteration": at % each,
        "candidate": np.tile(np.arange(candidates), iterations),
        "objective": found.tried.values.ravel(),
    }
    gains = np.concatenate(found.tried.gains).T
    return pd.DataFrame(columns | dict(zip(found.gains, gains, strict=True)))


def tried_of(table: pd.DataFrame, gains: Sequence[str]) -> Tried:
    """What a history says was tried, as far as its iterations are whole."""
    candidates = int(table["candidate"].max()) + 1
    whole = len(table) // candidates
    rows = table.iloc[: whole * candidates]
    values = rows["objective"].to_numpy(float).reshape(whole, candidates)
    return Tried(values, rows[list(gains)].to_numpy(float).reshape(whole, candidates, len(gains)))


def finalists(found: Search) -> pd.DataFrame:
    """The gains that were judged anew, best first."""
    rows = [
        {"origin": each.origin, "objective": each.objective, "validated": each.validated}
        | dict(zip(found.gains, each.gains, strict=True))
        for each in found.finalists
    ]
    return pd.DataFrame(rows)
