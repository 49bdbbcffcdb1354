"""What an analysis of hysteresis says, writes and draws, and what is identified of a measured loop."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import wristctl
from tests.identification.made_loops import SHORT, made_loop, written
from wristctl.commands.analyse.hysteresis_results import Hysteresis
from wristctl.commands.identify.hysteresis import LoopTold
from wristctl.config.study import Study
from wristctl.errors import UserError
from wristctl.identification.loop_problem import AS_BELIEVED
from wristctl.records.files import sha256_of
from wristctl.simulation.strokes import FrictionCase

CABLE = FrictionCase(0.1, 1.0, 2e-5)
QUICK = ("hysteresis.ranges_deg=[[0, 20], [5, 15]]", "hysteresis.frequencies=[0.5, 2]", "hysteresis.sheaths=[0, 1, 3]",
         "hysteresis.angles_deg=[10]", "hysteresis.ramp=0.3")  # fmt: skip


def study(*overrides: str) -> Study:
    return wristctl.load_study(None, *QUICK, *overrides)


def analysed(*overrides: str, out: Path | None = None) -> Hysteresis:
    done = wristctl.analyse(study(*overrides), of="hysteresis", out=out)
    assert isinstance(done, Hysteresis)
    return done


def identified(file: Path, *overrides: str, out: Path | None = None) -> LoopTold:
    done = wristctl.identify(study(*overrides), runs=file, model="hysteresis", out=out)
    assert isinstance(done, LoopTold)
    return done


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> Hysteresis:
    """In a run directory."""
    return analysed(out=tmp_path_factory.mktemp("hysteresis"))


def test_the_numbers_of_the_answer_are_the_runs(done: Hysteresis) -> None:
    band = next(each for each in done.dead_bands if each.tendons == CABLE)
    slow, fast = (each for each in done.loops if each.case.tendons == CABLE and each.case.low == 0.0)
    said = done.answer.sentence
    assert "friction coefficient of 0.1 and a sheath of 1 rad (57.3 deg)" in said
    assert f"dead band is {math.degrees(band.width):.3g} deg at 10 deg" in said
    assert f"Friction takes {1e3 * slow.friction_work:.3g} mJ in a cycle of 0 to 20 deg" in said
    loops = [dict(zip(done.tables[0].columns, row, strict=True)) for row in done.tables[0].rows]
    (quick,) = [row for row in loops if (row["sheath [rad]"], row["frequency [Hz]"]) == (1.0, 2.0)]
    assert quick["damping [mJ]"] == pytest.approx(1e3 * fast.damped_work) and quick["presliding [um]"] == 20.0
    assert done.metrics["friction_work"] == slow.friction_work
    assert done.metrics["dead_band"] == pytest.approx(math.degrees(band.width))
    assert done.metrics["friction_work_change"] == pytest.approx(abs(fast.friction_work / slow.friction_work - 1.0))
    assert done.run is not None and done.run.problems() == []
    told = (done.run.path / "README.md").read_text()
    assert told.index("the dead band is") < told.index("frequency [Hz]")


def test_its_files_hold_every_loop_and_dead_band(done: Hysteresis) -> None:
    assert done.run is not None
    loops, courses, bands = (done.run.data(name) for name in ("loops", "courses", "dead_bands"))
    assert len(loops) == 2 * 2 * 3 and len(courses) == 201 * len(loops) and len(bands) == 3
    for at, loop in enumerate(done.loops):
        own = courses[courses.loop == at]
        np.testing.assert_array_equal(own.theta, loop.course.theta)
        np.testing.assert_array_equal(own.spool_minus, loop.course.spool_minus)
        assert loops.raw_work[at] == loop.raw_work and loops.sheath[at] == loop.case.tendons.sheath
    area = np.trapezoid(own.spool_plus, own.theta)
    assert abs(area) > 0.0 and loops.width.iloc[-1] == done.loops[-1].width
    assert set(done.figures) == {"dead-band", "loops", "minor-loops", "work"}


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A loop that somebody measured."""
    return written(made_loop(CABLE, 1, SHORT).loop, tmp_path_factory.mktemp("measured") / "rig.csv")


