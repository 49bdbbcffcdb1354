"""Help is quick and complete."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

from wristctl.cli.app import COMMANDS

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
    assert "--set controllers=[smc,pid]" in done.stdout
