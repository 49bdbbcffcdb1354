"""Hysteresis as a mode of `analyse` and of `identify`: plans, errors, repeated runs, and its former name."""

from __future__ import annotations

import json
import re
import shlex
import tarfile
from pathlib import Path

import pytest

from tests.cli.conftest import Call
from tests.identification.made_loops import SHORT, made_loop, written
from wristctl.cli.former_hysteresis import words_today
from wristctl.errors import UserError
from wristctl.records import Run, list_runs, open_run
from wristctl.simulation.strokes import FrictionCase
from wristctl.study_files.load import load_study

QUICK = ("ranges_deg=[[0, 10]]", "frequencies=[1, 5]", "angles_deg=[]")
SET = tuple(word for text in QUICK for word in ("--set", f"hysteresis.{text}"))
LOOP = ("--of", "hysteresis", *SET)
ARCHIVE = Path(__file__).parents[1] / "data" / "runs" / "hysteresis.tar.xz"
MEASURED = ("identify", "loop.csv", "--model", "hysteresis")


def _repeated(call: Call, run: str) -> None:
    code, out, _ = call("runs", "replay", run, "--json")
    found = json.loads(out)
    assert code == 0 and found["same"]
    assert {each["verdict"] for each in found["files"]} <= {"identical", "volatile"}


@pytest.mark.painted
@pytest.mark.slow
def test_a_run_with_a_measured_loop_is_repeated_to_the_byte(call: Call, tmp_path: Path) -> None:
    weights = SHORT._replace(what="tensions")
    written(made_loop(FrictionCase(0.15, 0.5, 3e-5), 0, weights).loop, tmp_path / "loop.csv")
    code, out, err = call(*MEASURED)
    assert code == 0, err
    lines = out.splitlines()
    assert "loop.csv" in lines[0] and any(line.startswith("friction coefficient") and "0.1" in line for line in lines)
    _repeated(call, open_run(lines[-1]).id)


@pytest.mark.painted
@pytest.mark.slow
def test_what_was_typed_before_runs_and_is_answered_with_todays_words(call: Call, tmp_path: Path) -> None:
    code, out, err = call("hysteresis", "--quiet", *(word for text in QUICK for word in ("--set", text)))
    assert code == 0 and err.startswith("`wristctl hysteresis` is now `wristctl analyse --of hysteresis --set"), err
    run = open_run(out.splitlines()[-1])
    assert run.kind == "analyse" and run.manifest.argv[1:4] == ["analyse", "--of", "hysteresis"]
    code, again, _ = call(*shlex.split(err.split("`")[3])[1:])
    assert code == 0 and open_run(again.splitlines()[-1]).result_hash == run.result_hash
    _repeated(call, run.id)


@pytest.fixture
def sealed_before(tmp_path: Path) -> dict[str, Run]:
    """Runs that `wristctl hysteresis` sealed, by what they are today: of the model, and of a measured loop."""
    with tarfile.open(ARCHIVE) as archive:
        archive.extraction_filter = getattr(tarfile, "data_filter", None)  # which Python 3.11.2 lacks
        archive.extractall(tmp_path / "results")
    runs = list_runs(tmp_path / "results")
    return {run.kind_today: run for run in runs}


def test_runs_of_the_former_kind_are_opened_and_verified(call: Call, sealed_before: dict[str, Run]) -> None:
    code, out, _ = call("runs", "verify")
    assert code == 0 and out.count("  as sealed") == 2
    modelled, measured = sealed_before["analyse"], sealed_before["identify"]
    assert {run.kind for run in sealed_before.values()} == {"hysteresis"} and len(sealed_before) == 2
    assert modelled.config.analyse.of == "hysteresis" and modelled.config.hysteresis.circles_deg == (5.0,)
    fit = measured.config.identify
    assert (fit.model, fit.segments, fit.step, fit.misfit) == ("hysteresis", 1, 2e-3, "tell")
    assert [Path(log).is_file() for log in fit.logs] == [True] and fit.logs[0].startswith(str(measured.path))
    assert call("runs", "export", modelled.id, "--file", "loop.csv")[0] == 0 and Path("loop.csv").is_file()
    code, out, _ = call("identify", "--config", f"{measured.path}/config.yaml", "--dry-run")
    assert code == 0 and "friction, sheath, presliding from 140 samples of loop.csv" in out


@pytest.mark.painted
@pytest.mark.slow
@pytest.mark.parametrize("today", ["analyse", "identify"])
def test_runs_of_the_former_kind_are_repeated(call: Call, sealed_before: dict[str, Run], today: str) -> None:
    code, out, _ = call("runs", "replay", sealed_before[today].id, "--json")
    found = json.loads(out)
    assert code == 0 and found["same"], found


def test_the_commands_of_the_page_run_as_written(call: Call) -> None:
    page = (Path(__file__).parents[2] / "docs" / "hysteresis.md").read_text(encoding="utf-8")
    typed = re.findall(r"^wristctl (analyse .*)$", page, re.MULTILINE)
    assert len(typed) >= 3
    for each in typed:
        code, _, err = call(*shlex.split(each), "--dry-run")
        assert code == 0, f"{each}: {err}"


def test_angles_of_the_dead_band_that_nobody_gave_follow_the_outer_range() -> None:
    def angles(*given: str) -> tuple[float, ...]:
        return load_study(overrides=given).hysteresis.angles_deg

    assert angles() == (5.0, 15.0, 25.0)
    assert angles("hysteresis.ranges_deg=[[-12, 12], [0, 5]]") == pytest.approx((-8.0, 0.0, 8.0))
    assert angles("hysteresis.ranges_deg=[[0, 60]]", "hysteresis.angles_deg=[7]") == (7.0,)
    with pytest.raises(UserError, match="angles_deg: 25 deg") as refused:
        angles("hysteresis.ranges_deg=[[0, 20]]", "hysteresis.angles_deg=[25]")
    assert "angles_deg" in refused.value.fix