@pytest.mark.slow
def test_a_measured_loop_is_fitted_and_told_before_all_else(recorded: Path, tmp_path: Path) -> None:
    done = identified(recorded, out=tmp_path)
    assert done.run is not None
    assert done.answer.sentence.startswith("The loop of rig.csv by itself")
    for name, truth in CABLE._asdict().items():
        found = done.run.metrics[name]
        assert found["value"] == getattr(done.fit, name).value == done.metrics[name]
        assert found["interval"] == list(getattr(done.fit, name)[1:])
        assert found["interval"][0] <= truth <= found["interval"][1]
    source = json.loads((done.run.path / "data/source.json").read_text())
    assert source == {"name": recorded.name, "sha256": sha256_of(recorded)}
    kept = done.run.data("measured")
    np.testing.assert_allclose(kept.theta - kept.theta_model, done.fit.residuals[0], atol=1e-15)
    np.testing.assert_allclose(kept.tension_minus - kept.tension_minus_model, done.fit.residuals[2], atol=1e-12)
    assert "measured" in done.figures and kept.time.iloc[0] > 0.0
    rows = _rows_of_a_screen(done)
    for row, name, scale in zip(rows, CABLE._fields, (1.0, 1.0, 1e6), strict=False):
        low, high = (scale * end for end in getattr(done.fit, name)[1:])
        assert float(row[1]) == pytest.approx(scale * done.metrics[name], rel=5e-3)
        assert [float(end) for end in row[2].split(" to ")] == pytest.approx([low, high], rel=5e-3)


def _rows_of_a_screen(done: Hysteresis | LoopTold) -> list[Sequence[Any]]:
    """Rows of the answer's table, of an answer that fits a screen."""
    assert len(done.summary) <= 32 and done.answer.table is not None
    assert all(len(line) <= 100 for line in done.summary if "report.html" not in line)
    return list(done.answer.table.rows)


def test_the_answer_without_a_loop_gives_the_dead_band_and_the_width_of_each_sheath(done: Hysteresis) -> None:
    rows = _rows_of_a_screen(done)
    assert [row[1] for row in rows] == [0.0, 1.0, 3.0]
    own = next(row for row in rows if row[1] == CABLE.sheath)
    slow = next(loop for loop in done.loops if loop.case.tendons == CABLE and loop.case.frequency == 0.5)
    assert math.degrees(own[2]) == pytest.approx(done.metrics["dead_band"]) and own[3] == pytest.approx(slow.width)
    assert own[4] == pytest.approx(1e3 * done.metrics["friction_work"])
    assert f"{done.metrics['dead_band']:.3g} deg" in " ".join(done.summary)


@pytest.mark.slow
def test_what_a_narrow_loop_does_not_tell_is_said(tmp_path: Path) -> None:
    narrow = made_loop(CABLE, 2, SHORT._replace(low=13.0, high=17.0, what="spools")).loop
    done = identified(written(narrow, tmp_path / "narrow.csv"))
    said = " ".join(map(str, done.answer.notes))
    assert "only together" in said and f"up to {done.fit.friction.high:.3g}" in said and "wider range" in said
    assert math.isnan(done.metrics["sheath"]) and done.metrics["exponent"] > 0.0
    assert done.findings.metrics["sheath"]["interval"] is None, "it has no end"
    assert [row[1] for row in _rows_of_a_screen(done)[:2]] == ["-", "-"]


