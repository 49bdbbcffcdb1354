"""Recordings, excitations and motions of daily living: the angle is what was meant, and its derivatives are its own."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from wristctl.config.choices import REFERENCES
from wristctl.config.loop import Reference
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.simulation.metrics import range_untracked
from wristctl.simulation.motion import Motion
from wristctl.simulation.reference import jumps, motion, reference_name, toward
from wristctl.simulation.trajectory import Trajectory
from wristctl.wrist.kinematics import arc_tip, exact_arc

WRIST = WristParameters()
WIDE = WRIST.model_copy(update={"range_deg": 70.0})
TIME = np.arange(0.0, 3.0, 0.01)
ANGLE = 20.0 * np.sin(2.0 * TIME) ** 2
IN_ONE_PLANE = {kind: each for kind, each in REFERENCES.items() if each.planes == 1}
FROM_FILES = ("recording", "live")
OWN_COURSE = [kind for kind, each in IN_ONE_PLANE.items() if each.targets == "none" and kind not in FROM_FILES]
SMOOTH = [kind for kind in OWN_COURSE if kind not in ("square", "limited-square", "random-steps")]


def evaluated(wrist: WristParameters = WRIST, horizon: float = 3.0, period: float = 1e-3, **given: object) -> Motion:
    return motion(Reference.model_validate(given), wrist, horizon, period)


def written(folder: Path, text: str) -> Path:
    file = folder / "walk.csv"
    file.write_text(text)
    return file


def text_of(**columns: np.ndarray) -> str:
    """CSV of columns named as `angle__deg`."""
    heads = [name.replace("__", " [") + "]" for name in columns]
    rows = zip(*(each.tolist() for each in columns.values()), strict=True)
    return "\n".join([",".join(heads), *(",".join(map(repr, row)) for row in rows)]) + "\n"


def recorded(file: Path, horizon: float = 3.0, **given: object) -> Motion:
    return motion(Reference.model_validate({"kind": "recording", "file": str(file), **given}), WRIST, horizon, 1e-3)


@pytest.mark.parametrize("kind", [each for each in IN_ONE_PLANE if each not in FROM_FILES])
def test_a_kind_of_reference_is_one_of_steps_where_its_angle_jumps(kind: str) -> None:
    """By more than a degree within a tenth of a millisecond, from rest at 0; on none of the others."""
    path: dict[str, object] = {"tips": ((0.078, 0.014), (0.079, 0.01)), "inverse": "closed-form"}
    targets: dict[str, dict[str, object]] = {"multi-step": {"angles_deg": (10.0, -5.0)}, "tip-path": path}
    given = Reference.model_validate({"kind": kind} | targets.get(kind, {}))
    theta = motion(given, WIDE, 3.0, 1e-4).theta_ref
    assert jumps(given) == (np.abs(np.diff(theta, prepend=0.0)).max() > np.radians(1.0))


@pytest.mark.parametrize("kind", SMOOTH)
def test_rate_and_acceleration_are_the_derivatives_of_the_angle(kind: str) -> None:
    m = evaluated(WIDE, kind=kind, period=1e-4)
    np.testing.assert_allclose(np.gradient(m.theta_ref, m.time)[1:-1], m.rate_ref[1:-1], atol=2e-4)
    jumps = np.abs(np.diff(m.acceleration_ref)) > 0.5  # a chirp's rise ends at once
    smooth = ~(jumps[1:] | jumps[:-1])
    gradient = np.gradient(m.rate_ref, m.time)[1:-1]
    np.testing.assert_allclose(gradient[smooth], m.acceleration_ref[1:-1][smooth], atol=2e-2)
    assert jumps.sum() <= (kind == "chirp")


def test_a_two_sided_sine_has_its_phase_offset_and_both_sides() -> None:
    m = evaluated(kind="two-sided-sine", angle_deg=20.0, offset_deg=5.0, phase_deg=90.0, frequency=0.5)
    np.testing.assert_allclose(np.rad2deg(m.theta_ref[[0, 500, 1000, 1500]]), [25.0, 5.0, -15.0, 5.0], atol=1e-9)
    assert m.rest == m.horizon


def test_a_chirp_passes_zero_as_often_as_its_mean_frequency_says() -> None:
    """From f0 to f1 in D seconds it makes (f0 + f1) D / 2 cycles; after that f1 each second."""
    m = evaluated(kind="chirp", frequency=1.0, end_frequency=5.0, duration=2.0, angle_deg=10.0, period=1e-4)
    crossings = np.flatnonzero(np.diff(np.sign(m.theta_ref[1:])))
    assert np.sum(m.time[1:][crossings] < 2.0 - 1e-3) == 2 * 6 - 1
    assert np.sum(m.time[1:][crossings] > 2.0 + 1e-3) == 2 * 5 - 1
    assert np.rad2deg(np.abs(m.theta_ref).max()) == pytest.approx(10.0, abs=1e-3)
    with pytest.raises(UserError, match="does not end at -1"):
        evaluated(kind="chirp", end_frequency=-1.0)


def test_a_square_is_half_its_time_on_either_side_and_begins_on_the_angles() -> None:
    m = evaluated(kind="square", frequency=1.0, angle_deg=-8.0, offset_deg=2.0, horizon=2.0)
    assert set(np.rad2deg(m.theta_ref).round(12)) == {-6.0, 10.0} and m.theta_ref.mean() == pytest.approx(np.deg2rad(2))
    assert np.rad2deg(m.theta_ref[[0, 499, 500, 999, 1000]]).round(9).tolist() == [-6, -6, 10, 10, -6]


def test_random_steps_are_the_same_for_a_seed_fill_the_range_and_do_not_hang_on_the_horizon() -> None:
    one, longer = (evaluated(kind="random-steps", duration=0.1, horizon=h, seed=3) for h in (2.0, 60.0))
    np.testing.assert_array_equal(one.theta_ref, longer.theta_ref[: len(one.theta_ref)])
    held = np.rad2deg(longer.theta_ref.reshape(-1, 100))
    assert (np.ptp(held, axis=1) == 0.0).all() and abs(held.mean()) < 3.0
    assert held.std() == pytest.approx(60.0 / np.sqrt(12.0), rel=0.1)  # uniform in +-30 deg
    assert not np.array_equal(one.theta_ref, evaluated(kind="random-steps", duration=0.1, horizon=2.0).theta_ref)
    for seed in (-1, 0.5):
        with pytest.raises(UserError, match="no seed"):
            evaluated(kind="random-steps", seed=seed)


@pytest.mark.parametrize("kind", [each for each in OWN_COURSE if each.startswith("adl:")])
def test_a_motion_of_daily_living_goes_from_one_cited_end_to_the_other_and_is_anatomical(kind: str) -> None:
    cited = {
        "adl:personal-care": (-15, 10), "adl:eating": (-35, 5), "adl:stirring": (0, 46.6), "adl:combing": (-63.8, 0),
        "adl:jar": (-15.6, 0), "adl:phone": (0, 32.5), "adl:mean-flexion": (-30, 5), "adl:mean-deviation": (-10, 15),
        "adl:most-flexion": (-40, 40), "adl:all-flexion": (-60, 54), "adl:all-deviation": (-17, 40),
    }  # fmt: skip
    m = evaluated(WIDE, kind=kind, duration=1.0)
    assert np.rad2deg([m.theta_ref.min(), m.theta_ref.max()]) == pytest.approx(cited[kind], abs=1e-9)
    assert m.theta_ref[0] == 0.0 and m.rate_ref[0] == 0.0
    reference = Reference(kind=kind)
    plane, other = ("flexion", "ulnar") if REFERENCES[kind].plane == "flexion" else ("ulnar", "flexion")
    against = "extension" if plane == "flexion" else "radial"
    assert toward(reference, against) is toward(reference, plane) is reference  # type: ignore[arg-type]
    with pytest.raises(UserError, match=f"motion of the {plane} plane"):
        toward(reference, other)  # type: ignore[arg-type]


def test_a_motion_beyond_the_wrists_range_is_refused_and_may_be_scaled() -> None:
    with pytest.raises(UserError, match=r"bends by 63\.8 deg at 1 s, beyond the wrist's range of \+-50 deg"):
        evaluated(kind="adl:combing")
    assert np.rad2deg(evaluated(kind="adl:combing", scale=0.5).theta_ref.min()) == pytest.approx(-31.9)
    with pytest.raises(UserError, match="bends by 55"):
        evaluated(kind="two-sided-sine", angle_deg=30.0, offset_deg=-25.0)


@pytest.mark.parametrize("kind", ["two-sided-sine", "chirp", "square", "random-steps"])
def test_the_other_direction_is_the_mirrored_motion(kind: str) -> None:
    reference = Reference(kind=kind, angle_deg=15.0, offset_deg=4.0)
    one, other = (motion(each, WRIST, 2.0, 1e-3) for each in (reference, toward(reference, "radial")))
    for name in ("theta_ref", "rate_ref", "acceleration_ref"):
        np.testing.assert_allclose(getattr(other, name), -getattr(one, name), atol=1e-12)
    assert reference_name(reference.mirrored().mirrored()) == reference_name(reference)


def test_a_recording_is_its_samples_its_derivatives_a_splines_and_its_end_held(tmp_path: Path) -> None:
    file = written(tmp_path, text_of(time__s=TIME + 7.0, angle__deg=ANGLE))
    m = recorded(file, horizon=4.0)
    np.testing.assert_allclose(m.theta_ref[: 10 * len(TIME) : 10], np.deg2rad(ANGLE), atol=1e-12)
    inside = (m.time > 0.1) & (m.time < 2.8)
    np.testing.assert_allclose(m.rate_ref[inside], np.deg2rad(40.0) * np.sin(4.0 * m.time[inside]), atol=1e-5)
    np.testing.assert_allclose(m.acceleration_ref[inside], np.deg2rad(160) * np.cos(4.0 * m.time[inside]), atol=2e-3)
    after = m.time > TIME[-1] + 1e-6
    assert np.ptp(m.theta_ref[after]) == 0.0 and not m.rate_ref[after].any() and not m.acceleration_ref[after].any()
    assert m.rest == pytest.approx(TIME[-1]) and m.final == pytest.approx(np.deg2rad(ANGLE[-1]))


def test_units_names_and_order_of_columns_change_nothing(tmp_path: Path) -> None:
    one = recorded(written(tmp_path, text_of(time__s=TIME, angle__deg=ANGLE)))
    for columns in (
        {"bend__rad": np.deg2rad(ANGLE), "time__ms": 1e3 * TIME},
        {"time__s": TIME, "emg__mV": ANGLE**2, "theta__deg": ANGLE},
    ):
        again = recorded(written(tmp_path, "# of a trial\n" + text_of(**columns)))
        np.testing.assert_allclose(again.theta_ref, one.theta_ref, atol=1e-12)
    named = recorded(
        written(tmp_path, text_of(time__s=TIME, angle__deg=0.0 * ANGLE, wanted__deg=ANGLE)), column="wanted"
    )
    np.testing.assert_allclose(named.theta_ref, one.theta_ref, atol=1e-12)


def test_recorded_tips_are_the_arcs_that_end_there(tmp_path: Path) -> None:
    length = WRIST.length * (1.0 + 0.05 * np.sin(TIME))
    x, y = arc_tip(np.deg2rad(ANGLE), length).T
    file = written(tmp_path, text_of(time__s=TIME, tip_x__mm=1e3 * x, tip_y__mm=1e3 * y))
    m, through = recorded(file), recorded(file, inverse="exact")
    np.testing.assert_allclose(m.theta_ref[::10], np.deg2rad(ANGLE), atol=1e-12)
    np.testing.assert_allclose(m.tip_desired[::10], np.column_stack([x, y]), atol=1e-12)
    for name in ("theta_ref", "rate_ref", "acceleration_ref"):
        np.testing.assert_allclose(getattr(through, name), getattr(m, name), atol=1e-8)
    smaller = np.stack(exact_arc(recorded(file, scale=0.5).tip_desired[::10]))  # it bends less, and is as long
    np.testing.assert_allclose(smaller, [0.5 * np.deg2rad(ANGLE), length], atol=1e-12)


def test_a_smoothing_spline_takes_noise_out_of_the_acceleration(tmp_path: Path) -> None:
    rough = ANGLE + 0.05 * np.random.default_rng(0).standard_normal(len(TIME))
    file = written(tmp_path, text_of(time__s=TIME, angle__deg=rough))
    true = np.deg2rad(160.0) * np.cos(4.0 * TIME)
    through, past = (recorded(file, noise_deg=noise).acceleration_ref[::10] - true for noise in (0.0, 0.05))
    assert np.sqrt(np.mean(past**2)) < 0.2 < 10.0 < np.sqrt(np.mean(through**2))
    assert np.abs(recorded(file, noise_deg=0.05).theta_ref[::10] - np.deg2rad(ANGLE)).max() < np.deg2rad(0.1)


def test_a_mirrored_recording_is_the_same_motion_to_the_other_side(tmp_path: Path) -> None:
    file = str(written(tmp_path, text_of(time__s=TIME, angle__deg=ANGLE)))
    reference = Reference(kind="recording", file=file, scale=0.5)
    one, other = (motion(each, WRIST, 3.0, 1e-3) for each in (reference, toward(reference, "extension")))
    np.testing.assert_array_equal(other.theta_ref, -one.theta_ref)
    assert reference_name(reference) == reference_name(reference.mirrored()) == "recording walk.csv x0.5"


def test_a_file_that_has_changed_is_another_motion(tmp_path: Path) -> None:
    one = recorded(written(tmp_path, text_of(time__s=TIME, angle__deg=ANGLE)))
    two = recorded(written(tmp_path, text_of(time__s=TIME, angle__deg=0.5 * ANGLE, also__deg=ANGLE)))
    np.testing.assert_allclose(two.theta_ref, 0.5 * one.theta_ref, atol=1e-12)


@given(st.floats(0.2, 2.0), st.floats(1.0, 25.0), st.floats(-20.0, 20.0))
@pytest.mark.slow
def test_any_smooth_motion_comes_through_a_file_as_it_was(frequency: float, angle: float, offset: float) -> None:
    reference = Reference(
        kind="two-sided-sine",
        frequency=frequency,
        angle_deg=angle,
        offset_deg=offset,
    )
    before = motion(reference, WRIST, 1.0, 1e-3)
    with tempfile.TemporaryDirectory() as folder:
        file = written(Path(folder), text_of(time__s=before.time, angle__rad=before.theta_ref))
        after = recorded(file, horizon=1.0)
    np.testing.assert_allclose(after.theta_ref, before.theta_ref, atol=1e-12)
    np.testing.assert_allclose(after.rate_ref, before.rate_ref, atol=1e-4)


LINES = text_of(time__s=TIME, angle__deg=ANGLE).splitlines(keepends=True)


def put(line: int, text: str) -> str:
    return "".join([*LINES[: line - 1], text + "\n" if text else "", *LINES[line:]])


@pytest.mark.parametrize(
    ("text", "what", "where", "fix"),
    [
        ("", "the recording is empty", "", "a header such as time [s],angle [deg]"),
        (put(1, "time,angle [deg]"), "column 'time' has no unit", ":1", "time [s] or [ms]"),
        (put(1, "time [s],angle"), "column 'angle' has no unit", ":1", "angle [deg] or [rad]"),
        (put(1, "time [min],angle [deg]"), "time is in 'min'", ":1", "time [s] or [ms]"),
        (put(1, "time [s],angle [mm]"), "angle is in 'mm'", ":1", "angle [deg] or [rad]"),
        (put(1, "time [s],angel [deg]"), "neither an angle nor tips", "", "a header such as"),
        (put(1, "clock [s],angle [deg]"), "no column time", ":1", "a header such as"),
        (put(1, "time [s],tip_x [mm]"), "neither an angle nor tips", "", "tip_y [mm]"),
        (put(9, "0.06,1.0"), "time repeats", ":9", "one motion a file"),
        (put(9, "0.01,1.0"), "time repeats", ":9", "one motion a file"),
        ("".join([*LINES[:60], *LINES[80:]]), "a gap of 0.21 s, where samples are 0.01 s apart", ":61", "fill it in"),
        (put(40, "0.38,49.0"), "the angle jumps by 3", ":40", "mend that sample"),
        (text_of(time__s=TIME, angle__rad=ANGLE), "angle reaches 1,146 deg by its header", ":", "is it in degrees?"),
        (put(9, "0.07,ten"), "angle is 'ten'", ":9", "a number"),
        (put(9, "0.07,1.0,2.0"), "3 cells under 2 columns", ":9", "one number for each column"),
        ("".join(LINES[:4]), "3 samples, too few for a motion", "", "at least 4"),
    ],
)  # fmt: skip
def test_what_is_wrong_with_a_recording_is_said_with_its_place_and_remedy(
    text: str, what: str, where: str, fix: str, tmp_path: Path
) -> None:
    file = written(tmp_path, text)
    with pytest.raises(UserError) as caught:
        recorded(file)
    assert what in caught.value.what and fix in caught.value.fix and caught.value.exit_code == 2
    assert caught.value.where.startswith(str(file) + where)


def test_a_named_column_that_is_not_there_is_said_with_those_that_are(tmp_path: Path) -> None:
    file = written(tmp_path, text_of(time__s=TIME, angle__deg=ANGLE))
    with pytest.raises(UserError, match="no column wanted"):
        recorded(file, column="wanted")
    with pytest.raises(UserError, match="neither an angle nor tips"):
        recorded(file, column="tip")
    with pytest.raises(UserError, match=r"cannot read the recording: No such file.*gone\.csv"):
        recorded(tmp_path / "gone.csv")


def test_a_file_goes_with_a_recording_and_with_nothing_else() -> None:
    for wrong in ({"kind": "recording"}, {"kind": "sine", "file": "walk.csv"}):
        with pytest.raises(ValidationError, match="goes with its file"):
            Reference.model_validate(wrong)


def test_the_untracked_share_is_that_of_the_range_where_the_angle_was_off() -> None:
    """From 0 to 20 deg, more than 2 deg off from 15 deg on: 5 of 20 bins."""
    wanted = np.deg2rad(np.linspace(0.0, 20.0, 4001)[:-1])
    off = np.where(wanted >= np.deg2rad(15.0), np.deg2rad(2.01), np.deg2rad(1.99))
    zeros = np.zeros((len(wanted), 2))

    def course(theta: np.ndarray) -> Trajectory:
        return Trajectory(
            "", wanted, theta, zeros, wanted, wanted, wanted, zeros, zeros, wanted, wanted, zeros
        )  # fmt: skip

    assert range_untracked(course(wanted + off)) == range_untracked(course(wanted - off)) == 0.25
    assert range_untracked(course(wanted)) == 0.0 and range_untracked(course(np.full_like(wanted, np.nan))) == 1.0
