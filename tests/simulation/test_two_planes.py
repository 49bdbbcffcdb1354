"""The closed loop in two planes: against the loop in one plane, under turns, and what the planes do to each other."""

import numpy as np
import pytest

from wristctl.arrays import Array
from wristctl.config.loop import Loop, Reference
from wristctl.config.wrist import WristParameters
from wristctl.control.response import FULL
from wristctl.control.table import controller, gains_of
from wristctl.errors import UserError
from wristctl.plotting.bend_figure import bend_motion
from wristctl.simulation.closed_loop import follow
from wristctl.simulation.motion import Angles, Motion
from wristctl.simulation.planes import bends_of
from wristctl.simulation.references import minimum_jerk
from wristctl.simulation.repetitions import Simulation
from wristctl.simulation.rollout import rollout
from wristctl.simulation.spatial_references import BEND_PATHS, bend_path
from wristctl.simulation.trajectory import Trajectory
from wristctl.wrist.spatial.held_bends import reach_of_bends
from wristctl.wrist.tendon_layout import TendonLayout

LAW = controller("pid-ff")
GAINS = np.array(gains_of(LAW, "default"))
WRIST = WristParameters()
IGNORED = Loop(coupling="ignored")


def simulated(
    path: Array, wrist: WristParameters = WRIST, loop: Loop = IGNORED, force: Array | None = None
) -> Simulation:
    return follow(LAW, GAINS, Motion.of_bends(path, 1e-3, wrist.length), wrist, loop, force)


def followed(
    path: Array, wrist: WristParameters = WRIST, loop: Loop = IGNORED, force: Array | None = None
) -> Trajectory:
    return simulated(path, wrist, loop, force).trajectory


@pytest.mark.parametrize("name", BEND_PATHS)
def test_a_path_begins_at_rest_and_straight_and_its_derivatives_are_its_own(name: str) -> None:
    bend, rate, acceleration = np.swapaxes(bend_path(name, 25.0, 1.0, 2.0), 0, 1)
    assert not bend[:, 0].any() and not rate[:, 0].any()
    assert np.gradient(bend, 1e-3, axis=1)[:, 1:-1] == pytest.approx(rate[:, 1:-1], abs=2e-4)
    assert np.gradient(rate, 1e-3, axis=1)[:, 1:-1] == pytest.approx(acceleration[:, 1:-1], abs=0.05)  # the jerk jumps
    assert np.hypot(*bend).max() <= np.deg2rad(25.0) * (1.0 + 1e-9)


def test_circumduction_keeps_its_size_and_comes_round_once_a_turn() -> None:
    bend = bend_path("circumduction", 25.0, 1.0, 3.0)[:, 0]
    assert np.hypot(*bend[:, 600:]) == pytest.approx(np.deg2rad(25.0))
    assert bend[:, 1500] == pytest.approx(bend[:, 2500])
    assert bend[:, 1500] == pytest.approx(-bend[:, 2000])


@pytest.mark.parametrize("side", [0, 1])
def test_a_bend_in_one_plane_is_the_loop_in_that_plane(side: int) -> None:
    line = bend_path("dart-thrower", 35.0, 1.0, 1.0, toward_deg=-40.0)[0]
    path = np.zeros((2, *line.shape))
    path[side] = line
    course = followed(path)
    time = course.time
    motion = Motion(time, Angles.of(line), np.zeros((len(time), 2)), None, 0.0, time[-1], time[-1])
    loop = Loop(control_period=1e-3, substeps=1, plant_segments=4)
    planar = rollout(LAW, GAINS[None], [motion], np.zeros(1, np.int64), loop, WRIST, record=True)
    assert course.bend[:, side] == pytest.approx(planar.column("theta", 0), abs=1e-9)
    assert course.torque_wanted[:, side] == pytest.approx(planar.column("torque_wanted", 0), abs=1e-7)
    assert abs(course.bend[:, 1 - side]).max() < 1e-12


@pytest.mark.parametrize("name", BEND_PATHS)
def test_a_path_turned_by_a_right_angle_leaves_the_same_errors(name: str) -> None:
    first, second = (simulated(bend_path(name, 25.0, 1.0, 1.0, toward_deg=toward)) for toward in (0.0, 90.0))
    plain, turned = first.trajectory, second.trajectory
    assert turned.bend[:, 1] == pytest.approx(plain.bend[:, 0], abs=1e-10)
    assert turned.bend[:, 0] == pytest.approx(-plain.bend[:, 1], abs=1e-10)
    assert second.metrics["rmse_flexion"] == pytest.approx(first.metrics["rmse_ulnar"], rel=1e-6)
    assert second.metrics["rmse"] == pytest.approx(first.metrics["rmse"], rel=1e-6)


def test_what_the_planes_do_to_each_other_falls_with_the_bend_as_its_cube() -> None:
    def coupling(size: float) -> float:
        path = bend_path("figure-of-8", size, 1.0, 1.0)
        alone = path * np.array([1.0, 0.0])[:, None, None]
        return float(abs(followed(path).bend[:, 0] - followed(alone).bend[:, 0]).max())

    small, large = coupling(4.0), coupling(16.0)
    assert large > 1e-6
    assert 4.0**2 < large / small < 4.0**4


