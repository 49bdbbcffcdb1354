"""Where settings cease to be sensible: what lies on the edge is taken, and what lies beyond it refused."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import pytest
from pydantic import ValidationError

from wristctl.config.audit import AuditSettings, Claim
from wristctl.config.bench import RenderedCamera
from wristctl.config.camera import CharucoBoard, Markers
from wristctl.config.fair_study import FairStudySettings
from wristctl.config.families import Family, Range, Worlds, drawn_value
from wristctl.config.hw_run import HwRunSettings, LoadCells, RigSettings
from wristctl.config.hysteresis import HysteresisSettings
from wristctl.config.learning import DataSettings, Grid, NetworkSettings, TrainSettings
from wristctl.config.loop import CAMERA, LOOPS, Loop, Reference
from wristctl.config.plant import Actuator, Plant
from wristctl.config.recommend import RecommendSettings
from wristctl.config.section import Section
from wristctl.config.simulate import AnalyseSettings
from wristctl.config.study import Study
from wristctl.config.tune import Objective, TuneSettings
from wristctl.config.unknowns_box import Box, Unstated
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError


class Edge(NamedTuple):
    """A section, settings that it takes, and what, put in their place, it refuses."""

    section: type[Section]
    taken: dict[str, Any]
    refused: dict[str, Any]


def claim(name: str, **more: Any) -> dict[str, Any]:
    return {"id": name, "says": "it is so", "evidence": "text", "verdict": "open"} | more


COMPARED = claim("A1", evidence="comparison", value=1.0, controller="pid", gains="printed", metric="rmse")
ORDERED = COMPARED | {"evidence": "ordering", "than": "smc/printed"}
CAMERA_60 = {"sensor": {"level": "camera"}}
TWO_PLANES: dict[str, Any] = {"planes": 2, "port": "COM3"}
SECOND_ORDER: dict[str, Any] = {"optimiser": "levenberg-marquardt"}
SMALL = SECOND_ORDER | {"hidden": (61, 61)}
"""3 x 61 + 62 x 61 + 62 = 4027 weights; with 60 in each layer 3901."""

EDGES = {
    "a frame and its tick": Edge(Loop, {"control_period": 1 / 60, **CAMERA_60}, {"control_period": 1.01 / 60}),
    "markers": Edge(Markers, {"base": 3, "tip": 2}, {"base": 2}),
    "little marker": Edge(CharucoBoard, {"square": 0.05, "marker": 0.0201}, {"marker": 0.0199}),
    "large marker": Edge(CharucoBoard, {"square": 0.05, "marker": 0.0424}, {"marker": 0.0426}),
    "board": Edge(CharucoBoard, {"columns": 9, "rows": 11}, {"rows": 12}),
    "exposure": Edge(RenderedCamera, {"exposure": 0.02, "frame_rate": 50.0}, {"exposure": 0.0201}),
    "jitter": Edge(RenderedCamera, {"jitter": 0.02, "frame_rate": 50.0, "exposure": 1e-3}, {"jitter": 0.0201}),
    "study's laws": Edge(FairStudySettings, {"controllers": ["pid", "smc"]}, {"controllers": ["pid", "smc", "pid"]}),
    "beside another": Edge(
        FairStudySettings, {"variants": {"a": {"beside": "b"}, "b": {}}}, {"variants": {"a": {"beside": "a"}, "b": {}}}
    ),
    "beside its own": Edge(FairStudySettings, {"variants": {"a": {}}}, {"variants": {"a": {"beside": "b"}}}),
    "variant's optimiser": Edge(
        FairStudySettings, {"variants": {"a": {"optimiser": "random"}}}, {"variants": {"a": {"optimiser": "guess"}}}
    ),
    "sealed": Edge(Worlds, {"split": "sealed", "sealed": 0}, {"sealed": None}),
    "unsealed": Edge(Worlds, {"split": "test"}, {"sealed": 0}),
    "nothing to draw": Edge(Family, {"draw": {"plant_segments": (1,)}}, {"draw": {"plant_segments": ()}}),
    "drawn lower end": Edge(Family, {"draw": {"plant.payload": "0..1"}}, {"draw": {"plant.payload": "-0.1..1"}}),
    "drawn upper end": Edge(
        Family, {"draw": {"plant.creep": "0..0.9"}}, {"draw": {"plant.creep": "0..1.1"}}
    ),
    "drawn motion": Edge(
        Family, {"draw": {"reference.duration": "0.1..1"}}, {"draw": {"reference.duration": "-0.1..1"}}
    ),
    "late": Edge(
        HwRunSettings, {"safety": {"late": 0.1, "watchdog": 0.2}}, {"safety": {"late": 0.2, "watchdog": 0.2}}
    ),
    "late by a tick": Edge(
        HwRunSettings, {"safety": {"late": 0.13, "watchdog": 0.15}}, {"safety": {"late": 0.145, "watchdog": 0.15}}
    ),
    "mute cell": Edge(LoadCells, {"counts_per_newton": (1, -2, 3, 4)}, {"counts_per_newton": (1, 2, 0, 4)}),
    "markers of two planes": Edge(
        RigSettings,
        {**TWO_PLANES, "markers": {"base": 0, "tip": 1}, "markers_2": {"base": 2, "tip": 3}},
        {"markers_2": {"base": 2, "tip": 1}},
    ),
    "motors": Edge(RigSettings, {"actuator": {"level": "tendon"}}, {"actuator": {"level": "lagged"}}),
    "board ahead": Edge(
        RigSettings,
        {"actuator": {"level": "tendon", "step_acceleration": 80_000.0, "ramp": 80_000.0}},
        {"actuator": {"level": "tendon", "step_acceleration": 80_000.0, "ramp": 79_999.0}},
    ),
    "steepest ramp": Edge(RigSettings, {"actuator": {"ramp": 200_000.0}}, {"actuator": {"ramp": 200_001.0}}),
    "eyes": Edge(RigSettings, {"sensor": {"level": "camera"}}, {"sensor": {"level": "ideal"}}),
    "pushes or none": Edge(
        HwRunSettings, {"without_push": True, "push": {"force": 0.0}}, {"without_push": False}
    ),
    "some pushes": Edge(
        HwRunSettings, {"without_push": False, "push": {"force": -1.0}}, {"push": {"force": 0.0}}
    ),
    "frames of a rig": Edge(
        HwRunSettings, {"control_period": 0.02, "sensor": {"frame_rate": 50.0}}, {"sensor": {"frame_rate": 50.1}}
    ),
    "stored": Edge(HwRunSettings, {"positions": "stored", "calibration": "run"}, {"calibration": None}),
    "motion in two planes": Edge(
        HwRunSettings, {"planes": 2, "real_time": False, "directions": ["ulnar-flexion"]}, {"planes": 1}
    ),
    "push across": Edge(
        HwRunSettings, {"planes": 2, "real_time": False, "push_toward_deg": 0.0}, {"planes": 1}
    ),
    "range": Edge(
        HysteresisSettings, {"ranges_deg": [(0, 30), (-5, -4)], "angles_deg": []}, {"ranges_deg": [(0, 30), (-4, -4)]}
    ),
    "held low": Edge(HysteresisSettings, {"ranges_deg": [(0, 30)], "angles_deg": [0.1, 29.9]}, {"angles_deg": [0.0]}),
    "held high": Edge(HysteresisSettings, {"ranges_deg": [(0, 30), (0, 60)], "angles_deg": [15]}, {"angles_deg": [30]}),
    "speed": Edge(HysteresisSettings, {"frequencies": [1e-6, 20.0]}, {"frequencies": [20.1]}),
    "some speed": Edge(HysteresisSettings, {"frequencies": [1e-6]}, {"frequencies": [0.0]}),
    "friction": Edge(HysteresisSettings, {"frictions": [0.0], "sheaths": [0.0]}, {"frictions": [-0.01]}),
    "sheath": Edge(HysteresisSettings, {"sheaths": [0.0]}, {"sheaths": [-0.01]}),
    "presliding": Edge(HysteresisSettings, {"preslidings": [1e-9]}, {"preslidings": [0.0]}),
    "stretch up": Edge(DataSettings, {"stretch": (1.0, 1.0)}, {"stretch": (1.0, 0.999)}),
    "stretch": Edge(DataSettings, {"stretch": (1e-3, 1.0)}, {"stretch": (0.0, 1.0)}),
    "payload": Edge(DataSettings, {"payload": (0.0, 0.0)}, {"payload": (-0.1, 0.0)}),
    "payload up": Edge(DataSettings, {"payload": (0.2, 0.2)}, {"payload": (0.2, 0.1)}),
    "held-out payload": Edge(DataSettings, {"held_out_payload": (0.2, 0.2)}, {"held_out_payload": (0.2, 0.1)}),
    "second order": Edge(NetworkSettings, SMALL | {"hidden": (60, 60)}, SMALL),
    "first order": Edge(NetworkSettings, SMALL | {"optimiser": "adamw"}, SMALL),
    "second order searched": Edge(
        TrainSettings,
        SECOND_ORDER | {"hidden": (2,), "search": True, "grid": {"widths": (100,), "depths": (1,)}},
        {"grid": {"widths": (100,), "depths": (1, 2)}},
    ),
    "one network by itself": Edge(TrainSettings, {"rows": [{"name": "a"}, {"name": "b"}]}, {"rows": [{}]}),
    "networks": Edge(TrainSettings, {"rows": [{"name": "a"}]}, {"rows": [{"name": "a"}, {"name": "a"}]}),
    "rows and search": Edge(TrainSettings, {"rows": [{"name": "a"}]}, {"search": True}),
    "depth": Edge(Grid, {"depths": [1, 10]}, {"depths": [11]}),
    "some depth": Edge(Grid, {"depths": [1]}, {"depths": [0]}),
    "width": Edge(Grid, {"widths": [2, 10_000]}, {"widths": [1]}),
    "great width": Edge(Grid, {"widths": [10_000]}, {"widths": [10_001]}),
    "rates": Edge(Grid, {"learning_rates": [1e-9]}, {"learning_rates": [0.0]}),
    "decays": Edge(Grid, {"weight_decays": [0.0]}, {"weight_decays": [-1e-9]}),
    "neurons": Edge(NetworkSettings, {"hidden": [1, 10_000]}, {"hidden": [0]}),
    "many neurons": Edge(NetworkSettings, {"hidden": [10_000]}, {"hidden": [10_001]}),
    "angle or tip": Edge(
        Reference, {"angle_deg": None, "tip": (0.08, 0.0), "inverse": "closed-form"}, {"angle_deg": 0.0}
    ),
    "tips or ratios": Edge(
        Reference, {"kind": "tip-path", "tips": [(0.08, 0.0)], "inverse": "closed-form"}, {"tip_ratios": [(1.0, 0.0)]}
    ),
    "inverse of a tip": Edge(Reference, {"tip": (0.08, 0.0), "inverse": "closed-form"}, {"inverse": "none"}),
    "inverse of a path": Edge(Reference, {"kind": "tip-path", "inverse": "network"}, {"inverse": "none"}),
    "recording": Edge(Reference, {"kind": "recording", "file": "a.csv"}, {"file": None}),
    "no recording": Edge(Reference, {"kind": "sine"}, {"file": "a.csv"}),
    "of the plant, positive": Edge(Plant, {"length": 1e-3}, {"length": 0.0}),
    "of the plant, not negative": Edge(Plant, {"hand_mass": 0.0, "damping": 0.0}, {"damping": -1e-9}),
    "multiple": Edge(Plant, {"length": "x1.05"}, {"length": "x0"}),
    "multiple in words": Edge(Plant, {"length": "X 5e-1"}, {"length": "1.05x"}),
    "frequencies": Edge(RecommendSettings, {"frequencies": [0.01]}, {"frequencies": [0.0]}),
    "payloads": Edge(RecommendSettings, {"payloads": [0.01]}, {"payloads": [0.0]}),
    "weight of another metric": Edge(Objective, {"settling": 0.0}, {"settling": -0.1}),
    "tuned once": Edge(TuneSettings, {"controllers": ["smc", "pid"]}, {"controllers": ["smc", "pid", "smc"]}),
    "tensions": Edge(WristParameters, {"pretension": 2.0, "tension_limit": 2.001}, {"tension_limit": 2.0}),
    "seed": Edge(Study, {"seed": 0}, {"seed": -1}),
    "odds": Edge(Unstated, {"draw": "0..1", "unless": {"a": 1}, "odds": 0.99}, {"odds": 1.0}),
    "no odds": Edge(Unstated, {"draw": "0..1", "unless": {"a": 1}, "odds": 0.1}, {"odds": 0.0}),
    "odds of nothing": Edge(Unstated, {"draw": "0..1"}, {"odds": 0.1}),
    "nothing unstated": Edge(Unstated, {"draw": "0..1"}, {"draw": None}),
    "drawn and named": Edge(Unstated, {"one_of": {"a": {}}}, {"draw": "0..1"}),
    "named and without": Edge(Unstated, {"one_of": {"a": {}}}, {"unless": {"a": 1}, "odds": 0.1}),
    "horizon of a box": Edge(
        Box, {"unknowns": {"horizon": {"draw": "3..6"}}, "horizon": 6.0}, {"horizon": 5.9}
    ),
    "measured": Edge(
        Box,
        {"unknowns": {"measured": {"draw": ("ideal", "differenced", "observer")}}},
        {"unknowns": {"measured": {"draw": ("ideal", "guessed")}}},
    ),
    "beyond a box": Edge(
        Box, {"unknowns": {"wrist.length": {"draw": "0.05..0.1"}}}, {"unknowns": {"length": {"draw": "0.05..0.1"}}}
    ),
    "span": Edge(AnalyseSettings, {"span": 1.01}, {"span": 1.0}),
    "claims": Edge(AuditSettings, {"claims": [claim("A1"), claim("A2")]}, {"claims": [claim("A1"), claim("A1")]}),
    "a claim that is judged": Edge(Claim, COMPARED, {"value": None}),
    "a claim by text": Edge(Claim, claim("A1"), {"verdict": None}),
    "ordering": Edge(Claim, ORDERED, {"than": "smc"}),
    "one ordering": Edge(Claim, ORDERED, {"than": "smc/printed/x"}),
    "factor": Edge(Claim, COMPARED | {"value": 1e-9}, {"value": 0.0}),
    "bound": Edge(Claim, COMPARED | {"value": 0.0, "sense": "at most"}, {"sense": "about"}),
    "exactly nothing": Edge(Claim, COMPARED | {"value": 0.0, "sense": "exactly"}, {"sense": "about"}),
    "of the settings": Edge(Claim, COMPARED | {"value": -1.0, "evidence": "settings"}, {"evidence": "equation"}),
    "parts": Edge(
        AuditSettings,
        {"claims": [claim("A1", evidence="parts"), claim("A2", part_of="A1")]},
        {"claims": [claim("A1", evidence="parts"), claim("A2")]},
    ),
    "part of what is there": Edge(
        AuditSettings, {"claims": [claim("A1"), claim("A2", part_of="A1")]}, {"claims": [claim("A2", part_of="A1")]}
    ),
    "part of a part": Edge(
        AuditSettings,
        {"claims": [claim("A1"), claim("A2", part_of="A1"), claim("A3", part_of="A1")]},
        {"claims": [claim("A1"), claim("A2", part_of="A1"), claim("A3", part_of="A2")]},
    ),
}  # fmt: skip


def in_tuples(given: Any) -> Any:
    """Settings with tuples for lists, as files of studies are read."""
    if isinstance(given, dict):
        return {key: in_tuples(each) for key, each in given.items()}
    return tuple(in_tuples(each) for each in given) if isinstance(given, list | tuple) else given


@pytest.mark.parametrize("name", EDGES)
def test_what_lies_on_the_edge_is_taken_and_what_lies_beyond_it_refused(name: str) -> None:
    section, taken, refused = EDGES[name]
    section.model_validate(in_tuples(taken))
    with pytest.raises((ValidationError, UserError)) as caught:
        section.model_validate(in_tuples(taken | refused))
    if isinstance(caught.value, ValidationError):
        assert not {"extra_forbidden", "tuple_type"} & {error["type"] for error in caught.value.errors()}


@pytest.mark.parametrize("text", ["3..0", "1..1", "0..3 log", "-1..3 log", "x0..1", "x-1..1", "1..", "..1", "1-3", ""])
def test_what_is_no_range_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match="should be a range"):
        Range.read(text)


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("0..3", (0.0, 1.5, 3.0)),
        (" -3 .. -1 ", (-3.0, -2.0, -1.0)),
        ("1e2..1e4 log", (1e2, 1e3, 1e4)),
        ("X0.5..1.5", ("x0.5", "x1", "x1.5")),
        ("x0.5..x2 LOG", ("x0.5", "x1", "x2")),
    ],
)
def test_a_range_is_drawn_from_evenly_or_in_its_logarithm_and_as_multiples(text: str, values: tuple[Any, ...]) -> None:
    drawn = [drawn_value(text, share) for share in (0.0, 0.5, 1.0)]
    if isinstance(values[0], str):
        assert drawn == list(values)
    else:
        assert drawn == pytest.approx(values)


def test_each_of_a_list_is_drawn_as_often() -> None:
    drawn = [drawn_value((4, 4.5, "x2"), (number + 0.5) / 30) for number in range(30)]
    assert drawn == [4] * 10 + [4.5] * 10 + ["x2"] * 10 and drawn_value((4, 8), 1.0) == 8


def test_the_rows_of_settings_that_are_drawn_together_are_tried_one_by_one() -> None:
    rows = tuple({"plant.stiffness": 0.1 * number, "plant.length": 0.08} for number in (1, 2, 3))
    family = Family(together=rows)
    assert [family.world({"together": share}).plant.stiffness for share in (0.0, 0.3, 0.4, 0.6, 0.7, 0.99)] == [
        pytest.approx(each) for each in (0.1, 0.1, 0.2, 0.2, 0.3, 0.3)
    ]
    for wrong in range(3):
        worse = tuple(row | {"plant.length": -0.08 if number == wrong else 0.08} for number, row in enumerate(rows))
        with pytest.raises(ValidationError, match=f"row {wrong + 1} of together"):
            Family(together=worse)


def test_a_share_of_the_odds_has_the_setting_without_the_unknown() -> None:
    """Beside a draw, the rest of the shares covers the whole range."""
    unknown = Unstated(draw="2..4", unless={"wrist.hand_mass": 0.0}, odds=0.25)
    assert unknown.at(0.0)[0] == 2.0 and unknown.at(0.375)[0] == 3.0
    assert unknown.at(0.7499)[0] == pytest.approx(4.0, abs=1e-3) and unknown.at(0.7499)[1] is None
    for share in (0.75, 0.99):
        assert unknown.at(share) == (math.inf, {"wrist.hand_mass": 0.0})
    named = Unstated(one_of={"light": {"wrist.hand_mass": 0.1}, "heavy": {"wrist.hand_mass": 0.5}})
    assert [named.at(share)[0] for share in (0.0, 0.49, 0.5, 0.999, 1.0)] == [
        "light",
        "light",
        "heavy",
        "heavy",
        "heavy",
    ]
    assert named.at(0.9)[1] == {"wrist.hand_mass": 0.5}


def test_a_mirrored_reference_goes_the_same_way_to_the_other_side() -> None:
    assert Reference().mirrored().end_deg == -30.0 and Reference(angle_deg=20.0).mirrored().angle_deg == -20.0
    to_tip = Reference(tip=(0.07, 0.02), inverse="closed-form").mirrored()
    assert to_tip.tip == (0.07, -0.02) and to_tip.angle_deg is None
    steps = Reference(kind="multi-step", angles_deg=(1.0, -2.0)).mirrored()
    assert steps.angles_deg == (-1.0, 2.0)
    path = Reference(kind="tip-path", inverse="network")
    assert path.mirrored().end_ratios == tuple((x, -y) for x, y in path.end_ratios)
    in_metres = path.in_metres(0.08)
    assert in_metres.mirrored().tips == tuple((x, -y) for x, y in in_metres.tips or ())
    assert in_metres.mirrored().mirrored().tips == in_metres.tips and in_metres.mirrored().tip_ratios is None


def test_a_built_in_loop_that_is_changed_keeps_what_is_not_said() -> None:
    loops = TuneSettings.model_validate({"loops": {"exact": {"plant_segments": 2}, "own": {"plant_segments": 2}}}).loops
    assert loops["exact"] == LOOPS["exact"].model_copy(update={"plant_segments": 2})
    assert loops["own"] == Loop(plant_segments=2)
    assert "substeps" not in loops["exact"].model_fields_set, "what neither says is at its default, not given"


def test_a_rigs_step_rate_outlives_two_periods_and_the_shortest_time() -> None:
    """A board that hears nothing stops in time: a rate lives for some periods, and for a least time in a fast loop."""
    slowly = {"safety": {"watchdog": 1.0}, "sensor": {"frame_rate": 15.0}}
    fast, slow, slower = (
        HwRunSettings.model_validate(slowly | {"control_period": period}) for period in (2e-3, 0.04, 0.05)
    )
    assert slower.rate_life / slow.rate_life == pytest.approx(1.25) and slow.rate_life > 2.0 * slow.control_period
    assert fast.rate_life < slow.rate_life and fast.rate_life > 10.0 * fast.control_period


@pytest.mark.parametrize(
    ("period", "stiffness", "steps"),
    [(1e-3, 20e3, 1), (10e-3, 20e3, 10), (3e-3, 50e3, 3), (3e-3, 50.1e3, 6), (1.01e-3, 20e3, 2), (1e-4, 60e3, 1)],
)
def test_elastic_tendons_take_steps_of_1_ms_at_most_and_of_half_that_where_they_are_stiff(
    period: float, stiffness: float, steps: int
) -> None:
    loop = Loop(control_period=period, actuator=Actuator(level="tendon", tendon_stiffness=stiffness))
    assert loop.steps == steps
    assert loop.model_copy(update={"substeps": 7}).steps == 7
    assert loop.model_copy(update={"actuator": Actuator(tendon_stiffness=stiffness)}).steps == 1


def test_a_microstep_is_a_share_of_the_pulleys_circumference() -> None:
    actuator = Actuator(pulley_radius=0.01, motor_steps=200, microstep=8)
    assert 200 * 8 * actuator.step_length == pytest.approx(0.02 * math.pi)


def test_a_rig_of_which_a_loop_says_nothing_is_the_default_rig() -> None:
    given = {"loop": {"control_period": 0.02, "sensor": {"frame_rate": 30.0}}}
    loop, default = RecommendSettings.model_validate(given).loop, RecommendSettings().loop
    assert loop.actuator == default.actuator and loop.actuator.level == "tendon"
    assert loop.sensor == default.sensor.model_copy(update={"frame_rate": 30.0}) and loop.sensor.level == "camera"
    assert (loop.control_period, default.control_period) == (0.02, CAMERA.control_period)
    asked = RecommendSettings().family(12.5).draw["reference.angle_deg"]
    assert [drawn_value(asked, share) for share in (0.0, 1.0)] == [-12.5, 12.5]
