"""Whole experiments under a fault, in virtual time with a person who waits, and how they ended."""

from __future__ import annotations

import os
import pickle
import tempfile
import traceback
from collections.abc import Callable, Mapping, Sequence
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np

import wristctl
from tests.trial.conftest import WRIST
from tests.trial.fault_cases import AT, Case, Phase
from tests.trial.fault_judging import Course, Judged, judge
from wristctl.bench.virtual_bench import VirtualBench
from wristctl.board.driver import Board
from wristctl.config.bench import InjectedFault
from wristctl.config.hw_run import HwRunSettings
from wristctl.config.study import Study
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.trial.board_stand import BoardStand
from wristctl.trial.calibration import WristCalibration
from wristctl.trial.experiment import Experiment, log_of
from wristctl.trial.homing import Zero
from wristctl.trial.motion_limit import limited, peak_tension
from wristctl.trial.motors_ready import Halt
from wristctl.trial.testbeds import EmulatedTestbed
from wristctl.trial.trials import trials_of
from wristctl.vision.view import View

# What prepares the bench of a run.
Prepared = Callable[[VirtualBench], None]

_AHEAD, _FIRST = 0.01, ("homing", "moving")
_FULL = {
    "directions": ("ulnar", "flexion"), "rows": ({"controller": "smc-tracking", "gains": "hardware"},),
    "reference": {"duration": 1.0, "angle_deg": 30.0}, "horizon": 2.0, "back": 1.0, "rest": 0.3,
    "push": {"force": 0.0}, "calibration": "given", "positions": "stored",
    "bench": {"motors": {"slack": (0.0, 0.0, 0.0, 0.0)}, "person": {"takes": 10.0}},
}  # fmt: skip
_HOMED = {
    "calibration": None, "positions": "find", "reference": {"duration": 0.5, "angle_deg": 10.0}, "horizon": 0.8,
    "back": 0.5, "bench": {"motors": {"slack": (3e-4, 2e-4, 4e-4, 2.5e-4)}},
}  # fmt: skip


def over(below: Mapping[str, Any], above: Mapping[str, Any]) -> dict[str, Any]:
    """Settings with those above in place of those below."""
    made = dict(below)
    for name, value in above.items():
        made[name] = over(made[name], value) if isinstance(value, Mapping) and name in made else value
    return made


@cache
def _at_zero() -> WristCalibration:
    settings = HwRunSettings.model_validate(_FULL)
    nonce = Board(VirtualBench(settings.bench, WRIST, 0).transport).connect().boot_nonce
    return WristCalibration(Zero((1, 1, 1, 1), (1930.0,) * 4, (0.0,), (0.0,) * 4), "ulnar", nonce, (0, 0, 0, 0))


def as_limited(settings: HwRunSettings, wrist: WristParameters = WRIST) -> HwRunSettings:
    """The settings with tension limited to what their trials need, as `hw-run` limits it."""
    return limited(_study_of(settings, wrist), needed(settings, wrist)).hw_run


_NEEDED: dict[tuple[str, str], float] = {}


def needed(settings: HwRunSettings, wrist: WristParameters) -> float:
    """Tension [N] that trials need by the belief, which the emulated bench does not change."""
    alike = settings.model_copy(update={"bench": HwRunSettings().bench, "port": None}).model_dump_json()
    key = alike, wrist.model_dump_json()
    if key not in _NEEDED:
        trials = trials_of(settings, np.random.default_rng(0))
        _NEEDED[key] = peak_tension(_study_of(settings, wrist), trials, None, None)
    return _NEEDED[key]


def _study_of(settings: HwRunSettings, wrist: WristParameters) -> Study:
    return wristctl.load_study(None).model_copy(update={"hw_run": settings, "wrist": wrist})


class _Watched(BoardStand):
    decided = np.inf

    def stop(self, early: bool) -> Halt:
        if early:
            self.decided = self.now()
        return super().stop(early)


