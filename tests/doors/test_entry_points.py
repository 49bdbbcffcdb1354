"""Laws of installed packages: known by name, loaded when they are named and not before."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.doors.conftest import LAW, wristctl

STUDY = "simulate: {controller: strange, gains: default, horizon: 0.2, loop: {plant_segments: 1}}\n"


def install(site: Path, package: str, points: str, marker: Path) -> None:
    """A package as pip leaves it, that notes when it is imported."""
    (site / package).mkdir(parents=True)
    (site / package / "__init__.py").write_text(f"open({str(marker)!r}, 'a').close()\n")
    (site / package / "laws.py").write_text(LAW.replace("from helper", "from .springs"))
    (site / package / "springs.py").write_text(
        "from wristctl.lanes.compiled import compiled\n@compiled\ndef scaled(k, e):\n    return k * e\n"
    )
    info = site / f"{package}-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {package}\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(points)


@pytest.fixture
def site(tmp_path: Path) -> Path:
    """A folder on the path with one package, which has a law."""
    points = "[wristctl.controllers]\nstrange = pack.laws:STRANGE\n"
    install(tmp_path / "site", "pack", points, tmp_path / "imported")
    (tmp_path / "study.yaml").write_text(STUDY)
    return tmp_path / "site"


@pytest.mark.slow
def test_an_entry_point_is_a_controller_and_is_sealed_and_replayed_without_its_package(
    tmp_path: Path, site: Path
) -> None:
    done = wristctl(tmp_path, "simulate", "study.yaml", path=str(site))
    assert done.returncode == 0 and "strange with its default gains" in " ".join(done.stdout.split()), done.stderr
    (run,) = (tmp_path / "results").iterdir()
    copies = sorted(each.relative_to(run).as_posix() for each in run.glob("code/**/*.py"))
    assert copies == [f"code/laws/pack/{name}.py" for name in ("__init__", "laws", "springs")]
    again = wristctl(tmp_path, "runs", "replay", run.name, "--trust-code")
    assert again.returncode == 0 and f"{run.name}: identical" in again.stdout, again.stderr


@pytest.mark.slow
def test_it_is_loaded_only_when_it_is_named(tmp_path: Path, site: Path) -> None:
    marker = tmp_path / "imported"
    for arguments in (
        ("--help",),
        ("simulate", "--help"),
        ("simulate", "--dry-run"),
        ("simulate", "--controller", "strage"),
    ):
        done = wristctl(tmp_path, *arguments, path=str(site))
        assert not marker.exists(), arguments
    assert done.returncode == 2 and "did you mean 'strange'?" in done.stderr
    assert wristctl(tmp_path, "simulate", "study.yaml", "--dry-run", path=str(site)).returncode == 0
    assert marker.exists()


@pytest.mark.parametrize("other", ["another package", "a controller of wristctl", "a file"])
@pytest.mark.slow
def test_the_same_name_twice_is_refused(tmp_path: Path, site: Path, other: str) -> None:
    named, told = "strange", "2 installed packages have a 'strange'"
    if other == "another package":
        install(tmp_path / "site", "pock", "[wristctl.controllers]\nstrange = pock.laws:STRANGE\n", tmp_path / "pock")
    elif other == "a file":
        springs = (site / "pack" / "springs.py").read_text()
        (tmp_path / "mine.py").write_text(springs + LAW.replace("from helper import scaled", ""))
        named, told = "mine.py:STRANGE", "there is a controller 'strange' already"
    else:
        install(tmp_path / "site", "pock", "[wristctl.controllers]\npid = pock.laws:STRANGE\n", tmp_path / "pock")
        named, told = "pid", "'pid' is a controller of wristctl, and an installed package has one"
    gains = "printed" if named == "pid" else "default"
    done = wristctl(tmp_path, "simulate", "--controller", named, "--gains", gains, "--dry-run", path=str(site))
    assert done.returncode == 2 and told in done.stderr, done.stderr
    assert not (tmp_path / "pock").exists(), "of two of a name neither is loaded"