@pytest.mark.slow
def test_a_loop_sampled_too_coarsely_at_its_turns_is_warned_of(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    coarse = made_loop(CABLE, 3, SHORT._replace(rate=20.0, cycles=2.0)).loop
    identified(written(coarse, tmp_path / "coarse.csv"))
    assert any("leaps" in said and "sample more often" in said for said in caplog.messages)


@pytest.mark.slow
def test_pulls_that_tremble_are_warned_of(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    loop = made_loop(CABLE, 4, SHORT._replace(what="tensions")).loop
    assert loop.tensions is not None
    noise = 0.05 * np.random.default_rng(0).standard_normal(loop.tensions.shape)
    for own, told in ((loop, False), (replace(loop, tensions=loop.tensions + noise), True)):
        caplog.clear()
        identified(written(own, tmp_path / "pulls.csv"))
        assert any("tremble" in said for said in caplog.messages) == told


def test_a_file_that_is_no_loop_leaves_nothing_behind(tmp_path: Path) -> None:
    (tmp_path / "wrong.csv").write_text("time [s],angel [deg]\n")
    with pytest.raises(UserError, match="unknown column 'angel'"):
        identified(tmp_path / "wrong.csv", out=tmp_path / "results")
    assert not (tmp_path / "results").exists()


@pytest.mark.slow
def test_what_does_not_converge_is_marked_where_its_numbers_are(monkeypatch: pytest.MonkeyPatch) -> None:
    own = ("wrist.damping=1e-4", "hysteresis.tendon_stiffness=5e5", "hysteresis.shape=triangle")
    sound = analysed(*own)
    monkeypatch.setattr("wristctl.simulation.hysteresis.FINER", (2,))
    found = analysed(*own)
    drifts = [each.drift for each in found.loops] + [each.drift for each in found.dead_bands]
    open_ = [each for each in drifts if each > 0.0]
    assert 0 < len(open_) == found.metrics["not_converged"] and sound.metrics["not_converged"] == 0.0
    assert found.marks == [f"not converged: {len(open_)} of {len(found.loops) + len(found.dead_bands)}"]
    assert sound.marks == [] and "NOT CONVERGED" not in str(sound)
    table = found.tables[0]
    told = [row[list(table.columns).index("fate")] for row in table.rows]
    outer = [each for each in found.loops if each.case.low == 0.0]
    assert [bool(each) for each in told] == [each.drift > 0.0 for each in outer] and any(told)
    assert "have not converged" in " ".join(map(str, found.answer.notes))
    frame = found.frame()
    assert frame["drift"].tolist() == [each.drift for each in found.loops] and (frame["step"] <= 1e-3).all()


@pytest.mark.parametrize(("step", "told"), [(1e-3, False), (5e-3, True)])
@pytest.mark.slow
def test_a_fit_by_too_long_a_step_is_warned_of(
    step: float, told: bool, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    loop = made_loop(CABLE, 1, SHORT._replace(frequency=1.0, cycles=2.0)).loop
    identified(written(loop, tmp_path / "quick.csv"), f"identify.step={step}", "identify.misfit=tell")
    assert any("identify.step: 0.0025" in said for said in caplog.messages) == told


@pytest.mark.slow
def test_a_loop_that_no_model_fits_is_refused_where_everybody_looks(
    tmp_path: Path,
) -> None:
    """An angle that wriggles by 1 deg along its way: no friction does that."""
    loop = made_loop(CABLE, 1, SHORT._replace(what="spools")).loop
    wriggle = np.radians(1.0) * np.sin(12.0 * np.pi * 0.3 * loop.time)
    wriggling = replace(loop, angle=loop.angle + wriggle)
    file = written(wriggling, tmp_path / "wriggling.csv")
    with pytest.raises(UserError, match=r"the best model is off by .* it misses something") as caught:
        identified(file, out=tmp_path / "results")
    assert caught.value.exit_code == 3
    (run,) = (tmp_path / "results").glob("*-identify-*")
    told = (run / "README.md").read_text()
    assert "Nothing to rely on: the best model leaves" in told and "friction inside the wrist" in told
    assert json.loads((run / "metrics.json").read_text())["misfit"]["value"] > 2.0
    taken = identified(file, "identify.misfit=tell")
    assert taken.summary[0].startswith("Nothing to rely on") and len(taken.fits) == 3


@pytest.mark.slow
def test_in_two_planes_its_files_hold_both_bends_and_every_place(tmp_path: Path) -> None:
    done = analysed("wrist.tendons=three", "hysteresis.toward_deg=30", out=tmp_path)
    assert done.run is not None
    courses, loop = done.run.data("courses"), done.loops[0]
    own = courses[courses.loop == 0]
    way = math.radians(30.0)
    along = math.cos(way) * own.bend_ulnar + math.sin(way) * own.bend_flexion
    np.testing.assert_allclose(own.theta, along, atol=1e-12)
    np.testing.assert_array_equal(own.spool_3, loop.course.spool[:, 2])
    assert "spool_plus" not in courses and {"given_1", "wrist_2", "z_3"} < set(courses)
    said = " ".join(done.summary)
    assert "In two planes" in said and "toward 30 deg from ulnar" in said and loop.aside > 0.0
    assert done.figures["loops"].axes[0].get_ylabel() == "tension of tendon 1 [N]"


@pytest.mark.parametrize(
    ("setting", "said"),
    [
        ("wrist.tendons=three", "tendon 1 of this wrist"),
        ("identify.fix.damping=0.1", "damping of a loop of hysteresis cannot be held"),
        ("identify.columns=a;b", "names for 2 logs"),
    ],
)
def test_a_measured_loop_is_of_one_plane_and_of_its_own_parameters(setting: str, said: str) -> None:
    with pytest.raises(UserError, match=said):
        identified(Path("loop.csv"), setting)


def test_friction_inside_the_wrist_is_held_of_a_loop_alone(recorded: Path) -> None:
    with pytest.raises(UserError, match="inner_friction is no parameter of this model"):
        wristctl.identify(runs=recorded, fix={"inner_friction": 0.01})


def test_two_logs_are_no_loop(recorded: Path, tmp_path: Path) -> None:
    again = tmp_path / "again.csv"
    again.write_bytes(recorded.read_bytes())
    with pytest.raises(UserError, match="2 logs, and a loop of hysteresis is one"):
        wristctl.identify(runs=[recorded, again], model="hysteresis")


def test_what_a_loop_tells_is_no_wrist_to_simulate(recorded: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("wristctl.identification.loop_problem.SUPPOSITIONS", (AS_BELIEVED,))
    told = identified(recorded, "identify.misfit=tell")
    frame = told.frame().set_index("parameter")
    assert frame.value["friction"] == told.metrics["friction"] and frame.unit["presliding"] == "m"
    assert list(frame.index) == list(told.told)
    with pytest.raises(UserError, match="no wrist was identified there"):
        wristctl.simulate(from_identified=told, horizon=0.1)


def test_an_analysis_of_hysteresis_reads_no_controller_and_no_run(done: Hysteresis) -> None:
    assert done.run is not None
    config = done.run.file("config.yaml").read_text()
    assert "\nhysteresis:" in config and "\n  of: hysteresis" in config and "\nsimulate:" not in config
    assert done.run.manifest.about == "hysteresis"
    assert done.run.config.hysteresis == done.study.hysteresis and done.run.config.analyse.of == "hysteresis"
    with pytest.raises(UserError, match="reads no earlier run here - from_identified"):
        wristctl.analyse(of="hysteresis", from_identified=done)  # type: ignore[arg-type]
    with pytest.raises(UserError, match=r"an analysis of hysteresis does not read simulate\.controller"):
        wristctl.analyse(of="hysteresis", controller="pid")
    with pytest.raises(UserError, match=r"an analysis of a loop does not read hysteresis\.drive"):
        wristctl.analyse(hysteresis={"drive": "tensions"})
