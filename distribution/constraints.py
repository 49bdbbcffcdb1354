"""Write constraints.txt anew: `make constraints`. The newest versions that fit together on the oldest Python.

PyTorch stays where it is, since its builds without CUDA are asked for by number; what only its builds with CUDA need is
left out. Needs uv. Afterwards: `make test test-slow`, and a line in CHANGELOG.md where a floor of pyproject.toml moved.
"""

from __future__ import annotations

import re
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[1]
FILE = ROOT / "constraints.txt"
HEAD = "# The versions that the tests ran with: pip install -c constraints.txt -e '.[dev]' (made by make constraints)\n"
CUDA = re.compile(r"(nvidia|cuda|triton)\b")


def resolved(pinned: str, python: str) -> list[str]:
    """name==version of all that [dev] needs, in alphabetical order."""
    with tempfile.NamedTemporaryFile("w", suffix=".txt") as kept:
        kept.write(f"{pinned}\n")
        kept.flush()
        call = ["uv", "pip", "compile", "--quiet", "--no-header", "--no-annotate", "--extra", "dev", "-c", kept.name]
        call += ["--python-version", python, "--python-platform", "x86_64-manylinux_2_28", "pyproject.toml"]
        said = subprocess.run(call, cwd=ROOT, check=True, capture_output=True, text=True).stdout
    return [line for line in said.splitlines() if line and not CUDA.match(line)]


def main() -> None:
    """Resolve, write, and say what moved."""
    before = FILE.read_text(encoding="utf-8").splitlines()
    (pinned,) = [line for line in before if line.startswith("torch==")]
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    oldest = project["requires-python"].removeprefix(">=")
    after = resolved(pinned, oldest)
    FILE.write_text(HEAD + "".join(f"{line}\n" for line in after), encoding="utf-8")
    moved = sorted(set(after) ^ {line for line in before if not line.startswith("#")})
    sys.stdout.write("".join(f"{'+' if line in after else '-'} {line}\n" for line in moved) or "nothing has moved\n")


if __name__ == "__main__":
    main()
