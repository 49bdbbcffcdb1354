"""What strangers pin, build and install: versions stamped everywhere, licences shipped, one list of dependencies."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import pytest
import yaml
from packaging.requirements import Requirement
from packaging.version import Version

from wristctl.version import __version__

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
RECIPE = (ROOT / "distribution" / "recipe.yaml").read_text(encoding="utf-8")
CONDA = {"torch": "pytorch", "matplotlib": "matplotlib-base", "opencv-python-headless": "py-opencv"}
"""Names that conda-forge gives to packages of PyPI."""
WORKFLOWS = sorted((ROOT / ".github" / "workflows").glob("*.yml"))


@pytest.fixture
def release(monkeypatch: pytest.MonkeyPatch) -> Iterator[ModuleType]:
    monkeypatch.setattr(sys, "path", [str(ROOT / "distribution"), *sys.path])
    import release

    yield release
    del sys.modules["release"]


@pytest.fixture
def copy(tmp_path: Path, release: ModuleType) -> Path:
    """A folder of the files that hold the version, and the change log."""
    for name in (*release.STAMPED, "CHANGELOG.md"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / name, tmp_path / name)
    return tmp_path


def test_the_code_calls_itself_a_development_version_after_all_that_was_named_before() -> None:
    assert (
        Version(__version__).is_prerelease
        or subprocess.run(
            ["git", "tag", "--list", f"v{__version__}"], cwd=ROOT, capture_output=True, text=True
        ).stdout.strip()
    ), "a release is tagged"
    assert Version(__version__) > Version("0.1.0"), "which kept runs say"


def test_a_release_is_stamped_with_its_day_in_every_place_and_the_next_version_opened(
    copy: Path, release: ModuleType
) -> None:
    release.stamp("3.4.5", copy, day="2030-01-02")
    for name in release.STAMPED:
        text = (copy / name).read_text(encoding="utf-8")
        assert "3.4.5" in text and __version__ not in text, name
    citation = yaml.safe_load((copy / "CITATION.cff").read_text(encoding="utf-8"))
    assert (citation["version"], str(citation["date-released"])) == ("3.4.5", "2030-01-02")
    changes = (copy / "CHANGELOG.md").read_text(encoding="utf-8")
    before = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    empty, found, after = changes.partition("\n## 3.4.5 - 2030-01-02\n")
    assert found and empty.endswith("## Unreleased\n") and before.endswith(after)
    assert release.version(copy) == "3.4.5"
    release.check_tag("v3.4.5", copy)
    release.stamp("3.5.0.dev0", copy)
    with pytest.raises(release.NotReady, match="development"):
        release.check_tag("v3.5.0.dev0", copy)
    with pytest.raises(release.NotReady, match="nothing below Unreleased"):
        release.stamp("3.5.0", copy, day="2030-02-02")
    assert release.version(copy) == "3.5.0.dev0", "what is not ready is not written"


@pytest.mark.parametrize("tag", ["v3.4.6", "3.4.5", "v3.4.5rc1", ""])
def test_another_tag_than_the_version_is_refused(copy: Path, release: ModuleType, tag: str) -> None:
    release.stamp("3.4.5", copy)
    with pytest.raises(release.NotReady):
        release.check_tag(tag, copy)


def test_a_place_without_a_version_stops_a_release_before_anything_is_written(copy: Path, release: ModuleType) -> None:
    file = copy / "distribution" / "recipe.yaml"
    file.write_text(file.read_text(encoding="utf-8").replace("version:", "versions:"), encoding="utf-8")
    with pytest.raises(release.NotReady, match="recipe"):
        release.stamp("3.4.5", copy, day="2030-01-02")
    assert release.version(copy) == __version__


def test_what_is_not_committed_stops_a_release(tmp_path: Path, release: ModuleType) -> None:
    subprocess.run(["git", "init", "--quiet", tmp_path], check=True)
    release.check_tree(tmp_path)
    (tmp_path / "new file.py").write_text("")
    with pytest.raises(release.NotReady, match=r"new file\.py"):
        release.check_tree(tmp_path)


def test_the_recipe_needs_what_the_package_needs_and_ships_its_licences() -> None:
    recipe = yaml.safe_load(RECIPE)
    needed = {
        (CONDA.get(each.name, each.name), str(each.specifier)) for each in map(Requirement, PROJECT["dependencies"])
    }
    listed = [line.partition(" ") for line in recipe["requirements"]["run"]]
    of_recipe = {(name, ",".join(sorted(versions.split(",")))) for name, _, versions in listed}
    of_recipe = {each for each in of_recipe if each[0] not in ("__linux", "python")}
    assert of_recipe == {(name, ",".join(sorted(versions.split(",")))) for name, versions in needed}
    assert f">={recipe['context']['python_min']}" == PROJECT["requires-python"]
    shipped = {file.relative_to(ROOT).as_posix() for file in (ROOT / "LICENSES").glob("*.txt")}
    assert set(recipe["about"]["license_file"]) == {"LICENSE", *shipped} and len(shipped) == 3


def test_every_dependency_of_every_extra_is_pinned_within_its_floor() -> None:
    pins = {}
    for line in (ROOT / "constraints.txt").read_text(encoding="utf-8").splitlines():
        if not line.startswith("#"):
            pin = Requirement(line)
            (version,) = [each.version for each in pin.specifier]
            pins[re.sub(r"[-_.]+", "-", pin.name).lower()] = version
    wanted = [
        *PROJECT["dependencies"],
        *(each for extra in PROJECT["optional-dependencies"].values() for each in extra),
    ]
    requirements = [Requirement(each) for each in wanted]
    assert len(requirements) > 30
    for each in requirements:
        if each.name != PROJECT["name"]:
            assert pins[each.name.lower()] in each.specifier, each


@pytest.mark.parametrize("file", WORKFLOWS, ids=lambda file: file.stem)
def test_workflows_name_actions_by_hash_and_call_targets_that_are_there(file: Path) -> None:
    text = file.read_text(encoding="utf-8")
    used = re.findall(r"uses: (\S+)", text)
    assert used and all(re.search(r"@[0-9a-f]{40}$", each) for each in used)
    made = set((ROOT / "Makefile").read_text(encoding="utf-8").replace(":", " :").split("\n"))
    targets = {line.partition(" :")[0] for line in made if " :" in line and not line.startswith(("\t", "#", " "))}
    called = {target for call in re.findall(r"run: make (.*)", text) for target in call.split()}
    assert called and called <= targets
    steps = [step for job in yaml.safe_load(text)["jobs"].values() for step in job["steps"]]
    checkouts = [step for step in steps if step.get("uses", "").startswith("actions/checkout@")]
    assert checkouts and all(step["with"]["persist-credentials"] is False for step in checkouts)


def test_the_pythons_that_are_said_are_those_that_are_tested() -> None:
    (matrix,) = re.findall(r"python: \[(.*)\]", (ROOT / ".github/workflows/tests.yml").read_text(encoding="utf-8"))
    tested = re.findall(r'"(3\.\d+)"', matrix)
    (of_nox,) = re.findall(r"PYTHONS = \((.*)\)", (ROOT / "noxfile.py").read_text(encoding="utf-8"))
    said = [each.rpartition(" ")[2] for each in PROJECT["classifiers"] if re.search(r"Python :: 3\.\d+$", each)]
    assert tested == said == re.findall(r'"(3\.\d+)"', of_nox) and PROJECT["requires-python"] == f">={tested[0]}"
    (last,) = re.findall(
        r"`\.ci/run`.*?`python:(3\.\d+)-bookworm`", (ROOT / "docs/platforms.md").read_text(encoding="utf-8")
    )
    assert last == tested[0]