def perform(
    changes: Mapping[str, Any], seed: int = 0, prepared: Callable[[VirtualBench], None] | None = None
) -> Course:
    """Do the experiment of these settings; its bench can be prepared."""
    settings = as_limited(HwRunSettings.model_validate(changes))
    bench = VirtualBench(settings.bench, WRIST, seed, settings.markers)
    if prepared is not None:
        prepared(bench)
    stored = _at_zero() if settings.positions == "stored" else None
    rows: list[tuple[float, ...]] = []

    def shown(row: dict[str, Any]) -> None:
        rows.append((row["trial"], row["clock"], row["theta_ref"], row["rate_ref"]))

    log = log_of(Path(tempfile.mkdtemp()), settings, WRIST)
    done = Experiment(settings, WRIST, trials_of(settings, np.random.default_rng(0)), log)
    stand = _Watched(EmulatedTestbed(bench, settings, [View()], None), stored, seed)
    reason, fix, code = "", "", 0
    try:
        done.run(stand, shown)
    except UserError as raised:
        reason, fix, code = raised.what, str(raised.fix), raised.exit_code
    finally:
        log.close()
    stopped = bench.transport.now()
    bench.transport.wait(0.3)
    truth, start = bench.truth(), bench.faults._starts["first trial"]
    told = np.array(rows).reshape(-1, 4)
    tried = told[told[:, 0] >= 0]
    error = float(np.abs(np.interp(tried[:, 1], truth.time, truth.angle) - tried[:, 2]).max(initial=0.0))
    steps = [each for each in bench.motion().last_step if each is not None]
    odd = "; ".join(words for words in done.odd.values() if words)
    return Course(
        start, truth.time, truth.angle, truth.across, truth.pull.max(axis=1), error,
        min(stand.decided, stopped) if reason else np.inf, max(steps, default=0.0), reason, fix, code, odd,
        told[np.abs(told[:, 3]) > 0.05, 1],
    )  # fmt: skip


class _EndedByForks(BaseException):
    """All that was to come has been done by others."""


def fan_out(phase: Phase, groups: Sequence[Sequence[Case]], workers: int = 2) -> list[Judged]:
    """Judge faults of one moment, alone or together: the experiment is done once up to there, then once for each."""
    sound, since = sound_course(phase), "power-on" if phase == "homing" else "first trial"
    changes = [injecting([each for case in group for each in case.faults(phase)]) for group in groups]
    courses = forked(partial(_performed, _settings(phase)), changes, since, AT[phase], workers)
    return [judge(groups[number], phase, course, sound) for number, course in courses.items()]


def _performed(changes: Mapping[str, Any], prepared: Prepared) -> Course:
    return perform(changes, prepared=prepared)


def injecting(faults: Sequence[Mapping[str, Any]]) -> Prepared:
    """What injects these faults into a bench."""
    injected = tuple(InjectedFault.model_validate(each) for each in faults)

    def change(bench: VirtualBench) -> None:
        bench.faults._faults = injected

    return change


def forked(
    run: Callable[[Prepared], Any], changes: Sequence[Prepared], since: str, at: float, workers: int = 2
) -> dict[int, Any]:
    """What a run comes to with each of these changes of its bench, by number, so long [s] after power-on or a trial.

    `run` is given what prepares its bench. A process forks at that moment; its children go on with one change each.
    """
    mine: list[int] = []
    with tempfile.TemporaryDirectory() as folder:

        def fork(bench: VirtualBench) -> None:
            children: set[int] = set()
            for number, change in enumerate(changes):
                while len(children) >= workers:
                    children.discard(os.wait()[0])
                if not (child := os.fork()):
                    change(bench)
                    mine.append(number)
                    return
                children.add(child)
            while children:
                children.discard(os.wait()[0])
            raise _EndedByForks

        def prepared(bench: VirtualBench) -> None:
            transport, done, starts = bench.transport, [False], bench.faults._starts
            go_on = transport._run

            def watched(end: int) -> None:
                if not done[0] and transport.now() > starts[since] + at - _AHEAD:
                    done[0] = True
                    fork(bench)
                go_on(end)

            transport._run = watched  # type: ignore[method-assign]

        try:
            ended = run(prepared)
            Path(folder, str(mine[0])).write_bytes(pickle.dumps(ended))
            os._exit(0)
        except _EndedByForks:
            files = [(number, Path(folder, str(number))) for number in range(len(changes))]
            return {number: pickle.loads(file.read_bytes()) for number, file in files if file.exists()}
        except BaseException:
            if mine:
                traceback.print_exc()
                os._exit(1)
            raise


