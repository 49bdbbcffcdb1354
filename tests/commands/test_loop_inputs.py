"""What loops begin with: gains, networks and parameters that fit, and warnings of what does not."""

from __future__ import annotations

import logging
import math
from collections.abc import Callable, Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

import wristctl
from tests.commands.conftest import session
from wristctl.commands.identified_wrist import identified
from wristctl.commands.inputs import Inputs
from wristctl.commands.inputs_of_loops import (
    asked_of_search,
    asked_of_simulation,
    check_inverses,
    check_reach,
    check_row,
    inverses_of,
    network_for,
    tuned_gains,
    tuned_on,
)
from wristctl.commands.loop_warnings import warn_if_it_buckles, warn_if_outside, warn_of_loops
from wristctl.commands.procedure import procedure_named
from wristctl.commands.results import Findings
from wristctl.commands.study.command import FAIR_STUDY
from wristctl.config.controller_row import Row
from wristctl.config.loop import Loop, Reference
from wristctl.config.study import Study
from wristctl.control.table import controller
from wristctl.errors import UserError
from wristctl.simulation import worlds
from wristctl.simulation.planes import Asked
from wristctl.study_files.load import read_study
from wristctl.wrist import statics

STUDY = wristctl.load_study(None)
WRIST = STUDY.wrist.model_copy(update={"gravity": (-3.0, 4.0), "hand_mass": 0.25})


def test_tuned_gains_must_be_there_for_the_controller_that_asks_for_them() -> None:
    asked = Row(controller="pid", gains="tuned")
    gains = {"pid": {"kp": 1.0, "ki": 0.0, "kd": 0.0}}
    check_row(Row(controller="pid", gains="printed"), None)
    without: list[Any] = [None, {}, {"smc": {}}]
    for tuned in without:
        with pytest.raises(UserError) as caught:
            check_row(asked, tuned)
        assert (caught.value.what, caught.value.where) == ("no tuned gains of pid", "gains")
        assert caught.value.fix == "--tuned RUN, a tune run that tuned pid: `wristctl runs ls` shows the runs"
    with pytest.raises(UserError) as caught:
        check_row(asked, gains | {"pid": {"nonsense": 1.0}})
    assert "no tuned gains" not in caught.value.what


def test_a_network_is_asked_for_where_a_reference_goes_through_one() -> None:
    references = [Reference(inverse="network"), Reference(inverse="closed-form"), Reference(inverse="closed-form")]
    assert inverses_of(references) == {"network", "closed-form"}
    network: Any = SimpleNamespace()
    some = Inputs({"network": network})
    check_inverses(["network"], some)
    check_inverses(["none", "closed-form"], Inputs())
    check_inverses(["closed-form"], some)
    with pytest.raises(UserError, match="none is given"):
        check_inverses(["closed-form", "network"], Inputs())


class Network:
    """Learned a wrist of so many segments; of a pose and a hand, if that is said."""

    def __init__(self, segments: int, others: tuple[str, ...] = (), empty: bool = False) -> None:
        self.segments, self.others, self.asked, self.planes = segments, others, dict[str, float](), 1
        self.domain, self.along = SimpleNamespace(is_empty=empty), f"{segments} segments"

    def at(self, others: dict[str, float]) -> Network:
        self.asked |= others
        return self


def along(network: Network, *segments: int) -> Any:
    given: Any = SimpleNamespace(network=network, run=None)
    return network_for(Inputs({"network": given}), WRIST, [Loop(plant_segments=each) for each in segments])


def test_a_network_belongs_to_the_segments_that_it_learned() -> None:
    assert along(Network(3), 3, 3) == "3 segments"
    assert along(Network(1), 4, 2) == "1 segments", "of one segment fits any"
    assert network_for(Inputs(), WRIST, []) is None
    for network, others in ((Network(3), (3, 8, 1)), (Network(2), (1,))):
        with pytest.raises(UserError) as caught:
            along(network, *others)
        assert caught.value.what == f"the network learned a wrist of {network.segments} segments, the loop has 1"
        assert caught.value.where == "network" and f"plant_segments: {network.segments} in every" in caught.value.fix


