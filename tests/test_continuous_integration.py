"""What continuous integration runs: the README's commands, in a clone of the commit, in a folder with a blank."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
README = "```console\n$ git clone ADDRESS\n$ cd wristctl\n$ make run    # some minutes\n$ make test\n```\n"
# Each target notes its name, folder and commit; the last one fails at its first try.
MAKEFILE = """\
run test test-slow test-rig:
\t@echo "$@|$(CURDIR)|$$(git rev-parse HEAD)" >> "$$NOTED"
\t@echo "1 passed in $@"
\t@test $@ != test-rig || test $$(grep -c '^test-rig|' "$$NOTED") -gt 1
"""

Ci = Callable[..., tuple[int, str, str]]


def git(folder: Path, *arguments: str) -> str:
    """What git answers in a folder, with a name of the author whoever runs the tests."""
    author = ["-c", "user.name=a", "-c", "user.email=a@b", "-c", "init.defaultBranch=main"]
    call = ["git", "-C", str(folder), *author, *arguments]
    return subprocess.run(call, check=True, capture_output=True, text=True).stdout.strip()


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """A project of two commits with our script, a README and stand-ins of what is made."""
    folder = tmp_path / "project"
    (folder / ".ci").mkdir(parents=True)
    (folder / "tests" / "firmware").mkdir(parents=True)
    shutil.copy(ROOT / ".ci" / "run", folder / ".ci")
    (folder / "Makefile").write_text(MAKEFILE)
    (folder / "tests" / "firmware" / "Makefile").write_text(MAKEFILE.replace("run ", "firmware ", 1))
    (folder / "README.md").write_text(README)
    git(folder, "init", "--quiet")
    for message in ("first", "second"):
        git(folder, "add", "--all")
        git(folder, "commit", "--quiet", "--allow-empty", "--message", message)
    return folder


@pytest.fixture
def ci(tmp_path: Path) -> Ci:
    """Runs the script of a project as root of a Debian would, but for what it installs: exit code, stdout, stderr."""
    tools = tmp_path / "tools"
    tools.mkdir()
    for name, text in (("apt-get", "exit 0"), ("id", "echo 0")):
        (tools / name).write_text(f"#!/bin/sh\n{text}\n")
        (tools / name).chmod(0o755)
    scratch = tmp_path / "scratch"
    scratch.mkdir()
    told = {name: value for name, value in os.environ.items() if not name.startswith(("MAKE", "MFLAGS", "GIT_"))}
    told |= {"PATH": f"{tools}:{told['PATH']}", "TMPDIR": str(scratch), "NOTED": str(tmp_path / "noted")}

    def run(project: Path) -> tuple[int, str, str]:
        done = subprocess.run(["bash", ".ci/run"], cwd=project, env=told, capture_output=True, text=True)
        assert not list(scratch.iterdir()), "the clone is cleared away"
        return done.returncode, done.stdout, done.stderr

    return run


@pytest.mark.parametrize("checked_out", ["branch", "commit", "shallow"])
def test_all_is_made_in_one_clone_of_the_commit_that_is_checked_out(
    project: Path, tmp_path: Path, ci: Ci, checked_out: str
) -> None:
    if checked_out == "commit":
        git(project, "checkout", "--quiet", "HEAD~")
    elif checked_out == "shallow":
        git(tmp_path, "clone", "--quiet", "--depth", "1", project.as_uri(), "shallow")
        project = tmp_path / "shallow"
    code, out, err = ci(project)
    assert code == 0, err
    targets, folders, commits = zip(
        *(line.split("|") for line in (tmp_path / "noted").read_text().splitlines()), strict=True
    )
    assert targets == ("firmware", "run", "test", "test-slow", "test-rig", "test-rig")
    clone = folders[1]
    assert set(folders) == {clone, f"{clone}/tests/firmware"} and " " in clone and not clone.startswith(str(project))
    assert set(commits) == {git(project, "rev-parse", "HEAD")}
    assert out.splitlines()[-1] == "1 passed in test-rig"


@pytest.mark.parametrize(
    ("readme", "missing"),
    [
        (README.replace("$ make run    # some minutes\n", ""), "make run"),
        (README.replace("$ make test\n", "$ make test-slow\n"), "make test"),
        (README.replace("$ make test\n", "") + "\nThen `make test`:\n\nmake test\n", "make test"),
        (README.replace("```console", "```text"), "make run"),
    ],
    ids=["no run", "another test", "test in a sentence", "not commands"],
)
def test_a_readme_without_its_two_commands_fails(
    project: Path, tmp_path: Path, ci: Ci, readme: str, missing: str
) -> None:
    (project / "README.md").write_text(readme)
    code, _, err = ci(project)
    assert code == 1 and f"'{missing}'" in err and not (tmp_path / "noted").exists()
