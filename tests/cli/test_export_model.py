"""`wristctl export-model` as it is typed."""

from __future__ import annotations

import re
import shutil
from pathlib import Path
from xml.etree import ElementTree

import pytest

from tests.cli.conftest import Call
from wristctl.config.wrist import WristParameters
from wristctl.records import Run, list_runs, start_run
from wristctl.study_files.load import load_study

IDENTIFIED = "wrist: {stiffness: 0.5, flexion_ratio: 2.0, damping: 0.1, tendon_radius: 0.02}\n"
LOOP = "simulate: {loop: {actuator: {level: tendon}, sensor: {level: camera}}}\n"


@pytest.fixture
def identified(tmp_path: Path) -> Run:
    with start_run("identify", load_study([], ["wrist.stiffness=0.7"]), "", tmp_path / "results") as live:
        live.file("data/identified.yaml").write_text(IDENTIFIED + LOOP)
    return Run(live.path)


def stiffnesses(file: Path) -> list[float]:
    return [float(each.get("stiffness", "")) for each in ElementTree.parse(file).iter("joint") if each.get("stiffness")]


def test_the_identified_wrist_is_written_for_each_program(call: Call, identified: Run) -> None:
    code, out, err = call("export-model", "latest:identify", "--to", "mujoco")
    assert code == 0 and out.strip() == "wrist.xml", err
    assert stiffnesses(Path("wrist.xml")) == [2.0] * 4 and identified.id in Path("wrist.xml").read_text()
    code, out, err = call("export-model", identified.id, "--to", "matlab", "--direction", "flexion", "--segments", "2")
    assert code == 0 and out.strip() == "wrist_chain.m", err
    text = Path("wrist_chain.m").read_text()
    assert "stiffness = [4.0]'" in text and "alike = 2;" in text and re.search(f"run {identified.id} identified", text)


@pytest.mark.parametrize(("program", "file"), [("matlab", "wrist_chain.m"), ("mujoco", "wrist.xml")])
@pytest.mark.parametrize("name", ["x\n!touch PWN\n%", "a---><x/><!--", "b\x1b[2J\r%{"])
def test_a_folders_name_stays_within_its_comment(
    call: Call, tmp_path: Path, program: str, file: str, name: str
) -> None:  # fmt: skip
    with start_run("simulate", load_study([]), "", tmp_path / "results") as live:
        pass
    honest, odd = Run(live.path), tmp_path / name.replace("/", ":")
    assert call("export-model", str(honest.path), "--to", program)[0] == 0
    plain = Path(file).read_text().splitlines()
    Path(file).unlink()
    shutil.copytree(honest.path, odd)
    with pytest.MonkeyPatch.context() as lenient:  # a copied folder is refused, as it is not the run's: see past that
        lenient.setattr("wristctl.records.run.faults_of_manifest", lambda *given: [])
        assert call("export-model", str(odd), "--to", program)[0] == 0
    text = Path(file).read_text()
    changed = [line for line in text.splitlines() if line not in plain]
    assert len(text.splitlines()) == len(plain) and len(changed) == 1 and text.replace("\n", "").isprintable()
    if program == "matlab":
        assert changed[0].startswith("%   the wrist of run ")
    else:
        ElementTree.fromstring(text)


@pytest.mark.slow
def test_a_run_that_took_over_an_identification_gives_that_wrist(call: Call, identified: Run) -> None:
    code, _, err = call("simulate", "--set", "horizon=0.1", "--from-identified", identified.id)
    assert code == 0, err
    assert call("export-model", "latest:simulate", "--to", "mujoco", "--file", "a.xml")[0] == 0
    assert stiffnesses(Path("a.xml")) == [2.0] * 4
    assert call("simulate", "--set", "horizon=0.1", "--label", "own")[0] == 0
    (own,) = [run.id for run in list_runs(Path("results")) if run.manifest.label == "own"]
    assert call("export-model", own, "--to", "mujoco", "--file", "b.xml", "--segments", "1")[0] == 0
    assert stiffnesses(Path("b.xml")) == pytest.approx([4.0 * WristParameters().stiffness] * 4)


def written(call: Call, *arguments: str) -> ElementTree.Element:
    """The model that `export-model --to mujoco` writes with these arguments."""
    code, _, err = call("export-model", *arguments, "--to", "mujoco", "--file", "new.xml")
    assert code == 0, err
    text = Path("new.xml").read_text()
    Path("new.xml").unlink()
    return ElementTree.fromstring(text)


def hinges(model: ElementTree.Element) -> int:
    return len(list(model.iter("joint"))) - len(list(model.iterfind("./equality/joint")))


