"""What the shell completes: run ids, study files, controllers. Nothing heavy is imported for it."""

from __future__ import annotations

from pathlib import Path

import typer

from wristctl.config.choices import CONTROLLERS


def run_ids(context: typer.Context, incomplete: str) -> list[str]:
    """Run directories of the folder given with --out, newest first, and latest:KIND."""
    out = Path(context.params.get("out") or "results")
    try:
        names = sorted((path.name for path in out.iterdir() if (path / "run.json").is_file()), reverse=True)
    except OSError:
        return []
    kinds = {f"latest:{kind}" for kind in _commands() if any(f"-{kind}-" in name for name in names)}
    return [name for name in [*names, *sorted(kinds)] if name.startswith(incomplete)]


def study_files(incomplete: str) -> list[str]:
    """Folders and YAML files; those of experiments/ where nothing is typed yet."""
    typed = Path(incomplete or "experiments/")
    folder = typed if incomplete.endswith("/") or not incomplete else typed.parent
    try:
        found = [path for path in folder.iterdir() if path.suffix in (".yaml", ".yml") or path.is_dir()]
    except OSError:
        return []
    names = sorted(f"{path}/" if path.is_dir() else str(path) for path in found)
    return [name for name in names if name.startswith(incomplete)]


def controllers(incomplete: str) -> list[str]:
    """Names of the table of controllers."""
    return sorted(name for name in CONTROLLERS if name.startswith(incomplete))


def _commands() -> list[str]:
    from wristctl.cli.app import COMMANDS

    return list(COMMANDS)
