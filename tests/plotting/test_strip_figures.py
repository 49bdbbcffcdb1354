"""The audit's pictures: bars as wide as shares, marks where the ratios are."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from matplotlib.patches import Rectangle

from wristctl.commands.audit.figures import ours_over_the_papers, shares, strip
from wristctl.comparison.claims import Judgement
from wristctl.comparison.paper import FACTOR
from wristctl.comparison.robust import Leaf, Strip, Threshold
from wristctl.comparison.verdicts import Finding
from wristctl.config.audit import Claim, VerdictName

CLAIM = Claim(
    id="T", says="so", evidence="comparison", value=2.0, controller="smc", gains="printed", metric="rmse", unit="rad"
)
VERDICTS: list[VerdictName] = ["reproduced", "better than the paper", "worse than the paper", "worse than the paper"]
STRIP = Strip(
    CLAIM,
    np.array([1.0, 0.1, 9.0, np.nan]),
    VERDICTS,
    [Leaf("limit", 0.5)],
    Threshold(50.0, 45.0, 55.0, 0.5, 0.0),
    "limit",
)


def test_bars_are_as_wide_as_the_shares() -> None:
    (panel,) = shares([STRIP], "over the box").axes
    widths = [patch.get_width() for patch in panel.patches]  # type: ignore[attr-defined]
    assert widths == pytest.approx([0.25, 0.25, 0.5])
    assert "25.0 %" in [text.get_text() for text in panel.texts]


def test_every_draw_stands_at_its_ratio_and_what_fails_at_the_edge() -> None:
    (panel,) = strip(STRIP, [20.0, 40.0, 60.0, np.inf], "N").axes
    lines = panel.lines[:3]
    marks = np.concatenate([np.asarray(line.get_xydata(), float) for line in lines]).tolist()
    assert [y for _, y in marks] == [1.0, 0.1, 9.0, 1e4]
    assert marks[0][0] == pytest.approx(20.0, rel=0.1), "few values are spread a little"
    assert marks[3][0] > 60.0 and "none" in [text.get_text() for text in panel.texts]
    assert panel.get_xlabel() == "limit [N]"


def test_the_ledgers_ranges_are_ratios_to_the_papers_number() -> None:
    judged = Judgement(
        CLAIM, {"exact": Finding("reproduced", 1.0, 4.0), "four-segments": Finding("worse than the paper")}
    )
    (panel,) = ours_over_the_papers([judged]).axes
    assert [np.asarray(line.get_xdata(), float).tolist() for line in panel.lines] == [[0.5, 2.0], [1e5, 1e5]]


def test_the_band_is_as_wide_below_the_papers_number_as_above() -> None:
    judged = Judgement(CLAIM, {"exact": Finding("reproduced", 1.0, 4.0)})
    (drawn,), (ledger,) = strip(STRIP, [20.0, 40.0, 60.0, np.inf], "N").axes, ours_over_the_papers([judged]).axes
    (across,), (along,) = drawn.patches, ledger.patches
    assert isinstance(across, Rectangle) and isinstance(along, Rectangle)
    for begin, size in ((across.get_y(), across.get_height()), (along.get_x(), along.get_width())):
        assert begin * (begin + size) == pytest.approx(1.0) and begin + size == pytest.approx(FACTOR)


def test_what_stands_beside_the_bars_is_within_the_figure() -> None:
    told = "46 % where wrist.tension_limit < 21.1, 81 % above, 94 % where there is none"
    long = dataclasses.replace(STRIP, claim=CLAIM.model_copy(update={"id": "O-steady-state-smc-pid"}), told=told)
    made = shares([long] * 12, "over the box")
    made.draw_without_rendering()
    whole = made.bbox
    boxes = [text.get_window_extent() for text in made.axes[0].texts]
    assert len(boxes) == 2 * 12 + 2 and max(box.x1 for box in boxes) <= whole.x1 and min(box.x0 for box in boxes) > 0.0
