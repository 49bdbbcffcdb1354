"""What anybody who lives in the package may count on: a name means one thing, and a file fits a head."""

from __future__ import annotations

import ast
from collections import defaultdict
from collections.abc import Mapping
from pathlib import Path

import wristctl

PACKAGE = Path(wristctl.__file__).parent
LONGEST = 400
GENERATED = {"board/messages.py"}

SHARED_FILE_NAMES = {
    "a command: its options in cli, what it does in studies, its settings in config": {
        "analyse", "audit", "calibrate_camera", "calibrate_wrist", "compare", "gen_data", "hw_run", "hysteresis",
        "identify", "simulate", "study", "fair_study", "track", "train", "tune",
    },
    "a verb of `wristctl runs` in cli/runs, and what it does": {"lineage", "replay", "report"},
    "the settings, in config, of what has that name": {"bench", "control", "learning", "plant", "vision", "wrist"},
}  # fmt: skip
"""Why a name may stand in more than one folder, and which names do."""


def files() -> dict[str, list[str]]:
    """Folders of each name of a module or a package."""
    found: dict[str, list[str]] = defaultdict(list)
    for path in [PACKAGE, *PACKAGE.rglob("*")]:
        if path.suffix == ".py" and not path.name.startswith("__"):
            found[path.stem].append(path.parent.relative_to(PACKAGE).as_posix())
        elif (path / "__init__.py").exists() and path != PACKAGE:
            found[path.name].append(path.parent.relative_to(PACKAGE).as_posix())
    return found


def classes() -> dict[str, list[str]]:
    """Modules of each name of a public class."""
    found: dict[str, list[str]] = defaultdict(list)
    for path in PACKAGE.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                found[node.name].append(path.relative_to(PACKAGE).as_posix())
    return found


def shared(names: Mapping[str, list[str]]) -> dict[str, list[str]]:
    """Those in more than one place."""
    return {name: places for name, places in names.items() if len(places) > 1}


def test_no_public_class_stands_for_two_things() -> None:
    assert not shared(classes())


def test_a_file_name_stands_for_one_thing_unless_there_is_a_reason() -> None:
    assert set(shared(files())) == set().union(*SHARED_FILE_NAMES.values())


def test_what_shares_its_name_for_a_reason_stands_where_the_reason_says() -> None:
    """Two files called so in the rooms of the field's own things would be two things."""
    commands, verbs, settings = SHARED_FILE_NAMES.values()
    for name, folders in shared(files()).items():
        faces = {folder for folder in folders if folder in ("cli", "studies", "config", "cli/runs")}
        assert len(set(folders) - faces) <= 1, (name, folders)
        assert faces <= {"cli", "studies", "config"} if name in commands else True, (name, folders)
        assert faces == ({"cli/runs"} if name in verbs else {"config"}) if name in verbs | settings else True


def test_every_module_fits_a_head() -> None:
    long = {
        name: lines
        for path in PACKAGE.rglob("*.py")
        if (name := path.relative_to(PACKAGE).as_posix()) not in GENERATED
        and (lines := len(path.read_text(encoding="utf-8").splitlines())) > LONGEST
    }
    assert not long
