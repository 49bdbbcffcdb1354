"""Where compiled code is kept: by what it is made of, wherever the package lies."""

from __future__ import annotations

import ast
import fcntl
import importlib.util
import os
import subprocess
import sys
import threading
import time
import warnings
from pathlib import Path
from types import ModuleType
from typing import Any, TypeGuard

import numba
import pytest
from numba.core.caching import IndexDataCacheFile

import wristctl
from wristctl.lanes import compiled as module
from wristctl.lanes.compiled import TRIED, cache_folder, kernel, sources
from wristctl.lanes.functions import clip

PACKAGE = Path(wristctl.__file__).parent
CONFIG = ("wristctl.config", "wristctl.records")


def test_a_function_rests_on_what_it_imports_and_on_nothing_else() -> None:
    loop, plant = (PACKAGE / "simulation" / "kernel.py", PACKAGE / "wrist" / "pcc.py")
    names = [{each.relative_to(PACKAGE).as_posix() for each in sources(file)} for file in (loop, plant)]
    assert {"simulation/kernel.py", "simulation/observer.py", "wrist/tendon_mechanics.py", "lanes/lane.py"} <= names[0]
    assert {"wrist/integrator.py", "wrist/jacobian.py", "lanes/lane.py"} <= names[1]
    assert not any(
        name.startswith(("config/", "study_files/", "plugins/", "records/", "vision/", "board/", "cli/"))
        for name in names[0] | names[1]
    )


def test_what_is_for_compiled_code_is_refused_to_python() -> None:
    """numba would jump to an address that is not there."""
    with pytest.raises(TypeError, match="clip is for compiled code"):
        clip(1.0, 2.0, 3.0)


def test_another_line_in_an_imported_file_is_another_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_kernels", lambda: tmp_path / "kernels")
    law, helper = tmp_path / "law.py", tmp_path / "helper.py"
    law.write_text("from helper import gain\n")
    helper.write_text("gain = 1.0\n")
    assert sources(law) == [helper, law]
    before = cache_folder(law)
    for forget in (cache_folder, module._read):
        forget.cache_clear()  # what another process does not know
    helper.write_text("gain = 2.0\n")
    after = cache_folder(law)
    assert before is not None and after is not None and before != after
    cache_folder.cache_clear()


def doubling(folder: Path, gain: float = 2.0) -> Any:
    """A kernel from a file of its own in this folder."""
    folder.mkdir(parents=True, exist_ok=True)
    file = folder / "doubling.py"
    file.write_text(f"def doubled(x):\n    return {gain} * x\n")
    spec = importlib.util.spec_from_file_location("doubling", file)
    assert spec is not None and spec.loader is not None
    there = sys.modules["doubling"] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(there)
    return kernel(there.doubled)


def found(made: Any) -> int:
    """How often a kernel was found in the cache when it was first called."""
    made(1.0)
    return sum(made.stats.cache_hits.values())


@pytest.fixture
def kernels(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(module, "_kernels", lambda: tmp_path / "kernels")
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path / "numbas own"))
    monkeypatch.setitem(sys.modules, "doubling", ModuleType("doubling"))  # a kernel that is read again asks for it
    return tmp_path / "kernels"


