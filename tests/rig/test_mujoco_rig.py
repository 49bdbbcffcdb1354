"""A MuJoCo model as a rig: what it says of itself is what it was made of, and it moves as its tendons are reeled in."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from wristctl.commands.rig_certificate import Certificate
from wristctl.config.plant import Actuator
from wristctl.config.study import Study
from wristctl.config.wrist import TendonPlace, WristParameters
from wristctl.errors import UserError
from wristctl.mujoco_rig import EXACT, MujocoRig
from wristctl.rig import Drive, Refused, Sensor, Tendon
from wristctl.wrist.hinge_chain import HingeChain, Spools, mjcf

CHAIN = Path(__file__).parents[2] / "experiments/own_rigs/tapering_chain.py"

# A rod on one hinge, with a tendon of the lever 20 mm on either side; what pulls them is put in.
ROD = """
<mujoco>
  <compiler autolimits="true"/>
  <option gravity="0 0 0" timestep="0.001" integrator="implicitfast"><flag contact="disable"/></option>
  <worldbody>
    <body>
      <joint name="hinge" axis="0 0 1" stiffness="2" damping="0.1"/>
      <geom type="capsule" size="0.01" fromto="0 0 0 0.1 0 0" mass="0.2"/>
      <site name="tip" pos="0.1 0 0"/>
    </body>
  </worldbody>
  <tendon>
    <fixed name="left"><joint joint="hinge" coef="-0.02"/></fixed>
    <fixed name="right"><joint joint="hinge" coef="0.02"/></fixed>
  </tendon>
  <actuator>{}</actuator>
</mujoco>
"""
PULLS = {
    "forces": '<motor name="{0}" tendon="{0}" gear="-1" ctrlrange="0 50"/>',
    "forces of the other sign": '<motor name="{0}" tendon="{0}" gear="2" ctrlrange="-25 0"/>',
    "lengths": '<position name="{0}" tendon="{0}" kp="20000" forcerange="-50 0"/>',
    "lengths that would push": '<position name="{0}" tendon="{0}" kp="20000"/>',
    "lengths with a gear": '<position name="{0}" tendon="{0}" kp="5000" gear="2" forcerange="-25 0"/>',
}


def rod(pulls: str, **given: Any) -> MujocoRig:
    text = "".join(PULLS[pulls].format(name) for name in ("left", "right"))
    chosen: dict[str, Any] = {"tension": 50.0, "sensor": EXACT, "slack": 0.0} | given
    return MujocoRig(ROD.format(text), "tip", **chosen)


def bend_of(rig: MujocoRig) -> float:
    return float(np.ravel(rig.look().bend)[0])


def moved(rig: MujocoRig, *targets: float, seconds: float = 3.0) -> Any:
    rig.send(np.array(targets))
    rig.clock.wait_until(rig.clock.now() + seconds)
    return rig.look().bend


def exported(wrist: WristParameters, planes: int, spools: bool) -> str:
    chain = HingeChain.of(wrist, 4, planes)
    return mjcf(chain, "a wrist", Spools.of(Actuator(level="tendon"), wrist) if spools else None)


@pytest.mark.parametrize("spools", [True, False], ids=["spools", "tensions"])
@pytest.mark.parametrize("tendons", ["three", "four", "six", "oblique"])
def test_the_model_of_a_wrist_says_the_wrist(tendons: Any, spools: bool) -> None:
    """Levers, springs, masses and weight are found by small pulls; a wrist's own numbers are what they have to be."""
    oblique = tuple(TendonPlace(angle_deg=angle, radius=0.012) for angle in (10.0, 100.0, 170.0, 290.0))
    wrist = WristParameters(
        tendons=oblique if tendons == "oblique" else tendons, length=0.1, hand_mass=0.2, stiffness=0.8,
        flexion_ratio=1.5, stiffness_axis_deg=20.0, damping=0.05, gravity=(-3.0, 5.0), gravity_flexion=-2.0,
        pretension=0.0, tension_limit=40.0,
    )  # fmt: skip
    facts = MujocoRig(exported(wrist, 2, spools), "tip", tension=40.0).facts
    angles = {"three": [0, 120, 240], "four": [225, 135, 315, 45], "six": [0, 60, 120, 180, 240, 300]}
    radius = 0.012 if tendons == "oblique" else wrist.tendon_radius
    assert facts.planes == 2 and facts.limits.tension == 40.0
    assert [one.radius for one in facts.tendons] == pytest.approx([radius] * len(facts.tendons), rel=2e-3)
    turned = np.exp(1j * np.radians([one.angle_deg for one in facts.tendons]))
    np.testing.assert_allclose(turned, np.exp(1j * np.radians(angles.get(tendons, [10, 100, 170, 290]))), atol=3e-3)
    for name in ("length", "hand_mass", "hand_offset", "stiffness", "flexion_ratio", "damping"):
        assert facts.wrist[name] == pytest.approx(getattr(wrist, name), rel=0.01), name
    assert facts.wrist["stiffness_axis_deg"] == pytest.approx(20.0, abs=0.5)
    assert facts.wrist["gravity"] == pytest.approx((-3.0, 5.0)) and facts.wrist["gravity_flexion"] == pytest.approx(-2)
    assert facts.drive.stiffness == 20e3