def _settings(phase: Phase) -> dict[str, Any]:
    return over(_FULL, _HOMED) if phase == "homing" else dict(_FULL)


@cache
def sound_course(phase: Phase) -> Course:
    """The same without a fault."""
    return (
        perform(_settings("homing" if phase == "homing" else "moving")) if phase in _FIRST else sound_course("moving")
    )


def from_power_on(case: Case, phase: Phase) -> Judged:
    """Perform and judge a rig that is otherwise from the start."""
    return judge([case], phase, perform(over(_settings(phase), {"bench": case.bench})), sound_course(phase))


def camera_before(rng: np.random.Generator) -> dict[str, Any]:
    """A webcam on a tripod, in a room: as far off square as it may stand uncalibrated, its lens, and the light."""
    oblique, toward = np.sqrt(rng.uniform(0.0, 10.0**2)), rng.uniform(0.0, 2.0 * np.pi)
    return {
        "tilt_deg": oblique * np.cos(toward), "pan_deg": oblique * np.sin(toward), "roll_deg": rng.uniform(-3.0, 3.0),
        "distance": 0.28 * rng.uniform(0.94, 1.03), "distortion": rng.uniform(-0.15, 0.02),
        "gradient": rng.uniform(0.0, 0.8), "noise": rng.uniform(1.0, 8.0), "blur": rng.uniform(0.6, 1.2),
        "contrast": rng.uniform(0.6, 0.9),
    }  # fmt: skip


def rig_settings(rng: np.random.Generator, number: int) -> dict[str, Any]:
    """A sound rig drawn from those that there may be, homed, in one plane, pushed by a person."""
    late = rng.uniform(-0.02, 0.02)
    bench: dict[str, Any] = {
        "plant": {
            "stiffness_scale": rng.uniform(0.6, 1.2), "tendon_radius": WRIST.tendon_radius * rng.uniform(0.97, 1.03),
            "creep": 0.04,
        },
        "actuator": {
            "tendon_stiffness": float(np.exp(rng.uniform(np.log(5e3), np.log(50e3)))), "sheath": rng.uniform(0.0, 2.0),
            "creep": 0.04,
        },
        "camera": {"delay_frames": 2.0 + 60.0 * late, "scene": camera_before(rng)},
        "motors": {"slack": tuple(rng.uniform(1e-4, 5e-4, 4).tolist())},
        "person": {"takes": 1.0},
    }  # fmt: skip
    link, timer = (("16u2", 16e-3), ("ch340", 16e-3), ("ftdi", 1e-3))[rng.integers(3)]
    bench["line"] = {"adapter": link, "latency_timer": timer}
    bench["plant"]["inner_friction"] = rng.uniform(0.0, 0.02)
    bench["actuator"]["friction"] = rng.uniform(0.05, 0.2)
    own = {
        "calibration": None, "positions": "find",
        "directions": (("ulnar", "flexion", "radial", "extension")[number % 4],),
        "horizon": 3.5, "push": {"force": 2.0, "start": 2.0}, "without_push": False,
    }  # fmt: skip
    return over(over(_FULL, own), {"bench": bench})
