"""A virtual environment for each peer under the user's cache folder, versions pinned in requirements/."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
CACHE = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "wristctl" / "peers"


def python_of(venv: str | None) -> str:
    """Interpreter of a peer's environment, installed where it is missing or its requirements have changed."""
    if venv is None:
        return sys.executable
    wanted, folder = (HERE / "requirements" / f"{venv}.txt").read_text(), CACHE / venv
    stamp, python = folder / "installed.txt", folder / "bin" / "python"
    if not stamp.exists() or stamp.read_text() != wanted:
        print(f"installing {venv} in {folder}", file=sys.stderr, flush=True)
        subprocess.run([sys.executable, "-m", "venv", "--clear", str(folder)], check=True)
        requirements = str(HERE / "requirements" / f"{venv}.txt")
        subprocess.run([str(python), "-m", "pip", "install", "--quiet", "-r", requirements], check=True)
        stamp.write_text(wanted)
    return str(python)
