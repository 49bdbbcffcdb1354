"""The emulated bench in two planes with a wrist of rigid links: where it rests and moves, and what its cameras show."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from tests.bench.conftest import TAUT
from tests.bench.test_spatial_bench import SECOND, SLIDING, course, hosted, off_the_truth
from wristctl.bench.bench_wrist import Truth
from wristctl.bench.virtual_bench import VirtualBench
from wristctl.config.bench import BenchSettings, WeakenedPlant
from wristctl.config.plant import Disturbances, Push
from wristctl.config.wrist import TendonPlace, WristParameters
from wristctl.errors import UserError
from wristctl.simulation.worlds import plant_of
from wristctl.wrist.directions import ACTIVE, DIRECTIONS, TENDONS
from wristctl.wrist.plant import PLANTS_IN_SPACE
from wristctl.wrist.spatial.hinges_in_space import hinged_equilibrium

pytestmark = pytest.mark.slow

LINKS: dict[str, Any] = {"model": "hinges", "taper": 2.0}
CENTRE = TendonPlace(angle_deg=0.0, radius=0.0)
THREE = tuple(TendonPlace(angle_deg=angle) for angle in (10.0, 130.0, 230.0))
PUSH = Disturbances(push=Push(force=2.0, start=0.2, duration=0.3))


def toward(direction: str) -> tuple[int, ...]:
    """Steps of the axes of tendons 1, 2, 4, 5 that bend it there by about 0.12 rad."""
    return tuple(130 if number in DIRECTIONS[direction].tendons else -110 for number in ACTIVE)


@pytest.mark.parametrize(
    ("wrist", "wound"),
    [
        (WristParameters(), "four"),
        (WristParameters(gravity=(0.0, 9.81), gravity_flexion=-4.0), "four"),
        (WristParameters(stiffness_axis_deg=30.0, flexion_ratio=2.0, tendons="five"), "four"),
        (WristParameters(tendons="three"), "three"),
        (WristParameters(tendons=(CENTRE, *THREE)), THREE),
    ],
)
def test_on_held_spools_it_rests_where_the_simulated_plant_does_under_the_same_pulls(
    wrist: WristParameters, wound: Any
) -> None:
    plant, three = WeakenedPlant(**LINKS, payload=0.05), wound != "four"
    host = hosted(wrist, actuator=SLIDING, plant=plant)
    host.reel((-300, 300, 50, 200) if three else (-300, -100, -80, 500))  # the last of four winds none of three
    host.rest(4.0)
    truth = host.bench.truth()
    true = plant_of(wrist, plant).model_copy(update={"tendons": wound})
    resting = hinged_equilibrium(true, BenchSettings().segments, truth.pull[-1])
    assert truth.pull.shape[1] == (3 if three else 4) and np.abs(truth.angle[-1]).min() > 0.04
    assert np.abs(truth.theta[-1] - resting).max() < 1e-6
    assert truth.angle[-1] == pytest.approx(PLANTS_IN_SPACE["hinges"].angle(resting), abs=1e-5)


@pytest.mark.parametrize("direction", DIRECTIONS)
def test_a_motion_in_one_plane_is_that_of_the_bench_in_one_plane(direction: str) -> None:
    """But for the microseconds between the axes' steps, which may fall into the next millisecond."""
    own = DIRECTIONS[direction].plane == "flexion"
    done: list[Truth] = []
    for planes in (1, 2):
        host = hosted(planes=planes, plant=LINKS)
        host.bench.face(direction)
        toward_deg = 90.0 if own else 0.0
        host.bench.begin(host.start, PUSH.model_copy(update={"toward_deg": toward_deg}))
        host.reel(toward(direction))  # type: ignore[arg-type]
        host.rest(0.8)
        done.append(host.bench.truth())
    flat, spatial = done
    assert DIRECTIONS[direction].sign * flat.angle[-1] > 0.1
    assert np.abs(spatial.theta[:, own::2] - flat.theta).max() < 5e-6
    assert np.abs(spatial.angle[:, int(own)] - flat.angle).max() < 5e-6
    across = np.abs(spatial.theta[:, 1 - own :: 2])
    assert across.max() < 1e-3 and across[-1].max() < 1e-5
    assert np.abs(spatial.pull - flat.pull).max() < 0.01


def test_all_of_it_turned_by_a_right_angle_moves_alike() -> None:
    """Tendon 1 is turned to where 4 was, 2 to 1, 4 to 5 and 5 to 2."""
    steps = (-300, -100, -80, 500)
    turned = (steps[1], steps[3], steps[0], steps[2])
    first = course(steps, PUSH.model_copy(update={"toward_deg": 20.0}), plant=LINKS)
    second = course(turned, PUSH.model_copy(update={"toward_deg": 110.0}), plant=LINKS)
    shared = min(len(first.time), len(second.time))
    assert np.ptp(first.angle, axis=0).min() > 0.1
    assert np.abs(second.angle[:shared, 1] - first.angle[:shared, 0]).max() < 1e-3
    assert np.abs(second.angle[-1] - [-first.angle[-1, 1], first.angle[-1, 0]]).max() < 1e-5


@pytest.mark.parametrize("sign", [1, -1])
def test_a_taper_bends_it_more_at_its_tip_and_less_at_its_base(sign: int) -> None:
    """A light pull bends each joint by its own stiffness: with a taper of 3 the last one three times as far."""
    steps = tuple(40 if sign * TENDONS[tendon][1] > 0 else -100 for tendon in ACTIVE)
    even, tapered = (
        course(steps, Disturbances(), plant={"model": "hinges", "taper": taper}).theta[-1].reshape(-1, 2)
        for taper in (1.0, 3.0)
    )
    assert (sign * even[:, 1] > 0.005).all() and np.abs(even[:, 0]).max() < 1e-4
    ratios = tapered[:, 1] / even[:, 1]
    assert (np.diff(ratios) > 0.0).all() and ratios[-1] / ratios[0] == pytest.approx(3.0, rel=0.1)


def test_each_camera_tells_the_true_bend_of_its_plane() -> None:
    host = hosted(plant=LINKS)
    off = off_the_truth(host, host.reel, 0.3)
    assert min(map(len, off)) > 20 and np.degrees(np.abs(np.concatenate(off)).max()) < 0.3


@pytest.mark.parametrize("planes", [1, 2])
def test_arcs_with_a_taper_are_refused(planes: int) -> None:
    plant: dict[str, Any] = {"taper": 2.0}
    with pytest.raises(UserError, match="equally stiff") as refused:
        VirtualBench(BenchSettings.model_validate({"motors": TAUT, "plant": plant}), WristParameters(), 0, None,
                     SECOND if planes == 2 else None)  # fmt: skip
    assert refused.value.exit_code == 2
