"""hw-run under every fault: motors stopped within the stated time, the run sealed with its reason, no row lost."""

from __future__ import annotations

import itertools
import json
import os
import re
import signal
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest

from tests.cli.conftest import Call
from wristctl.bench.virtual_bench import VirtualBench
from wristctl.board.driver import Board
from wristctl.commands.hw_run import figures as trial_figures
from wristctl.config.bench import FAULTS
from wristctl.config.study import Study
from wristctl.records import list_runs, start_run
from wristctl.records.manifest import read_overview
from wristctl.records.run import Run
from wristctl.trial import homing, testbeds
from wristctl.trial.calibration import FILE, WristCalibration
from wristctl.trial.homing import Zero
from wristctl.trial.log import TrialLog

THOROUGH = bool(os.environ.get("WRISTCTL_THOROUGH"))
AT, PERIOD = 0.2, 10e-3
STAGGER = 0.02
"""Between two faults, so that the second comes while the first is being noticed."""
TRIAL = (
    "hw-run", "--set", "directions=[ulnar]", "--set", "push.force=0", "--set", "horizon=0.6", "--set", "back=0.2",
    "--set", "rest=0.1", "--set", "reference={duration: 0.5, angle_deg: 20.0}",
    "--set", "controllers=[{controller: smc-tracking, gains: hardware}]", "--set", "bench.motors.slack=[0, 0, 0, 0]",
    "--set", "homing={frames: 1, rest: 0.1, let_go: 1.0}", "--set", "bench.person.takes=0.5",
)  # fmt: skip
RAMP = {"STOP": 1.0 / 50_000, "life": 1.0 / 50_000, "reset": 0.0}
UPDATE = 2e-3
"""Between two new rates of an axis [s]: a ramp ends with one of these."""
UNANSWERED = 0.075
"""Seconds in which a command is sent three times before the host gives up."""


class Stated(NamedTuple):
    """A row of the table of docs/hardware/stopping.md."""

    within: float
    """From the fault to the beginning of the ramp [s]."""
    by: str
    exit_code: int
    says: str


def _stated() -> dict[str, Stated]:
    text = (Path(__file__).parents[2] / "docs" / "hardware" / "stopping.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| (\S+) \| [^|]+ \| (\d+) ms \| (\w+) \| (\d+) \| ([^|]+) \|$", text, re.MULTILINE)
    return {kind: Stated(1e-3 * float(within), by, int(code), says) for kind, within, by, code, says in rows}


STATED = _stated()
OF_THE_CHAIN = [kind for kind in FAULTS if kind in STATED]
"""Those of cable, board, camera and law; how others end is told by tests/trial/test_fault_table.py."""


@dataclass
class Ended:
    """A hw-run that has ended, and the bench it ran on."""

    code: int
    err: str
    run: Run
    bench: VirtualBench

    @property
    def stop(self) -> dict[str, Any]:
        return dict(json.loads(self.run.file("data/stop.json").read_text()))


HwRun = Callable[..., Ended]


