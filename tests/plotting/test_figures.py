"""What holds for every figure: units, nothing cut, no overlaps, the same bytes twice."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from pathlib import Path

import pytest
from matplotlib._pylab_helpers import Gcf
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.text import Annotation, Text
from matplotlib.ticker import FixedLocator
from matplotlib.transforms import Bbox

from wristctl.plotting.style import fit, for_paper
from wristctl.records.formats import write_figure


def tick_labels(axis: Axis) -> list[Text]:
    """Tick labels that are seen."""
    low, high = sorted(axis.get_view_interval())
    ticks = [*axis.get_major_ticks(), *axis.get_minor_ticks()]
    room = 1e-9 * (high - low)
    seen = [tick for tick in ticks if low - room <= tick.get_loc() <= high + room and tick.get_visible()]
    labels = [label for tick in seen for label in (tick.label1, tick.label2)]  # the second on a colour bar
    return [label for label in labels if label.get_visible() and label.get_text()]


def texts(figure: Figure) -> list[Text]:
    """Every text that is seen."""
    axes = figure.axes
    ticks = [label for each in axes for axis in (each.xaxis, each.yaxis) for label in tick_labels(axis)]
    own = {id(text) for each in axes for axis in (each.xaxis, each.yaxis) for text in axis.findobj(Text)}
    own -= {id(axis.label) for each in axes for axis in (each.xaxis, each.yaxis)}
    others = [text for text in figure.findobj(Text) if id(text) not in own and not isinstance(text, Annotation)]
    return [text for text in [*ticks, *others] if text.get_visible() and text.get_text().strip()]


def extent(text: Text) -> Bbox:
    return text.get_window_extent().padded(-1.0)


@pytest.mark.slow
def test_every_axis_of_numbers_has_a_label_with_its_unit_and_one_with_a_label_has_numbers(drawn: Figure) -> None:
    shared = {"x": drawn.get_supxlabel(), "y": drawn.get_supylabel()}
    for axes in drawn.axes:
        for axis in (axes.xaxis, axes.yaxis):
            numbers, label = tick_labels(axis), axis.label.get_text()
            if numbers and not isinstance(axis.get_major_locator(), FixedLocator):
                said = label or shared[axis.axis_name]
                assert said == "iteration" or "[" in said, f"{axis.axis_name} axis: {said!r}"
            assert numbers or not label, label


def test_no_text_is_cut_or_lies_on_another_or_is_too_small_to_read(drawn: Figure) -> None:
    assert_in_its_place(drawn, 7.0)
    assert not Gcf.get_all_fig_managers(), "drawing leaves no figure open"


@pytest.mark.slow
def test_in_a_column_of_88_mm_no_text_is_cut_or_lies_on_another(make: Callable[[], Figure]) -> None:
    with for_paper(88.0 / 25.4):
        made = make()
        fit(made)
        made.draw_without_rendering()
        assert_in_its_place(made, 5.0)


def assert_in_its_place(drawn: Figure, smallest: float) -> None:
    """Every text within the figure, beside all others, and of at least the smallest size [pt]."""
    shown = texts(drawn)
    boxes = [extent(text) for text in shown]
    for text, box in zip(shown, boxes, strict=True):
        assert box.x0 >= 0 and box.y0 >= 0, text.get_text()
        assert box.x1 <= drawn.bbox.x1 and box.y1 <= drawn.bbox.y1, text.get_text()
        assert float(text.get_fontsize()) >= smallest, text.get_text()
    for one, other in itertools.combinations(range(len(shown)), 2):
        assert not boxes[one].overlaps(boxes[other]), f"{shown[one].get_text()!r} on {shown[other].get_text()!r}"


@pytest.mark.parametrize("make", ["errors, log", "rmse map", "directions", "stroboscope"], indirect=True)
@pytest.mark.slow
@pytest.mark.painted
def test_figure_has_the_same_bytes_when_drawn_again(make: Callable[[], Figure], tmp_path: Path) -> None:
    for folder in ("first", "second"):
        (tmp_path / folder).mkdir()
        write_figure(tmp_path / folder / "figure", make())
    for suffix in ("png", "svg"):
        first, second = ((tmp_path / folder / f"figure.{suffix}").read_bytes() for folder in ("first", "second"))
        assert first == second
