"""Whatever happens to a sealed file is found and named."""

from __future__ import annotations

import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from wristctl.records import Run

Make = Callable[..., Run]


def test_a_flipped_byte_in_any_file_is_found_and_named(make: Make) -> None:
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
            assert run.problems() == [(name, "hash does not match what was sealed")]
        file.write_bytes(whole)
    assert run.problems() == []


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


def test_the_sums_themselves_cannot_hide_a_change(make: Make, tmp_path: Path) -> None:
    run = make()
    sums = run.path / "SHA256SUMS"
    whole = sums.read_bytes()
    for at in range(0, len(whole), 97):
        sums.write_bytes(whole[:at] + bytes([whole[at] ^ 1]) + whole[at + 1 :])
        assert run.problems(), f"byte {at}"
