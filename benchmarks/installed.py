"""Does the built wheel work elsewhere? `make installed WITH=python3.13`, with `OLDEST=--lowest` at the oldest versions.

Builds the wheel (`--dist FILE` takes that wheel or source archive), installs it into an environment of its own, and
tries the commands of the README there, in an empty folder: no clone and no git. Prints a line a command, and ends with
1 where one failed, or was left out: without a CPU build of torch for this Python, in its own index or pip's, that is
`train`; `--without-torch` takes this as it is, `--cuda` takes the build of several GB that pip finds.
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
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[1]
TORCH_INDEX = "https://download.pytorch.org/whl/cpu"
TORCH = re.compile(r"torch(?![-\w])")
COMMANDS = (
    "--version",
    "init study",
    "gen-data quick",
    "train quick --data latest:gen-data --set epochs=5",
    "tune quick",
    "compare quick --tuned latest:tune",
    "simulate --controller smc --gains exchanged",
    "analyse --controller gvsc --gains default",
    "study pid-ff ct-dob scenarios/ideal --executor processes",
    "paper audit claims",
    "analyse hysteresis",
    "hw-run --set directions=[ulnar] --set push.force=0",
    "identify latest:hw-run --dry-run",
    "new controller own",
    "check-controller own.py:OWN",
    "simulate --controller own.py:OWN --gains default",
    "runs verify",
    "runs replay latest:simulate --trust-code",
    "runs pack latest:compare",
)
"""In their order; each ends with 0."""


def lowest(requirements: list[str]) -> list[str]:
    """Each requirement at the oldest version that it allows."""
    return [re.sub(r">=([\d.]+).*", r"==\1", each) for each in requirements]


def installer(commands: Path) -> list[str]:
    """The call that installs into an environment, but for what it installs."""
    if uv := shutil.which("uv"):
        return [uv, "pip", "install", "--quiet", "--python", str(commands / "python")]
    return [str(commands / "pip"), "install", "--quiet", "--disable-pip-version-check"]


def environment(
    folder: Path, python: str, oldest: bool, built: Path | None = None, cuda: bool = False
) -> tuple[Path, bool]:
    """The environment's folder of commands, and whether torch is there; `built` is installed, or a wheel built now."""
    commands = folder / "env" / "bin"
    uv = shutil.which("uv")  # much faster, where it is there
    made = [uv, "venv", "--quiet", "--python", python] if uv else [python, "-m", "venv"]
    subprocess.run([*made, folder / "env"], check=True)
    if built is None:
        build = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(folder)]
        subprocess.run(build, cwd=ROOT, check=True, capture_output=True)
        (built,) = folder.glob("*.whl")
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    wanted = [each for each in project["dependencies"] if not TORCH.match(each)]
    pip = installer(commands)
    subprocess.run([*pip, *(lowest(wanted) if oldest else wanted)], check=True)
    pins = (ROOT / "constraints.txt").read_text(encoding="utf-8").splitlines()
    (pinned,) = [each for each in pins if TORCH.match(each)]
    indexes = ([*pip, "--no-deps", "--index-url", TORCH_INDEX], [*pip, "--only-binary=:all:", "--no-deps"])
    with_torch = any(subprocess.run([*each, f"{pinned}+cpu"], capture_output=True).returncode == 0 for each in indexes)
    if with_torch or cuda:
        subprocess.run([*pip, f"{pinned}+cpu" if with_torch else pinned], check=True)  # what it needs
    subprocess.run([*pip, "--no-deps", str(built)], check=True)
    return commands, with_torch or cuda


def tried(commands: Path, folder: Path, command: str) -> str:
    """Why a command failed; empty where it did not."""
    own = {key: value for key, value in os.environ.items() if key not in ("PYTHONPATH", "VIRTUAL_ENV")}
    typed = [str(commands / "wristctl"), *command.split()]
    done = subprocess.run(typed, cwd=folder, env=own, capture_output=True, text=True)
    return "" if done.returncode == 0 else f"exit {done.returncode}: {done.stderr.strip()[-300:]}"


def main() -> None:
    """Install, try, tell."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("python", nargs="?", default=sys.executable)
    parser.add_argument("--lowest", action="store_true")
    parser.add_argument("--dist", type=Path, help="wheel or source archive, instead of a wheel built now")
    parser.add_argument("--without-torch", action="store_true", help="train may be left out")
    parser.add_argument("--cuda", action="store_true", help="without a CPU build of torch, take one with CUDA")
    given = parser.parse_args()
    built = given.dist and given.dist.resolve()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        commands, with_torch = environment(folder, given.python, given.lowest, built, given.cuda)
        version = subprocess.run([commands / "python", "-V"], capture_output=True, text=True).stdout.strip()
        age, torch = "oldest" if given.lowest else "newest", "with" if with_torch else "without"
        print(f"{version}, {age} dependencies, {torch} torch", flush=True)
        (folder / "empty").mkdir()
        failed = 0
        for command in COMMANDS:
            if command.startswith("train") and not with_torch:
                print(f"  left out       wristctl {command}")
                failed += not given.without_torch
                continue
            began = time.perf_counter()
            why = tried(commands, folder / "empty", command)
            failed += bool(why)
            took = time.perf_counter() - began
            print(f"  {'FAILED' if why else 'ok':6} {took:6.1f} s wristctl {command}", flush=True)
            if why:
                print(f"         {why}", flush=True)
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
