"""What a real wrist has in two planes: in a plane that of one, alike in all directions, and as SciPy integrates it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from tests.oracles.real_bends import Facts, real_course
from tests.simulation.spools_in_space import Wrist, moved
from wristctl.arrays import Array
from wristctl.config.loop import Loop
from wristctl.config.plant import Actuator, TrueActuator, TrueWrist
from wristctl.config.wrist import WristParameters
from wristctl.control.table import controller, gains_of
from wristctl.simulation.closed_loop import equilibrium, follow
from wristctl.simulation.motion import Angles, Motion
from wristctl.simulation.rollout import rollout
from wristctl.simulation.spatial_references import dart_thrower, turned
from wristctl.simulation.worlds import World
from wristctl.wrist.directions import in_plane
from wristctl.wrist.plant import PLANTS_IN_SPACE
from wristctl.wrist.spatial.spatial_kinematics import tip_bends
from wristctl.wrist.tendon_layout import TendonLayout, TendonPlace

pytestmark = pytest.mark.slow

PERIOD = 5e-3
TIME = PERIOD * np.arange(300.0)
RUBBING = {"actuator": {"level": "tendon", "sheath": 1.0}}
LEAVES: dict[str, dict[str, Any]] = {
    "springs creep": {"plant": {"creep": 0.2, "creep_time": 0.3}},
    "end stops": {"plant": {"end_stop_deg": 25.1}, "disturbances": {"push": {"force": 12.0, "start": 0.4}}},
    "inner friction": {"plant": {"inner_friction": 0.05}},
    "payload": {"plant": {"payload": 0.2, "tilt_deg": 0.0}},
    "tendons creep": RUBBING | {"plant": {"actuator": {"creep": 0.2, "creep_time": 0.3}}},
    "backlash": RUBBING | {"plant": {"actuator": {"backlash": 1e-4}}},
    "stall": RUBBING | {"plant": {"actuator": {"torque": 0.03, "top_speed": 1e5}}},
    "all": RUBBING
    | {
        "plant": {
            "creep": 0.2, "inner_friction": 0.05, "end_stop_deg": 25.1, "actuator": {"creep": 0.2, "backlash": 1e-4}
        }
    },
}  # fmt: skip


@pytest.mark.parametrize("side", [0, 1])
@pytest.mark.parametrize("leaf", LEAVES)
def test_a_motion_in_a_plane_is_the_planar_one_with_all_that_a_real_wrist_has(leaf: str, side: int) -> None:
    law = controller("pid-ff")
    gains, wrist = np.array(gains_of(law, "hardware")), WristParameters(flexion_ratio=1.4)
    line = turned(dart_thrower(TIME, np.deg2rad(25.0), 1.0), -40.0)[0]
    path = np.zeros((2, 3, len(TIME)))
    path[side] = line
    base: dict[str, Any] = {
        "control_period": PERIOD,
        "coupling": "ignored",
        "spool_lead": False,
        "substeps": 5,
    } | LEAVES[leaf]
    pushed: dict[str, Any] = base.get("disturbances", {})
    in_space = base | {"disturbances": pushed | {"toward_deg": 90.0 * side}}
    course = follow(law, gains, Motion.of_bends(path, PERIOD, wrist.length), wrist, Loop.model_validate(in_space))
    bend = course.trajectory.bend
    motion = Motion(TIME, Angles.of(line), np.zeros((len(TIME), 2)), None, 0.0, 1.5, 1.5)

    def planar(loop: dict[str, Any]) -> Array:
        facing, lanes = in_plane(wrist, ("ulnar", "flexion")[side]), np.zeros(1, np.int64)
        one = rollout(law, gains[None], [motion], lanes, Loop.model_validate(loop), facing, streams=[(0,)], record=True)
        theta: Array = one.column("theta", 0)
        return theta

    assert bend[:, side] == pytest.approx(planar(base), abs=1e-9)
    assert np.abs(bend[:, 1 - side]).max() < 1e-9
    without = planar({key: part for key, part in base.items() if key != "plant"})
    assert np.abs(bend[:, side] - without).max() > 1e-4, "it does something"


WRIST = WristParameters(damping=0.04, flexion_ratio=1.3, stiffness_axis_deg=25.0)
SOFT = Actuator(level="tendon", tendon_stiffness=4e3, friction=0.2, sheath=0.5, presliding=2e-4)
SMOOTH = SOFT.model_copy(update={"friction": 0.0})
END, STEP = 0.3, 5e-5
# Two tendons are alike at the first place.
PLACES = (TendonPlace(0.3, 0.02, 3, 2), TendonPlace(2.2, 0.018), TendonPlace(4.1, 0.02))


def layout(turn: float = 0.0) -> TendonLayout:
    return TendonLayout(tuple(TendonPlace(p.angle + turn, p.radius, p.ends_at, p.multiplicity) for p in PLACES))


def reeled(time: Array) -> Array:
    """Three spools that reel in one after the other (..., 3) [m]."""
    swing = 2.0 * np.pi * np.asarray(time)[..., None] / END - np.array([0.0, 2.0, 4.0])
    return 2e-3 + 2.5e-3 * (1.0 - np.cos(swing)) * np.minimum(1.0, np.asarray(time)[..., None] / 0.05)


FACTS: dict[str, tuple[Actuator, dict[str, Any], dict[str, Any]]] = {
    "friction": (SOFT, {}, {}),
    "tendons creep": (SMOOTH, {"creep": 0.3, "creep_time": 0.2}, {}),
    "springs creep": (SMOOTH, {}, {"creep": 0.3, "creep_time": 0.05}),
    "inner friction": (SMOOTH, {}, {"inner_friction": 0.08, "inner_presliding_deg": 2.0}),
    "end stops": (SMOOTH, {}, {"end_stop_deg": 6.0, "end_stop_stiffness": 5.0, "end_stop_dissipation": 2.0}),
    "one of two breaks": (SMOOTH, {"broken_at": 0.15, "broken_tendon": 1}, {}),
    "the only one breaks": (SMOOTH, {"broken_at": 0.15, "broken_tendon": 3}, {}),
    "a place slips": (SMOOTH, {"slips_at": 0.15, "slip": 2e-3, "slipping_tendon": 2}, {}),
}


def real(fact: str, n: int, turn: float = 0.0) -> Wrist:
    actuator, facts, plant = FACTS[fact]
    c, s = np.cos(turn), np.sin(turn)
    force = (0.2, 0.5 * c, 0.5 * s)
    wrist = WRIST.model_copy(update={"stiffness_axis_deg": WRIST.stiffness_axis_deg + np.degrees(turn)})
    return Wrist(
        wrist, layout(turn), actuator, TrueActuator.model_validate(facts), TrueWrist.model_validate(plant), n, force
    )


@pytest.mark.parametrize("fact", FACTS)
def test_a_wrist_moves_as_scipy_integrates_its_equations_written_out(fact: str) -> None:
    wrist, (actuator, facts, plant) = real(fact, 1), FACTS[fact]
    alike, every = wrist.layout.multiplicity, 500
    steps = np.arange(0.0, END, STEP)
    course = moved(wrist, reeled(steps), STEP)

    def left(time: float) -> Array:
        shares = np.ones(3)
        if time >= facts.get("broken_at", np.inf):
            place = facts["broken_tendon"] - 1
            shares[place] = 1.0 - 1.0 / alike[place]
        return shares

    def held(time: float) -> Array:
        """Held over each step as it was at its beginning."""
        lengths: Array = reeled(np.asarray(max(time - 0.5 * STEP, 0.0)))
        if time >= facts.get("slips_at", np.inf):
            lengths[facts["slipping_tendon"] - 1] -= facts["slip"]
        return lengths

    expected = real_course(
        wrist.values,
        Facts(
            alike * actuator.tendon_stiffness, actuator.friction, actuator.sheath, actuator.presliding,
            facts.get("creep", 0.0), facts.get("creep_time", 1.0), plant.get("creep", 0.0),
            plant.get("creep_time", 1.0), plant.get("inner_friction", 0.0),
            np.radians(plant.get("inner_presliding_deg", 1.0)), np.radians(plant.get("end_stop_deg", np.inf)),
            plant.get("end_stop_stiffness", 0.0), plant.get("end_stop_dissipation", 0.0),
        ),
        left, held, steps[::every],
    )  # fmt: skip
    assert course.q[::every] == pytest.approx(expected, abs=1e-5)
    plain = moved(wrist._replace(actuator=SMOOTH, facts=TrueActuator(), plant=TrueWrist()), reeled(steps), STEP)
    assert np.abs(course.q - plain.q).max() > 5e-3, "it does something"
    crosses = np.abs(np.cross(np.append(course.bend[2000], 0.0), np.append(course.bend[-1], 0.0))).max()
    assert crosses > 1e-3, "and in no one plane"


@pytest.mark.parametrize("fact", FACTS)
def test_all_turned_about_the_bases_axis_the_wrist_moves_as_before(fact: str) -> None:
    turn = 0.7
    steps = np.arange(0.0, END, 1e-3)
    plain, aside = moved(real(fact, 2), reeled(steps), 1e-3), moved(real(fact, 2, turn), reeled(steps), 1e-3)
    c, s = np.cos(turn), np.sin(turn)
    assert aside.bend == pytest.approx(plain.bend @ np.array([[c, s], [-s, c]]), abs=1e-9)
    assert aside.pulls == pytest.approx(plain.pulls, abs=1e-6)
    assert np.abs(plain.bend).max() > 0.05


@pytest.mark.parametrize("fact", FACTS)
def test_a_step_of_a_millisecond_is_as_good_as_twenty(fact: str) -> None:
    """What stiffens and brakes the wrist is in the step's Jacobian."""
    lengths = reeled(np.arange(0.0, END, 1e-3))
    coarse, fine = moved(real(fact, 2), lengths, 1e-3), moved(real(fact, 2), np.repeat(lengths, 20, axis=0), 5e-5)
    assert np.degrees(np.abs(coarse.bend - fine.bend[::20]).max()) < 0.01