def test_copies_of_the_package_share_their_kernels_and_other_sources_do_not(
    kernels: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    copies = [tmp_path / name / "package" for name in ("first", "second", "changed")]
    hits = []
    for package, gain in zip(copies, (2.0, 2.0, 3.0), strict=True):
        monkeypatch.setattr(module, "_PACKAGE", package)
        hits.append(found(doubling(package / "control", gain)))
    assert hits == [0, 1, 0]
    assert found(doubling(copies[2] / "wrist", 3.0)) == 0, "elsewhere in the package the same lines are another file"
    assert len(list(kernels.glob("*/doubling.doubled-1.*.nbi"))) == 3
    assert not (tmp_path / "numbas own").exists()


def test_files_outside_the_package_share_nothing(kernels: Path, tmp_path: Path) -> None:
    """What they read from files beside them is not in their text."""
    assert [found(doubling(tmp_path / name)) for name in ("first", "second", "first")] == [0, 0, 1]


ONE_OF_SEVERAL = """
import sys
import doubling
from wristctl.lanes.compiled import kernel
made = kernel(doubling.doubled)
print("ready", flush=True)
sys.stdin.readline()
made(1.0)
print(sum(made.stats.cache_hits.values()), sum(made.stats.cache_misses.values()))
"""
# Long enough to compile that the other has begun before it ends.
LONG = "def doubled(x):\n" + "".join(f"    for k{n} in range({n}):\n        x = x * 2.0 - k{n}\n" for n in range(60))


def test_of_processes_that_need_the_same_at_once_one_compiles_and_the_others_take_it(tmp_path: Path) -> None:
    (tmp_path / "doubling.py").write_text(LONG + "    return x\n")
    own = {**os.environ, "WRISTCTL_KERNELS": str(tmp_path / "kernels"), "PYTHONPATH": str(PACKAGE.parent)}
    command = [sys.executable, "-c", ONE_OF_SEVERAL]
    several = [
        subprocess.Popen(command, cwd=tmp_path, env=own, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        for _ in range(3)
    ]
    for each in several:
        assert each.stdout is not None and each.stdout.readline() == "ready\n"
    for each in several:
        assert each.stdin is not None
        each.stdin.write("go\n")
        each.stdin.flush()
    assert sorted(each.communicate(timeout=100)[0].split() for each in several) == [["0", "1"], ["1", "0"], ["1", "0"]]


def test_signatures_that_are_kept_at_once_each_have_a_file_of_their_own(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As by several processes: between one's look at the index and its file another looks too."""
    read = IndexDataCacheFile._load_index
    together = threading.Barrier(4)

    def slowly(self: Any) -> Any:
        known = read(self)
        time.sleep(0.02)
        return known

    def keep_one(key: int) -> None:
        together.wait(timeout=30.0)
        module._Index(str(tmp_path), "loop", "stamp").save(key, f"code of {key}")

    with monkeypatch.context() as slow:
        slow.setattr(IndexDataCacheFile, "_load_index", slowly)
        several = [threading.Thread(target=keep_one, args=(key,)) for key in range(4)]
        for each in several:
            each.start()
        for each in several:
            each.join()
    kept = module._Index(str(tmp_path), "loop", "stamp")
    assert [kept.load(key) for key in range(5)] == [*(f"code of {key}" for key in range(4)), None]


def test_a_process_that_never_ends_compiling_is_not_waited_for(
    kernels: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert found(doubling(tmp_path)) == 0
    (lock,) = kernels.glob("*/doubled.*.lock")
    monkeypatch.setattr(module, "_PATIENCE", 0.2)
    with lock.open("a") as other:
        fcntl.flock(other, fcntl.LOCK_EX)
        assert found(doubling(tmp_path)) == 1


def test_what_does_not_compile_leaves_no_lock_behind(kernels: Path, tmp_path: Path) -> None:
    made = doubling(tmp_path)
    for _ in range(2):
        with pytest.raises(numba.TypingError):
            made("word")
    (lock,) = kernels.glob("*/doubled.*.lock")
    with lock.open("a") as other:
        fcntl.flock(other, fcntl.LOCK_EX | fcntl.LOCK_NB)


def test_where_nothing_can_be_written_nothing_is_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").touch()
    monkeypatch.setattr(module, "_kernels", lambda: tmp_path / "file")
    assert [found(doubling(tmp_path / "law")) for _ in range(2)] == [0, 0]


@pytest.mark.slow
def test_compiled_functions_take_nothing_from_configuration_and_at_most_eight_arguments() -> None:
    """A comment in the configuration compiles nothing anew, so no number there may decide what is compiled."""
    seen = 0
    for file in PACKAGE.rglob("*.py"):
        tree = ast.parse(file.read_text())
        imports = [n for n in tree.body if isinstance(n, ast.ImportFrom) and (n.module or "").startswith(CONFIG)]
        foreign = {alias.asname or alias.name for each in imports for alias in each.names}
        kernels = {a.id for n in ast.walk(tree) if isinstance(n, ast.Call) for a in n.args[:1] if _is_kernel(a, n)}
        for node in tree.body:
            if isinstance(node, ast.FunctionDef) and (node.name in kernels or _decorated(node)):
                seen += 1
                used = {each.id for each in ast.walk(node) if isinstance(each, ast.Name)}
                assert not used & foreign, f"{file}: {node.name} uses {used & foreign}"
                given = [*node.args.posonlyargs, *node.args.args]
                assert len(given) <= 8, f"{file}: {node.name} takes {len(given)}"
    assert seen > 100


def _decorated(node: ast.FunctionDef) -> bool:
    used = (each.func if isinstance(each, ast.Call) else each for each in node.decorator_list)
    compiling = ("compiled", "spelled_out", "kernel", "by_type", "implements")
    return any(isinstance(each, ast.Name) and each.id in compiling for each in used)


def _is_kernel(argument: ast.expr, call: ast.Call) -> TypeGuard[ast.Name]:
    """Compiled for each plant: `kernel_of(function, model)`."""
    return isinstance(call.func, ast.Name) and call.func.id == "kernel_of" and isinstance(argument, ast.Name)


@pytest.mark.slow
def test_a_numba_that_nobody_has_tried_is_named() -> None:
    code = "import numba; numba.__version__ = '9.1.0'; import wristctl.lanes.compiled"
    done = subprocess.run([sys.executable, "-c", code], cwd=PACKAGE.parent, capture_output=True, text=True, check=True)
    assert f"numba 9.1.0: wristctl was tried with {TRIED} only" in done.stderr
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        subprocess.run([sys.executable, "-W", "error::UserWarning", "-c", "import wristctl.lanes.compiled"], check=True)
