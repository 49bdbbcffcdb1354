"""Load cells are tared and scaled by a weight, told which is silent, and written as a study file."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import ClassVar

import numpy as np
import pytest
import yaml

from tests.cli.conftest import Call
from wristctl.board.emulator import atmega2560 as virtual
from wristctl.board.emulator.atmega2560 import VirtualTransport
from wristctl.cli import hw_weigh
from wristctl.config.hw_run import LoadCells
from wristctl.study_files.load import load_study

GRAVITY = 9.80665
TRUE = LoadCells(counts_per_newton=(80.0, -86.0, 91.0, 85.0), offset=(110.0, -60.0, 20.0, 5.0))


class Emulated(VirtualTransport):
    """A board with amplifiers on the cells in `wired`, on which masses [kg] hang."""

    wired: ClassVar[Sequence[int]] = range(4)
    masses: ClassVar[list[float]] = [0.0] * 4

    def __init__(self) -> None:
        super().__init__()
        for axis in self.wired:
            self.chip.fit_amplifier(axis, True)

    def wait(self, seconds: float) -> None:
        for _ in range(max(1, round(seconds / 0.01))):
            for axis, mass in enumerate(self.masses):
                counts = TRUE.offset[axis] + TRUE.counts_per_newton[axis] * GRAVITY * mass
                self.chip.convert(axis, round(256.0 * counts), self.chip.cycles)
            super().wait(min(seconds, 0.01))


@pytest.fixture(autouse=True)
def emulated(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.setattr(virtual, "VirtualTransport", Emulated)
    monkeypatch.setattr(Emulated, "wired", range(4))
    yield


def hanging(monkeypatch: pytest.MonkeyPatch, masses: Sequence[Sequence[float]]) -> None:
    """At each question these masses are hung up."""
    coming = iter(masses)

    def answered(meanwhile: object) -> str:
        Emulated.masses = list(next(coming))
        return ""

    monkeypatch.setattr(hw_weigh, "typed_line", answered)


NONE = (0.0,) * 4


@pytest.mark.slow
def test_four_cells_are_tared_and_scaled_and_the_study_file_has_what_was_found(
    call: Call, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    hanging(monkeypatch, [NONE, *(2.0 * np.eye(4)).tolist()])
    code, out, err = call("hw", "weigh", "--kg", "2", "--port", "emulated")
    assert code == 0 and "tendon 5" in err
    file = tmp_path / "cells.yaml"
    file.write_text(out)
    study = load_study((file,))
    for cells in (study.hw_run.load_cells, study.calibrate_wrist.load_cells):
        assert cells is not None and cells.rate == 80
        assert cells.offset == pytest.approx(TRUE.offset, abs=0.6)
        assert cells.counts_per_newton == pytest.approx(TRUE.counts_per_newton, rel=1e-3)
    hanging(monkeypatch, [(0.0, 0.0, 0.1, 0.0)])
    code, out, _ = call("hw", "weigh", str(file), "--port", "emulated")
    again = yaml.safe_load(out)["hw-run"]["load_cells"]
    assert code == 0 and tuple(again["counts_per_newton"]) == study.hw_run.load_cells.counts_per_newton  # type: ignore[union-attr]
    assert again["offset"][2] - TRUE.offset[2] == pytest.approx(0.1 * GRAVITY * 91.0, abs=1.0)


@pytest.mark.slow
def test_a_weight_on_another_cell_or_one_that_shows_nothing_is_refused_by_name(
    call: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    hanging(monkeypatch, [NONE, (0.0, 2.0, 0.0, 0.0)])
    code, _, err = call("hw", "weigh", "--kg", "2", "--axis", "0", "--port", "emulated")
    assert code == 2 and "hangs on the load cell of axis 1 (tendon 2)" in err
    hanging(monkeypatch, [NONE, (0.02, 0.0, 0.0, 0.0)])
    code, _, err = call("hw", "weigh", "--kg", "2", "--axis", "0", "--port", "emulated")
    assert code == 2 and "counts on axis 0" in err


@pytest.mark.slow
def test_silent_cells_are_told_left_out_and_keep_what_was_known(call: Call, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Emulated, "wired", (1,))
    hanging(monkeypatch, [NONE, (0.0, 2.0, 0.0, 0.0)])
    code, out, err = call("hw", "weigh", "--kg", "2", "--port", "emulated")
    cells = yaml.safe_load(out)["hw-run"]["load_cells"]
    assert code == 0 and err.count("silent") == 6
    assert cells["counts_per_newton"] == [85.5, pytest.approx(-86.0, rel=1e-3), 85.5, 85.5]
    assert cells["offset"] == [0.0, pytest.approx(-60.0, abs=0.6), 0.0, 0.0]
    monkeypatch.setattr(Emulated, "wired", ())
    hanging(monkeypatch, [NONE])
    code, out, err = call("hw", "weigh", "--port", "emulated")
    assert code == 4 and out == "" and "no load cell answers" in err