@pytest.mark.parametrize("toward", [0.0, 90.0])
def test_a_law_that_knows_what_the_planes_do_to_each_other_follows_several_times_as_well(toward: float) -> None:
    """A wrist of one segment, as the model has it: what is left in either plane is by the ticks alone."""
    law, path = controller("computed-torque"), bend_path("circumduction", 25.0, 1.0, 2.0, toward_deg=toward)
    gains = np.array(gains_of(law, "default"))
    known, ignored = (
        follow(
            law, gains, Motion.of_bends(path, 1e-3, WRIST.length), WRIST, Loop(plant_segments=1, coupling=coupling)
        ).metrics
        for coupling in ("compensated", "ignored")
    )
    for name in ("rmse_ulnar", "rmse_flexion"):
        assert 0.0 < 3.0 * known[name] < ignored[name]


def test_a_push_from_the_side_bends_toward_it_and_the_loop_answers() -> None:
    path = bend_path("dart-thrower", 0.0, 1.0, 1.0)
    pushed, other = (followed(path, force=np.array([0.0, 0.0, side])) for side in (2.0, -2.0))
    assert pushed.bend[100, 1] > 1e-4
    assert other.bend[:, 1] == pytest.approx(-pushed.bend[:, 1], abs=1e-10)
    assert pushed.torque[-1, 1] < -1e-3
    assert abs(pushed.bend[:, 0]).max() < 1e-10


def test_three_tendons_follow_and_pulls_keep_their_limits() -> None:
    done = simulated(bend_path("circumduction", 25.0, 1.0, 2.0), WristParameters(tendons="three"))
    course, share = done.trajectory, np.asarray(done.trajectory.share)
    assert course.tension.shape[1] == 3 and not course.failed
    assert course.tension.min() >= WRIST.pretension - 1e-12 and course.tension.max() <= WRIST.tension_limit + 1e-12
    reached = share > 1.0 - 1e-12
    assert course.torque[reached] == pytest.approx(course.torque_wanted[reached], abs=1e-10)
    assert done.metrics["rmse"] < np.deg2rad(0.5)


def test_torque_out_of_reach_keeps_its_direction_and_counts_as_saturation() -> None:
    weak = WRIST.model_copy(update={"tension_limit": 6.0})
    done = simulated(bend_path("circumduction", 30.0, 1.0, 1.5), weak)
    course, share = done.trajectory, np.asarray(done.trajectory.share)
    scaled = (share > 0.0) & (share < 0.99)
    assert done.metrics["saturation"] == pytest.approx(np.mean(share < 1.0 - 1e-9)) and scaled.any()
    wanted = share[scaled, None] * course.torque_wanted[scaled]
    assert course.torque[scaled] == pytest.approx(wanted, abs=1e-9)


def pushed_back(
    toward: float, newton: float, limit: float, name: str = "pid-ff", places: str = "four", coupling: str = "ignored"
) -> tuple[Trajectory, Array]:
    """A bend of 30 deg, pushed back from 1.2 to 2.2 s; and how far it bends in that direction [deg]."""
    law, time = controller(name), 1e-3 * np.arange(3001.0)
    along, pushed = np.array([np.cos(np.radians(toward)), np.sin(np.radians(toward))]), (time > 1.2) & (time < 2.2)
    path = along[:, None, None] * np.deg2rad(30.0) * minimum_jerk(time, 1.0)
    force = np.array([0.0, *(-newton * along)])[:, None] * pushed
    wrist = WristParameters.model_validate({"tension_limit": limit, "tendons": places})
    gains, loop = np.array(gains_of(law, "default")), Loop.model_validate({"coupling": coupling})
    course = follow(law, gains, Motion.of_bends(path, 1e-3, wrist.length), wrist, loop, force).trajectory
    return course, np.rad2deg(course.bend @ along)


@pytest.mark.parametrize(
    ("name", "toward", "places", "coupling"),
    [
        ("pid-ff", 45.0, "four", "ignored"),
        ("pid-ff", 225.0, "four", "compensated"),
        ("pid-ff", 110.0, "three", "ignored"),
        ("pid-ff", 315.0, "three", "compensated"),
        ("ct-dob", 135.0, "four", "compensated"),
        ("adrc", 315.0, "four", "ignored"),
    ],
)
def test_a_wrist_pushed_out_of_reach_on_a_diagonal_comes_back_as_one_of_that_reach_in_one_plane(
    name: str, toward: float, places: str, coupling: str
) -> None:
    """No integral winds up and no observer takes torque for load that the other plane's part left no room for."""
    course, bend = pushed_back(toward, 11.0, 28.0, name, places, coupling)
    begin, end = 1200, 2200
    assert (np.asarray(course.share)[begin:end] < FULL).mean() > 0.5, "out of reach while it is pushed"
    reach = float(np.hypot(*course.torque[end - 10]))
    limit = WRIST.pretension + reach / (np.sqrt(2.0) * WRIST.tendon_radius)  # two tendons, each at r/sqrt(2)
    alone, lone_bend = pushed_back(0.0, 11.0, limit, name)
    assert bend[end:].max() == pytest.approx(lone_bend[end:].max(), abs=0.25)
    behind = [float((np.asarray(each.share)[end:] < FULL).sum()) for each in (course, alone)]
    assert behind[0] <= behind[1] + 4.0, "ticks out of reach after the push"
    across = np.rad2deg(course.bend[end:] @ [-np.sin(np.radians(toward)), np.cos(np.radians(toward))])
    assert abs(across).max() < 0.5


