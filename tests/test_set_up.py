"""What `make` installs before anything else: a Python that is new enough, and PyTorch without CUDA."""

from __future__ import annotations

import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import threading
import time
import zipfile
from collections.abc import Callable, Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
(PINNED,) = re.findall(r"^torch==(.+)$", (ROOT / "constraints.txt").read_text(encoding="utf-8"), re.MULTILINE)


class Index:
    """A package index on this computer with one version of a stand-in for PyTorch, and when it was asked for it."""

    def __init__(self, folder: Path, version: str) -> None:
        self.asked: list[float] = []
        folder.mkdir()
        wheel, about = folder / f"torch-{version}-py3-none-any.whl", f"torch-{version}.dist-info"
        with zipfile.ZipFile(wheel, "w") as archive:
            archive.writestr(f"{about}/METADATA", f"Metadata-Version: 2.1\nName: torch\nVersion: {version}\n")
            archive.writestr(f"{about}/WHEEL", "Wheel-Version: 1.0\nRoot-Is-Purelib: true\nTag: py3-none-any\n")
            archive.writestr(f"{about}/RECORD", f"{about}/METADATA,,\n{about}/WHEEL,,\n{about}/RECORD,,\n")
        index = self

        class Handler(BaseHTTPRequestHandler):
            def do_GET(self) -> None:
                index.asked.append(time.monotonic())
                page = f'<!doctype html><a href="{wheel.name}">{wheel.name}</a>'.encode()
                of_wheel = self.path.endswith(".whl")
                self.send_response(200)
                self.send_header("Content-Type", "application/octet-stream" if of_wheel else "text/html")
                self.end_headers()
                self.wfile.write(wheel.read_bytes() if of_wheel else page)

            def log_message(self, *about: object) -> None:
                """Nothing is logged."""

        self.server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self.url = f"http://127.0.0.1:{self.server.server_port}"
        threading.Thread(target=self.server.serve_forever, daemon=True).start()


@pytest.fixture
def index(tmp_path: Path) -> Iterator[Callable[[str], Index]]:
    """Makes an index with a version of the stand-in."""
    made: list[Index] = []

    def make(version: str) -> Index:
        made.append(Index(tmp_path / f"index {len(made)}", version))
        return made[-1]

    yield make
    for each in made:
        each.server.shutdown()
        each.server.server_close()


