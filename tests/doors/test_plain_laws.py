"""Laws of plain Python: the same loop as a compiled one, one rollout at a time, and nothing compiled for them."""

from __future__ import annotations

import math
import signal
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numba.core import event

import wristctl as face
from tests.doors.conftest import ROOT
from wristctl.commands.analyse.command import ANALYSE
from wristctl.commands.compare.command import COMPARE
from wristctl.commands.perform import prepare
from wristctl.commands.plain_python import warn_of_plain
from wristctl.commands.simulate.command import SIMULATE
from wristctl.comparison import step_cost
from wristctl.comparison.combinations import count_rollouts
from wristctl.config.loop import Loop, Reference
from wristctl.config.study import Study
from wristctl.config.wrist import WristParameters
from wristctl.control.computed_torque import COMPUTED_TORQUE
from wristctl.control.law import Controller, Gain
from wristctl.control.plain_model import plain_one_segment
from wristctl.control.table import CONTROLLERS
from wristctl.control.vetting import vet
from wristctl.errors import UserError
from wristctl.interrupt import from_outside, interrupts
from wristctl.simulation.motion import Motion
from wristctl.simulation.outcome import Outcome
from wristctl.simulation.reference import motion
from wristctl.simulation.rollout import rollout
from wristctl.simulation.spatial_references import bend_path
from wristctl.study_files.load import load_study

WRIST = WristParameters()


def ct(now: Any, wrist: Any, gains: Any, memory: Any) -> float:
    """Computed torque, as `wristctl.control.computed_torque` has it."""
    inertia, load = plain_one_segment(wrist, now.theta, now.rate)
    error, error_rate = now.theta - now.theta_ref, now.rate - now.rate_ref
    return inertia * (now.acceleration_ref - 2.0 * gains.zeta * gains.w * error_rate - gains.w**2 * error) + load


def plain(law: Any, **more: Any) -> Controller:
    given: dict[str, Any] = {"gains": {}, "presets": {"default": {}}} | more
    return Controller("plainly", law, "a test", plain=True, **given)


def run(law: Controller, gains: np.ndarray, loop: Loop | None = None, **more: Any) -> Outcome:
    followed = motion(Reference(angle_deg=20.0, duration=0.3), WRIST, 0.5, 1e-3)
    which = np.zeros(len(gains), np.int64)
    return rollout(law, gains, [followed], which, loop or Loop(), WRIST, record=True, **more)


@pytest.mark.parametrize("rig", [False, True], ids=["ideal", "camera and tendons"])
def test_a_plain_law_moves_the_wrist_as_the_compiled_one_does(rig: bool) -> None:
    names = list(COMPUTED_TORQUE.gains)
    law = plain(ct, gains=COMPUTED_TORQUE.gains, presets={})
    levels = {"actuator": {"level": "tendon"}, "sensor": {"level": "camera"}, "control_period": 5e-3} if rig else {}
    loop = Loop.model_validate(levels)
    values = {"w": 15.0, "zeta": 1.0}
    gains = np.array([[values[name] for name in names]])
    ours, theirs = run(law, gains, loop), run(COMPUTED_TORQUE, gains, loop)
    np.testing.assert_allclose(ours.column("theta", 0), theirs.column("theta", 0), atol=1e-9)
    np.testing.assert_allclose(ours.column("torque_wanted", 0), theirs.column("torque_wanted", 0), atol=1e-7)


def test_each_of_a_batch_is_what_it_is_alone_and_begins_afresh() -> None:
    """A class is made anew for every rollout, and so is the memory: nothing is left of the one before."""

    class Counts:
        def __init__(self) -> None:
            self.ticks = 0

        def __call__(self, now: Any, wrist: Any, gains: Any, memory: Any) -> float:
            self.ticks += 1
            memory[0] += 1.0
            assert memory[0] == self.ticks
            return -gains.k * (now.theta - now.theta_ref) - 1e-4 * self.ticks

    law = plain(Counts, gains={"k": Gain("N m/rad", "", 0.1, 10.0)}, presets={}, memory=1)
    gains = np.array([[1.0], [2.0], [3.0]])
    heard: list[float] = []
    together = run(law, gains)
    run(law, gains, progress=heard.append)
    for k in range(3):
        np.testing.assert_array_equal(together.column("theta", k), run(law, gains[k : k + 1]).column("theta", 0))
    assert heard[-1] == pytest.approx(1.0) and np.all(np.diff(heard) > 0.0)


