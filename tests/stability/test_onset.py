"""The simulated loop begins to oscillate where its linearisation says; docs/loop_analysis.py tries all of it."""

from __future__ import annotations

from types import ModuleType

import numpy as np
import pytest

from tests.documented import DOCS, script_of_docs


@pytest.fixture(scope="module")
def measured() -> ModuleType:
    """docs/loop_analysis.py"""
    return script_of_docs("loop_analysis")


@pytest.mark.parametrize("number", [0, 3])
@pytest.mark.slow
def test_a_loop_rests_within_its_margins_and_swings_beyond(measured: ModuleType, number: int) -> None:
    """An ideal loop, and one with lagged motors behind a camera, 15 % on either side; delays by whole periods."""
    judged = measured.ROWS[number]
    found, still, period = judged.row.analysed(0.0), measured.STILL, judged.loop.control_period
    assert found is not None and found.margins.stable
    factors = found.margins.most.value * np.array([0.85, 1.15])
    rests, swings = measured.swings(judged, 1.0, factors, np.zeros(2))
    assert rests <= still < swings
    ticks = np.array([np.floor(found.margins.delay / period * 0.95), np.ceil(found.margins.delay / period * 1.05)])
    rests, swings = measured.swings(judged, 1.0, np.ones(2), ticks * period)
    assert rests <= still < swings


@pytest.mark.slow
def test_an_ideal_loop_begins_to_oscillate_within_a_few_percent_of_its_limit(measured: ModuleType) -> None:
    """Simulated finely: by the step of 1 ms that its period has, the limit would be 11 % lower."""
    judged = measured.ROWS[0]
    found, still = judged.row.analysed(0.0), measured.STILL
    assert found is not None
    rests, swings = measured.swings(judged, 1.0, found.margins.most.value * np.array([0.97, 1.03]), np.zeros(2))
    assert rests <= still < swings


def test_the_page_is_of_the_rows_that_the_script_has(measured: ModuleType) -> None:
    page = (DOCS / "loop_analysis.md").read_text(encoding="utf-8")
    for each in measured.ROWS:
        assert each.label.replace(" | ", ", ") in page
    assert "| **" in page and "images/loop-analysis.png" in page and (DOCS / "images/loop-analysis.png").is_file()
