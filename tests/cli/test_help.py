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
from wristctl.cli.commands import CALIBRATIONS, COMMANDS
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


def test_help_and_listing_load_no_heavy_package() -> None:
    named = [*([name] for name in COMMANDS), ["hw", "calibrate", "camera"]]
    typed = [[], ["--help"], ["--version"], ["runs", "ls"], *([*name, "--help"] for name in named)]
    done = _python(_LOADED, json.dumps(typed))
    ended = [json.loads(line.removeprefix("ended:")) for line in done.stderr.splitlines() if line.startswith("ended:")]
    assert [arguments for arguments, _, _ in ended] == typed
    for arguments, code, loaded in ended:
        assert code == 0 and not set(loaded) & set(HEAVY), arguments


def test_wristctl_alone_shows_help_with_examples() -> None:
    done = _python("from wristctl.cli.app import main; main()")
    assert done.returncode == 0
    for name in COMMANDS:
        assert f" {name} " in done.stdout
    assert "wristctl gen-data experiments/quick.yaml" in done.stdout
    assert "--set 'controllers=[smc,pid]'" in done.stdout


TAKEN_FOR_GRANTED = (
    r"no such run - \w*RUN in ",
    r"no such video - ",
    r"cannot read the measured (loop|data): No such file",
    r"no [a-z-]+ run that ended ok - latest:[a-z-]+ in ",
)


def test_every_example_runs_as_written_but_for_what_it_takes_for_granted(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    """Earlier runs and recordings; and a study file that it names says something of its command."""
    monkeypatch.chdir(ROOT)
    entries = (*COMMANDS.values(), *CALIBRATIONS.values())
    pages = [get_command(typer_of(entry)).epilog for entry in entries]
    examples = [line for page in (*pages, app.info.epilog) for line in (page or "").split("\n") if "wristctl " in line]
    assert len(examples) > 30
    for example in examples:
        _, *typed = shlex.split(example.replace("\\[", "["))
        if typed[0] in ("runs", "export-model"):
            continue
        monkeypatch.setattr(sys, "argv", ["wristctl", *typed, "--dry-run", "--out", str(tmp_path)])
        with pytest.raises(SystemExit) as ended:
            main()
        said = capsys.readouterr().err
        assert ended.value.code == 0 or any(re.search(other, said) for other in TAKEN_FOR_GRANTED), f"{example}: {said}"
        for file in (word for word in typed if word.endswith(".yaml")):
            assert typed[0] in parse_yaml(Path(file).read_bytes(), file).data, example