@pytest.mark.slow
def test_in_two_planes_it_is_the_compiled_law_in_both_and_a_class_has_an_object_for_each() -> None:
    path = Motion.of_bends(bend_path("circumduction", 20.0, 0.5, 0.4), 1e-3, WRIST.length)
    loop, gains = Loop(coupling="ignored"), np.array([[15.0, 1.0]])
    laws = plain(ct, gains=COMPUTED_TORQUE.gains, presets={}), COMPUTED_TORQUE
    ours, theirs = (rollout(law, gains, [path], np.zeros(1, np.int64), loop, WRIST, record=True) for law in laws)
    for column in ("bend_ulnar", "bend_flexion"):
        np.testing.assert_allclose(ours.column(column, 0), theirs.column(column, 0), atol=1e-9)
    assert np.ptp(ours.column("bend_flexion", 0)) > 0.1

    class Sums:
        def __init__(self) -> None:
            self.seen: list[float] = []

        def __call__(self, now: Any, wrist: Any, gains: Any, memory: Any) -> float:
            self.seen.append(now.theta_ref)
            memory[0] += now.theta_ref
            assert memory[0] == pytest.approx(sum(self.seen), abs=1e-12), "this plane's references alone"
            return wrist.stiffness * float(now.theta_ref)

    law = plain(Sums, memory=1)
    done = rollout(law, np.empty((2, 0)), [path], np.zeros(2, np.int64), loop, WRIST, record=True)
    np.testing.assert_array_equal(done.column("bend_flexion", 0), done.column("bend_flexion", 1))


def test_it_sees_what_compiled_laws_see() -> None:
    seen: list[Any] = []

    def look(now: Any, wrist: Any, gains: Any, memory: Any) -> float:
        seen.append((now, now.ahead(1), now.ahead(5), wrist, gains, len(memory)))
        return 0.0

    law = plain(look, gains={"lambda": Gain("", "", 1.0, 9.0)}, presets={}, preview=5, memory=2)
    run(law, np.array([[3.5]]))
    followed = motion(Reference(angle_deg=20.0, duration=0.3), WRIST, 0.5, 1e-3)
    now, one, five, wrist, gains, memory = seen[100]
    for told, at in ((now[2:5], 100), (one, 101), (five, 105)):
        expected = followed.theta_ref[at], followed.rate_ref[at], followed.acceleration_ref[at]
        np.testing.assert_allclose(told, expected, rtol=1e-12)
    assert (now.period, gains.lambda_, memory) == (1e-3, 3.5, 2)
    assert wrist.stiffness == WRIST.stiffness and wrist.length == WRIST.length
    assert now.torque_low < 0.0 < now.torque_high and math.isfinite(now.load)


def test_nothing_is_compiled_for_a_plain_law() -> None:
    def push(now: Any, wrist: Any, gains: Any, memory: Any) -> float:
        return 0.1

    def other(now: Any, wrist: Any, gains: Any, memory: Any) -> float:
        return -0.1

    run(plain(push), np.zeros((1, 0)))
    with event.install_recorder("numba:compile") as seen:
        run(plain(other), np.zeros((1, 0)))
    assert not seen.buffer


def test_what_it_raises_ends_the_rollout_there() -> None:
    calls: list[float] = []

    def fails(now: Any, wrist: Any, gains: Any, memory: Any) -> float:
        calls.append(now.theta)
        if len(calls) == 10:
            raise KeyError("ten")
        return 0.0

    with pytest.raises(UserError, match="plainly\\(py\\) failed: KeyError: 'ten'"):
        run(plain(fails), np.zeros((4, 0)))
    assert len(calls) == 10

    def interrupted(now: Any, wrist: Any, gains: Any, memory: Any) -> float:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run(plain(interrupted), np.zeros((1, 0)))