FORMER = {
    "--measured loop.csv": "identify loop.csv --model hysteresis",
    "wrist.yaml --measured=loop.csv --columns a=b -q": "identify loop.csv --model hysteresis --config wrist.yaml --set "
    "identify.columns=a=b -q",
    "--set measured=loop.csv --set step=2e-3 --set known.spool_error=1e-5 --set known.run_up=1e-4": "identify loop.csv "
    "--model hysteresis --set identify.step=2e-3 --set identify.spool_error=1e-5 --set identify.known.run_up=1e-4",
    "old.yaml --set hysteresis.misfit=tell": "identify --model hysteresis --config old.yaml --set identify.misfit=tell",
    "wrist.yaml --drive tensions --set step=2e-3 --set wrist.length=0.1 --out there": "analyse --of hysteresis "
    "--config wrist.yaml --set hysteresis.drive=tensions --set hysteresis.step=2e-3 --set wrist.length=0.1 --out there",
    "-c wrist.yaml --seed=3 --dry-run --all": "analyse --of hysteresis --config wrist.yaml --seed 3 --dry-run --all",
}


@pytest.mark.parametrize("typed", FORMER)
def test_the_former_command_has_words_of_today(typed: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("wrist.yaml").write_text("wrist: {length: 0.09}\n")
    Path("old.yaml").write_text("hysteresis: {measured: loop.csv, segments: 2}\n")
    assert words_today(shlex.split(typed)) == shlex.split(FORMER[typed])


def test_a_study_that_names_a_measured_loop_in_the_former_place_is_one_of_identify(
    call: Call, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    problem = made_loop(FrictionCase(0.1, 1.0, 2e-5), 0, SHORT)
    written(problem.loop, tmp_path / "loop.csv")
    (tmp_path / "old.yaml").write_text(
        "hysteresis: {measured: loop.csv, segments: 2, step: 2.0e-3, tendon_stiffness: 1.0e+4, misfit: tell, "
        "known: {spool_error: 1.0e-5, run_up: 1.0e-4}, ranges_deg: [[0, 40]]}\n"
    )
    code, out, _ = call("identify", "--config", "old.yaml", "--dry-run", "--json")
    plan = json.loads(out)
    config = plan["config"].replace("\n", " ")
    assert code == 0 and "friction, sheath, presliding" in plan["plan"]
    assert "hysteresis.measured is now identify.logs" in caplog.text
    assert "hysteresis.step is now identify.step" in caplog.text
    for leaf in ("model: hysteresis", "segments: 2", "step: 0.002", "tendon_stiffness: 10000.0", "misfit: tell",
                 "spool_error: 1e-05", "run_up: 0.0001", "loop.csv"):  # fmt: skip
        assert leaf in config, leaf
    code, former, _ = call("hysteresis", "old.yaml", "--dry-run", "--json")
    assert code == 0 and json.loads(former) == plan


def test_a_plan_says_what_would_be_fitted(call: Call, tmp_path: Path) -> None:
    problem = made_loop(FrictionCase(0.1, 1.0, 2e-5), 0, SHORT)
    written(problem.loop, tmp_path / "loop.csv")
    code, out, _ = call(*MEASURED, "--dry-run")
    samples = len(problem.measured[0])
    assert code == 0 and f"friction, sheath, presliding from {samples} samples" in out.replace("\n", " ")
    code, out, _ = call("analyse", *LOOP, "--dry-run")
    assert code == 0 and "6 loops, " in out and "simulated seconds" in out and "simulate:" not in out


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--set", "hysteresis.ranges_deg=[[20, 10]]"), "from a lower to a higher angle, not from 20 to 10 deg"),
        (("--set", "hysteresis.angles_deg=[40]"), "40 deg lies outside the outer range"),
        (("--set", "hysteresis.ranges_deg=[[0, 60]]"), "beyond the wrist's range"),
        (("--set", "hysteresis.samples=41"), "multiple of 4"),
        (("--set", "hysteresis.frequencies=[0]"), "greater than 0"),
        (("--set", "hysteresis.shape=square"), "one of sine, triangle"),
        (("--set", "hysteresis.sheats=[1]"), "did you mean 'sheaths'?"),
        (("--set", "angles_deg=[10]"), "an analysis of hysteresis does not read analyse.angles_deg"),
        (("--controller", "pid"), "an analysis of hysteresis does not read simulate.controller"),
        (("--network", "latest:train"), "an analysis of hysteresis does not read simulate.network"),
    ],
)
def test_wrong_settings_are_refused_before_anything_is_written(
    arguments: tuple[str, ...], said: str, call: Call, tmp_path: Path
) -> None:
    code, out, err = call("analyse", "--of", "hysteresis", *arguments)
    assert code == 2 and said in err and out == "" and not (tmp_path / "results").exists()


def test_a_loop_that_is_not_there_is_named(call: Call, tmp_path: Path) -> None:
    code, out, err = call("identify", "gone.csv", "--model", "hysteresis")
    assert code == 2 and "cannot read the log" in err and out == "" and not (tmp_path / "results").exists()
    code, _, err = call("hysteresis", "--measured", "gone.csv")
    assert code == 2 and "cannot read the log" in err