def test_a_network_is_asked_at_the_wrists_pose_and_hand(caplog: pytest.LogCaptureFixture) -> None:
    network = Network(1, ("pose", "hand_mass"))
    along(network, 1)
    assert (
        network.asked == {"pose": pytest.approx(math.atan2(4.0, 3.0)), "roll": 0.0, "hand_mass": 0.25}
        and not caplog.messages
    )
    alone = Network(1)
    along(alone, 1)
    assert not alone.asked
    along(Network(1, ("pose",), empty=True), 1)
    assert "outside what the network learned" in caplog.text


def test_gains_and_parameters_in_memory_are_those_of_their_results() -> None:
    tuned: Any = SimpleNamespace(gains={"pid": {}}, study=STUDY)
    inputs = Inputs({"tuned": tuned})
    assert tuned_gains(inputs) == {"pid": {}} and tuned_on(inputs) is STUDY.tune
    assert tuned_gains(Inputs()) is None and tuned_on(Inputs()) is None
    assert identified(STUDY, "simulate", Inputs()) is STUDY
    found: Any = SimpleNamespace(yaml="wrist: {stiffness: 55.5}\nsimulate: {loop: {actuator: {}, sensor: {}}}\n")
    assert identified(STUDY, "simulate", Inputs({"from_identified": found})).wrist.stiffness == 55.5
    for nothing in (SimpleNamespace(), SimpleNamespace(yaml="")):
        ratios: Any = nothing
        with pytest.raises(UserError, match="no wrist was identified"):
            identified(STUDY, "simulate", Inputs({"from_identified": ratios}))


@pytest.mark.parametrize("command", ["simulate", "analyse", "compare", "hw-run"])
def test_gains_of_a_tune_run_that_no_row_takes_are_warned_of(command: str, caplog: pytest.LogCaptureFixture) -> None:
    kp, ki, kd = controller("pid").gains
    tuned: Any = SimpleNamespace(gains={"pid": {kp: 10.0, ki: 2.0, kd: 0.1}}, study=STUDY, run=None)
    for gains, warned in (("tuned", False), ("printed", True)):
        rows = f"controllers=[{{controller: pid, gains: {gains}}}]"
        row = rows if command == "compare" else f"controller=pid/{gains}"
        study = read_study(overrides=[row], command=command)[0]
        caplog.clear()
        procedure_named(command).plan(study, Inputs({"tuned": tuned}))
        assert ("takes the gains of the tune run" in caplog.text) is warned
        caplog.clear()
        if not warned:
            continue
        procedure_named(command).plan(study, Inputs())
        assert not caplog.text


def test_tips_outside_are_warned_of_in_percent(caplog: pytest.LogCaptureFixture) -> None:
    warn_if_outside(0.0)
    assert not caplog.messages
    warn_if_outside(0.125)
    assert "12.5 % of the wanted tips" in caplog.text


@pytest.mark.parametrize(("stiffness", "buckles"), [((2.0, 1.0), False), ((2.0, 0.0), True), ((-1.0, 2.0), True)])
def test_the_least_stiff_loop_says_whether_the_wrist_buckles(
    caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch, stiffness: tuple[float, float], buckles: bool
) -> None:
    noted: dict[str, Any] = {}
    findings: Findings = session(STUDY).findings
    monkeypatch.setattr(findings, "numerics", lambda **facts: noted.update(facts))
    monkeypatch.setattr(worlds, "plant_of", lambda wrist, plant: (wrist.hand_mass, plant))
    plant = Loop().plant
    known = {((0.25, plant), at): value for at, value in enumerate(stiffness, start=1)}
    monkeypatch.setattr(statics, "least_stiffness", lambda made, segments: known[made, segments])
    with caplog.at_level(logging.WARNING):
        warn_if_it_buckles(findings, WRIST, [Loop(plant_segments=1), Loop(plant_segments=2)], 1)
    assert noted == {"least_stiffness": min(stiffness), "buckles": buckles}
    assert len(caplog.messages) == buckles and (f"{min(stiffness):.3g} N m/rad" in caplog.text) == buckles