@pytest.mark.parametrize("toward", [45.0, 225.0])
def test_a_push_within_reach_on_a_diagonal_is_answered_as_in_one_plane(toward: float) -> None:
    course, bend = pushed_back(toward, 8.0, 30.0)
    alone, lone_bend = pushed_back(0.0, 8.0, 30.0)
    assert all((np.asarray(each.share) >= FULL).all() for each in (course, alone))
    assert bend == pytest.approx(lone_bend, abs=0.1)


def test_a_wrist_pushed_out_of_its_range_has_failed_for_good() -> None:
    weak = WRIST.model_copy(update={"tension_limit": 4.0})
    done = simulated(bend_path("circle", 10.0, 1.0, 1.0), weak, force=np.array([0.0, 60.0, 0.0]))
    course = done.trajectory
    assert course.failed and done.failed and np.isnan(done.metrics["rmse"])
    lost = np.isnan(course.bend[:, 0])
    assert lost[np.argmax(lost) :].all()


def test_the_reach_of_weak_tendons_is_where_a_held_bend_saturates() -> None:
    weak = WRIST.model_copy(update={"tension_limit": 9.0})
    reach = np.hypot(*reach_of_bends(weak, TendonLayout.four(WRIST.tendon_radius), 8).T)
    assert reach[0] == pytest.approx(reach[[2, 4, 6, 8]])
    assert reach[1] == pytest.approx(reach[[3, 5, 7]])
    assert 0.0 < reach[1] < reach[0] < np.deg2rad(WRIST.range_deg)  # toward one tendon; between two
    still = np.zeros((2, 3, 3001))
    for degrees, saturates in ((-2.0, False), (2.0, True)):
        still[0, 0] = np.minimum(np.arange(3001) / 1500, 1.0) * (reach[0] + np.deg2rad(degrees))
        assert (np.asarray(followed(still, weak).share)[-1] < 0.999) == saturates


def test_the_picture_draws_what_is_wanted_followed_and_in_reach() -> None:
    course = followed(bend_path("figure-of-8", 20.0, 1.0, 1.0))
    axes = bend_motion(course, reach_of_bends(WRIST, TendonLayout.of(WRIST))).axes[-1]
    lines = {line.get_label(): line.get_xydata() for line in axes.get_lines()}
    assert set(lines) == {"in reach", "wanted", "followed"}
    assert np.array(lines["followed"]) == pytest.approx(np.rad2deg(course.bend))
    assert np.hypot(*np.array(lines["in reach"]).T).max() == pytest.approx(WRIST.range_deg)


@pytest.mark.parametrize(("angle", "words"), [(0.0, "ulnar"), (90.0, "flexion"), (180.0, "radial"), (-45.0, "-45 deg")])
def test_a_motion_along_a_line_is_drawn_over_time_toward_where_it_bends(angle: float, words: str) -> None:
    toward = np.array([np.cos(np.deg2rad(angle)), np.sin(np.deg2rad(angle))])
    path = np.zeros((2, 3, 501))
    path[:, 0] = np.deg2rad(20.0) * np.outer(toward, np.sin(np.arange(501) / 160.0))
    course = followed(path)
    axes = bend_motion(course, reach_of_bends(WRIST, TendonLayout.of(WRIST))).axes[-1]
    lines = {line.get_label(): np.array(line.get_xydata()) for line in axes.get_lines()}
    assert set(lines) == {"wanted", "followed"} and f"toward {words}" in axes.get_ylabel()
    assert lines["wanted"].max() == pytest.approx(20.0, rel=1e-3)
    assert lines["followed"] == pytest.approx(np.column_stack([course.time, np.rad2deg(course.bend @ toward)]))


def test_what_cannot_run_is_said() -> None:
    with pytest.raises(UserError, match="no bend path 'square'"):
        bend_path("square", 10.0, 1.0, 1.0)
    with pytest.raises(UserError, match="beyond the wrist's range"):
        bends_of(Reference(kind="circumduction", angle_deg=WRIST.range_deg + 1.0), "ulnar", WRIST, 2.0, 1e-3)
    with pytest.raises(UserError, match="end stop at 14 deg lies inside the reference's range, 15 deg"):
        path = bend_path("circle", 15.0, 1.0, 1.0, 45.0)
        followed(path, loop=Loop.model_validate({"plant": {"end_stop_deg": 14.0}}))