@pytest.fixture(scope="module")
def made_environment(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a blank, and in it what `make` reads and an environment without packages."""
    folder = tmp_path_factory.mktemp("set-up") / "a clone"
    folder.mkdir()
    for name in ("Makefile", "constraints.txt"):
        shutil.copy(ROOT / name, folder)
    subprocess.run([sys.executable, "-m", "venv", folder / ".venv"], check=True)
    return folder


@pytest.fixture
def clone(made_environment: Path) -> Path:
    """The same, where no test has installed anything yet."""
    python = made_environment / ".venv" / "bin" / "python"
    without = [str(python), "-m", "pip", "uninstall", "--quiet", "--yes", "torch"]
    subprocess.run(without, check=True, capture_output=True, env=surroundings(made_environment))
    (made_environment / ".venv" / "torch").unlink(missing_ok=True)
    return made_environment


def surroundings(clone: Path, **more: str) -> dict[str, str]:
    """The environment of a user who has told pip nothing but `more`."""
    plain = {name: value for name, value in os.environ.items() if not name.startswith(("PIP_", "MAKE", "MFLAGS"))}
    return {**plain, "PIP_CONFIG_FILE": os.devnull, "PIP_NO_CACHE_DIR": "1", "HOME": str(clone), **more}


def set_up(clone: Path, address: str, **more: str) -> str:
    """What `make` says that installs PyTorch from an index, and else from pip's own."""
    call = ["make", ".venv/torch", f"TORCH_INDEX={address}"]
    done = subprocess.run(call, cwd=clone, env=surroundings(clone, **more), text=True, stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT)  # fmt: skip
    assert done.returncode == 0, done.stdout
    return done.stdout


def installed(clone: Path) -> str:
    """Version of PyTorch in the environment."""
    ask = "from importlib.metadata import version; print(version('torch'))"
    return subprocess.run(
        [clone / ".venv" / "bin" / "python", "-c", ask], check=True, capture_output=True, text=True
    ).stdout.strip()


@pytest.mark.slow
def test_pytorch_without_cuda_is_taken_from_its_own_index_and_asked_for_once(
    clone: Path, index: Callable[[str], Index]
) -> None:
    cpu, usual = index(f"{PINNED}+cpu"), index(PINNED)
    said = set_up(clone, cpu.url, PIP_INDEX_URL=usual.url)
    assert installed(clone) == f"{PINNED}+cpu" and cpu.asked and not usual.asked
    assert "190 MB" in said.splitlines()[0], "what will be downloaded is said before it is"
    cpu.asked.clear()
    (clone / ".venv" / "torch").unlink()
    set_up(clone, cpu.url, PIP_INDEX_URL=usual.url)
    assert not cpu.asked and not usual.asked, "what is installed is not asked for again"


@pytest.mark.slow
def test_further_indexes_of_the_user_do_not_bring_cuda(clone: Path, index: Callable[[str], Index]) -> None:
    cpu, usual = index(f"{PINNED}+cpu"), index(PINNED)
    set_up(clone, cpu.url, PIP_EXTRA_INDEX_URL=usual.url, PIP_FIND_LINKS=f"{usual.url}/torch/")
    assert installed(clone) == f"{PINNED}+cpu" and usual.asked


@pytest.mark.slow
def test_where_pytorchs_index_is_closed_pips_own_gives_it(clone: Path, index: Callable[[str], Index]) -> None:
    usual = index(PINNED)
    with socket.create_server(("127.0.0.1", 0)) as closed:
        address = f"http://127.0.0.1:{closed.getsockname()[1]}"
    said = set_up(clone, address, PIP_INDEX_URL=usual.url)
    assert installed(clone) == PINNED
    assert f"No torch=={PINNED} from {address}" in said and "CUDA, 2.7 GB" in said


class Silent:
    """An index that takes calls and never answers, and when it was called."""

    def __init__(self) -> None:
        self.called: list[float] = []
        self.calling = threading.Event()
        self.server = socket.create_server(("127.0.0.1", 0))
        self.url = f"http://127.0.0.1:{self.server.getsockname()[1]}"
        threading.Thread(target=self.hold, daemon=True).start()

    def hold(self) -> None:
        """Keep each caller waiting until the server is closed."""
        held = []
        while True:
            try:
                held.append(self.server.accept()[0])
            except OSError:
                break
            self.called.append(time.monotonic())
            self.calling.set()
        for each in held:
            each.close()


@pytest.fixture
def silent() -> Iterator[Silent]:
    index = Silent()
    yield index
    index.server.shutdown(socket.SHUT_RDWR)
    index.server.close()


@pytest.mark.slow
def test_an_index_that_never_answers_is_given_up(clone: Path, index: Callable[[str], Index], silent: Silent) -> None:
    usual = index(PINNED)
    set_up(clone, silent.url, PIP_INDEX_URL=usual.url)
    assert installed(clone) == PINNED
    assert usual.asked[0] - silent.called[0] < 60.0, "it is not waited for"


@pytest.mark.slow
def test_a_download_that_is_interrupted_is_not_gone_on_with_from_elsewhere(
    clone: Path, index: Callable[[str], Index], silent: Silent
) -> None:
    usual = index(PINNED)
    call = ["make", ".venv/torch", f"TORCH_INDEX={silent.url}"]
    told = surroundings(clone, PIP_INDEX_URL=usual.url)
    with subprocess.Popen(call, cwd=clone, env=told, start_new_session=True, stderr=subprocess.DEVNULL) as made:
        assert silent.calling.wait(60)
        os.killpg(made.pid, signal.SIGINT)  # as a terminal does on Ctrl-C
        assert made.wait(60) != 0
    assert not usual.asked and not (clone / ".venv" / "torch").exists()


@pytest.fixture
def tools(tmp_path: Path) -> Path:
    """A folder of what `make` needs, for a PATH without any Python."""
    folder = tmp_path / "tools"
    folder.mkdir()
    for name in ("make", "bash", "grep", "touch"):
        found = shutil.which(name)
        assert found is not None
        (folder / name).symlink_to(found)
    return folder


def program(file: Path, text: str) -> None:
    """A program of so many lines of shell."""
    file.write_text(f"#!/bin/sh\n{text}\n")
    file.chmod(0o755)


@pytest.mark.parametrize(
    ("there", "taken"),
    [
        ({"python3": 0}, "python3"),
        ({"python3": 0, "python3.11": 0}, "python3.11"),
        ({"python3": 0, "python3.11": 127}, "python3"),  # what pyenv puts there for a Python that is not switched on
        ({"python3": 1, "python3.13": 0}, "python3.13"),  # too old, as it says of itself
    ],
)
def test_the_environment_is_made_by_a_python_that_runs_and_is_new_enough(
    tools: Path, tmp_path: Path, there: dict[str, int], taken: str
) -> None:
    for name, code in there.items():
        program(tools / name, f"exit {code}")
    for name in ("Makefile", "constraints.txt"):
        shutil.copy(ROOT / name, tmp_path)
    call = [str(tools / "make"), "--dry-run", ".venv/torch"]
    said = subprocess.run(call, cwd=tmp_path, env={"PATH": str(tools)}, capture_output=True, text=True, check=True)
    assert f"|| {taken} -m venv .venv" in said.stdout


def test_without_a_python_that_is_new_enough_the_need_is_said(tools: Path, tmp_path: Path) -> None:
    program(tools / "python3", "exit 1")
    for name in ("Makefile", "constraints.txt", "pyproject.toml"):
        shutil.copy(ROOT / name, tmp_path)
    done = subprocess.run(
        [str(tools / "make"), "run"], cwd=tmp_path, env={"PATH": str(tools)}, capture_output=True, text=True
    )
    assert done.returncode != 0 and "Python 3.11 or newer is needed" in done.stderr


def test_what_is_installed_once_is_not_installed_again(tmp_path: Path) -> None:
    folder = tmp_path / "a clone"
    (folder / ".venv" / "bin").mkdir(parents=True)
    for name in ("Makefile", "constraints.txt", "pyproject.toml"):
        shutil.copy(ROOT / name, folder)
    program(folder / ".venv" / "bin" / "pip", "exit 1")
    program(folder / ".venv" / "bin" / "python", 'echo "$*" >> asked')
    for target in (".venv/run", ".venv/run", ".venv/dev", ".venv/dev", ".venv/run", ".venv/docs"):
        subprocess.run(["make", target], cwd=folder, check=True, capture_output=True)
    asked = (folder / "asked").read_text().splitlines()
    assert [line.split()[-1] for line in asked] == [f"torch=={PINNED}", ".", ".[dev]"]
    assert all("-c constraints.txt" in line for line in asked[1:])
