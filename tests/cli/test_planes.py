"""Which commands bend in two planes, and with which tendons, is as the pages and the errors say."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.cli.conftest import Call
from wristctl.cli.commands import COMMANDS
from wristctl.gym import WristEnv
from wristctl.records import start_run
from wristctl.study_files.load import load_study
from wristctl.wrist.tendon_layout import TendonLayout

ROOT = Path(__file__).parents[2]
TWO_PLANES = {
    "simulate": ("--reference", "circumduction"),
    "hw-run": ("--reference", "circumduction"),
    "compare": ("--set", "references=[{kind: circumduction}]"),
    "tune": ("--set", "scenarios=[{reference: {kind: circumduction}}]"),
    "analyse": ("--set", "reference.kind=circumduction"),
    "gen-data": ("--set", "planes=2"),
    "train": ("--set", "gen-data.planes=2"),
    "recommend": ("--set", "references=[{kind: circumduction}]"),
    "study": (),  # its family has motions in two planes
}
"""How a motion in two planes is asked for, of commands whose motions can be chosen."""
WRIST = {"simulate", "gen-data", "train", "tune", "compare", "recommend", "hw-run", "study", "analyse"}
"""Commands that compute with a wrist of the user's."""
ANY = {"simulate", "compare", "tune", "study", "recommend", "analyse", "gen-data", "train", "hw-run"}
"""Of these, those that take tendons at any places; of a motor board it is as many as its axes wind."""
MUST = {"study": ("two_planes_study",)}
"""Study files without which a command has nothing to do."""


def _takes(call: Call, command: str, *typed: str) -> bool:
    code, _, err = call(command, *MUST.get(command, ()), *typed, "--dry-run", "--quiet")
    assert code == 0 or (code == 2 and "plane" in err and " - fix: " in err), (command, err)
    return code == 0


def test_commands_that_bend_in_two_planes_are_those_that_the_pages_name(call: Call) -> None:
    bend = {command: _takes(call, command, *motion) for command, motion in TWO_PLANES.items()}
    three = ("--set", "wrist.tendons=three")
    any_tendons = {command for command in WRIST if _takes(call, command, *TWO_PLANES.get(command, ()), *three)}
    taking = {command: "any" if command in any_tendons else "four" for command in bend if bend[command]}
    for page in ("overview.md", "two-planes.md"):
        text = " ".join((ROOT / "docs" / page).read_text(encoding="utf-8").split())
        (said,) = re.findall(r"Commands that bend in two planes: (.*?\))\.", text)
        assert dict(re.findall(r"`([\w-]+)` \((?:with )?(\w+)", said)) == taking, page
    assert any_tendons == ANY and set(COMMANDS) > WRIST


def test_in_one_plane_all_take_a_fifth_tendon_in_the_centre_and_three_bend_in_two(call: Call) -> None:
    for command in sorted(WRIST):
        assert _takes(call, command, "--set", "wrist.tendons=five"), command
    taking = {command for command in WRIST if _takes(call, command, "--set", "wrist.tendons=three")}
    assert taking == ANY


@pytest.mark.parametrize("motion", [(), ("--reference", "circumduction")])
def test_a_rig_says_what_takes_a_wrist_that_its_motors_do_not_wind(call: Call, motion: tuple[str, ...]) -> None:
    code, out, _ = call("hw-run", *motion, "--set", "wrist.tendons=three", "--dry-run")
    assert code == 0 and "planes: 2" in out, "nobody has to ask for them"
    code, _, err = call("hw-run", *motion, "--set", "wrist.tendons=three", "--set", "hw-run.planes=1", "--dry-run")
    assert code == 2 and "in one plane" in err and "planes=2" in err
    inner = "wrist.tendons=[{angle_deg: 0, ends_at: 3}, {angle_deg: 120}, {angle_deg: 240}]"
    code, _, err = call("hw-run", *motion, "--set", inner, "--dry-run")
    assert code == 2 and "ends inside the wrist" in err and "planes=2" not in err
    code, _, err = call("hw-run", *motion, "--set", "wrist.tendons=three", "--set", "hw-run.load_cells={}", "--dry-run")
    assert code == 2 and "load_cells: a board's go with the tendons 1, 2, 4 and 5" in err
    _, _, err = call("hw-run", *motion, "--set", "wrist.tendons=six", "--dry-run")
    assert "4 axes" in err and "6 tendons off its axis" in err and "wristctl identify" in err


def test_the_table_of_the_readme_says_which_command_bends_in_two_planes_and_takes_three_tendons(call: Call) -> None:
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    table = text.partition("| command | one plane | two planes | tendons |")[2].partition("\n\n")[0]
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in table.splitlines()[2:]]
    said = {name: row for row in rows for name in re.findall(r"`([\w.-]+)`", row[0])}
    for command, motion in TWO_PLANES.items():
        assert (said[command][2] == "yes") == _takes(call, command, *motion), command
    for command in WRIST:
        takes = _takes(call, command, *TWO_PLANES.get(command, ()), "--set", "wrist.tendons=three")
        assert said[command][3].startswith(("three", "any")) == takes, command
    assert said["export-model"][2] == said["wristctl.gym"][2] == "yes" and said["export-model"][3].startswith("any")


@pytest.mark.parametrize(
    "tendons", ["three", "six", "[{angle_deg: 10}, {angle_deg: 140, radius: 0.01}, {angle_deg: 250}]"]
)
def test_other_programs_and_environments_take_any_tendons(call: Call, tmp_path: Path, tendons: str) -> None:
    study = load_study([], [f"wrist.tendons={tendons}"])
    places = len(TendonLayout.of(study.wrist).places)
    assert WristEnv(study, actions="tensions").action_space.shape == (places,)
    with start_run("simulate", study, "", tmp_path / "results"):
        pass
    code, _, err = call("export-model", "latest:simulate", "--to", "mujoco")
    assert code == 0 and Path("wrist.xml").read_text().count("<spatial ") == places, err
