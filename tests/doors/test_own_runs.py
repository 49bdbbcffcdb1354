"""Nobody is asked about a run that they sealed on this machine; about anything else that looks like one they are."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.doors.carrier import CARRIED, LAW_FILE, MARK, forged, made
from tests.doors.conftest import wristctl
from wristctl.config.study import Study
from wristctl.errors import UserError
from wristctl.plugins.places import load
from wristctl.plugins.trust import asking
from wristctl.records import Run, start_run
from wristctl.records.archive import pack, unpack
from wristctl.records.seal import write_seal

SECTION = {"controller": CARRIED, "gains": "default"}


@pytest.fixture
def state(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The user's own XDG_STATE_HOME, which nothing has written to."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    return tmp_path / "state"


@pytest.fixture
def own(state: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Run:
    """A run with a law, sealed by this user here; the process that made it has ended."""
    run = made(tmp_path, "simulate", SECTION)
    monkeypatch.setenv("WRISTCTL_TRUSTED_CODE", "")
    return run


def _asks(folder: Path, law: str = LAW_FILE) -> bool:
    """Whether somebody is asked before the law is loaded; says no. UserError where it is refused at once."""
    asked: list[str] = []

    def no(shown: str) -> bool:
        asked.append(shown)
        return False

    try:
        with asking(no):
            load(f"{folder / law}:STRANGE")
    except UserError as error:
        if "nobody has said" not in error.what:
            raise
    return bool(asked)


def _imported(tmp_path: Path) -> bool:
    return (tmp_path / MARK).exists()


def test_ones_own_run_asks_nobody(own: Run, tmp_path: Path) -> None:
    assert not _asks(own.path) and _imported(tmp_path)


def test_ones_own_run_asks_nobody_in_python(own: Run, tmp_path: Path) -> None:
    load(f"{own.path / LAW_FILE}:STRANGE")
    assert _imported(tmp_path)


def test_a_run_is_ones_own_by_what_is_in_it_wherever_it_lies(own: Run, tmp_path: Path) -> None:
    pack(own, tmp_path / "own.zip")
    unpacked = unpack(tmp_path / "own.zip", tmp_path / "other results").run
    assert not _asks(unpacked.path)
    moved = shutil.move(own.path, tmp_path / "archive")
    assert not _asks(Path(moved))


def test_of_another_user_or_machine_it_asks(own: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "their state"))
    assert _asks(own.path) and not _imported(tmp_path)


def _resealed(run: Run) -> None:
    law = run.path / LAW_FILE
    law.write_text(law.read_text() + "\n")
    write_seal(run.path, {})


def _other_settings(run: Run) -> None:
    config = run.path / "config.yaml"
    config.write_text(config.read_text().replace("gains: default", "gains: rig"))


def _shortened(run: Run) -> None:
    seal = run.path / "SHA256SUMS"
    seal.write_text("".join(line for line in seal.read_text().splitlines(keepends=True) if "README" not in line))


TAMPERED: dict[str, Callable[[Run], object]] = {
    "another law, sealed anew": _resealed,
    "another manifest, sealed anew": lambda run: forged(run, lambda manifest: manifest.update(label="mine")),
    "another configuration": _other_settings,
    "no configuration": lambda run: (run.path / "config.yaml").unlink(),
    "no seal": lambda run: (run.path / "SHA256SUMS").unlink(),
    "an empty seal": lambda run: (run.path / "SHA256SUMS").write_text(""),
    "a line less in the seal": _shortened,
}


@pytest.mark.parametrize("what", TAMPERED)
def test_a_run_that_was_changed_asks_whatever_its_name(own: Run, tmp_path: Path, what: str) -> None:
    TAMPERED[what](own)
    assert _asks(own.path) and not _imported(tmp_path)


@pytest.mark.parametrize("file", ["strange.py", "helper.py", "more.py"])
def test_other_code_under_ones_own_seal_is_refused(own: Run, tmp_path: Path, file: str) -> None:
    with (own.path / "code" / "strange" / file).open("a") as source:
        source.write("\n")
    with pytest.raises(UserError, match="not as it was sealed"):
        _asks(own.path)
    assert not _imported(tmp_path)


def test_a_run_within_ones_own_run_asks(own: Run, tmp_path: Path) -> None:
    """Whose seal somebody else has written."""
    shutil.copy(own.path / "run.json", own.path / "code")
    write_seal(own.path / "code", {})
    assert _asks(own.path) and not _imported(tmp_path)


def test_what_is_no_copy_of_code_asks(state: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A sealed file that a run only found or was given, and never ran."""
    run = made(tmp_path, "simulate", SECTION, found="data/found")
    monkeypatch.setenv("WRISTCTL_TRUSTED_CODE", "")
    assert not _asks(run.path)
    (tmp_path / MARK).unlink()
    monkeypatch.setenv("WRISTCTL_TRUSTED_CODE", "")
    assert _asks(run.path, "data/found/helper.py") and not _imported(tmp_path)


def _linked(record: Path) -> None:
    record.rename(record.with_name("elsewhere"))
    record.symlink_to("elsewhere")


def _pipe(record: Path) -> None:
    record.unlink()
    os.mkfifo(record, 0o600)


def _folder(record: Path) -> None:
    record.unlink()
    record.mkdir()


