"""The paper's tables, and the band around them that counts as reproduced."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from wristctl.comparison.paper import EXPERIMENT, T1, T2, verdict
from wristctl.config.load import load_study

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
    rmse, settling, steady_state = T2[name]
    at = {"reproduced": 1.5 * (1.0 - HAIR), "not reproduced": 1.5 * (1.0 + HAIR)}
    for said, factor in at.items():
        for near in (factor, 1.0 / factor):
            assert verdict(name, near * rmse, settling, steady_state) == said
            assert verdict(name, rmse, near * settling, steady_state) == said
        assert verdict(name, rmse, settling, factor * steady_state) == said
    assert verdict(name, rmse, settling, 0.0) == "reproduced", "a smaller steady-state error is as good"


def test_what_diverges_or_never_settles_is_not_reproduced_and_strangers_have_no_verdict() -> None:
    rmse, settling, steady_state = T2["smc"]
    for never in (math.nan, math.inf):
        assert verdict("smc", never, settling, steady_state) == "not reproduced"
        assert verdict("smc", rmse, never, steady_state) == "not reproduced"
        assert verdict("smc", rmse, settling, never) == "not reproduced"
    assert verdict("feedforward", rmse, settling, steady_state) == ""