@pytest.mark.parametrize("pulls", PULLS)
def test_of_two_tendons_on_one_hinge_it_finds_one_plane(pulls: str) -> None:
    facts = rod(pulls).facts
    assert facts.planes == 1 and facts.tendons == (Tendon(0.0, 0.02), Tendon(180.0, 0.02))
    assert facts.wrist["stiffness"] == pytest.approx(2.0, rel=1e-4) and facts.limits.tension == 50.0
    assert facts.wrist["damping"] == pytest.approx(0.1, rel=1e-4) and "flexion_ratio" not in facts.wrist


@pytest.mark.parametrize("pulls", PULLS)
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_reeled_tendon_bends_the_rod_by_what_its_stretch_leaves(pulls: str, side: float) -> None:
    """K b = k r (s - r b), the other tendon being slack; what lets both out moves nothing."""
    rig = rod(pulls)
    rig.connect()
    reeled = 3e-3
    bend = moved(rig, *((reeled, -0.02) if side > 0 else (-0.02, reeled)))
    assert bend[0] == pytest.approx(side * 20e3 * 0.02 * reeled / (2.0 + 20e3 * 0.02**2), rel=1e-4)
    assert moved(rig, -0.02, -0.02)[0] == pytest.approx(0.0, abs=1e-6)


@settings(max_examples=15, deadline=None)
@given(first=st.floats(-0.01, 0.01), second=st.floats(-0.01, 0.01))
def test_a_rod_whose_tendons_change_places_bends_to_the_other_side(first: float, second: float) -> None:
    rig = rod("lengths")
    rig.connect()
    one = moved(rig, first, second)
    rig.connect()
    np.testing.assert_allclose(moved(rig, second, first), -one, atol=1e-9)


def test_a_tendon_pulls_no_more_than_it_bears() -> None:
    rig = rod("forces", tension=5.0)
    rig.connect()
    assert moved(rig, 0.02, -0.02)[0] == pytest.approx(5.0 * 0.02 / 2.0, rel=1e-4)


def test_bends_are_as_old_as_seldom_and_as_noisy_as_the_sensor_says() -> None:
    rig = rod("lengths", sensor=Sensor(rate=50.0, delay=0.045, noise_deg=0.2))
    rig.connect()
    looks = {}
    assert np.isnan(rig.look().bend).all()  # nothing is old enough yet
    for _ in range(4000):
        rig.clock.wait_until(rig.clock.now() + 5e-3)
        look = rig.look()
        assert 0.045 - 1e-9 <= rig.clock.now() - look.time < 0.045 + 0.02 + 1e-6 or look.time == 0.0
        looks[look.time] = float(np.ravel(look.bend)[0])
    times = np.array(sorted(looks))
    np.testing.assert_allclose(np.diff(times), 0.02, atol=1e-9)
    bends = np.degrees([looks[time] for time in times])
    assert np.std(bends) == pytest.approx(0.2, rel=0.1) and abs(np.mean(bends)) < 0.03


def test_motors_wait_for_their_delay_lag_behind_round_and_stop() -> None:
    rig = rod("lengths", drive=Drive(delay=0.03, lag=0.1, resolution=1e-3))
    rig.connect()
    assert rig.send(np.array([2.4e-3, -2.6e-3])) == pytest.approx([2e-3, -3e-3])
    rig.clock.wait_until(rig.clock.now() + 0.029)
    assert np.abs(rig.motion[:, 1]).max() < 1e-12
    rig.clock.wait_until(rig.clock.now() + 0.1)
    half = bend_of(rig)
    rig.stop()
    rig.clock.wait_until(rig.clock.now() + 2.0)
    whole = 20e3 * 0.02 * 2e-3 / (2.0 + 20e3 * 0.02**2)
    assert bend_of(rig) == pytest.approx(whole * -math.expm1(-0.99), rel=0.02) and 0.3 * whole < half < 0.9 * whole
    rig.send(np.array([2e-3, -3e-3]))
    rig.stop()
    rig.clock.wait_until(rig.clock.now() + 1.0)
    assert bend_of(rig) < 0.7 * whole


