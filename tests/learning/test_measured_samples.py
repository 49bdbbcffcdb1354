"""Measured tips and angles: which recording each sample is of, whatever it was called and in whatever unit."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from wristctl.errors import UserError
from wristctl.learning.dataset import Samples
from wristctl.learning.measured_samples import RecordedCourse, courses_in, read_courses, samples_of_courses
from wristctl.wrist.kinematics import arc_tip
from wristctl.wrist.spatial.spatial_kinematics import spatial_tips

THETA = np.linspace(-0.6, 0.6, 40)
TIP = arc_tip(THETA, 0.08)
TRIAL = np.repeat([3.0, 5.0], 20)


def course(rows: int, seed: int = 0) -> RecordedCourse:
    theta = np.random.default_rng(seed).uniform(-0.7, 0.7, rows)
    return RecordedCourse(f"course {seed}", arc_tip(theta, 0.08), theta, {})


def written(folder: Path, head: str, *columns: np.ndarray, name: str = "data.csv") -> Path:
    file = folder / name
    rows = zip(*(each.tolist() for each in columns), strict=True)
    file.write_text("\n".join([head, *(",".join(map(repr, row)) for row in rows)]) + "\n")
    return file


def test_samples_are_rows_of_recordings_in_their_order_and_know_which() -> None:
    one, other = course(30), course(40, 1)
    everything = samples_of_courses([one, other], 1000, np.random.default_rng(0))
    np.testing.assert_array_equal(everything.tip, np.concatenate([one.tip, other.tip]))
    np.testing.assert_array_equal(everything.theta, np.concatenate([one.theta, other.theta]))
    np.testing.assert_array_equal(everything.recording, np.repeat([0, 1], [30, 40]))
    some = samples_of_courses([one, other], 25, np.random.default_rng(0))
    places = [everything.theta.tolist().index(theta) for theta in some.theta.tolist()]
    assert len(places) == 25 and places == sorted(set(places)) and some.recording is not None
    assert [each >= 30 for each in places] == some.recording.astype(bool).tolist()
    np.testing.assert_allclose(some.arc_length, 0.08)
    assert some.domain.contains(some.tip).all() and some.segments == 1 and not some.held_out.any()
    again = Samples.from_arrays(some.arrays())
    np.testing.assert_array_equal(again.recording, some.recording)


def test_ten_samples_are_enough() -> None:
    assert len(samples_of_courses([course(10)], 100, np.random.default_rng(0)).theta) == 10
    with pytest.raises(UserError, match="9 samples are known"):
        samples_of_courses([course(9)], 100, np.random.default_rng(0))


def test_trials_of_a_table_and_rows_of_arrays_are_recordings_and_what_is_not_known_is_left_out() -> None:
    theta = THETA.copy()
    theta[2] = np.nan
    columns = {"tip_x": TIP[:, 0], "tip_y": TIP[:, 1], "theta": theta, "trial": TRIAL, "verdict": ["ok"] * 40}
    first, second = courses_in(columns, "frames")
    assert (first.name, second.name) == ("frames, trial 3", "frames, trial 5")
    np.testing.assert_array_equal(first.theta, np.delete(THETA[:20], 2))
    np.testing.assert_array_equal(second.tip, TIP[20:])
    grid = {name: np.reshape(np.asarray(columns[name]), (4, 10)) for name in ("tip_x", "tip_y", "theta")}
    assert [len(each.theta) for each in courses_in(grid, "series")] == [9, 10, 10, 10]
    assert not list(courses_in({name: columns[name] for name in ("tip_x", "theta")}, "none"))


def test_names_and_units_of_a_file_change_nothing(tmp_path: Path) -> None:
    (one,) = read_courses(written(tmp_path, "tip_x [m],tip_y [m],theta [rad]", *TIP.T, THETA))
    np.testing.assert_allclose(one.tip, TIP)
    for head, *columns in (
        ("angle [deg],y [mm],x [mm]", np.rad2deg(THETA), 1e3 * TIP[:, 1], 1e3 * TIP[:, 0]),
        ("time [s],x [um],tip_y [mm],theta [deg]", THETA, 1e6 * TIP[:, 0], 1e3 * TIP[:, 1], np.rad2deg(THETA)),
    ):
        (again,) = read_courses(written(tmp_path, head, *columns))
        np.testing.assert_allclose(again.tip, TIP, rtol=1e-12, atol=1e-15)
        np.testing.assert_allclose(again.theta, THETA, rtol=1e-12, atol=1e-15)


def test_other_inputs_and_trials_come_along(tmp_path: Path) -> None:
    head = "x [m],y [m],angle [rad],pose [deg],hand_mass [g],trial"
    file = written(tmp_path, head, *TIP.T, THETA, 0 * THETA + 90.0, 300.0 + 0 * THETA, TRIAL)
    courses = read_courses(file)
    assert [each.name for each in courses] == ["data.csv, trial 3", "data.csv, trial 5"]
    samples = samples_of_courses(courses, 1000, np.random.default_rng(0))
    assert samples.names == ("pose", "hand_mass")
    np.testing.assert_allclose(samples.others, [[np.pi / 2.0, 0.3]] * 40)
    with pytest.raises(UserError, match="inputs none beside the tip, where others have pose, hand_mass"):
        samples_of_courses([*courses, course(20)], 1000, np.random.default_rng(0))


@pytest.mark.parametrize(
    ("head", "what", "fix"),
    [
        ("x,y [mm],angle [deg]", "column 'x' has no unit", "x [m] or [mm]"),
        ("x [mm],y [mm],angle", "column 'angle' has no unit", "angle [deg] or [rad]"),
        ("x [inch],y [mm],angle [deg]", "x is in 'inch'", "x [m] or [mm]"),
        ("x [mm],w [mm],angle [deg]", "unknown column 'w'", "leave it out"),
        ("x [mm],tip_x [mm],angle [deg]", "column tip_x stands there twice", "leave one out"),
        ("x [mm],time [s],angle [deg]", "no column tip_y", "a header such as tip_x [mm]"),
        ("x [m],y [m],angle [rad]", "angle reaches 1,970 deg by its header", "is it in degrees?"),
    ],
)
def test_what_is_wrong_with_a_file_is_said(head: str, what: str, fix: str, tmp_path: Path) -> None:
    columns = (1e3 * TIP[:, 0], 1e3 * TIP[:, 1], np.rad2deg(THETA))
    with pytest.raises(UserError) as caught:
        read_courses(written(tmp_path, head, *columns))
    assert what in caught.value.what and fix in caught.value.fix and "data.csv" in caught.value.where


def test_recordings_in_two_planes_are_samples_of_a_bend_of_both(tmp_path: Path) -> None:
    bends = np.stack([THETA, 0.5 * THETA], axis=-1)
    x, y, z = spatial_tips(bends, 0.08).T
    log = written(tmp_path, "tip_x [m],tip_y [m],tip_z [m],bend_y [rad],bend_z [rad],trial", x, y, z, *bends.T, TRIAL)
    of_log = read_courses(log)
    columns = {"tip_x": x, "tip_y": y, "tip_z": z, "bend_ulnar": bends[:, 0], "bend_flexion": bends[:, 1]}
    for courses in (of_log, list(courses_in({**columns, "trial": TRIAL}, "bends"))):
        found = samples_of_courses(courses, None, np.random.default_rng(0))
        np.testing.assert_allclose(found.theta, bends, atol=1e-15)
        np.testing.assert_allclose(found.arc_length, 0.08)
        assert found.planes == 2 and found.recording is not None and set(found.recording) == {0, 1}
        assert found.domain.contains(found.inputs).all() and found.curvature_is_constant
    with pytest.raises(UserError, match="some recordings bend in one plane, others in two"):
        samples_of_courses([*of_log, course(20)], None, np.random.default_rng(0))
    far = written(tmp_path, "tip_x [m],tip_y [m],tip_z [m],bend_y [deg],bend_z [deg]", x, y, z, THETA, 400.0 * THETA)
    with pytest.raises(UserError, match="an angle of 240 deg"):
        read_courses(far)