SPOILT: dict[str, Callable[[Path], object]] = {
    "its group writes it": lambda record: record.chmod(0o620),
    "others write it": lambda record: record.chmod(0o602),
    "others write its folder": lambda record: record.parent.chmod(0o777),
    "a group writes a folder above": lambda record: record.parents[1].chmod(0o770),
    "it is a link": _linked,
    "it has another name too": lambda record: os.link(record, record.with_name("other")),
    "it is a pipe": _pipe,
    "it is gone": lambda record: record.unlink(),
    "it is a folder": _folder,
    "it is of another run": lambda record: record.write_text(64 * "0" + "\n"),
    "the hash is within a longer word": lambda record: record.write_text(f"x{record.read_text()}"),
}


@pytest.mark.parametrize("spoilt", SPOILT)
def test_a_record_that_others_could_write_counts_for_nothing(
    own: Run, state: Path, tmp_path: Path, spoilt: str
) -> None:
    SPOILT[spoilt](state / "wristctl" / "own_runs")
    assert _asks(own.path) and not _imported(tmp_path)


def test_a_record_of_another_user_counts_for_nothing(own: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "geteuid", lambda: os.getuid() + 1)
    assert _asks(own.path) and not _imported(tmp_path)


def test_a_link_that_another_user_made_leads_to_no_record(
    own: Run, state: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if os.geteuid() != 0:
        pytest.skip("making another user's link needs root")
    link = tmp_path / "link"
    link.symlink_to(state)
    monkeypatch.setenv("XDG_STATE_HOME", str(link))
    os.lchown(link, 12345, 12345)
    assert _asks(own.path)
    os.lchown(link, 0, 0)
    assert not _asks(own.path)


def test_a_folder_above_in_which_each_has_only_ones_own_will_do(own: Run, tmp_path: Path, state: Path) -> None:
    """As /tmp is."""
    state.chmod(0o1777)
    assert not _asks(own.path)


@pytest.mark.parametrize("home", ["", "."])
def test_the_working_folder_is_no_home(
    own: Run, state: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, home: str
) -> None:
    """What was unpacked there is the user's file, and anybody's content."""
    planted = tmp_path / "unpacked" / ".local" / "state"
    shutil.copytree(state, planted)
    monkeypatch.chdir(tmp_path / "unpacked")
    monkeypatch.setenv("HOME", home)
    for named in ("", ".local/state"):
        monkeypatch.setenv("XDG_STATE_HOME", named)
        assert _asks(own.path) and not _imported(tmp_path)


def test_without_xdg_the_record_is_below_home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("XDG_STATE_HOME", raising=False)
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    (tmp_path / "home").mkdir()
    run = made(tmp_path, "simulate", SECTION)
    monkeypatch.setenv("WRISTCTL_TRUSTED_CODE", "")
    assert not _asks(run.path) and (tmp_path / "home/.local/state/wristctl/own_runs").is_file()


def test_nobody_else_can_write_what_is_made(state: Path, tmp_path: Path) -> None:
    before = os.umask(0)
    try:
        made(tmp_path, "simulate", SECTION)
    finally:
        os.umask(before)
    for path, mode in ((state, 0o700), (state / "wristctl", 0o700), (state / "wristctl" / "own_runs", 0o600)):
        assert path.stat().st_mode & 0o777 == mode, path


@pytest.mark.parametrize("way", ["a file", "others write"])
def test_a_run_that_cannot_be_recorded_is_sealed_all_the_same(state: Path, tmp_path: Path, way: str) -> None:
    if way == "a file":
        state.write_text("")
    else:
        state.mkdir()
        state.chmod(0o777)
    run = made(tmp_path, "simulate", SECTION)
    os.environ["WRISTCTL_TRUSTED_CODE"] = ""
    assert run.state == "ok" and run.problems() == [] and _asks(run.path)
    record = state / "wristctl" / "own_runs"
    assert way == "a file" or record.read_bytes() == b""


def test_runs_without_code_of_their_own_are_not_recorded(state: Path, tmp_path: Path) -> None:
    with start_run("tune", Study(), "", tmp_path / "results"):
        pass
    assert not state.exists()


@pytest.mark.slow
def test_minutes_later_nobody_is_asked_and_anybody_else_is(
    state: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert wristctl(tmp_path, "new", "controller", "mine").returncode == 0
    controller = ("--controller", "mine.py:MINE", "--set", "horizon=0.3", "--set", "loop.plant_segments=1")
    simulated = wristctl(tmp_path, "simulate", *controller)
    assert simulated.returncode == 0, simulated.stderr
    run = Path(simulated.stdout.splitlines()[-1]).name
    calls = (
        ("runs", "figures", run, "--format", "svg"),
        ("runs", "report", run, "--all-figures"),
        ("runs", "replay", run),
        ("simulate", "-c", f"results/{run}/config.yaml", "--dry-run"),
        ("check-controller", f"results/{run}/code/mine/mine.py:MINE", "--no-board"),
    )
    for typed in calls:
        done = wristctl(tmp_path, *typed)
        assert done.returncode == 0 and "carries code" not in done.stderr, (typed, done.stderr)
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "their state"))
    for typed in calls:
        done = wristctl(tmp_path, *typed)
        assert done.returncode == 2 and "nobody has said that it may run" in done.stderr, (typed, done.stderr)
    assert json.loads((tmp_path / "results" / run / "run.json").read_text())["code"]["foreign"]
