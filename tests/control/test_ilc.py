"""What `ilc` learns over repetitions of a motion, and how a loop repeats a motion for a law that learns."""

from __future__ import annotations

import importlib.util
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from wristctl.commands.simulate.results import controller_words
from wristctl.config.loop import CAMERA, Loop, Reference
from wristctl.config.plant import Plant
from wristctl.config.wrist import WristParameters
from wristctl.control.ilc import COUNT, ILC, SPACING
from wristctl.control.law import Controller, Gain
from wristctl.control.pid_ff import PID_FF
from wristctl.lanes.functions import maximum
from wristctl.lanes.lane import where, zero_like
from wristctl.simulation.motion import Motion
from wristctl.simulation.outcome import Outcome
from wristctl.simulation.planes import motion_in
from wristctl.simulation.rollout import rollout

WRIST = WristParameters()
NOMINAL = Loop(plant_segments=1)
DRAWN = Loop(
    plant=Plant.model_validate({"stiffness": "x0.7", "damping": "x1.5", "payload": 0.1, "tendon_radius": "x0.97"})
)
HORIZON = 3.0


def asked(kind: str, loop: Loop, wrist: WristParameters = WRIST, planes: int = 1, horizon: float = HORIZON) -> Motion:
    reference = Reference(kind=kind, duration=0.7)
    return motion_in(planes, reference, None, wrist, horizon, max(loop.control_period, 1e-3))


def after(
    repetitions: int,
    loop: Loop,
    preset: str = "default",
    wrist: WristParameters = WRIST,
    planes: int = 1,
    noises: int = 1,
    **gains: float,
) -> Outcome:
    """Outcome of the last of so many repetitions, once for each stream of noise."""
    law = replace(ILC, learning=repetitions)
    values = np.tile(np.array(law.values({**law.presets[preset], **gains})), (noises, 1))
    motion = asked("adl:mean" if planes == 2 else "adl:eating", loop, wrist, planes)
    which, streams = np.zeros(noises, np.int64), [(7, number) for number in range(noises)]
    return rollout(law, values, [motion], which, loop, wrist, None, streams, record=True, converge=False)


def errors(loop: Loop, preset: str = "default", times: tuple[int, ...] = (1, 2, 3, 4, 5, 6), **more: Any) -> np.ndarray:
    """RMSE [rad] of each repetition, over the streams of noise their mean."""
    return np.array([np.mean(after(each, loop, preset, **more).metrics["rmse"]) for each in times])


