"""What the shell completes: run ids, study files, controllers. Nothing heavy is imported for it."""

from __future__ import annotations

import os
from itertools import islice
from pathlib import Path

import typer

from wristctl.config.choices import CONTROLLERS
from wristctl.config.shipped import shipped_names

MOST = 200
"""Runs offered: of many thousands nobody reads the list, and a shell asks at every key."""


def run_ids(context: typer.Context, incomplete: str) -> list[str]:
    """Run directories of the folder given with --out, the newest first, and latest:KIND."""
    out = Path(context.params.get("out") or "results")
    try:
        names = sorted((name for name in os.listdir(out) if not name.startswith(".")), reverse=True)
    except OSError:
        return []
    kinds = {f"latest:{kind}" for kind in _commands() if any(f"-{kind}-" in name for name in names)}
    fitting = (name for name in names if name.startswith(incomplete) and (out / name / "run.json").is_file())
    return [*islice(fitting, MOST), *(name for name in sorted(kinds) if name.startswith(incomplete))]


def study_files(incomplete: str) -> list[str]:
    """Folders and YAML files, those of experiments/ where nothing is typed yet; else names of experiments."""
    typed = Path(incomplete or "experiments/")
    folder = typed if incomplete.endswith("/") or not incomplete else typed.parent
    try:
        found = [path for path in folder.iterdir() if path.suffix in (".yaml", ".yml") or path.is_dir()]
    except OSError:
        found = []
    names = sorted(f"{path}/" if path.is_dir() else str(path) for path in found)
    fitting = [name for name in names if name.startswith(incomplete)]
    return fitting or [name for name in shipped_names() if name.startswith(incomplete)]


def controllers(incomplete: str) -> list[str]:
    """Names of the table of controllers."""
    return sorted(name for name in CONTROLLERS if name.startswith(incomplete))


def _commands() -> list[str]:
    from wristctl.cli.app import COMMANDS

    return list(COMMANDS)
