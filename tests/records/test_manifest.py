"""What a run notes of itself, its machine and its times, and where it puts it."""

from __future__ import annotations

import errno
import os
import re
import time
from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from wristctl.config.study import Study
from wristctl.errors import UserError
from wristctl.records import InputRun, Run, start_run
from wristctl.records.files import files_below, sha256_of_list
from wristctl.records.manifest import Code
from wristctl.records.run_writer import readme
from wristctl.records.tags import change_tags
from wristctl.study_files.keys import command_of
from wristctl.study_files.resolved import config_hash

Make = Callable[..., Run]


def test_a_directory_is_named_by_time_kind_label_and_configuration(make: Make) -> None:
    run = make("train", label="quick.2_b-c")
    stamp, rest = run.id.split("-", 1)
    started = datetime.fromisoformat(run.manifest.timing.started)
    assert re.fullmatch(r"\d{8}T\d{6}Z", stamp) and started.utcoffset() == timedelta()
    named = datetime.strptime(stamp, "%Y%m%dT%H%M%SZ").replace(tzinfo=UTC)
    assert timedelta() <= started - named < timedelta(days=1)
    assert rest == f"train-quick.2_b-c-{config_hash(Study(), 'train')[:6]}"
    assert make("train").id.split("-", 1)[1] == f"train-{config_hash(Study(), 'train')[:6]}"


@pytest.mark.parametrize(("label", "taken"), [("a" * 60, True), ("a" * 61, False), ("a b", False), ("ä", False)])
def test_a_label_has_at_most_sixty_plain_characters(make: Make, label: str, taken: bool) -> None:
    if taken:
        assert label in make(label=label).id
    else:
        with pytest.raises(UserError, match="a label holds letters, digits, dots, dashes and underscores"):
            make(label=label)


def test_times_are_in_seconds_and_memory_in_megabytes(results: Path) -> None:
    with start_run("tune", Study(), "", results) as live:
        time.sleep(0.02)
    timing = Run(live.path).manifest.timing
    assert timing.ended is not None and timing.wall_s is not None and timing.cpu_s is not None
    elapsed = datetime.fromisoformat(timing.ended) - datetime.fromisoformat(timing.started)
    assert 0.02 <= timing.wall_s <= elapsed.total_seconds() + 1.0
    assert 0.0 < timing.cpu_s <= time.process_time()
    status = Path("/proc/self/status")
    if status.exists():
        peak = int(re.findall(r"VmHWM:\s+(\d+) kB", status.read_text())[0]) / 1024
        assert timing.max_rss_mb is not None and 10.0 < timing.max_rss_mb <= 1.01 * peak


def test_limits_on_threads_are_noted(results: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("OMP_NUM_THREADS", "3")
    with start_run("tune", Study(), "", results) as live:
        pass
    assert Run(live.path).manifest.environment.threads == {"OMP_NUM_THREADS": "3"}


@pytest.mark.parametrize(
    ("number", "said"),
    [
        (errno.ENOSPC, "cannot write: No space left on device - there - fix: free space or choose another --out"),
        (errno.EDQUOT, "cannot write: Disk quota exceeded - there - fix: free space or choose another --out"),
        (errno.EROFS, "cannot write: Read-only file system - there - fix: choose a folder you can write to with --out"),
        (errno.EFBIG, "cannot write: File too large - there - fix: raise the limit on files"),
        (errno.EIO, "the system refuses: Input/output error - there - fix: check the disk"),
        (errno.EMFILE, "the system refuses: Too many open files - there - fix: raise the limit on open files"),
        (errno.ENOLCK, "the system refuses: No locks available - there - fix: choose a folder"),
    ],
)
def test_what_the_disk_or_the_system_refuses_is_an_error_of_the_user(results: Path, number: int, said: str) -> None:
    with pytest.raises(UserError, match=re.escape(said)), start_run("tune", Study(), "", results) as live:
        raise OSError(number, os.strerror(number), "there")
    assert Run(live.path).state == "failed"


def test_any_other_error_of_a_file_is_no_matter_of_the_disk(results: Path) -> None:
    with pytest.raises(FileNotFoundError), start_run("tune", Study(), "", results) as live:
        raise FileNotFoundError(errno.ENOENT, "No such file", "there")
    error = Run(live.path).manifest.error
    assert error is not None and error.type == "FileNotFoundError"


def test_hidden_files_are_no_part_of_a_run_and_told_of(make: Make) -> None:
    run = make()
    for name in (".lock", "data/.x.part", ".cache/file"):
        (run.path / name).parent.mkdir(exist_ok=True)
        (run.path / name).write_text("left")
    assert not any(part.startswith(".") for name in files_below(run.path) for part in name.split("/"))
    assert run.problems() == [(name, "file was added after sealing") for name in (".cache/file", "data/.x.part")]


def test_an_added_file_is_no_reason_to_refuse_a_run(make: Make) -> None:
    run = make()
    (run.path / "notes.txt").write_text("the third one was best")
    run.check()


def test_a_hash_over_files_does_not_depend_on_their_order() -> None:
    pairs = [("b", "2"), ("a", "1"), ("c", "3")]
    assert (
        sha256_of_list(pairs) == sha256_of_list(sorted(pairs)) != sha256_of_list([("a", "2"), ("b", "1"), ("c", "3")])
    )


@pytest.mark.parametrize(
    ("kind", "command"),
    [("calibrate-camera", "hw calibrate camera"), ("calibrate-wrist", "hw calibrate wrist"), ("hw-run", "hw-run")],
)
def test_a_readme_says_how_to_make_the_run_again(make: Make, kind: str, command: str) -> None:
    run = make(kind)
    assert command_of(kind) == command
    assert f"`wristctl {command} --config {run.id}/config.yaml`" in run.file("README.md").read_text()


def test_a_readme_says_what_was_read_changed_and_went_wrong(make: Make, results: Path) -> None:
    data = make()
    with (
        pytest.raises(UserError),
        start_run("train", Study(seed=4), "", results, inputs=[InputRun("data", data)]) as live,
    ):
        live.summary("in words")
        raise UserError("the wrist buckles", "wrist.hand_mass")
    run = Run(live.path)
    text = run.file("README.md").read_text()
    assert f"Input `data`: gen-data run {data.id} (result {data.result_hash[:12]})." in text
    assert "failed" in text and "seed 4" in text and "Error: the wrist buckles wrist.hand_mass" in text
    assert "## Result\n\nin words" in text and f"result hash: `{run.result_hash}`" in text
    manifest = run.manifest
    for dirty in (False, True):
        manifest.code = Code(version="1", dirty=dirty, tree_sha256="t")
        assert ("uncommitted changes: `code.patch`" in readme(manifest, "")) == dirty


def test_tags_are_added_and_taken_away_at_once(make: Make, results: Path) -> None:
    run = make()
    assert change_tags(results, run.id, ["a", "b"]) == ["a", "b"]
    assert change_tags(results, run.id, ["c", "b"], ["a", "b"]) == ["c"], "what is taken away is gone"
    assert change_tags(results, run.id, [], ["c"]) == []
