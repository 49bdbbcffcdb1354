"""`wristctl identify` on a log of motors' currents, and what other commands make of its ratios."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.cli.conftest import Call
from tests.identification.test_driven_logs import OF_THREE, made, waves
from wristctl.records.open_log import OpenLog, write_log

TIME = np.arange(0.0, 16.0, 0.05)
MINE = ("--set", "wrist.tendons=three", "--set", "wrist.hand_mass=0.2")


def currents() -> OpenLog:
    log = made(OF_THREE, waves(3), TIME, np.array([12.0, 9.0, 15.0]))
    return OpenLog(log.file, log.what, {name: log.columns[name] for name in log.columns if "rate" not in name})


@pytest.mark.slow
def test_currents_give_ratios_that_simulate_takes_with_a_stiffness(call: Call, tmp_path: Path) -> None:
    file = tmp_path / "arm.csv"
    write_log(currents(), file)
    code, out, err = call("identify", str(file), *MINE)
    assert code == 0, err
    assert out.startswith("Identified: stiffness, direction_1") and " A/rad" in out and "% of its motion" in out
    assert "no scale in newtons" in " ".join(out.split())
    code, _, err = call("simulate", "--from-identified", "latest:identify")
    assert code == 2 and "nobody has said that" in err and "wrist.stiffness" in err
    quick = ("--set", "simulate.horizon=0.06", "--set", "simulate.reference.duration=0.05", "--controller", "pd-ff")
    code, out, err = call(
        "simulate", "--from-identified", "latest:identify", *MINE, "--set", "wrist.stiffness=1.1", *quick
    )
    assert code == 0, err
    assert "wrist.damping = " in err and "wrist.tendons" in err


@pytest.mark.slow
def test_a_motion_that_currents_do_not_make_is_refused_without_a_table(call: Call, tmp_path: Path) -> None:
    log, other, file = currents(), made(OF_THREE, waves(3, 7), TIME), tmp_path / "arm.csv"
    write_log(OpenLog(log.file, log.what, {**log.columns, "bend_y": other.columns["bend_y"]}), file)
    code, out, err = call("identify", str(file), *MINE)
    assert code == 3 and "not identifiable from these data" in err and "more than a tenth" in err
    assert "slow circles" in err and "parameter" not in out + err
    (run,) = (tmp_path / "results").glob("*-identify-*")
    assert not (run / "data/parameters.csv").exists() and not (run / "data/ratios.json").exists()