def test_a_wrist_of_any_layout_is_written_in_two_planes_with_what_pulls_it(call: Call, tmp_path: Path) -> None:
    places = (
        "[{angle_deg: 0}, {angle_deg: 100, multiplicity: 2}, {angle_deg: 200, radius: 0.01, ends_at: 3}, "
        "{angle_deg: 290}]"
    )
    motors = "simulate.loop.actuator={tendon_stiffness: 3e4, friction: 0.2, sheath: 1.0}"
    for label, tendons in {"three": "three", "four": "four", "drawn": places}.items():
        with start_run("simulate", load_study([], [f"wrist.tendons={tendons}", motors]), label, tmp_path / "results"):
            pass
    three, four, drawn = (
        next(run.id for run in list_runs(Path("results")) if run.manifest.label == label)
        for label in ("three", "four", "drawn")
    )
    model = written(call, three)
    assert hinges(model) == 8 and len(model.findall("./actuator/motor")) == 3
    assert hinges(written(call, four)) == 4 and hinges(written(call, four, "--planes", "2")) == 8
    model = written(call, drawn, "--motors", "spools")
    springs = {each.get("name"): each for each in model.findall("./actuator/general")}
    assert [each.get("gear") for each in springs.values()] == ["-1.0", "-2.0", "-1.0", "-1.0"]
    assert {float(each.get("gainprm", "")) for each in springs.values()} == {3e4}
    sites = [len(each) for each in model.findall("./tendon/spatial")]
    assert sites == [8, 8, 4, 8], "the third ends at the third of five discs"
    losses = [float(each.get("frictionloss", "")) for each in model.findall("./tendon/spatial")]
    assert losses[1] == 2.0 * losses[0] and 0.2 < losses[0] / WristParameters().pretension < 0.3
    code, _, err = call("export-model", three, "--to", "matlab")
    assert code == 0, err
    assert "[ulnar; flexion]" in Path("wrist_chain.m").read_text()


def test_a_run_that_bent_in_two_planes_gives_two(call: Call, tmp_path: Path) -> None:
    with start_run("simulate", load_study([], ["simulate.reference.kind=circumduction"]), "", tmp_path / "results"):
        pass
    assert (
        hinges(written(call, "latest:simulate")) == 8
        and hinges(written(call, "latest:simulate", "--direction", "flexion")) == 4
    )


@pytest.mark.parametrize(
    ("arguments", "what"),
    [
        (
            ("--direction", "ulnar"),
            "these tendons bend the wrist in two planes - --direction ulnar - fix: leave it out",
        ),
        (("--planes", "1"), "these tendons bend the wrist in two planes - --planes 1"),
        (("--planes", "2", "--direction", "ulnar"), "a direction is of one plane - --direction ulnar"),
        (("--segments", "3"), "tendon 2 ends at disc 3 of 5, within one of 3 segments - wrist.tendons.1"),
    ],
)
def test_a_plane_that_the_tendons_leave_is_not_written(
    call: Call, tmp_path: Path, arguments: tuple[str, ...], what: str
) -> None:
    places = "wrist.tendons=[{angle_deg: 0}, {angle_deg: 120, ends_at: 3}, {angle_deg: 240}]"
    with start_run("simulate", load_study([], [places]), "", tmp_path / "results"):
        pass
    code, _, err = call("export-model", "latest:simulate", "--to", "mujoco", *arguments)
    assert code == 2 and what in err and not Path("wrist.xml").exists(), err


@pytest.mark.parametrize(
    ("arguments", "what"),
    [
        (
            ("latest:identify", "--to", "matlab", "--motors", "spools"),
            "the function for MATLAB takes tensions - --motors spools",
        ),
        (("latest:identify", "--to", "mujoco"), "a file is in the way - wrist.xml"),
        (("latest:identify", "--to", "matlab", "--file", "other.m"), "a function by its file's name"),
        (("latest:train", "--to", "mujoco"), "no train run that ended ok"),
        (("latest:identify", "--to", "adams"), "'adams' is not one of"),
        (("latest:identify", "--to", "mujoco", "--file", "gone/wrist.xml"), "cannot write"),
    ],
)
def test_what_cannot_be_written_is_said(call: Call, identified: Run, arguments: tuple[str, ...], what: str) -> None:
    Path("wrist.xml").write_text("mine")
    code, _, err = call("export-model", *arguments)
    assert code == 2 and what in err and Path("wrist.xml").read_text() == "mine"


def test_a_program_that_is_none_of_those_there_are_is_told_in_plain_words(call: Call) -> None:
    code, _, err = call("export-model", "latest", "--to", "simulink")
    assert code == 2 and "'--to': 'simulink' is not one of 'mujoco', 'matlab', 'urdf'" in err
