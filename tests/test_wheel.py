"""What is installed is whole: from the built wheel, without a clone, documented commands find all that they name."""

from __future__ import annotations

import json
import os
import re
import shlex
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest

from wristctl.records.provenance import code_state

ROOT = Path(__file__).parents[1]
PACKAGED = ("board/firmware/wrist.hex", "board/firmware/wrist.hex.sha256", "board/messages.toml", "py.typed")
LATER = r"no [a-z-]+ run that ended ok - latest:[a-z-]+ in "
"""What a command may lack in an empty folder: the run before it."""

_CALLS = """
import json, sys
import wristctl
from wristctl.cli.app import main
print("package:", wristctl.__file__)
for typed in json.loads(sys.argv[1]):
    sys.argv = ["wristctl", *typed]
    try:
        main()
    except SystemExit as ended:
        print("ended:", ended.code, file=sys.stderr, flush=True)
"""


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("dist")
    command = [sys.executable, "-m", "hatchling", "build", "-t", "sdist", "-t", "wheel", "-d", str(folder)]
    subprocess.run(command, cwd=ROOT, check=True, capture_output=True)
    return folder


@pytest.fixture(scope="module")
def installed(built: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    (wheel,) = built.glob("*.whl")
    folder = tmp_path_factory.mktemp("site")
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(folder)
    return folder


def _said(installed: Path, folder: Path, *calls: list[str]) -> tuple[str, list[tuple[int, str]]]:
    """Where the package was, and how each call ended, with what it said on stderr."""
    environment = {**os.environ, "PYTHONPATH": str(installed)}
    command = [sys.executable, "-c", _CALLS, json.dumps(calls)]
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True)
    *ended, _ = re.split(r"^(ended: -?\d+)\n", done.stderr, flags=re.MULTILINE)
    codes = [int(each.removeprefix("ended: ")) for each in ended[1::2]]
    return done.stdout, list(zip(codes, ended[::2], strict=True))


@pytest.mark.slow
def test_the_wheel_holds_experiments_firmware_templates_and_types_as_they_are_here(installed: Path) -> None:
    package = installed / "wristctl"
    for name in PACKAGED:
        assert (package / name).read_bytes() == (ROOT / "wristctl" / name).read_bytes(), name
    for here, there in (
        (ROOT / "experiments", package / "experiments"),
        (ROOT / "wristctl/cli/templates", package / "cli/templates"),
        (ROOT / "wristctl/plotting/templates", package / "plotting/templates"),
    ):
        files = [each for each in here.rglob("*") if each.is_file() and each.suffix != ".pyc"]
        assert len(files) > 2
        for file in files:
            assert (there / file.relative_to(here)).read_bytes() == file.read_bytes(), file
    assert not [each for each in installed.iterdir() if not each.name.startswith("wristctl")]
    (about,) = installed.glob("*.dist-info")
    for licence in (ROOT / "LICENSE", *(ROOT / "LICENSES").iterdir()):
        assert (about / "licenses" / licence.relative_to(ROOT)).read_bytes() == licence.read_bytes(), licence


def test_the_sdist_holds_the_tests_and_what_they_read(built: Path) -> None:
    (sdist,) = built.glob("*.tar.gz")
    with tarfile.open(sdist) as archive:
        held = {name.partition("/")[2] for name in archive.getnames()}
    wanted = ["README.md", "CONTRIBUTING.md", "Makefile", "pyproject.toml", "constraints.txt", "LICENSE", ".gitignore"]
    wanted.append("results/README.md")
    for top in ("tests", "experiments", "docs", "benchmarks", "wristctl"):
        wanted += [
            each.relative_to(ROOT).as_posix()
            for suffix in ("py", "yaml", "json", "md", "hex", "xz", "c")
            for each in (ROOT / top).rglob(f"*.{suffix}")
            if not {"__pycache__", "build", "results"} & set(each.relative_to(ROOT).parts[:-1])
        ]
    assert len(wanted) > 800 and not set(wanted) - held


@pytest.mark.slow
def test_the_documented_commands_find_their_studies_in_an_empty_folder(installed: Path, tmp_path: Path) -> None:
    page = (ROOT / "docs" / "commands.md").read_text(encoding="utf-8")
    named = re.findall(r"`(wristctl [^`]*experiments/[^`]*)`", page.replace("wristctl paper audit", "wristctl audit"))
    examples = [shlex.split(each)[1:] for each in named]
    assert {typed[0] for typed in examples} >= {"gen-data", "train", "tune", "study", "audit", "analyse"}
    calls = [[*typed, "--dry-run"] for typed in [*examples, ["tune", "quick"], ["tune", "scenarios/camera"]]]
    out, ended = _said(installed, tmp_path, *calls)
    assert out.startswith(f"package: {installed}/wristctl/")
    assert len(ended) == len(calls)
    for typed, (code, said) in zip(calls, ended, strict=True):
        assert code == 0 or (code == 2 and re.search(LATER, said)), f"{typed}: {said}"
    assert ended[-2][0] == 0 and not list(tmp_path.iterdir())


@pytest.mark.slow
def test_an_installed_wristctl_makes_sealed_runs_of_the_same_code_as_the_clone(installed: Path, tmp_path: Path) -> None:
    _, ended = _said(installed, tmp_path, ["gen-data", "quick", "--set", "samples=50", "-q"], ["init", "study"])
    assert [code for code, _ in ended] == [0, 0], ended
    (run,) = (tmp_path / "results").glob("*-gen-data-quick-*")
    assert (run / "SHA256SUMS").is_file()
    made = [
        each for each in code_state()[2].splitlines() if "/build/" not in each
    ]  # the firmware's compiler leaves some
    assert (run / "code.txt").read_text(encoding="utf-8").splitlines() == made
    assert (tmp_path / "study" / "experiments" / "own_controllers" / "lqr.py").is_file()