def test_its_first_repetition_is_pid_ff() -> None:
    gains = {name: ILC.presets["default"][name] for name in PID_FF.gains}
    values = np.array([PID_FF.values(gains)])
    motion = asked("adl:eating", DRAWN)
    beside = rollout(PID_FF, values, [motion], np.zeros(1, np.int64), DRAWN, WRIST, record=True, converge=False)
    first = after(1, DRAWN)
    np.testing.assert_allclose(first.column("theta", 0), beside.column("theta", 0), rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("loop", [NOMINAL, DRAWN], ids=["nominal", "drawn"])
def test_the_error_falls_from_each_repetition_to_the_next(loop: Loop) -> None:
    learning = errors(loop)
    if loop is DRAWN:
        assert learning[0] > np.radians(1.0)
        assert (learning[1:] < 0.6 * learning[:-1]).all()
        assert errors(loop, times=(8,))[0] < 0.01 * learning[0]
    else:
        assert (learning[1:] <= learning[:-1]).all()


def test_it_learns_in_both_planes_with_three_tendons() -> None:
    wrist = WristParameters(tendons="three")
    loop = Loop(plant=DRAWN.plant)
    first, last = (after(each, loop, wrist=wrist, planes=2).metrics for each in (1, 8))
    for plane in ("ulnar", "flexion"):
        assert last[f"rmse_{plane}"][0] < 0.1 * first[f"rmse_{plane}"][0]


def _chattering(repetitions: int, loop: Loop, cutoff: float) -> float:
    return float(np.mean(after(repetitions, loop, "hardware", noises=4, cutoff=cutoff).metrics["chattering"]))


@pytest.mark.parametrize("plant", [Plant(), DRAWN.plant], ids=["nominal", "drawn"])
def test_behind_a_camera_the_error_that_it_sees_falls(plant: Plant) -> None:
    loop = CAMERA.model_copy(update={"plant": plant})
    motion, last = asked("adl:eating", loop), np.inf
    for repetitions in (1, 2, 4, 8):
        done = after(repetitions, loop, "hardware", noises=4)
        seen = np.sqrt(np.mean([(done.part("seen", lane)[:, 0] - motion.theta_ref) ** 2 for lane in range(4)]))
        assert seen < 0.9 * last
        last = seen


def test_behind_a_camera_an_unknown_wrist_is_followed_better() -> None:
    loop = CAMERA.model_copy(update={"plant": DRAWN.plant})
    learning = errors(loop, "hardware", (1, 2, 4, 8, 16), noises=4)
    assert (np.diff(learning) < 0.0).all() and learning[-1] < 0.6 * learning[0]


@pytest.mark.parametrize("plant", [Plant(), DRAWN.plant], ids=["nominal", "drawn"])
def test_the_noise_of_a_camera_is_not_learned_below_the_cutoff_alone(plant: Plant) -> None:
    """Each repetition has noise of its own: tensions chatter more and more where all of the error is learned."""
    loop = CAMERA.model_copy(update={"plant": plant})
    early, late = (_chattering(each, loop, ILC.presets["hardware"]["cutoff"]) for each in (8, 16))
    assert late < 1.03 * early
    assert _chattering(16, loop, 1e5) > 3.0 * late


def test_a_lead_as_late_as_the_loop_learns_faster() -> None:
    """Motors that lag: the same gains without a lead leave more of the error."""
    loop = DRAWN.model_copy(update={"actuator": DRAWN.actuator.model_copy(update={"level": "lagged"})})
    late, in_time = (errors(loop, times=(6,), lead=lead)[0] for lead in (1e-6, 0.02))
    assert in_time < 0.8 * late


def test_beyond_what_it_has_room_for_the_learned_torque_stays() -> None:
    law = replace(ILC, learning=2)
    values, loop = np.array([law.values(law.presets["default"])]), DRAWN.model_copy(update={"control_period": 0.01})
    motion = asked("adl:eating", loop, horizon=COUNT * SPACING + 2.0)
    done = rollout(law, values, [motion], np.zeros(1, np.int64), loop, WRIST, record=True, converge=False)
    assert not done.failed[0] and np.isfinite(done.column("torque_wanted", 0)).all()


def _counts(now: Any, wrist: Any, gains: Any, memory: Any) -> Any:
    begins = memory[0] <= 0.0
    memory[1] = memory[1] + where(begins, 1.0, zero_like(now.theta))
    memory[2] = maximum(memory[2], 1.0 - now.period * memory[0])
    memory[0] = memory[0] + 1.0
    return 1e-3 * memory[1] + 0.0 * memory[2] + where(memory[0] > 1.0, 0.0, 1e-1 * memory[2])


def _leaves(now: Any, wrist: Any, gains: Any, memory: Any) -> Any:
    """Drives the wrist out of its range in its first repetition, and holds it in all others."""
    first = memory[1] <= 0.0
    memory[1] = where(now.theta > 0.5, 1.0, memory[1])
    return where(first, 100.0, wrist.stiffness * now.theta_ref)


def _toy(law: Any, **more: Any) -> Controller:
    return Controller(
        name="toy", law=law, source="this test", gains={"K": Gain("", "unused", 1e-3, 1e3)}, presets={}, **more
    )


def test_a_loop_keeps_what_is_learned_and_empties_the_rest_at_each_repetition() -> None:
    """The torque tells how often the first tick came, and that at it the last value is no more than it makes it."""
    law = _toy(_counts, memory=3, learning=5, learned=2)
    motion = asked("minimum-jerk", NOMINAL, horizon=0.05)
    done = rollout(law, np.ones((9, 1)), [motion], np.zeros(9, np.int64), NOMINAL, WRIST, record=True, converge=False)
    for lane in (0, 8):
        wanted = done.column("torque_wanted", lane)
        assert wanted[0] == pytest.approx(5e-3 + 0.1) and wanted[1:] == pytest.approx(5e-3)


def _tells_the_last_bend(now: Any, wrist: Any, gains: Any, memory: Any) -> Any:
    """At its first tick a trace of the bend that was seen last in the repetition before, else nothing."""
    told = where(memory[0] <= 0.0, 1e-9 * memory[1], zero_like(now.theta))
    memory[0], memory[1] = memory[0] + 1.0, now.theta
    return told


def test_each_repetition_has_noise_of_its_own_and_the_last_that_of_any_other_law() -> None:
    motion = asked("minimum-jerk", CAMERA, horizon=0.6)
    seen, told = dict[int, np.ndarray](), dict[int, float]()
    for repetitions in (1, 2, 3):
        law = _toy(_tells_the_last_bend, memory=2, learning=repetitions, learned=2)
        which = np.zeros(1, np.int64)
        done = rollout(
            law, np.ones((1, 1)), [motion], which, CAMERA, WRIST, None, [(7, 1)], record=True, converge=False
        )
        seen[repetitions], told[repetitions] = done.part("seen", 0)[:, 0], done.column("torque_wanted", 0)[0]
    ends = [1e9 * told[2], 1e9 * told[3], float(seen[1][-1])]
    assert told[1] == 0.0 and np.diff(sorted(ends)).min() > 1e-5
    np.testing.assert_allclose(seen[3], seen[1], rtol=0.0, atol=1e-7)


def test_an_answer_tells_how_many_repetitions_there_were() -> None:
    assert f"{ILC.learning} repetitions" in controller_words("ilc", "default")
    assert "repetitions" not in controller_words("pid-ff", "default")


def test_a_wrist_that_fails_while_its_law_learns_has_failed() -> None:
    loop = NOMINAL.model_copy(update={"limits": False})
    motion = asked("minimum-jerk", loop, horizon=0.5)
    law = _toy(_leaves, memory=2, learning=2, learned=2)
    done = rollout(law, np.ones((1, 1)), [motion], np.zeros(1, np.int64), loop, WRIST, record=True, converge=False)
    assert done.failed[0]
    alone = replace(law, law=_held)
    done = rollout(alone, np.ones((1, 1)), [motion], np.zeros(1, np.int64), loop, WRIST, record=True, converge=False)
    assert not done.failed[0]


def _held(now: Any, wrist: Any, gains: Any, memory: Any) -> Any:
    memory[1] = 1.0 + zero_like(now.theta)
    return wrist.stiffness * now.theta_ref


def test_the_controller_of_the_page_learns_a_constant_torque(tmp_path: Path) -> None:
    page = (Path(__file__).parents[2] / "docs" / "your-own-controller.md").read_text(encoding="utf-8")
    (block,) = [
        each for each in re.findall(r"^```python\n(.*?)^```", page, re.DOTALL | re.MULTILINE) if "share" in each
    ]
    imports = "from wristctl.control.model import one_segment\nfrom wristctl.lanes.lane import where\n\n\n"
    (tmp_path / "learner.py").write_text(imports + block, encoding="utf-8")
    spec = importlib.util.spec_from_file_location("learner", tmp_path / "learner.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    gains = {name: Gain("", "of the page", 1e-3, 1e3) for name in ("Kp", "Kd", "share")}
    law = replace(_toy(module.law, memory=3, learning=6, learned=3), gains=gains)
    motion = asked("minimum-jerk", DRAWN)
    errors = []
    for repetitions in (1, 6):
        repeated = replace(law, learning=repetitions)
        done = rollout(
            repeated, np.array([[2.0, 0.1, 1.0]]), [motion], np.zeros(1, np.int64), DRAWN, WRIST, record=True,
            converge=False,
        )  # fmt: skip
        errors.append(abs(np.mean(done.column("theta", 0) - motion.theta_ref)))
    assert errors[1] < 0.05 * errors[0]


@pytest.mark.parametrize("stated", [{"learning": 0}, {"learning": 3}, {"learning": 3, "learned": 9, "memory": 4}])
def test_a_controller_that_learns_says_where_it_keeps_it(stated: dict[str, int]) -> None:
    with pytest.raises(ValueError, match="what it learns stands in memory"):
        _toy(_held, **stated)