def test_the_clock_goes_on_when_it_is_connected_again_and_the_robot_stands_as_at_first() -> None:
    rig = rod("lengths")
    rig.connect()
    first = moved(rig, 2e-3, -2e-3)
    later = rig.clock.now()
    np.testing.assert_array_equal(rig.connect(), [0.0, 0.0])
    assert rig.clock.now() == later and bend_of(rig) == 0.0 and rig.look().time == later
    np.testing.assert_allclose(moved(rig, 2e-3, -2e-3), first, rtol=1e-9)


@pytest.mark.parametrize("wrong", [[math.nan, 0.0], [0.0, -math.inf], [1.0, 0.0], [0.0, -1.0]])
def test_targets_beyond_its_travel_are_refused_and_move_nothing(wrong: list[float]) -> None:
    rig = rod("lengths")
    rig.connect()
    with pytest.raises(Refused):
        rig.send(np.array(wrong))
    rig.clock.wait_until(1.0)
    assert np.abs(rig.motion[:, 1]).max() == 0.0


def test_the_tip_is_told_in_the_axes_of_the_bend() -> None:
    """Of a rod that hangs along z and bends toward -x: the tip of a circle about its joint."""
    text = ROD.replace('fromto="0 0 0 0.1 0 0"', 'fromto="0 0 0 0 0 -0.1"').replace('pos="0.1 0 0"', 'pos="0 0 -0.1"')
    text = text.replace('axis="0 0 1"', 'axis="0 1 0"')
    pulls = "".join(PULLS["lengths"].format(name) for name in ("left", "right"))
    rig = MujocoRig(text.format(pulls), "tip", along=(0, 0, -1), toward=(-1, 0, 0), sensor=EXACT, slack=0.0)
    rig.connect()
    moved(rig, 3e-3, -0.01)
    bend, tip = rig.motion[-1, 1], rig.motion[-1, 2:]
    assert bend > 0.1 and tip == pytest.approx([0.1 * math.cos(bend), 0.1 * math.sin(bend), 0.0], abs=1e-12)


WRONG: dict[str, tuple[str, dict[str, Any], str]] = {
    "no XML": ("<mujoco", {}, "MuJoCo cannot read the model"),
    "no site": (ROD.format(PULLS["lengths"].format("left")), {"bend": "top"}, "no site 'top'"),
    "no actuator": (ROD.format(""), {}, "no actuator of the model pulls a tendon"),
    "a joint's motor": (ROD.format('<motor name="m" joint="hinge"/>'), {"actuators": ["m"]}, "'m' pulls no tendon"),
    "a misspelt actuator": (ROD.format(PULLS["lengths"].format("left")), {"actuators": ["lift"]}, "no actuator 'lift'"),
    "no limit": (ROD.format('<motor name="m" tendon="left"/>'), {}, "how much its tendons bear"),
    "a filter": (
        ROD.format('<general name="m" tendon="left" dyntype="filter" dynprm="0.1" ctrlrange="-50 0"/>'), {},
        "no motor of a spool",
    ),
    "one direction": (ROD.format(PULLS["lengths"].format("left")), {"toward": (2, 0, 0)}, "no two directions"),
    "a fixed site": (
        ROD.replace("<worldbody>", '<worldbody><site name="base"/>').format(PULLS["lengths"].format("left")),
        {"bend": "base"}, "no joint moves the site",
    ),
    "too weak": (ROD.replace('stiffness="2"', 'stiffness="9e3"').format(PULLS["forces"].format("left")), {}, "bends"),
}  # fmt: skip


@pytest.mark.parametrize("wrong", WRONG)
def test_what_is_no_robot_with_tendons_is_refused_by_its_name(wrong: str) -> None:
    text, given_, words = WRONG[wrong]
    with pytest.raises(UserError, match=words):
        MujocoRig(text, **{"bend": "tip"} | given_)


@pytest.mark.slow
def test_the_tapering_chain_passes_every_check() -> None:
    checks = {check.asked: check for check in Certificate(f"{CHAIN}:RIG", Study()).checks()}
    passed = {asked: check.passed for asked, check in checks.items() if asked not in ("source", "silence")}
    assert all(passed.values()) and {"sense", "scale", "delay", "trial"} < set(passed), checks
