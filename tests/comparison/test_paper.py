"""The paper's tables, and the band around them that counts as reproduced."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from wristctl.comparison.paper import EXPERIMENT, T1, T2, rounded, verdict
from wristctl.study_files.load import load_study

LEDGER = Path(__file__).parents[2] / "experiments" / "claims.yaml"
HAIR = 1e-9


def test_the_tables_print_what_the_ledger_claims() -> None:
    """Both were typed from the paper, each by itself."""
    claimed = {claim.id: claim.value for claim in load_study([LEDGER]).audit.claims}
    measures = {"final-gradient": "gradient_norm", "accuracy": "accuracy"}
    measures |= {"training-loss": "train_loss", "validation-loss": "validation_loss"}
    printed = {f"T1-{name}-{said}": getattr(row, own) for name, row in T1.items() for said, own in measures.items()}
    experiment = dict(zip(("mean-of-directions", "push-radial", "push-flexion"), EXPERIMENT.values(), strict=True))
    for prefix, table in (("T2", T2), ("X", experiment)):
        for name, row in table.items():
            for field, value in row._asdict().items():
                printed[f"{prefix}-{name}-{field.replace('_', '-')}"] = value
    assert len(printed) == 16 + 15 + 9
    assert printed == {name: claimed[name] for name in printed}


@pytest.mark.parametrize("name", T2)
def test_within_a_factor_of_one_and_a_half_counts_as_reproduced(name: str) -> None:
    """From the ends of what the printed digits may stand for."""
    rmse, settling, steady_state = T2[name]
    at = {"reproduced": 1.5 * (1.0 - HAIR), "not reproduced": 1.5 * (1.0 + HAIR)}
    for said, factor in at.items():
        for near in (rounded(rmse).high * factor, rounded(rmse).low / factor):
            assert verdict(name, near, settling, steady_state) == said
        for near in (rounded(settling).high * factor, rounded(settling).low / factor):
            assert verdict(name, rmse, near, steady_state) == said
        assert verdict(name, rmse, settling, factor * rounded(steady_state).high) == said
    assert verdict(name, rmse, settling, 0.0) == "reproduced", "a smaller steady-state error is as good"


def test_what_diverges_or_never_settles_is_not_reproduced_and_strangers_have_no_verdict() -> None:
    rmse, settling, steady_state = T2["smc"]
    for never in (math.nan, math.inf):
        assert verdict("smc", never, settling, steady_state) == "not reproduced"
        assert verdict("smc", rmse, never, steady_state) == "not reproduced"
        assert verdict("smc", rmse, settling, never) == "not reproduced"
    assert verdict("feedforward", rmse, settling, steady_state) == ""


@pytest.mark.parametrize(
    ("printed", "low", "high"),
    [
        (2.7e-4, 2.65e-4, 2.75e-4),
        (2.31e-4, 2.305e-4, 2.315e-4),
        (1.3e-3, 1.25e-3, 1.35e-3),
        (3.0, 2.5, 3.5),
        (3.18, 3.175, 3.185),
        (1e4, 9999.5, 10000.5),
        (99.7, 99.65, 99.75),
        (1e-10, 0.5e-10, 1.5e-10),
    ],
)
def test_a_printed_number_may_be_half_a_unit_of_its_last_digit_off(printed: float, low: float, high: float) -> None:
    assert rounded(printed) == (low, high)
