"""Tasks that a newcomer finds the file of by the tree alone: what is kept as the answer is still so."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import yaml

ROOT = Path(__file__).parents[2]
TASKS: list[dict[str, Any]] = yaml.safe_load(Path(__file__).with_name("which_file.yaml").read_text())


@pytest.mark.parametrize("task", TASKS, ids=lambda task: str(task["files"][0]))
def test_the_file_of_a_task_holds_what_it_is_about(task: dict[str, Any]) -> None:
    first, *others = (ROOT / name for name in task["files"])
    assert task["holds"].lower() in first.read_text().lower() and all(other.is_file() for other in others)


def test_twenty_tasks_are_in_as_many_files() -> None:
    assert len(TASKS) == len({task["files"][0] for task in TASKS}) == 20
