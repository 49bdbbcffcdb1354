"""`wristctl hysteresis`: its plan, its errors, and a run that is repeated to the byte."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.cli.conftest import Call
from tests.identification.made_loops import SHORT, made_loop, written
from wristctl.records import open_run
from wristctl.simulation.strokes import FrictionCase

QUICK = ("--set", "ranges_deg=[[0, 10]]", "--set", "frequencies=[1, 5]", "--set", "angles_deg=[]")


@pytest.mark.painted
@pytest.mark.slow
def test_a_run_with_a_measured_loop_is_repeated_to_the_byte(call: Call, tmp_path: Path) -> None:
    weights = SHORT._replace(what="tensions")
    written(made_loop(FrictionCase(0.15, 0.5, 3e-5), 0, weights).loop, tmp_path / "loop.csv")
    code, out, err = call("hysteresis", *QUICK, "--measured", "loop.csv")
    assert code == 0, err
    lines = out.splitlines()
    assert "loop.csv" in lines[0] and any(line.startswith("friction coefficient") and "0.1" in line for line in lines)
    run = open_run(lines[-1])
    code, out, _ = call("runs", "replay", run.id, "--json")
    found = json.loads(out)
    assert code == 0 and found["same"]
    assert {each["verdict"] for each in found["files"]} <= {"identical", "volatile"}


def test_a_plan_says_what_would_be_fitted(call: Call, tmp_path: Path) -> None:
    problem = made_loop(FrictionCase(0.1, 1.0, 2e-5), 0, SHORT)
    written(problem.loop, tmp_path / "loop.csv")
    code, out, _ = call("hysteresis", *QUICK, "--measured", "loop.csv", "--dry-run")
    samples = len(problem.measured[0])
    assert code == 0 and f"friction, sheath, presliding from {samples} samples" in out.replace("\n", " ")
    assert "simulated seconds" not in out, "a measured loop is fitted; nothing else is driven"


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--set", "ranges_deg=[[20, 10]]"), "from a lower to a higher angle, not from 20 to 10 deg"),
        (("--set", "angles_deg=[40]"), "40 deg lies outside the outer range"),
        (("--set", "ranges_deg=[[0, 60]]"), "beyond the wrist's range"),
        (("--set", "samples=41"), "multiple of 4"),
        (("--set", "frequencies=[0]"), "greater than 0"),
        (("--shape", "square"), "one of sine, triangle"),
        (("--measured", "gone.csv"), "cannot read the measured loop"),
        (("--set", "sheats=[1]"), "did you mean 'sheaths'?"),
    ],
)
def test_wrong_settings_are_refused_before_anything_is_written(
    arguments: tuple[str, ...], said: str, call: Call, tmp_path: Path
) -> None:
    code, out, err = call("hysteresis", *arguments)
    assert code == 2 and said in err and out == "" and not (tmp_path / "results").exists()