class Odd(BaseException):
    """As a library may have one."""


@pytest.mark.parametrize(
    "raised", [SystemExit, SystemExit("bye"), GeneratorExit, KeyboardInterrupt, Odd("x")], ids=repr
)
def test_whatever_it_raises_is_the_laws_and_only_ctrl_c_the_users(raised: BaseException) -> None:
    def ends(now: Any, wrist: Any, gains: Any, memory: Any) -> float:
        raise raised

    name = (raised if isinstance(raised, type) else type(raised)).__name__
    with pytest.raises(UserError, match=f"plainly.py. failed: {name}") as caught, interrupts():
        run(plain(ends), np.zeros((1, 0)))
    assert "test_plain_laws.py" in caught.value.where

    def pressed(now: Any, wrist: Any, gains: Any, memory: Any) -> float:
        signal.raise_signal(signal.SIGINT)
        return 0.0

    with pytest.raises(KeyboardInterrupt), interrupts():
        run(plain(pressed), np.zeros((1, 0)))


def test_in_a_worker_that_leaves_ctrl_c_to_its_parent_no_interrupt_is_the_users() -> None:
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        assert not from_outside(KeyboardInterrupt())
    finally:
        signal.signal(signal.SIGINT, before)
    assert from_outside(KeyboardInterrupt()) and not from_outside(SystemExit())


def test_every_table_flags_it(monkeypatch: pytest.MonkeyPatch) -> None:
    def push(now: Any, wrist: Any, gains: Any, memory: Any) -> float:
        return 0.1

    law = plain(push)
    monkeypatch.setitem(CONTROLLERS, law.name, law)
    data = {
        "horizon": 0.1,
        "rows": ({"controller": law.name, "gains": "default"},),
        "loops": {"fast": {"plant_segments": 1}},
        "references": ({"duration": 0.05},),
        "inverses": ("none",),
    }
    compared = face.compare(Study.model_validate({"compare": data}))
    for table in compared.tables:
        if "controller" in table.columns:
            at = list(table.columns).index("controller")
            assert all("plainly(py)" in str(row[at]) for row in table.rows), table.title
    with pytest.raises(UserError, match="plain Python"):
        face.analyse(Study.model_validate({"simulate": {"controller": law.name, "gains": "default"}}))


def test_each_preset_is_tried_on_random_states_before_a_controller_runs() -> None:
    """One preset that gives no number is enough, and so are gains between their limits where there is no preset."""

    def root(now: Any, wrist: Any, gains: Any, memory: Any) -> float:
        return math.nan if gains.k < 0.3 else -gains.k * now.theta

    gains = {"k": Gain("N m/rad", "", 0.1, 10.0)}
    tried = vet(plain(root, gains=gains, presets={"soft": {"k": 0.5}, "stiff": {"k": 2.0}}), "here")
    assert set(np.ravel(tried.gains)) == {0.5, 2.0}
    np.testing.assert_allclose(vet(plain(root, gains=gains, presets={}), "here").gains, 1.0)
    for number in (0, 1):
        presets = {"odd" if k == number else f"sound-{k}": {"k": 0.2 if k == number else 1.0} for k in (0, 1)}
        with pytest.raises(UserError, match=r"returned nan"):
            vet(plain(root, gains=gains, presets=presets), "here")


@pytest.mark.slow
def test_the_mpc_of_the_worked_example_follows_and_pulls_as_hard_as_it_may_and_no_harder() -> None:
    pytest.importorskip("osqp")
    design: Any = CONTROLLERS[f"{ROOT}/experiments/own_controllers/mpc_osqp.py:MPC"]
    law, loop = design.made({"horizon": 30.0}), Loop(plant_segments=1)
    assert run(law, np.zeros((1, 0)), loop).metrics["rmse"][0] < 1e-3
    weak = WRIST.model_copy(update={"tension_limit": WRIST.pretension + 2.0})
    followed = motion(Reference(kind="step", angle_deg=20.0), weak, 0.2, 1e-3)
    limited = rollout(law, np.zeros((1, 0)), [followed], np.zeros(1, np.int64), loop, weak, record=True)
    assert limited.column("tension_plus", 0)[1:20].max() == pytest.approx(weak.tension_limit, rel=1e-6)
    wanted, given = limited.column("torque_wanted", 0), limited.column("torque", 0)
    assert np.abs(wanted - given).max() < 1e-9, "it plans within what the tendons reach"


