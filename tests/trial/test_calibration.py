"""A rig's calibration comes back from its file as it was, and holds as long as the board has not moved."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from tests.trial.rig import RigBoard
from wristctl.board.board_errors import BoardError
from wristctl.errors import UserError
from wristctl.trial.calibration import WristCalibration
from wristctl.trial.homing import Zero

KNOWN = WristCalibration(
    Zero((1, -1, 1, 1), (900.0, 910.0, 920.0, 930.0), (0.07,), (1e-4, 2e-4, 3e-4, 4e-4)), "flexion", 7, (1, 2, 3, 4)
)


def run_with(tmp_path: Path, said: dict[str, Any]) -> Any:
    (tmp_path / "wrist.json").write_text(json.dumps(said))
    return SimpleNamespace(file=lambda name: tmp_path / Path(name).name)


def test_it_reads_back_as_it_was_kept(tmp_path: Path) -> None:
    assert WristCalibration.load(run_with(tmp_path, KNOWN.plain())) == KNOWN
    assert KNOWN.plain()["schema"] == "wristctl.wrist/1"


def test_one_of_two_planes_keeps_both_cameras_and_every_direction(tmp_path: Path) -> None:
    zero = Zero((1, 1, 1, -1), (900.0,) * 4, (0.07, -0.02), (1e-4,) * 4, (1e-5,) * 4, (-2.3, 2.3, -0.8, 0.8))
    both = dataclasses.replace(KNOWN, zero=zero)
    read = WristCalibration.load(run_with(tmp_path, json.loads(json.dumps(both.plain()))))
    assert read == both and read.zero.markers == (0.07, -0.02)
    assert KNOWN.zero.markers == (0.07,)


@pytest.mark.parametrize("change", [{"schema": "another/1"}, {"signs": None}, {"marker": "much"}])
def test_a_file_that_is_none_is_said(tmp_path: Path, change: dict[str, Any]) -> None:
    with pytest.raises(UserError, match="not a wrist calibration"):
        WristCalibration.load(run_with(tmp_path, KNOWN.plain() | change))


def test_its_positions_are_taken_up_where_the_board_still_stands_there() -> None:
    board: Any = RigBoard((1, 2, 3, 4))
    KNOWN.restore(board)
    assert board.told == [("home", (1, 2, 3, 4))]


def test_positions_of_a_board_that_moved_or_restarted_are_refused() -> None:
    moved: Any = RigBoard((1, 2, 3, 5))
    with pytest.raises(BoardError, match=r"left the motors at \(1, 2, 3, 4\), the board says \(1, 2, 3, 5\)"):
        KNOWN.restore(moved)
    restarted: Any = RigBoard((1, 2, 3, 4))
    restarted.hello = SimpleNamespace(boot_nonce=8)
    with pytest.raises(BoardError, match="restarted since"):
        KNOWN.restore(restarted)
    assert not moved.told and not restarted.told


def test_a_calibration_cannot_be_changed() -> None:
    for thing, name in ((KNOWN, "plane"), (KNOWN.zero, "marker")):
        with pytest.raises(dataclasses.FrozenInstanceError):
            setattr(thing, name, 0)
