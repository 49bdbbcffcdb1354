"""Units of random walks, and of work that fails, for the tests."""

from __future__ import annotations

from pathlib import Path

from wristctl.work.worker import Golden, Unit


def walks(count: int = 6, takes: float = 0.0) -> list[Unit]:
    return [Unit("piecework:walk", {"seed": k, "steps": 5, "takes": takes}, f"walk {k}") for k in range(count)]


def at(folder: Path, does: str, seed: int = 99) -> Unit:
    return Unit(f"piecework:{does}", {"seed": seed, "steps": 5, "tries": str(folder / f"tries-{does}")}, f"the {does}")


def tries(folder: Path, does: str) -> int:
    return len((folder / f"tries-{does}").read_text())


def golden(does: str = "constant") -> Golden:
    return Golden.here(f"piecework:{does}", {"of": 1})


def contents(folder: Path) -> dict[str, bytes]:
    return {each.name: each.read_bytes() for each in folder.iterdir()}
