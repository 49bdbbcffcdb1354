"""Checkpoints: read back as written, refused where they are another's, and a full disk is the disk's fault."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
import torch

from wristctl.errors import UserError
from wristctl.learning.training import read_checkpoint, write_checkpoint


def test_a_checkpoint_reads_back_and_only_for_its_own_training(tmp_path: Path) -> None:
    file = tmp_path / "run/checkpoints/0.pt"
    write_checkpoint(file, "mark", {"weights": torch.arange(3.0), "epoch": 7})
    state = read_checkpoint(file, "mark")
    assert state["epoch"] == 7 and torch.equal(state["weights"], torch.arange(3.0))
    with pytest.raises(UserError, match="other settings, data or seed"):
        read_checkpoint(file, "another")
    file.write_bytes(file.read_bytes()[:-40])
    with pytest.raises(UserError, match="not a readable checkpoint"):
        read_checkpoint(file, "mark")


def test_a_full_disk_is_no_bug_and_leaves_the_earlier_checkpoint(small_disk: Callable[[int], Path]) -> None:
    file = small_disk(1) / "0.pt"
    write_checkpoint(file, "mark", {"epoch": 1})
    with pytest.raises(UserError, match="No space left on device"):
        write_checkpoint(file, "mark", {"weights": torch.zeros(10**6)})
    assert read_checkpoint(file, "mark") == {"epoch": 1}
    assert [each.name for each in file.parent.iterdir()] == ["0.pt"]
