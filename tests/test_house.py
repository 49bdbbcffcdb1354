"""What anybody who lives in the package may count on: a name means one thing, imports lead down, a file fits a head."""

from __future__ import annotations

import ast
import re
from collections import defaultdict
from collections.abc import Iterator, Mapping
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

import wristctl

PACKAGE = Path(wristctl.__file__).parent
LONGEST = 400
GENERATED = {"board/messages.py"}

SHARED_FILE_NAMES = {
    "a command or a thing, and its settings in config": {
        "audit", "bench", "camera", "compare", "hw_run", "hysteresis", "identify", "learning", "plant", "recommend",
        "simulate", "study", "tune", "wrist",
    },
    "what commands do, and the part of the command line that shows it": {"commands", "progress"},
}  # fmt: skip
"""Why a name may stand in more than one folder, and which names do. A command's folder names its parts by itself."""


def modules() -> Iterator[tuple[str, Path]]:
    """Dotted name and file of each module of the package."""
    for path in PACKAGE.rglob("*.py"):
        parts = path.relative_to(PACKAGE.parent).with_suffix("").parts
        yield ".".join(parts[:-1] if parts[-1] == "__init__" else parts), path


def imports(name: str, path: Path, known: frozenset[str]) -> set[str]:
    """The modules of the package that a module imports anywhere in it, for types too."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom):
            assert node.module and node.level == 0, f"{path}: imports name the whole path"
            whole = [f"{node.module}.{each.name}" for each in node.names]
            found |= {each if each in known else node.module for each in whole}
        elif isinstance(node, ast.Import):
            found |= {each.name for each in node.names}
    return {each for each in found if each in known} - {name}


@pytest.fixture(scope="module")
def graph() -> dict[str, set[str]]:
    """What each module imports."""
    known = frozenset(name for name, _ in modules())
    return {name: imports(name, path, known) for name, path in modules()}


def order() -> list[str]:
    """The rooms from top to bottom, as CONTRIBUTING.md has them."""
    text = (PACKAGE.parent / "CONTRIBUTING.md").read_text(encoding="utf-8")
    found = re.search(r"within functions: ((?:\w+ >\s+)+)the modules beside the rooms", text)
    assert found is not None
    return re.findall(r"\w+", found[1])


def room(name: str) -> str:
    """The folder of the package, or the module beside these, that a module is in; nothing for the package whole."""
    return name.split(".")[1] if "." in name else ""


def files() -> dict[str, list[str]]:
    """Folders of each name of a module or a package, but for the parts of a command in its folder."""
    found: dict[str, list[str]] = defaultdict(list)
    for path in PACKAGE.rglob("*"):
        folder = path.parent.relative_to(PACKAGE).as_posix()
        if path.suffix == ".py" and not path.name.startswith("__") and not folder.startswith("commands/"):
            found[path.stem].append(folder)
        elif (path / "__init__.py").exists() and folder != "commands":
            found[path.name].append(folder)
    for path in (PACKAGE / "commands").iterdir():
        if path.is_dir() and path.name in found:
            found[path.name].append("commands")
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


@pytest.mark.slow
def test_no_public_class_stands_for_two_things_in_a_room() -> None:
    rooms = {name: [place.partition("/")[0] for place in places] for name, places in classes().items()}
    assert not {name: places for name, places in shared(rooms).items() if len(set(places)) < len(places)}


def test_a_file_name_stands_for_one_thing_unless_there_is_a_reason() -> None:
    assert set(shared(files())) == set().union(*SHARED_FILE_NAMES.values())


def test_what_shares_its_name_for_a_reason_stands_where_the_reason_says() -> None:
    """Two files called so in the rooms of the field's own things would be two things."""
    settings, _ = SHARED_FILE_NAMES.values()
    for name, folders in shared(files()).items():
        faces = {"config", "commands"} if name in settings else {"cli", "commands", "."}
        assert len(set(folders) - faces) <= 1 and ("config" in folders) == (name in settings), (name, folders)


@pytest.mark.slow
def test_imports_point_down(graph: Mapping[str, set[str]]) -> None:
    """A room imports what is below it, the modules beside the rooms no room, and none of them the package whole."""
    height = {name: at for at, name in enumerate(["__main__", "", *order()])}
    assert set(height) <= {room(name) for name in graph}
    assert {path.name for path in PACKAGE.iterdir() if (path / "__init__.py").exists()} <= set(height)
    up = [
        (name, each)
        for name, found in graph.items()
        for each in found
        if room(each) in height and height.get(room(name), len(height)) > height[room(each)]
    ]
    assert up == []


def test_no_module_imports_itself_by_way_of_others(graph: Mapping[str, set[str]]) -> None:
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        pytest.fail(" -> ".join(error.args[1]))


def test_every_module_fits_a_head() -> None:
    long = {
        name: lines
        for path in PACKAGE.rglob("*.py")
        if (name := path.relative_to(PACKAGE).as_posix()) not in GENERATED
        and (lines := len(path.read_text(encoding="utf-8").splitlines())) > LONGEST
    }
    assert not long
