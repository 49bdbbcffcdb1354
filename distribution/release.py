"""Prepare a release: `make release VERSION=0.2.0` stamps, builds, checks and tries; a person tags and publishes.

`python distribution/release.py --open 0.3.0.dev0` stamps the next development version afterwards; `--check-tag v0.2.0`,
which the release workflow calls, fails where a tag is not the version of the code. docs/taking-over.md has the whole
way.
"""

from __future__ import annotations

import argparse
import hashlib
import re
import subprocess
import sys
from datetime import UTC, datetime
from pathlib import Path

ROOT = Path(__file__).parents[1]
RELEASE = re.compile(r"\d+\.\d+\.\d+")
DEVELOPMENT = re.compile(r"\d+\.\d+\.\d+\.dev0")
STAMPED = {
    "wristctl/version.py": r'(?<=__version__ = ").*(?=")',
    "CITATION.cff": r"(?<=\nversion: ).*",
    "README.md": r"(?<=\n  version = \{).*(?=\})",
    "distribution/recipe.yaml": r'(?<=\n  version: ").*(?=")',
}
"""Files that hold the version, each once, and where."""
UNRELEASED = "## Unreleased\n"


class NotReady(Exception):
    """Why nothing can be released as things are."""


def version(root: Path = ROOT) -> str:
    """The version that the code calls itself."""
    found = re.search(STAMPED["wristctl/version.py"], (root / "wristctl/version.py").read_text(encoding="utf-8"))
    assert found is not None
    return found[0]


def stamp(new: str, root: Path = ROOT, day: str = "") -> list[Path]:
    """Write a version wherever it stands; with a day [YYYY-MM-DD] as released then, all that has changed below it.

    Raises NotReady where a place is missing or doubled, or nothing has changed; then nothing is written.
    """
    texts: dict[Path, str] = {}
    for name, pattern in STAMPED.items():
        file = root / name
        text, count = re.subn(pattern, new, file.read_text(encoding="utf-8"))
        if count != 1:
            raise NotReady(f"{name} has the version {count} times")
        texts[file] = text
    if day:
        citation, changes = root / "CITATION.cff", root / "CHANGELOG.md"
        dated = re.sub(r"\ndate-released: .*", "", texts[citation])
        texts[citation] = re.sub(r"(?<=\nversion: ).*", rf"\g<0>\ndate-released: {day}", dated)
        before, found, after = changes.read_text(encoding="utf-8").partition(UNRELEASED)
        if not found or not after.partition("\n## ")[0].strip():
            raise NotReady("CHANGELOG.md has nothing below Unreleased")
        texts[changes] = f"{before}{UNRELEASED}\n## {new} - {day}\n{after}"
    for file, text in texts.items():
        file.write_text(text, encoding="utf-8")
    return list(texts)


def check_tag(tag: str, root: Path = ROOT) -> None:
    """Raise NotReady where a tag, v0.2.0, is not that of the code's version, or this is none to release."""
    here = version(root)
    if not RELEASE.fullmatch(here):
        raise NotReady(f"the code calls itself {here}, which is a development version")
    if tag != f"v{here}":
        raise NotReady(f"the tag is {tag}, the code calls itself {here}")


def check_tree(root: Path = ROOT) -> None:
    """Raise NotReady where something is not committed."""
    call = ["git", "status", "--porcelain"]
    if changed := subprocess.run(call, cwd=root, capture_output=True, text=True, check=True).stdout.strip():
        raise NotReady(f"not committed: {', '.join(line.split(maxsplit=1)[1] for line in changed.splitlines())}")


def build(root: Path = ROOT) -> None:
    """Source archive and wheel in dist/, the wheel from the archive, as an installer would build it."""
    folder = root / "dist"
    for old in folder.glob("wristctl-*"):
        old.unlink()
    subprocess.run([sys.executable, "-m", "hatchling", "build", "-t", "sdist", "-d", str(folder)], cwd=root, check=True)
    (source,) = folder.glob("*.tar.gz")
    subprocess.run(
        [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "-w", str(folder), source], check=True
    )


def main() -> None:
    """Stamp, build, try, and say what is left; ends with 1 where something is not as it should be."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("version", nargs="?", help="to release, as 0.2.0")
    parser.add_argument("--open", metavar="VERSION", help="the next development version, as 0.3.0.dev0")
    parser.add_argument("--build", action="store_true", help="source archive and wheel into dist/, nothing else")
    parser.add_argument("--check-tag", metavar="TAG", help="fail unless it is the code's version")
    given = parser.parse_args()
    try:
        if given.check_tag:
            check_tag(given.check_tag)
        elif given.build:
            build()
        elif given.open:
            if not DEVELOPMENT.fullmatch(given.open):
                raise NotReady(f"{given.open} is no development version, as 0.3.0.dev0")
            stamp(given.open)
        elif given.version:
            _release(given.version)
        else:
            parser.error("give a version, --open, --build or --check-tag")
    except NotReady as why:
        sys.exit(f"not ready: {why}")
    except subprocess.CalledProcessError as failed:
        sys.exit(f"not ready: {' '.join(map(str, failed.cmd))} ended with {failed.returncode}")


def _release(new: str) -> None:
    if not RELEASE.fullmatch(new):
        raise NotReady(f"{new} is no version to release, as 0.2.0")
    if tuple(map(int, new.split("."))) < tuple(map(int, version().split(".")[:3])):
        raise NotReady(f"{new} is before {version()}")
    check_tree()
    stamped = stamp(new, day=datetime.now(UTC).strftime("%Y-%m-%d"))
    print(f"stamped {new}: {', '.join(str(file.relative_to(ROOT)) for file in stamped)}", flush=True)
    subprocess.run(["make", "check-package"], cwd=ROOT, check=True)
    (source,), (wheel,) = ((ROOT / "dist").glob(f"wristctl-*{ending}") for ending in (".tar.gz", ".whl"))
    for file in (source, wheel):
        print(f"{file.name}, in an environment of its own:", flush=True)
        subprocess.run([sys.executable, "benchmarks/installed.py", "--dist", str(file)], cwd=ROOT, check=True)
    digest = hashlib.sha256(source.read_bytes()).hexdigest()
    print(
        f"""ready. Left to a person:
  git diff; git commit -am "Release {new}"; git tag -s v{new} -m "wristctl {new}"; git push --follow-tags
  on the tag's page: Publish release (the workflow tests, checks the tag, and uploads to PyPI)
  python distribution/release.py --open NEXT.dev0; git commit -am "Open NEXT"
  sha256 for the recipe: {digest}"""
    )


if __name__ == "__main__":
    main()
