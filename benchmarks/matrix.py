"""Does wristctl work with each Python that is here? `make matrix`, or `python benchmarks/matrix.py [PYTHON ...]`.

What the matrix of .github/workflows/tests.yml runs on other machines, as far as this one can. For each Python, one
after the other: the wheel in an environment of its own with the newest dependencies, commands in an empty folder, and
tests of the model, the settings, the board's protocol and run directories against the installed package. The oldest
Python is tried with the lowest dependencies too. Prints a line a step and a table, and ends with 1 where one failed.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from installed import ROOT, environment, installer, tried

OLDEST = (3, 11)
COMMANDS = ("--version", "--help", "simulate --controller ct-dob", "runs verify")
TRAINED = ("gen-data quick", "train quick --data latest:gen-data --set epochs=2")
TESTS = (
    "tests/wrist/test_kinematics.py", "tests/wrist/test_tendons.py", "tests/simulation/test_reference.py",
    "tests/config/test_section.py", "tests/records/test_verify.py", "tests/board/test_framing.py",
)  # fmt: skip


def pythons() -> list[str]:
    """Every Python here that is new enough, the oldest first: on the PATH, and in pyenv's folder.

    Of several 3.11 it is the newest.
    """
    folders = [Path(folder) for folder in os.environ.get("PATH", "").split(os.pathsep)]
    folders += sorted((Path.home() / ".pyenv" / "versions").glob("*/bin"))
    versions: dict[tuple[int, ...], str] = {}
    for folder in folders:
        for python in sorted(folder.glob("python3.*")):
            match = re.fullmatch(r"python3\.(\d+)", python.name)
            if match is None or (3, int(match[1])) < OLDEST:
                continue
            call = [str(python), "-c", "import sys; print(*sys.version_info[:3])"]
            asked = subprocess.run(call, capture_output=True, text=True)
            if asked.returncode == 0:
                versions.setdefault(tuple(map(int, asked.stdout.split())), str(python))
    newest = {version[:2]: versions[version] for version in sorted(versions)}
    return list(newest.values())


def tests(commands: Path, folder: Path) -> str:
    """Why a test of a copy of the tests failed with the installed package; empty where all pass."""
    shutil.copytree(ROOT / "tests", folder / "tests", ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(ROOT / "pyproject.toml", folder)
    subprocess.run([*installer(commands), "pytest>=8", "pytest-xdist", "hypothesis", "cobs", "mpmath"], check=True)
    plain = {key: value for key, value in os.environ.items() if key not in ("PYTHONPATH", "VIRTUAL_ENV")}
    call = [str(commands / "python"), "-m", "pytest", "-n", "0", "-p", "no:cacheprovider", *TESTS]
    done = subprocess.run(call, cwd=folder, env=plain, capture_output=True, text=True)
    return "" if done.returncode == 0 else f"exit {done.returncode}: {(done.stdout + done.stderr).strip()[-1500:]}"


def attempt(python: str, oldest: bool, cuda: bool) -> tuple[str, list[str]]:
    """The environment in words, and what failed in it."""
    failed = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        commands, with_torch = environment(folder, python, oldest, cuda=cuda)
        version = subprocess.run([commands / "python", "-V"], capture_output=True, text=True).stdout.strip()
        about = f"{version}, {'lowest' if oldest else 'newest'} dependencies{'' if with_torch else ', without torch'}"
        sys.stdout.write(f"{about}\n")
        sys.stdout.flush()
        for place in ("empty", "tried"):
            (folder / place).mkdir()
        for step in (*COMMANDS, *(TRAINED if with_torch else ()), "tests"):
            began = time.perf_counter()
            why = tests(commands, folder / "tried") if step == "tests" else tried(commands, folder / "empty", step)
            took = time.perf_counter() - began
            sys.stdout.write(
                f"  {'FAILED' if why else 'ok':6} {took:6.1f} s {step}\n{why and f'         {why}{chr(10)}'}"
            )
            sys.stdout.flush()
            failed += [step] * bool(why)
    return about, failed


def main() -> None:
    """Try each, tell."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("python", nargs="*", help="instead of every Python that is here")
    parser.add_argument("--lowest", action="store_true", help="only with the lowest dependencies")
    parser.add_argument("--cuda", action="store_true", help="without a CPU build of torch, train with one with CUDA")
    asked = parser.parse_args()
    every = asked.python or pythons()
    wanted = [] if asked.lowest else [(python, False) for python in every]
    wanted += [(python, True) for python in (every if asked.lowest else [] if asked.python else every[:1])]
    outcomes = [attempt(python, oldest, asked.cuda) for python, oldest in wanted]
    for about, failed in outcomes:
        sys.stdout.write(f"{'failed: ' + ', '.join(failed) if failed else 'passed':10} {about}\n")
    sys.exit(any(failed for _, failed in outcomes))


if __name__ == "__main__":
    main()
