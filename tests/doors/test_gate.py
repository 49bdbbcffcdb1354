"""What is left of a run is one still: its code asks, whatever was lost or taken away, and so does what it leads to."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from tests.cli.conftest import Call, call  # noqa: F401
from tests.doors.carrier import CARRIED, LAW_FILE, MARK, carrier
from wristctl.errors import UserError
from wristctl.plugins import trust
from wristctl.plugins.places import load
from wristctl.plugins.trust import asking, run_around
from wristctl.records import Run
from wristctl.records.seal import write_seal
from wristctl.sha256sums import read_seal

MARKS = ("run.json", "SHA256SUMS", "code.txt", "config.yaml")


def _without(*lost: str) -> Callable[[Path], None]:
    def take(run: Path) -> None:
        for name in lost:
            (run / name).unlink()

    return take


def _dangling(name: str) -> Callable[[Path], None]:
    def replace(run: Path) -> None:
        _without(*MARKS)(run)
        (run / name).symlink_to("/nonexistent")

    return replace


def _emptied(run: Path) -> None:
    _without("run.json", "code.txt", "config.yaml")(run)
    (run / "SHA256SUMS").write_text("")


LEFT_OVERS: dict[str, Callable[[Path], None]] = {
    "no manifest": _without("run.json"),
    "neither manifest nor seal": _without("run.json", "SHA256SUMS"),
    "the configuration beside the code": _without("run.json", "SHA256SUMS", "code.txt"),
    "an empty seal": _emptied,
    **{f"{name} alone": _without(*(each for each in MARKS if each != name)) for name in MARKS},
    **{f"{name} leads nowhere": _dangling(name) for name in MARKS},
}


@pytest.fixture
def run(tmp_path: Path) -> Run:
    """A run that carries a law."""
    return carrier(tmp_path, "simulate", {"controller": CARRIED, "gains": "default"})


def _noting(asked: list[str]) -> Callable[[str], bool]:
    """Somebody who notes what is asked, and says no."""

    def ask(shown: str) -> bool:
        asked.append(shown)
        return False

    return ask


@pytest.mark.parametrize("left", LEFT_OVERS)
def test_the_code_of_what_is_left_of_a_run_asks(run: Run, tmp_path: Path, left: str) -> None:
    LEFT_OVERS[left](run.path)
    asked = list[str]()
    refused = "nobody has said" if left != "SHA256SUMS leads nowhere" else "a link, and a run holds files only"
    with asking(_noting(asked)), pytest.raises(UserError, match=refused):
        load(f"{run.path / LAW_FILE}:STRANGE")
    assert len(asked) == (left != "SHA256SUMS leads nowhere") and not (tmp_path / MARK).exists()


@pytest.mark.parametrize("left", ["no manifest", "neither manifest nor seal", "the configuration beside the code"])
@pytest.mark.parametrize("given", [("-c",), ("-c", "copy")])
def test_a_dry_run_imports_nothing_of_what_is_left_of_a_run(
    run: Run, tmp_path: Path, call: Call, left: str, given: tuple[str, ...]  # noqa: F811
) -> None:  # fmt: skip
    LEFT_OVERS[left](run.path)
    config = run.path / "config.yaml"
    if "copy" in given:  # taken out of its run, beside a link to the code
        config = Path(shutil.copy(config, tmp_path))
        (tmp_path / "code").symlink_to(run.path / "code")
    code, _, err = call("simulate", "--dry-run", "-c", str(config))
    assert code == 2 and "--trust-code" in err and not (tmp_path / MARK).exists()


def test_a_law_of_ones_own_asks_nobody(run: Run, tmp_path: Path) -> None:
    assert run_around(tmp_path / "sources" / "strange.py") is None
    load(f"{tmp_path}/sources/strange.py:STRANGE")
    assert (tmp_path / MARK).exists()


def test_the_configuration_of_a_run_includes_nothing_from_outside(run: Run, tmp_path: Path, call: Call) -> None:  # noqa: F811
    """Which would name code that is in no run."""
    shutil.move(tmp_path / "sources", tmp_path / "results" / "library")
    outside = tmp_path / "results" / "library" / "more.yaml"
    outside.write_text("simulate: {controller: 'strange.py:STRANGE', gains: default}\n")
    config = run.path / "config.yaml"
    for way in (str(outside), "../library/more.yaml"):
        config.write_text(f"include: ['{way}']\n")
        code, _, err = call("simulate", "--dry-run", "-c", str(config))
        assert code == 2 and "outside the run" in err and not (tmp_path / MARK).exists(), way
    inside = shutil.copy(outside, run.path)
    config.write_text("include: [more.yaml]\n")
    code, _, err = call("simulate", "--dry-run", "-c", str(config))
    assert code == 2 and "no file" in err and "outside" not in err, inside


def test_names_of_a_runs_files_forge_no_lines_of_the_question(run: Run, tmp_path: Path) -> None:
    odd = run.path / "code" / "strange" / "a\nb\x1b[2K.py"
    odd.write_text("")
    (run.path / "SHA256SUMS").unlink()
    asked = list[str]()
    with asking(_noting(asked)), pytest.raises(UserError):
        load(f"{run.path / LAW_FILE}:STRANGE")
    (shown,) = asked
    assert len(shown.splitlines()) == 4 and "\x1b" not in shown


def test_what_is_agreed_to_is_what_was_shown(run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Not what is read a moment later: what takes a file's place between is neither loaded nor agreed to."""
    (run.path / "SHA256SUMS").unlink()
    law, check = run.path / LAW_FILE, trust._check_seal

    def swap(*given: Any) -> None:
        check(*given)
        law.write_text("STRANGE = 1\n")

    with asking(lambda shown: True), monkeypatch.context() as meanwhile:
        meanwhile.setattr(trust, "_check_seal", swap)
        with pytest.raises(UserError, match="changed after it was shown"):
            load(f"{law}:STRANGE")
    with pytest.raises(UserError, match="nobody has said"):
        load(f"{law}:STRANGE")
    assert not (tmp_path / MARK).exists()


def test_a_line_of_the_seal_ends_where_a_name_does_not(run: Run) -> None:
    """Whoever reads it: a name may hold what only Python takes for the end of a line."""
    odd = run.path / "code" / "strange" / "a\x0bb\x85c\u2028d\re.txt"
    odd.write_text("data")
    names = [each.relative_to(run.path).as_posix() for each in sorted((run.path / "code").rglob("*")) if each.is_file()]
    write_seal(run.path, {})
    assert set(names) <= set(read_seal(run.path) or ()) and run.problems() == []
    with asking(lambda shown: True):
        law, _ = load(f"{run.path / LAW_FILE}:STRANGE")
    assert law.name == "strange"
