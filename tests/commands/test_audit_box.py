"""An audit over a box of settings has a figure of every claim, draw by draw, for whoever asks."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import wristctl
from wristctl.records import list_runs

STUDY = """
audit:
  claims:
    - {id: own, says: it settles so, evidence: comparison, value: 2.7e-4, controller: smc, gains: exchanged,
       metric: steady_state, unit: rad}
  box:
    draws: 24
    continuous: [2, 1]
    horizon: 2.0
    unknowns:
      loop.control_period: {draw: [1.0e-3, 1.0e-2], why: a board's}
      wrist.tension_limit: {draw: 20..100 log, why: a motor's}
"""


@pytest.mark.slow
def test_each_claim_can_be_drawn_setting_by_setting_with_the_unit_of_what_decides_it(tmp_path: Path) -> None:
    (tmp_path / "own.yaml").write_text(STUDY)
    found = wristctl.audit(wristctl.load_study(tmp_path / "own.yaml"), out=tmp_path / "results")
    (run,) = [each for each in list_runs(tmp_path / "results") if each.kind == "audit"]
    (one,) = found.strips
    assert {"box", "strip-own"} <= set(found.figures)
    assert not list((run.path / "figures").glob("strip-*")), "drawn when somebody asks"
    (panel,) = found.figures["strip-own"].axes
    unit = {"loop.control_period": "s", "wrist.tension_limit": "N"}[one.leaves[0].name]
    assert panel.get_xlabel() == f"{one.leaves[0].name} [{unit}]"
    marks = sum(len(np.asarray(line.get_xdata())) for line in panel.lines if line.get_marker() == "o")
    assert marks == len(one.verdicts) > 20
