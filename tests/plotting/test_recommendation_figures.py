"""Figures of a recommendation, by their marks and words."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg

from wristctl.commands.recommend.answer import Limit
from wristctl.commands.recommend.figures import limits


@pytest.mark.parametrize("lost", [(1, 0, 2), (0, 3, 1), (12, 12, 12)])
def test_words_on_lost_rigs_stand_beside_a_line_that_rises(lost: tuple[int, int, int]) -> None:
    """Left of the marker above the line that comes to it; at the first, right of it below the line that leaves it."""
    tried = [Limit(0.2 + 0.4 * k, 12, each, math.radians(0.3 * 2.0**k), 0.0) for k, each in enumerate(lost)]
    result: Any = SimpleNamespace(motions=tried, payloads=tried, bending="")
    figure = limits(result)
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    for axes in figure.axes:
        told = {text.get_text(): text for text in axes.texts}
        assert len(axes.texts) == sum(map(bool, lost)) and all(f"{each} of 12 lost" in told for each in lost if each)
        places = [k for k, each in enumerate(lost) if each]
        for text, k in zip(axes.texts, places, strict=True):
            box = text.get_window_extent(canvas.get_renderer())
            x, y = axes.transData.transform((tried[k].value, math.degrees(tried[k].error)))
            assert (box.x0 > x and box.y1 < y) if k == 0 else (box.x1 < x and box.y0 > y)