LEVEL = WristParameters(gravity=(-8.0, 3.0), gravity_flexion=-4.0, flexion_ratio=1.3, stiffness_axis_deg=20.0)


@pytest.mark.parametrize("level", ["ideal", "tendon"])
def test_a_wrist_that_begins_in_equilibrium_stays_there_while_nothing_pulls_more(level: str) -> None:
    """But for what the controller's allocation and spools take as one arc."""
    law, wrist, ideal = controller("pid"), LEVEL.model_copy(update={"tendons": "three"}), level == "ideal"
    loop = Loop.model_validate(
        {
            "control_period": PERIOD, "actuator": {"level": level, "friction": 0.0}, "coupling": "ignored",
            "sensor": {"level": "ideal" if ideal else "camera", "noise_deg": 0.0},
            "plant": {"payload": 0.1, "tendon_radius": 0.021 if ideal else 0.02},
        }
    )  # fmt: skip
    hanging = tip_bends(equilibrium(loop, 2)(World(loop, wrist).plant))
    assert np.abs(hanging).min() > 0.1, "in both planes"
    still = np.zeros((2, 3, 100))
    still[:, 0] = hanging[:, None]
    nothing, motion = np.zeros((1, len(law.gains))), Motion.of_bends(still, PERIOD, wrist.length)
    outcome = rollout(
        law, nothing, [motion], np.zeros(1, np.int64), loop, wrist, equilibrium(loop, 2), record=True, converge=False
    )
    bend = outcome.part("bend", 0)
    assert bend[0] == pytest.approx(hanging, abs=1e-12)
    assert outcome.part("seen", 0)[0] == pytest.approx(hanging, abs=1e-12)
    assert np.abs(bend - hanging).max() < 2e-3
    assert outcome.part("acting", 0)[0] == pytest.approx(np.full(3, wrist.pretension), abs=0.1 if ideal else 0.3)


@pytest.mark.parametrize("model", PLANTS_IN_SPACE)
def test_the_equilibrium_of_a_wrist_that_hangs_in_a_plane_is_that_of_one_plane(model: str) -> None:
    wrist = WristParameters(gravity=(-8.0, 3.0), gravity_flexion=0.0)
    loop = Loop.model_validate({"planes": 2, "plant": {"model": model}})
    q = equilibrium(loop, 2)(wrist)
    assert q[::2] == pytest.approx(equilibrium(loop)(wrist), abs=1e-12) and np.abs(q[::2]).min() > 0.01
    assert np.abs(q[1::2]).max() < 1e-12
