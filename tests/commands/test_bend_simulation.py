"""`simulate` in two planes: what is run, told, written and refused."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import wristctl
from wristctl.commands.export.run_data import open_log_of
from wristctl.commands.inputs import Inputs
from wristctl.commands.simulate.command import SIMULATE
from wristctl.commands.simulate.results import Simulated
from wristctl.config.study import Study
from wristctl.errors import UserError
from wristctl.records import Run
from wristctl.simulation.metrics import metrics_in
from wristctl.simulation.planes import Asked, bends_of, planes_of
from wristctl.simulation.spatial_references import bend_path
from wristctl.wrist.spatial.spatial_kinematics import exact_bend, spatial_tips

pytestmark = pytest.mark.slow

# The kernel that tests of the loop in two planes compile.
LOOP = ("simulate.controller=pid-ff", "simulate.gains=default", "simulate.loop.coupling=ignored", "simulate.horizon=1")


def study_of(*settings: str) -> Study:
    return wristctl.load_study(None, *LOOP, *settings)


def simulated(*settings: str, out: Path | None = None) -> Simulated:
    result: object = wristctl.simulate(study_of(*settings), out=out)
    assert isinstance(result, Simulated)
    return result


def test_a_dart_throw_is_answered_by_plane_and_as_one_norm_in_a_sealed_run(tmp_path: Path) -> None:
    done = simulated("simulate.reference.kind=dart-thrower", out=tmp_path)
    assert list(done.metrics) == list(metrics_in(2))
    error = done.trajectory.error
    assert done.metrics["rmse_ulnar"] == pytest.approx(np.sqrt(np.mean(error[:, 0] ** 2)))
    assert done.metrics["rmse"] == pytest.approx(np.hypot(done.metrics["rmse_ulnar"], done.metrics["rmse_flexion"]))
    text = " ".join(done.summary)
    assert "dart-thrower of 30 deg in 1.5 s on the paper's wrist in two planes (4 tendons" in text
    assert "toward ulnar" in text and "toward flexion" in text and "over both" in text and not done.marks
    run = done.run
    assert run is not None and not run.problems()
    table = Run(run.path).data("bends")
    np.testing.assert_allclose(table["bend_flexion"], done.trajectory.bend[:, 1], rtol=1e-12)
    assert {"acting_4", "pull_1", "tip_z", "bend_4_ulnar", "load_seen_flexion"} <= set(table)
    log = open_log_of(Run(run.path))
    bends = log.bends()
    assert bends is not None
    np.testing.assert_allclose(bends, done.trajectory.bend, rtol=1e-12)
    assert sorted(log.tendons("tension")) == [1, 2, 4, 5] and not log.tendons("spool")
    assert "figures/bends.png" in (run.path / "README.md").read_text()


def test_the_result_says_where_its_motion_is_whether_in_one_plane_or_in_two() -> None:
    bends = wristctl.simulate(study_of("simulate.reference.kind=dart-thrower"))
    assert len(bends.frame()) == len(bends.trajectory.bend) == len(bends.course)
    planar = wristctl.simulate(study_of())
    assert planar.trajectory.theta.ndim == 1 and len(planar.frame()) == len(planar.trajectory.theta)
    assert (bends.trajectory.planes, planar.trajectory.planes) == (2, 1)
    np.testing.assert_array_equal(planar.trajectory.bend[:, 0], planar.trajectory.theta)
    assert list(bends.courses()) == ["bends"] and list(planar.courses()) == ["trajectory"]


def test_a_tip_that_is_off_beside_a_small_error_is_explained_and_segments_and_weight_are_why() -> None:
    circle = "simulate.reference={kind: circle}"
    several, one = simulated(circle), simulated(circle, "simulate.loop.plant_segments=1")
    weightless = simulated(circle, "wrist.gravity=[0, 0]")
    assert several.metrics["rmse"] < 1e-3 and several.metrics["tip_rmse_mm"] > 0.05
    assert max(one.metrics["tip_rmse_mm"], weightless.metrics["tip_rmse_mm"]) < 0.3 * several.metrics["tip_rmse_mm"]
    said, even = " ".join(several.summary), " ".join(one.summary)
    assert "bend unevenly" in said and "under their weight" in said and "unevenly" not in even


def test_what_a_motion_in_two_planes_had_under_other_names_is_found_under_them() -> None:
    course = simulated("simulate.reference.kind=circle").trajectory
    assert course.pulls is course.tension and course.coordinates is course.segment_theta  # type: ignore[attr-defined]
    with pytest.raises(AttributeError, match="no metrics"):
        _ = course.metrics  # type: ignore[attr-defined]


def test_a_recording_of_two_planes_is_followed_in_both(tmp_path: Path) -> None:
    time = np.arange(0.0, 1.0, 0.02)
    bends = np.array([12.0 * np.sin(np.pi * time) ** 2, -7.0 * time**2])
    rows = "\n".join(f"{t:.3f},{y:.9f},{z:.9f}" for t, y, z in zip(time, *bends, strict=True))
    file = tmp_path / "both.csv"
    file.write_text(f"time [s],bend_y [deg],bend_z [deg]\n{rows}\n")
    study = study_of("simulate.reference.kind=recording", f"simulate.reference.file={file}", "simulate.loop.planes=2")
    chosen = study.simulate
    wanted = bends_of(chosen.reference, chosen.direction, study.wrist, 0.98, 1e-3)
    assert np.rad2deg(wanted[:, 0, ::20]) == pytest.approx(bends[:, : wanted[:, 0, ::20].shape[1]], abs=1e-6)
    assert wanted[1, 2, 500] == pytest.approx(np.deg2rad(-14.0), rel=1e-4)
    for scale in (0.5, -1.0):
        scaled = study_of("simulate.loop.planes=2", "simulate.reference.kind=recording",
                          f"simulate.reference={{file: {file}, scale: {scale}}}").simulate.reference  # fmt: skip
        scaled_bends = bends_of(scaled, chosen.direction, study.wrist, 1.5, 1e-3)
        np.testing.assert_allclose(scaled_bends[:, :, :980], scale * wanted, atol=1e-9)
        assert not scaled_bends[:, 1:, 981:].any() and np.ptp(scaled_bends[:, 0, 981:], axis=1).max() == 0.0, "it rests"
    one = tmp_path / "one.csv"
    rows = "\n".join(f"{t:.3f},{y:.6f}" for t, y in zip(time, bends[0], strict=True))
    one.write_text(f"time [s],angle [deg]\n{rows}\n")
    alone = study_of("simulate.reference.kind=recording", f"simulate.reference.file={one}", "simulate.loop.planes=2")
    with pytest.raises(UserError, match="no bends in two planes"):
        SIMULATE.plan(alone, Inputs())
    one_plane = alone.simulate.model_copy(update={"loop": alone.simulate.loop.model_copy(update={"planes": None})})
    assert planes_of(study.wrist, [Asked(one_plane.loop, one_plane.reference)]) == 1


def test_noise_of_a_recording_in_two_planes_is_smoothed_away(tmp_path: Path) -> None:
    time, rng = np.arange(0.0, 2.0, 0.01), np.random.default_rng(0)
    clean = np.array([10.0 * np.sin(2.0 * time), 8.0 * np.cos(2.0 * time)])
    rows = zip(time, *(clean + 0.2 * rng.standard_normal(clean.shape)), strict=True)
    file = tmp_path / "noisy.csv"
    file.write_text("time [s],bend_y [deg],bend_z [deg]\n" + "\n".join(f"{t:.2f},{y:.6f},{z:.6f}" for t, y, z in rows))
    for noise, most in ((0.0, None), (0.2, 0.08)):
        asked = study_of("simulate.loop.planes=2", "simulate.reference.kind=recording",
                         f"simulate.reference={{file: {file}, noise_deg: {noise}}}")  # fmt: skip
        wanted = np.rad2deg(bends_of(asked.simulate.reference, "ulnar", asked.wrist, 1.99, 0.01))
        off = np.sqrt(np.mean((wanted[:, 0] - clean[:, :199]) ** 2, axis=1))
        assert (off == pytest.approx(0.2, rel=0.2)) if most is None else (off < most).all()


def tips_file(folder: Path, tips: np.ndarray, more: str = "") -> Study:
    """A study that follows tips (T, 3) [m], 50 a second, in two planes."""
    rows = "\n".join(f"{0.02 * k:.3f},{x:.7f},{y:.7f},{z:.7f}" for k, (x, y, z) in enumerate(1e3 * tips))
    (folder / "tips.csv").write_text(f"time [s],x [mm],y [mm],z [mm]\n{rows}\n")
    named = ("simulate.reference.kind=recording", f"simulate.reference.file={folder / 'tips.csv'}", more)
    return study_of("simulate.loop.planes=2", *filter(None, named))


def test_recorded_tips_are_followed_in_both_planes(tmp_path: Path) -> None:
    bends = bend_path("circumduction", 25.0, 0.5, 1.0)[:, 0, ::20].T
    study = tips_file(tmp_path, spatial_tips(bends, 0.08))
    chosen = study.simulate
    wanted = bends_of(chosen.reference, chosen.direction, study.wrist, 1.0, 0.02)
    np.testing.assert_allclose(wanted[:, 0].T, bends[:50], atol=1e-7)
    assert SIMULATE.plan(study, Inputs()).startswith("one rollout of 1 s in two planes")


@pytest.mark.parametrize(
    ("at", "tip", "why"),
    [
        (30, (0.084, 0.0, 0.0), "4 mm from where an arc of 80 mm can end"),
        (31, (0.0, 0.0, 0.0), "from where an arc of 80 mm can end"),
        (32, (0.05, -0.03, 0.04), r"asks for 90\.0 deg, beyond the range of \+-50"),
        (33, (-0.08, 0.0, 0.0), "beyond the range"),
    ],
)
def test_a_tip_out_of_reach_is_refused_with_its_line_and_the_nearest_in_reach(
    tmp_path: Path, at: int, tip: tuple[float, float, float], why: str
) -> None:
    tips = spatial_tips(bend_path("circle", 20.0, 1.0, 1.0)[:, 0, ::20].T, 0.08)
    tips[at] = tip
    study = tips_file(tmp_path, tips)
    with pytest.raises(UserError, match=why) as refused:
        SIMULATE.plan(study, Inputs())
    assert refused.value.where == f"{tmp_path / 'tips.csv'}:{at + 2}"
    x, y, z = (1e-3 * float(number) for number in re.findall(r"-?[\d.]+", refused.value.fix.partition(";")[0]))
    bend, length = exact_bend(np.array([x, y, z]))
    assert length == pytest.approx(0.08, abs=1e-4) and np.rad2deg(np.hypot(*bend)) <= 50.1
    assert y * tip[2] == pytest.approx(z * tip[1], abs=1e-6), "in the plane of the tip, if it has one"


def test_tips_are_taken_where_a_recording_has_bends_too_and_they_are_named(tmp_path: Path) -> None:
    bends = bend_path("circle", 20.0, 1.0, 1.0)[:, 0, ::20].T
    study = tips_file(tmp_path, spatial_tips(bends, 0.08), "simulate.reference.column=tip")
    text = (tmp_path / "tips.csv").read_text().splitlines()
    rows = [f"{text[0]},bend_y [deg],bend_z [deg]", *(f"{line},1,2" for line in text[1:])]
    (tmp_path / "tips.csv").write_text("\n".join(rows))
    for reference, expected in (
        (study.simulate.reference, bends[40]),
        (study.simulate.reference.model_copy(update={"column": None}), np.deg2rad([1.0, 2.0])),
    ):
        wanted = bends_of(reference, "ulnar", study.wrist, 1.0, 0.02)
        np.testing.assert_allclose(wanted[:, 0, 40], expected, atol=1e-7)


@pytest.mark.parametrize(("direction", "plane", "sign"), [("ulnar", 0, 1), ("radial", 0, -1), ("extension", 1, -1)])
def test_a_motion_in_one_plane_is_the_same_with_gravity_from_the_side(direction: str, plane: int, sign: int) -> None:
    done = simulated(
        "simulate.loop.planes=2", f"simulate.direction={direction}", "simulate.reference.angle_deg=20",
        "simulate.reference.duration=0.5", "wrist.gravity=[0.0, -9.81]",
    )  # fmt: skip
    assert done.trajectory.bend_ref[-1, plane] == pytest.approx(sign * np.deg2rad(20.0))
    assert not done.trajectory.bend_ref[:, 1 - plane].any()


@pytest.mark.parametrize("kind", ["minimum-jerk", "circle"])
def test_three_tendons_bend_in_two_planes_on_any_reference(kind: str) -> None:
    course = simulated("wrist.tendons=three", f"simulate.reference.kind={kind}").trajectory
    assert course.tension.shape[1] == 3 and not course.failed
    with pytest.raises(UserError, match="in two planes, and the loop in one"):
        wristctl.simulate(study_of("wrist.tendons=three", f"simulate.reference.kind={kind}", "simulate.loop.planes=1"))


@pytest.mark.parametrize("setting", ["slack=[1e-3]", "broken_tendon=2", "slipping_tendon=2"])
def test_what_only_two_planes_have_is_refused_in_one(setting: str) -> None:
    rig = ("simulate.loop.actuator.level=tendon", f"simulate.loop.plant.actuator.{setting}")
    study = wristctl.load_study(None, "simulate.horizon=0.1", "simulate.loop.planes=1", *rig)
    with pytest.raises(UserError, match="bends in one plane") as refused:
        wristctl.simulate(study)
    assert setting.split("=")[0] in str(refused.value)


def test_what_the_controller_does_not_know_is_told_by_tendon() -> None:
    settings = ("simulate.loop.plant.actuator.slack=[0.0, 1e-3]", "simulate.loop.plant.stiffness_axis_deg=30")
    study = study_of("simulate.reference.kind=circle", *settings)
    plan = SIMULATE.plan(study, Inputs())
    assert plan.startswith("one rollout of 1 s in two planes")
    assert "actuator.slack.2 is 0.001 m" in plan and "stiffness_axis_deg is 30 deg, believed 0" in plan


def test_a_sweep_runs_at_every_point_in_two_planes() -> None:
    study = study_of("simulate.reference.kind=circle", "simulate.reference.turn=1").model_copy(
        update={"sweep": ("reference.angle_deg=5,15",)}
    )
    table = wristctl.simulate(study).frame()
    small, large = table["peak_tension"]
    assert table["simulate.reference.angle_deg"].tolist() == [5, 15] and 0.0 < small < large


@pytest.mark.parametrize(
    ("settings", "what"),
    [
        (("simulate.reference.angle_deg=60", "simulate.reference.turn=1"), "beyond the wrist's range"),
        (("simulate.loop.planes=1",), "bends in two planes, and the loop in one"),
        (("simulate.loop.plant.taper=2",), "equally stiff"),
        (("simulate.reference.inverse=network",), "none is given"),
        (("simulate.gains=nothing",), "nothing"),
    ],
)
def test_what_cannot_run_in_two_planes_is_refused_before_it_runs(settings: tuple[str, ...], what: str) -> None:
    study = study_of("simulate.reference.kind=circumduction", *settings)
    with pytest.raises(UserError, match=what):
        SIMULATE.plan(study, Inputs())


def test_a_bend_out_of_reach_is_said_with_what_holds_it_not() -> None:
    done = simulated("simulate.reference.kind=circumduction", "simulate.reference.turn=1", "wrist.tension_limit=6")
    assert done.marks == ["does not arrive"]
    assert "tensions of 6 N hold at most" in done.short_of and done.metrics["saturation"] > 0.1
    assert any("tension_limit" in note for note in done.advice)


@pytest.mark.parametrize(("stiffer", "held"), [(1.0, True), (2.0, False)])
def test_whether_a_bend_is_in_reach_is_judged_on_the_wrist_as_it_is(stiffer: float, held: bool) -> None:
    """The controller's wrist is held with 12 N; one of twice its stiffness is not, and no gains help."""
    done = simulated(
        "simulate.reference.kind=circumduction", "simulate.reference.angle_deg=25", "simulate.reference.turn=1",
        "wrist.tension_limit=12", f"simulate.loop.plant.stiffness_scale={stiffer}",
    )  # fmt: skip
    assert ("tensions of 12 N hold at most" not in done.short_of) is held
    assert held or any("No gains can help" in note for note in done.advice)


def test_a_push_from_the_side_bends_toward_its_direction_and_is_told_with_it() -> None:
    settings = (
        "simulate.loop.planes=2", "simulate.reference.angle_deg=0", "simulate.loop.disturbances.toward_deg=130",
        "simulate.loop.disturbances.push={force: 5.0, start: 0.1, duration: 0.5}", "simulate.horizon=0.4",
    )  # fmt: skip
    done = simulated(*settings)
    ulnar, flexion = done.trajectory.bend[200]
    assert np.rad2deg(np.arctan2(flexion, ulnar)) == pytest.approx(130.0, abs=1.0)
    assert "a push of 5 N at 0.1 s, toward 130 deg from ulnar" in " ".join(done.summary)