@pytest.fixture(scope="module")
def at_zero(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A calibrate-wrist run that holds for the bench at power-on without slack."""
    nonce = Board(VirtualBench(Study().hw_run.bench, Study().wrist, 0).transport).connect().boot_nonce
    known = WristCalibration(Zero((1, 1, 1, 1), (960.0,) * 4, (0.0,), (0.0,) * 4), "ulnar", nonce, (0, 0, 0, 0))
    with start_run("calibrate-wrist", Study(), out=tmp_path_factory.mktemp("calibrated")) as run:
        run.file(FILE).write_text(json.dumps(known.plain()))
    return run.path


@pytest.fixture
def hw_run(call: Call, monkeypatch: pytest.MonkeyPatch, at_zero: Path) -> HwRun:
    """Performs a short hw-run, at zero from the start."""
    benches: list[VirtualBench] = []

    class Kept(VirtualBench):
        def __init__(self, *arguments: Any) -> None:
            super().__init__(*arguments)
            benches.append(self)

    monkeypatch.setattr(testbeds, "VirtualBench", Kept)

    def run(*options: str, out: Path = Path("results")) -> Ended:
        stored = ("--calibration", str(at_zero), "--set", "positions=stored")
        code, _, err = call(*TRIAL, *stored, "--out", str(out), *options)
        assert benches, err
        (made,) = list_runs(out)
        return Ended(code, err, made, benches.pop())

    return run


def injected(faults: dict[str, float]) -> tuple[str, str]:
    return "--set", f"bench.faults={json.dumps([{'kind': kind, 'at': at} for kind, at in faults.items()])}"


def judge(ended: Ended, faults: dict[str, float]) -> None:
    """Exit code, seal, reason, rows, and when the last step fell, of a run with these faults (kind: time)."""
    stated = {kind: STATED[kind] for kind in faults}
    run, stop, log = ended.run, ended.stop, ended.run.data("log")
    assert ended.code in {each.exit_code for each in stated.values()} and "Traceback" not in ended.err
    assert run.state == "failed" and run.problems() == [] and run.manifest.exit_code == ended.code
    assert run.manifest.error is not None and run.manifest.error.what == stop["reason"]
    assert any(each.says in stop["reason"] for each in stated.values()), stop["reason"]
    assert run.data("trials")["outcome"].tolist() == [stop["reason"]]

    assert np.diff(log["time"], prepend=-PERIOD) == pytest.approx(PERIOD, abs=1e-4)
    assert stop["time"] - log["time"].iloc[-1] < 2 * PERIOD + UNANSWERED and stop["trial"] == 0
    assert run.data("truth")["time"].iloc[-1] >= stop["time"] - 2e-3
    assert stop["motors_stand"] == (not {"port-lost", "host-silent"} & set(faults)) or len(faults) > 1

    ended.bench.transport.wait(0.3)  # what the board does with nobody there
    motion = ended.bench.motion()
    assert not any(motion.energised)
    start = float((log["clock"] - log["time"]).iloc[0])
    last = max(at for at in motion.last_step if at is not None) - start
    rate = float(log[[f"sent_{tendon}" for tendon in (1, 2, 4, 5)]].tail(40).abs().to_numpy().max())
    alone = [kind for kind in stated if stated[kind].by != "STOP"]  # where only the board can stop
    limits = {kind: faults[kind] + stated[kind].within + RAMP[stated[kind].by] * rate for kind in alone or stated}
    limit, named = min(limits.values()), " + ".join(f"{kind} {at:g} s" for kind, at in faults.items())
    print(f"{named}: last step {1e3 * (last - AT):.1f} ms after the first, stated {1e3 * (limit - AT):.1f} ms")
    assert AT - 0.02 < last <= limit + UPDATE


def test_every_fault_has_a_stated_time() -> None:
    assert {*OF_THE_CHAIN, "Ctrl-C"} == set(STATED) and set(OF_THE_CHAIN) < set(FAULTS)


@pytest.mark.parametrize("kind", OF_THE_CHAIN)
@pytest.mark.slow
def test_each_fault_ends_within_its_time_in_a_sealed_run(hw_run: HwRun, kind: str) -> None:
    judge(hw_run(*injected({kind: AT})), {kind: AT})


PAIRS = [
    *({one: AT, other: AT} for one, other in itertools.combinations(OF_THE_CHAIN, 2)),
    *({one: AT, other: AT + STAGGER} for one, other in itertools.permutations(OF_THE_CHAIN, 2)),
]
DAILY = ({"port-lost": AT, "disk-full": AT}, {"marker-covered": AT, "host-silent": AT + STAGGER})


@pytest.mark.parametrize("faults", PAIRS if THOROUGH else DAILY, ids=lambda faults: "+".join(faults))
@pytest.mark.slow
def test_two_faults_together_end_within_the_sooner_ones_time(hw_run: HwRun, faults: dict[str, float]) -> None:
    judge(hw_run(*injected(faults)), faults)


def interrupted_at(moment: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Have Ctrl-C come as this begins."""
    place, name = {
        "homing": (homing.Finder, "_go"),
        "between trials": (TrialLog, "truth"),
        "drawing": (trial_figures, "errors"),
    }[moment]
    original = getattr(place, name)

    def interrupting(*arguments: Any) -> Any:
        signal.raise_signal(signal.SIGINT)
        return original(*arguments)

    monkeypatch.setattr(place, name, interrupting)


@pytest.mark.parametrize("moment", ["homing", "between trials", "drawing"])
@pytest.mark.slow
def test_ctrl_c_stops_the_motors_and_seals_the_run(hw_run: HwRun, monkeypatch: pytest.MonkeyPatch, moment: str) -> None:
    interrupted_at(moment, monkeypatch)
    ended = hw_run(*(("--set", "positions=find") if moment == "homing" else ()))
    assert ended.code == 130 and ended.run.state == "interrupted" and ended.run.problems() == []
    assert "Traceback" not in ended.err and "interrupted; what was found: wristctl runs show " in ended.err
    assert not any(ended.bench.motion().energised)
    if moment != "drawing":  # where all trials are done
        assert ended.stop["motors_stand"] and ended.stop["reason"] == STATED["Ctrl-C"].says
        first, *trials = filter(None, read_overview(ended.run.path).answer)
        done = sum(ended.run.data("trials")["outcome"] == "ok")
        assert STATED["Ctrl-C"].says in first and ("homed" in first) == (moment == "homing") and len(trials) == done


@pytest.mark.slow
def test_on_a_disk_that_is_really_full_the_motors_stop_and_the_run_is_sealed(
    hw_run: HwRun, small_disk: Callable[[int], Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Another program fills it to the last byte in the middle of a trial."""
    tick, disk = TrialLog.tick, small_disk(12)

    def filling(self: TrialLog, row: dict[str, Any]) -> None:
        tick(self, row)
        if row["trial"] == 0 and row["time"] >= AT:
            with suppress(OSError), (disk / "ballast").open("ab", buffering=0) as ballast:
                while ballast.write(bytes(4096)):
                    pass

    monkeypatch.setattr(TrialLog, "tick", filling)
    ended = hw_run(out=disk)
    assert ended.code == 5 and ended.run.state == "failed" and ended.run.problems() == []
    log, stop = ended.run.data("log"), ended.stop
    assert stop["motors_stand"] and "No space left on device" in stop["reason"]
    assert log["time"].iloc[-1] >= AT and np.diff(log["time"], prepend=-PERIOD) == pytest.approx(PERIOD, abs=1e-4)
    assert stop["time"] - log["time"].iloc[-1] < 2 * PERIOD
    assert ended.run.data("truth")["time"].iloc[-1] >= stop["time"] - 2e-3