@pytest.mark.parametrize(("section", "asked"), [("simulate", asked_of_simulation), ("tune", asked_of_search)])
@pytest.mark.parametrize(("kind", "buckles"), [("circumduction", True), ("minimum-jerk", False)])
def test_a_wrist_that_falls_over_in_its_second_plane_is_warned_of_where_a_motion_bends_it_there(
    caplog: pytest.LogCaptureFixture, section: str, asked: Callable[[Study], Sequence[Asked]], kind: str, buckles: bool
) -> None:
    study = wristctl.load_study(
        None, "wrist.flexion_ratio=0.2", f"simulate.reference.kind={kind}",
        f"tune.scenarios=[{{loop: exact, reference: {{kind: {kind}}}}}]",
    )  # fmt: skip
    with caplog.at_level(logging.WARNING):
        warn_of_loops(session(study).findings, study, getattr(study, section), asked(study))
    assert ("the straight wrist buckles" in caplog.text) == buckles


def test_a_reference_out_of_reach_is_named_by_its_place(tmp_path: Path) -> None:
    """Its leaf where it is a target's, itself where it is a course, and the line of a file."""
    file = tmp_path / "walk.csv"
    file.write_text("time [s],angle [deg]\n0,1\n1,2\n")
    swings = Reference.model_validate({"kind": "two-sided-sine", "angle_deg": 60.0})
    places = {
        "compare.references.1.angle_deg": Reference(angle_deg=60.0),
        "compare.references.1.tip": Reference(tip=(0.0, 0.08), inverse="closed-form"),
        "compare.references.1": swings,
        str(file): Reference(kind="recording", file=str(file)),
    }
    for where, wrong in places.items():
        with pytest.raises(UserError) as caught:
            check_reach([Reference(), wrong], WRIST, "compare.references.{}")
        assert caught.value.where == where


def test_the_study_of_all_laws_refuses_a_tip_that_a_familys_wrist_does_not_reach() -> None:
    asked = "{references: [{}, {kind: tip-path, inverse: closed-form, tips: [[0.12, 0.0], [0.078, 0.014]]}]}"
    given = wristctl.load_study(None, "wrist.length=0.12", "families.good={}", f"families.f={asked}")
    with pytest.raises(UserError) as caught:
        FAIR_STUDY.plan(given, Inputs())
    assert caught.value.where == "families.f.references.1.tips"


def test_samples_of_another_wrist_than_the_study_gives_are_warned_of(caplog: pytest.LogCaptureFixture) -> None:
    """What a study does not say of its wrist is no other wrist."""
    made = wristctl.gen_data(None, samples=40, wrist={"length": 0.095})
    for given, warned in (((), False), (("wrist.length=0.095",), False), (("wrist.length=0.07",), True)):
        caplog.clear()
        procedure_named("train").plan(wristctl.load_study(None, *given), Inputs({"data": made}))
        assert ("wrist.length is 0.095 there and 0.07 here" in caplog.text) is warned
        assert bool(caplog.text) is warned


@pytest.mark.parametrize("kind", ["minimum-jerk", "circumduction"])
def test_a_horizon_of_few_control_periods_is_refused_and_the_least_is_none_of_them(kind: str) -> None:
    def planned(horizon: float) -> str:
        settings = [f"simulate.reference={{kind: {kind}}}", f"simulate.horizon={horizon}"]
        return procedure_named("simulate").plan(wristctl.load_study(None, *settings), Inputs())

    for short in (5e-4, 3e-3, 4.9e-3):
        with pytest.raises(UserError, match="fewer than 5 control periods"):
            planned(short)
    for enough in (5e-3, 0.01, 0.013):
        assert f"{enough:g} s" in planned(enough)