def test_the_lqr_of_the_worked_example_solves_its_riccati_equation() -> None:
    from scipy.linalg import solve_continuous_are

    from wristctl.control.vetting import call_law

    law = CONTROLLERS[f"{ROOT}/experiments/own_controllers/lqr.py:LQR"]
    q, qd = 4.0e4, 100.0
    cost = solve_continuous_are(
        np.array([[0.0, 1.0], [0.0, 0.0]]), np.array([[0.0], [1.0]]), np.diag([q, qd]), np.eye(1)
    )
    states = np.zeros((3, 9))
    states[1, 0], states[2, 1] = 1e-4, 1e-3
    rest, bent, moving = call_law(law, states, np.tile([q, qd], (3, 1)))
    inertia, load = plain_one_segment(_segments(), 0.0, 0.0)
    for torque, state in ((bent, states[1]), (moving, states[2])):
        own_inertia, own_load = plain_one_segment(_segments(), state[0], state[1])
        assert (torque - own_load) / own_inertia == pytest.approx(-cost[1] @ state[:2], rel=1e-9)
    assert rest == pytest.approx(load, abs=1e-15) and inertia > 0.0


def _segments() -> Any:
    from wristctl.wrist.segments import segments

    return segments(WRIST, 1)


def test_the_files_of_the_worked_examples_are_shown_in_the_page() -> None:
    page = (ROOT / "docs" / "your-own-controller.md").read_text(encoding="utf-8")
    for name in ("lqr", "mpc_osqp"):
        assert (ROOT / "experiments" / "own_controllers" / f"{name}.py").read_text(encoding="utf-8") in page


def compared(loops: dict[str, Any], *names: str) -> Study:
    data = {
        "horizon": 0.1,
        "controllers": tuple({"controller": name, "gains": "default"} for name in names),
        "loops": loops,
        "references": ({"duration": 0.05}, {"duration": 0.05, "angle_deg": -10.0}),
        "inverses": ("none",),
    }
    return Study.model_validate({"compare": data})


FAST = {"limits": False, "control_period": 1e-6, "plant_segments": 1, "substeps": 1}
SLOW = {"plant_segments": 1, "substeps": 1}


