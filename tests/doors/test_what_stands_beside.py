"""Which module a file from elsewhere imports where several have its name, and what an installed law is made of."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from importlib import import_module
from pathlib import Path
from types import ModuleType

import pluggy
import pytest

from wristctl.errors import UserError
from wristctl.plugins.import_hook import imported
from wristctl.plugins.places import installed

Write = Callable[[str, str], Path]


@pytest.fixture(autouse=True)
def forgotten() -> Iterator[None]:
    """Modules of a test are gone after it."""
    before = dict(sys.modules)
    yield
    for name in sys.modules.keys() - before.keys():
        del sys.modules[name]
    sys.modules.update(before)


@pytest.fixture
def write(tmp_path: Path) -> Write:
    """Writes a file below the folder of this test."""

    def written(name: str, text: str = "") -> Path:
        file = tmp_path / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)
        return file

    return written


@pytest.mark.parametrize("taken", ["json", "pluggy"])
def test_what_is_installed_or_of_python_comes_before_a_file_of_the_same_name(write: Write, taken: str) -> None:
    law = write("own/law.py", f"import {taken}\nWHICH = {taken}.__file__\n")
    write(f"own/{taken}.py", "raise AssertionError('this is not the one')\n")
    known = import_module(taken)
    module, seen = imported(law)
    assert known.__file__ == module.WHICH and list(seen) == [law]
    assert sys.modules[taken] is known and sys.modules["pluggy"] is pluggy


def test_a_module_beside_comes_before_one_from_another_folder_which_is_left_as_it_was(
    write: Write, monkeypatch: pytest.MonkeyPatch
) -> None:
    other = write("other/helper_of_mine.py", "VALUE = 'theirs'\n").parent
    law = write("own/law.py", "from helper_of_mine import VALUE\n")
    own = write("own/helper_of_mine.py", "VALUE = 'own'\n")
    monkeypatch.syspath_prepend(str(other))
    theirs = import_module("helper_of_mine")
    finders = list(sys.meta_path)
    module, seen = imported(law)
    assert theirs.VALUE == "theirs" and module.VALUE == "own" and set(seen) == {law, own}
    assert sys.modules["helper_of_mine"] is theirs and sys.meta_path == finders


def test_a_module_of_another_folder_that_is_not_beside_is_taken_from_there(
    write: Write, monkeypatch: pytest.MonkeyPatch
) -> None:
    other = write("other/only_there.py", "VALUE = 'theirs'\n").parent
    law = write("own/law.py", "import only_there\nVALUE = only_there.VALUE\n")
    monkeypatch.syspath_prepend(str(other))
    known = import_module("only_there")
    module, seen = imported(law)
    assert module.VALUE == "theirs" and list(seen) == [law] and sys.modules["only_there"] is known


@pytest.fixture
def site(write: Write, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder on the path with two packages of similar names and a module."""
    for name in ("packed/__init__", "packed/laws", "packed/springs", "packed/deep/__init__", "packed/deep/down"):
        write(f"site/{name}.py", "LAW = 1\n")
    write("site/packedness/__init__.py", "LAW = 1\n")
    write("site/packed_alone.py", "LAW = 1\n")
    site = write("site/packed/never_imported.py", "LAW = 1\n").parents[1]
    monkeypatch.syspath_prepend(str(site))
    return site


@pytest.mark.parametrize("name", ["packed", "packed.laws", "packed.deep", "packed.deep.down"])
def test_a_law_of_a_package_is_made_of_all_loaded_modules_of_it_alone(site: Path, name: str) -> None:
    for each in ("packed.laws", "packed.springs", "packed.deep.down", "packedness", "packed_alone"):
        import_module(each)
    module: ModuleType = import_module(name)
    origin = installed(module, "LAW")
    names = ("packed/__init__", "packed/laws", "packed/springs", "packed/deep/__init__", "packed/deep/down")
    assert set(origin.files) == {site / f"{each}.py" for each in names}
    assert origin.root == site and origin.file == Path(str(module.__file__)) and origin.attribute == "LAW"
    assert all(len(digest) == 64 for digest in origin.files.values())


def test_a_law_of_a_single_module_is_made_of_its_file(site: Path) -> None:
    origin = installed(import_module("packed_alone"), "LAW")
    assert set(origin.files) == {site / "packed_alone.py"} and origin.root == site


def test_an_error_is_told_at_the_innermost_line_of_ones_own_files(write: Write) -> None:
    law = write("own/law.py", "import helper\n\n\nhelper.fails()\n")
    helper = write("own/helper.py", "import json\n\n\ndef fails():\n    json.loads('no')\n")
    with pytest.raises(UserError) as raised:
        imported(law)
    assert f"{helper}:5" in str(raised.value) and "JSONDecodeError" in str(raised.value)
