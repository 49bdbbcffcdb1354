"""Whatever happens to a sealed file is found and named."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from wristctl.config.study import Study
from wristctl.errors import UserError
from wristctl.records import InputRun, Run, open_run, require, start_run
from wristctl.records.find import entries
from wristctl.records.lineage import ancestry
from wristctl.records.replay import changed_inputs
from wristctl.records.seal import write_seal

Make = Callable[..., Run]
CHANGED = "hash does not match what was sealed"


def _flips(file: Path) -> Iterator[tuple[int, int]]:
    """Flip each bit of a file, one at a time: which byte, which bit of it. The content is put back after each."""
    content = file.read_bytes()
    handle = os.open(file, os.O_WRONLY)
    for at, byte in enumerate(content):
        for bit in range(8):
            os.pwrite(handle, bytes([byte ^ 1 << bit]), at)
            yield at, bit
        os.pwrite(handle, bytes([byte]), at)
    os.close(handle)


def _little(run: Run) -> Run:
    """The run sealed anew with no more than it must have, most of it short: it is hashed again and again."""
    for name in ("README.md", "report.html", "events.jsonl", "console.log"):
        (run.path / name).unlink(missing_ok=True)
    for name in ("config.yaml", "environment.txt", "code.txt"):
        (run.path / name).write_text("short\n")
    write_seal(run.path, {})
    assert run.problems() == []
    return run


@pytest.fixture(params=["made now", "made by an earlier version"])
def lone_manifest(request: pytest.FixtureRequest, earlier: Path, results: Path) -> Run:
    """A run that is little but its manifest."""
    if request.param == "made now":
        with start_run("gen-data", Study(), "", results, ["wristctl", "gen-data"]) as live:
            live.metric("rmse", 1 / 3)
        return _little(Run(live.path))
    (old,) = earlier.glob("*-calibrate-wrist-*")
    shutil.copytree(old, results / old.name)
    return _little(Run(results / old.name))


@pytest.mark.slow
def test_every_flipped_bit_of_a_manifest_is_refused_in_the_same_words(lone_manifest: Run) -> None:
    run, kind, manifest = lone_manifest, lone_manifest.kind, lone_manifest.path / "run.json"
    ways: tuple[Callable[[], object], ...] = (run.check, lambda: require(run.path, kind))
    for at, bit in _flips(manifest):
        for way in ways:
            try:
                way()
            except UserError as error:
                assert (error.what, error.where) == (CHANGED, str(manifest)), (at, bit)
            else:
                pytest.fail(f"bit {bit} of byte {at} was not noticed")
        if bit == at % 8:
            assert run.problems() == [("run.json", CHANGED)], (at, bit)
    run.check()


@pytest.mark.parametrize(
    ("before", "after"),
    [('"kind": "gen-data"', '"kind": "gen-dat`"'), ('"state": "ok"', '"state": "oj"'), ("{", "z"), ("tip", "tap")],
    ids=["kind", "state", "no JSON", "a word in a table"],
)
def test_a_changed_manifest_is_named_by_whoever_reads_the_run(
    make: Make, results: Path, before: str, after: str
) -> None:
    run, other = make(label="data"), make("train")
    with start_run("tune", run.config, "", results, inputs=[InputRun("network", run)]) as live:
        pass
    manifest = run.path / "run.json"
    manifest.write_text(manifest.read_text().replace(before, after, 1))
    beginning = run.id[: run.id.index("data-data") + 7]
    for ref in (run.path, manifest, run.id, beginning, "latest:gen-data"):
        for kind in ("gen-data", "train", None):
            with pytest.raises(UserError) as caught:
                require(ref, kind, results)
            assert (caught.value.what, caught.value.where) == (CHANGED, str(manifest)), (ref, kind)
    assert open_run(run.id, results).state == "broken"
    assert [each.note for each in entries(results) if each.state == "broken"] == [f"run.json: {CHANGED}"]
    assert changed_inputs(Run(live.path)) == [f"input: network: {CHANGED} ({manifest})"]
    assert [each.state for each in ancestry(Run(live.path)).inputs] == ["broken"]
    assert open_run("latest:train", results).path == other.path, "the latest of another kind is as good as ever"
    other.check()


def test_no_older_run_stands_in_for_the_latest_whose_manifest_was_changed(make: Make, results: Path) -> None:
    older, latest = make(label="a"), make(label="b")
    (latest.path / "run.json").write_text(latest.file("run.json").read_text().replace("1.", "2.", 1))
    with pytest.raises(UserError, match=CHANGED):
        require("latest:gen-data", "gen-data", results)
    (latest.path / "run.json").unlink()
    with pytest.raises(UserError, match=r"sealed file is missing.*run\.json"):
        require("latest:gen-data", "gen-data", results)
    (latest.path / "SHA256SUMS").unlink()
    assert require("latest:gen-data", "gen-data", results).path == older.path, "never sealed: it never ended"


def test_a_run_that_ends_while_it_is_read_is_not_taken_for_a_changed_one(
    results: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with ExitStack() as going_on:
        live = going_on.enter_context(start_run("tune", Study(), "", results))
        read = Path.read_bytes

        def read_and_end(path: Path) -> bytes:
            content = read(path)
            if path.name == "run.json":
                going_on.close()
            return content

        monkeypatch.setattr(Path, "read_bytes", read_and_end)
        assert Run(live.path).manifest.state == "running"
    assert Run(live.path).state == "ok"


def test_a_flipped_bit_in_any_file_is_found_and_named(make: Make) -> None:
    run = make()
    names = [line.split("  ")[1] for line in run.file("SHA256SUMS").read_text().splitlines()]
    assert {"data/samples.csv", "metrics.json", "run.json", "config.yaml"} <= set(names)
    for name in names:
        file = run.path / name
        whole = file.read_bytes()
        if not whole:
            continue
        for at in (0, len(whole) // 2, len(whole) - 1):
            file.write_bytes(whole[:at] + bytes([whole[at] ^ 1]) + whole[at + 1 :])
            assert run.problems() == [(name, CHANGED)]
            with pytest.raises(UserError) as caught:
                run.check()
            assert (caught.value.what, caught.value.where) == (CHANGED, str(file))
        file.write_bytes(whole)
    assert run.problems() == []


def test_a_changed_file_is_to_be_restored_or_made_again(make: Make) -> None:
    run = make("calibrate-camera")
    run.file("metrics.json").write_text("{}")
    with pytest.raises(UserError) as caught:
        run.check()
    assert caught.value.fix == "restore it or run `wristctl hw calibrate camera` again"
    run.file("run.json").write_text("{}")
    with pytest.raises(UserError) as caught:
        run.check()
    assert caught.value.fix == "restore it or name another run", "what command made it cannot be known"


def test_missing_and_added_files_are_named(make: Make) -> None:
    run = make()
    (run.path / "data" / "samples.csv").unlink()
    (run.path / "data" / "other.csv").write_text("x\n")
    found = dict(run.problems())
    assert found["data/samples.csv"] == "sealed file is missing"
    assert found["data/other.csv"] == "file was added after sealing"


@pytest.mark.parametrize("flip", [False, True])
def test_sha256sum_says_the_same(make: Make, flip: bool) -> None:
    run = make()
    if flip:
        (run.path / "metrics.json").write_text("{}")
    done = subprocess.run(["sha256sum", "--quiet", "-c", "SHA256SUMS"], cwd=run.path, capture_output=True, text=True)
    assert (done.returncode != 0) == flip == ("metrics.json" in done.stdout)


@pytest.mark.slow
def test_no_flipped_bit_of_the_sums_goes_unnoticed(make: Make) -> None:
    run = _little(make())
    for at, bit in _flips(run.path / "SHA256SUMS"):
        assert run.problems(), (at, bit)
    assert run.problems() == []
