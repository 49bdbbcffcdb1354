"""Help is quick and complete."""

from __future__ import annotations

import json
import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest
from typer.main import get_command

from wristctl.cli.app import app, main, typer_of
from wristctl.cli.commands import CALIBRATIONS, COMMANDS, PAPER
from wristctl.errors import UserError
from wristctl.study_files.keys import field_at, keys_of
from wristctl.study_files.load import load_study
from wristctl.study_files.strict_yaml import parse_yaml

ROOT = Path(__file__).parents[2]
HEAVY = ("torch", "scipy", "pandas", "matplotlib", "cv2", "numba", "numpy", "llvmlite")


def _python(code: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "COLUMNS": "100"}
    return subprocess.run([sys.executable, "-c", code, *arguments], capture_output=True, text=True, env=environment)


_LOADED = """
import json, sys
from wristctl.cli.app import main
for arguments in json.loads(sys.argv[1]):
    sys.argv = ["wristctl", *arguments]
    try:
        main()
    except SystemExit as ended:
        loaded = sorted({name.split(".")[0] for name in sys.modules})
        print("ended:", json.dumps([arguments, ended.code, loaded]), file=sys.stderr)
"""


@pytest.mark.slow
def test_help_and_listing_load_no_heavy_package() -> None:
    named = [*([name] for name in COMMANDS), ["hw", "calibrate", "camera"], ["paper", "audit"]]
    typed = [[], ["--help"], ["--version"], ["runs", "ls"], *([*name, "--help"] for name in named)]
    done = _python(_LOADED, json.dumps(typed))
    ended = [json.loads(line.removeprefix("ended:")) for line in done.stderr.splitlines() if line.startswith("ended:")]
    assert [arguments for arguments, _, _ in ended] == typed
    for arguments, code, loaded in ended:
        assert code == 0 and not set(loaded) & set(HEAVY), arguments


def test_wristctl_alone_shows_help_with_examples() -> None:
    done = _python("from wristctl.cli.app import main; main()")
    assert done.returncode == 0
    for name, entry in COMMANDS.items():
        assert (f" {name} " in done.stdout) != entry.hidden
    assert "Examples:\n wristctl " in re.sub(r" *\n", "\n", done.stdout)


def test_what_most_users_want_stands_in_front() -> None:
    front = ["init", "simulate", "gen-data", "train", "tune", "compare", "recommend", "identify", "hw-run", "runs"]
    shown = _python("from wristctl.cli.app import main; main()").stdout
    places = [shown.index(f"│ {name} ") for name in front]
    assert places == sorted(places) and set(front) < set(COMMANDS)
    assert all(
        shown.index(f"│ {name} ") > places[-1]
        for name in COMMANDS.keys() - {*front, "audit", "check-law", "hysteresis"}
    )


_PAGES = """
import json, sys
from wristctl.cli.app import main
for arguments in json.loads(sys.argv[1]):
    sys.argv = ["wristctl", *arguments]
    print("page:", json.dumps(arguments))
    try:
        main()
    except SystemExit:
        pass
"""


def _pages(typed: list[list[str]]) -> dict[str, str]:
    """Help pages at 100 columns, by what was typed."""
    pages = _python(_PAGES, json.dumps(typed)).stdout.split("page: ")[1:]
    return {" ".join(arguments): page.partition("\n")[2] for arguments, page in zip(typed, pages, strict=True)}


@pytest.mark.slow
def test_each_page_of_help_is_one_screen_and_with_all_names_every_option() -> None:
    named = [
        [],
        *([name] for name in COMMANDS),
        ["paper", "audit"],
        *(["hw", "calibrate", name] for name in CALIBRATIONS),
    ]
    short, whole = _pages([[*name, "--help"] for name in named]), _pages([[*name, "--help", "--all"] for name in named])
    for page, text in short.items():
        assert len(text.rstrip().splitlines()) <= 40, page
    advanced = ("--seed", "--json", "--debug", "--force", "--trust-code", "--label")
    for page in ("simulate --help", "compare --help", "hw-run --help"):
        assert not [option for option in advanced if option in short[page]], page
        assert [option for option in advanced if option in whole[f"{page} --all"]] == list(advanced), page
        assert "--set" in short[page] and "--dry-run" in short[page]
    assert "--executor" in whole["tune --help --all"] and "--executor" not in short["tune --help"]
    assert "--priority" in whole["hw-run --help --all"] and "--priority" not in short["hw-run --help"]
    assert "--version" in whole["--help --all"]


