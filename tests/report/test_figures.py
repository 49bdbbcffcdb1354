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


def test_every_axis_of_numbers_has_a_label_with_its_unit(drawn: Figure) -> None:
    shared = {"x": drawn.get_supxlabel(), "y": drawn.get_supylabel()}
    for axes in drawn.axes:
        for axis in (axes.xaxis, axes.yaxis):
            if tick_labels(axis) and not isinstance(axis.get_major_locator(), FixedLocator):
                label = axis.label.get_text() or shared[axis.axis_name]
                assert label == "iteration" or "[" in label, f"{axis.axis_name} axis: {label!r}"


def test_an_axis_with_a_label_has_its_numbers(drawn: Figure) -> None:
    for axes in drawn.axes:
        for axis in (axes.xaxis, axes.yaxis):
            assert tick_labels(axis) or not axis.label.get_text(), axis.label.get_text()


def test_no_text_is_cut(drawn: Figure) -> None:
    for text in texts(drawn):
        box = extent(text)
        assert box.x0 >= 0 and box.y0 >= 0, text.get_text()
        assert box.x1 <= drawn.bbox.x1 and box.y1 <= drawn.bbox.y1, text.get_text()


def test_no_text_lies_on_another(drawn: Figure) -> None:
    for one, other in itertools.combinations(texts(drawn), 2):
        assert not extent(one).overlaps(extent(other)), f"{one.get_text()!r} on {other.get_text()!r}"


def test_text_is_large_enough_to_read(drawn: Figure) -> None:
    assert min(float(text.get_fontsize()) for text in texts(drawn)) >= 7.0


@pytest.mark.parametrize("make", ["errors, log", "rmse map", "directions", "stroboscope"], indirect=True)
def test_figure_has_the_same_bytes_when_drawn_again(make: Callable[[], Figure], tmp_path: Path) -> None:
    for folder in ("first", "second"):
        (tmp_path / folder).mkdir()
        write_figure(tmp_path / folder / "figure", make())
    for suffix in ("png", "svg"):
        first, second = ((tmp_path / folder / f"figure.{suffix}").read_bytes() for folder in ("first", "second"))
        assert first == second


def test_drawing_leaves_no_figure_open(drawn: Figure) -> None:
    assert not Gcf.get_all_fig_managers()