def test_a_comparison_leaves_plain_python_out_of_loops_of_a_microsecond_and_says_what_the_rest_costs(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    ticks: list[float] = []

    def push(now: Any, wrist: Any, gains: Any, memory: Any) -> float:
        ticks.append(now.period)
        return 0.1

    law = plain(push)
    monkeypatch.setitem(CONTROLLERS, law.name, law)
    study = compared({"fast": FAST, "slow": SLOW}, "feedforward", law.name)
    done = face.compare(study)
    rows = {(row.controller, row.loop) for row in done.rows}
    assert rows == {("feedforward", "fast"), ("feedforward", "slow"), (law.name, "slow")}
    assert set(ticks) == {1e-3}
    assert count_rollouts(study.compare) == len(done.rows) == 6
    (told,) = [record.getMessage() for record in caplog.records if law.name in record.getMessage()]
    assert "fast" in told and "slow" not in told and "2 cases" in told
    placed = {ranking.name: ranking.labels for ranking in done.rankings}
    assert [law.name in str(labels) for labels in placed.values()].count(True) == 1
    with pytest.raises(UserError, match="plainly") as refused:
        face.compare(compared({"fast": FAST}, "feedforward", law.name))
    assert refused.value.exit_code == 2


def test_in_a_class_of_a_fast_and_a_slower_loop_compiled_laws_are_compared_on_both(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def push(now: Any, wrist: Any, gains: Any, memory: Any) -> float:
        return 0.1

    law = plain(push)
    monkeypatch.setitem(CONTROLLERS, law.name, law)
    loops = {"fast": FAST, "ideal": SLOW | {"control_period": 1e-4, "limits": False}}
    (ranking,) = face.compare(compared(loops, law.name, "feedforward")).rankings
    assert ranking.labels == ["feedforward/default"] and list(ranking.loops) == ["fast", "ideal"]


def test_the_cost_told_is_that_of_the_laws_own_ticks(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def push(now: Any, wrist: Any, gains: Any, memory: Any) -> float:
        return 0.1

    monkeypatch.setattr(step_cost, "step_time", lambda *_: step_cost.StepTime(2000.0, 2000.0))
    law = plain(push)
    monkeypatch.setitem(CONTROLLERS, law.name, law)
    study = Study.model_validate({"simulate": {"controller": law.name, "gains": "default", "horizon": 1200.0}})
    warn_of_plain(SIMULATE, study)
    (told,) = [record.getMessage() for record in caplog.records]
    assert told.endswith("40 min"), "1.2 million ticks of 2 ms"


OWN = """
from wristctl.control.law import Controller, Gain
def law(now, wrist, gains, memory):
    return -gains.k * (now.theta - now.theta_ref)
GAINS = {"k": Gain("N m/rad", "spring", 0.1, 10.0)}
ONLY = Controller("only", law, "", GAINS, {"soft": {"k": 0.5}})
TWO = Controller("two", law, "", GAINS, {"soft": {"k": 0.5}, "default": {"k": 1.0}})
PLAIN = Controller("plainly", law, "", GAINS, {"soft": {"k": 0.5}}, plain=True)
"""


@pytest.mark.parametrize(("name", "preset"), [("ONLY", "soft"), ("TWO", "default")])
@pytest.mark.parametrize("command", [SIMULATE, ANALYSE, COMPARE], ids=lambda procedure: procedure.kind)
def test_a_controller_brings_its_own_preset_where_nobody_names_gains(
    tmp_path: Path, name: str, preset: str, command: Any
) -> None:
    (tmp_path / "own.py").write_text(OWN)
    place = f"{tmp_path}/own.py:{name}"
    field, overrides = (
        ("rows", [f"controllers=[{{controller: {place}}}]", "inverses=[none]"])
        if command is COMPARE
        else ("gains", [f"simulate.controller={place}"])
    )
    study = prepare(command, load_study((), overrides, command.kind), tmp_path).study
    chosen = study.compare.rows[0].gains if field == "rows" else study.simulate.gains
    assert chosen == preset


def test_gains_that_somebody_names_with_the_controller_are_never_replaced(tmp_path: Path) -> None:
    (tmp_path / "own.py").write_text(OWN)
    place = f"{tmp_path}/own.py:ONLY"
    (tmp_path / "other.yaml").write_text("simulate: {controller: smc, gains: exchanged}")
    (tmp_path / "mine.yaml").write_text("simulate: {controller: own.py:ONLY, gains: exchanged}")

    def gains(*overrides: str, file: str = "other.yaml") -> Any:
        prepared = prepare(SIMULATE, load_study([tmp_path / file], overrides, "simulate"), tmp_path)
        prepared.plan()
        return prepared.study.simulate.gains

    assert gains(f"controller={place}") == "soft", "the file's gains are for the file's controller"
    assert gains("controller=smc") == "exchanged", "which another may have too"
    for overrides, file in (((f"controller={place}", "gains=exchanged"), "other.yaml"), ((), "mine.yaml")):
        with pytest.raises(UserError, match="exchanged"):
            gains(*overrides, file=file)


def test_a_plain_law_that_is_to_be_analysed_is_refused_for_being_plain(tmp_path: Path) -> None:
    (tmp_path / "own.py").write_text(OWN)
    study = load_study((), [f"simulate.controller={tmp_path}/own.py:PLAIN"], "analyse")
    with pytest.raises(UserError, match="plain Python") as refused:
        prepare(ANALYSE, study, tmp_path).plan()
    assert refused.value.where == "simulate.controller"
