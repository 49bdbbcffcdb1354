"""Files that `identify` is given and that hold too little, and the figure of what it predicts."""

from __future__ import annotations

from pathlib import Path

import pytest

import wristctl
from wristctl.errors import UserError

HEADER = "time [s],bend_y [deg],spool_1 [mm],spool_2 [mm]"


@pytest.mark.parametrize("model", ["arcs", "wrist", "hysteresis"])
@pytest.mark.parametrize("text", [HEADER, HEADER + "\n"])
def test_a_header_without_samples_is_refused_as_that(tmp_path: Path, model: str, text: str) -> None:
    file = tmp_path / "headonly.csv"
    file.write_text(text)
    with pytest.raises(UserError, match=r"a header, and no samples below it - .*headonly\.csv:1 - "):
        wristctl.identify(runs=str(file), model=model)  # type: ignore[arg-type]


def test_too_few_samples_are_counted_by_what_they_have(tmp_path: Path) -> None:
    file = tmp_path / "short.csv"
    file.write_text("\n".join([HEADER, *(f"{0.01 * k},{k},{0.3 * k},{-0.3 * k}" for k in range(9))]))
    with pytest.raises(UserError, match=r"9 samples of trial short have spools and motion - .*20 or more"):
        wristctl.identify(runs=str(file))