@pytest.mark.slow
def test_an_advanced_option_works_without_being_shown(tmp_path: Path) -> None:
    asked = ("-m", "wristctl", "simulate", "--dry-run", "--json", "--seed", "5")
    done = subprocess.run([sys.executable, *asked], capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == 0 and "seed: 5" in json.loads(done.stdout)["config"]


@pytest.mark.slow
def test_former_names_are_the_same_commands() -> None:
    assert COMMANDS["audit"].place == PAPER["audit"].place
    typed = [["audit", "--help"], ["paper", "audit", "--help"], ["check-law", "--help"], ["check-controller", "--help"]]
    audit, paper_audit, check_law, check_controller = _pages(typed).values()
    assert audit.partition("[FILE]")[2].split() == paper_audit.partition("[FILE]")[2].split() != []
    assert check_law.partition("FILE:NAME")[2].split() == check_controller.partition("FILE:NAME")[2].split() != []


TAKEN_FOR_GRANTED = (
    r"no such run - \w*RUN in ",
    r"no such video - ",
    r"cannot read the (measured loop|measured data|log): No such file",
    r"no such folder - ",
    r"no file .*my_rig\.py",
    r"no [a-z-]+ run that ended ok - latest:[a-z-]+ in ",
)


@pytest.mark.slow
def test_every_example_runs_as_written_but_for_what_it_takes_for_granted(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    """Earlier runs and recordings; and a study file that it names says something of its command."""
    monkeypatch.chdir(ROOT)
    entries = (*COMMANDS.values(), *CALIBRATIONS.values(), *PAPER.values())
    pages = [get_command(typer_of(entry)).epilog for entry in entries]
    examples = [line for page in (*pages, app.info.epilog) for line in (page or "").split("\n") if "wristctl " in line]
    assert len(examples) > 30
    for example in examples:
        _, *typed = shlex.split(example.replace("\\[", "["))
        typed = typed[1:] if typed[0] == "paper" else typed
        if typed[0] in ("init", "list", "runs", "export-model", "export-law") or "--list" in typed:
            continue
        monkeypatch.setattr(sys, "argv", ["wristctl", *typed, "--dry-run", "--out", str(tmp_path)])
        with pytest.raises(SystemExit) as ended:
            main()
        said = capsys.readouterr().err
        assert ended.value.code == 0 or any(re.search(other, said) for other in TAKEN_FOR_GRANTED), f"{example}: {said}"
        for file in (word for word in typed if word.endswith(".yaml")):
            assert typed[0] in parse_yaml(Path(file).read_bytes(), file).data, example


@pytest.mark.slow
def test_horizon_and_seed_mean_the_same_wherever_they_are() -> None:
    """Each command whose section has a horizon has the option for it, in seconds; each that makes a run has --seed."""
    told = dict[str, set[str]]()
    for name, entry in (COMMANDS | PAPER).items():
        if entry.place.startswith("wristctl.cli"):
            continue
        options = {option: each for each in get_command(typer_of(entry)).params for option in each.opts}
        assert "--seed" in options, name
        if "horizon" in keys_of(field_at((name,))[0]):
            assert "--horizon" in options, name
        for option in {"--horizon", "--seed"} & set(options):
            told.setdefault(option, set()).add(
                str(getattr(options[option], "help", "")).replace("\\[", "[").partition(" of ")[2]
            )
    assert len(told["--seed"]) == 1
    assert told["--horizon"] == {"one rollout [s]", "a trial [s]"}


def test_a_horizon_that_worlds_would_leave_unread_is_refused() -> None:
    files, worlds = [Path("scenarios/camera")], "worlds.family=camera"
    for command in ("compare", "tune"):
        with pytest.raises(UserError, match=r"their? own .*horizon=4: .* --set families\.camera\.horizon=4"):
            load_study(files, [worlds, "horizon=4"], command)
        assert load_study(files, [worlds, "families.camera.horizon=4"], command).families["camera"].horizon == 4.0
        assert getattr(load_study([], ["horizon=4"], command), command).horizon == 4.0
