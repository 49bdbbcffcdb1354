"""One look: a controller keeps its colour, its gains differ in dashes."""

from __future__ import annotations

import re
from itertools import pairwise

import pytest
from hypothesis import example, given
from hypothesis.strategies import floats, sampled_from

from wristctl.control.table import CONTROLLERS
from wristctl.plotting.style import colour, figure, legend_below, line, logarithmic, numbered, title


def test_controllers_of_the_table_have_colours_of_their_own() -> None:
    assert len({colour(name) for name in CONTROLLERS}) == len(CONTROLLERS)


@pytest.mark.parametrize("name", CONTROLLERS)
def test_gains_of_a_controller_share_its_colour_and_differ_in_dashes(name: str) -> None:
    lines = [line(f"{name}/{gains}") for gains in {*CONTROLLERS[name].presets, "tuned"} - {"default"}]
    assert {each["color"] for each in lines} == {colour(name)}
    assert len({str(each["linestyle"]) for each in lines}) == len(lines)


def test_unknown_controller_keeps_one_colour() -> None:
    assert colour("someone-elses") == colour("someone-elses") == line("someone-elses/tuned")["color"]


def test_axes_are_always_an_array_of_rows_and_columns() -> None:
    assert figure()[1].shape == (1, 1)
    assert figure(2, 3)[1].shape == (2, 3)


def test_legend_below_names_each_label_once() -> None:
    made, axes = figure(1, 2)
    for each in axes.ravel().tolist():
        each.plot([0.0, 1.0], label="smc/tuned")
    legend_below(made)
    assert [text.get_text() for text in made.legends[0].get_texts()] == ["smc/tuned"]


def test_axes_keep_their_height_above_a_legend_of_many_rows() -> None:
    """Of names so long that one fills a row."""
    heights = []
    for rows in (2, 12):
        made, ((axes,),) = figure(height=2.4)
        for k in range(rows):
            axes.plot([0.0, 1.0], label=f"{k} of {'names ' * 12}")
        legend_below(made)
        made.draw_without_rendering()
        heights.append(axes.get_window_extent().height)
    assert heights[1] == pytest.approx(heights[0], rel=0.1)


def test_titles_of_axes_side_by_side_do_not_reach_the_next_ones() -> None:
    words = "motors and a camera behind it"
    made, axes = figure(1, 4)
    for panel in axes.flat:
        title(panel, words)  # type: ignore[arg-type]
    made.draw_without_rendering()
    titles = [panel._left_title for panel in axes.flat]  # type: ignore[attr-defined]
    assert all(text.get_text().split() == words.split() for text in titles)
    boxes = [text.get_window_extent() for text in titles]
    assert all(left.x1 < right.x0 for left, right in pairwise(boxes))


@pytest.mark.parametrize(("low", "high"), [(1e-7, 3e-2), (0.9, 40.0), (0.02, 0.05)])
@pytest.mark.slow
def test_powers_of_ten_name_the_ticks_that_formulas_would(low: float, high: float) -> None:
    made, ((plain, formulas),) = figure(1, 2)
    logarithmic(plain.yaxis)
    formulas.set_yscale("log")
    for axes in (plain, formulas):
        axes.set_ylim(low, high)
    made.draw_without_rendering()
    raised = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")
    for minor in (False, True):
        shown = [label.get_text() for label in plain.get_yticklabels(minor=minor)]
        wanted = [label.get_text() for label in formulas.get_yticklabels(minor=minor)]
        assert len(shown) == len(wanted)
        for text, formula in zip(shown, wanted, strict=True):
            expected = re.sub(r"\$\\mathdefault|[{}^$]", "", formula).replace(r"\times", "\u00d7")
            assert text.translate(raised) == expected.removesuffix("\u00d7100"), "2, not 2 times 10 to the 0"


@example(power=-5.7, decades=0.65, most=None)
@example(power=-0.9, decades=0.12, most=3)
@given(power=floats(-9.0, 3.0), decades=floats(0.03, 6.0), most=sampled_from([None, 3]))
def test_a_logarithmic_axis_has_two_numbers_at_least_each_once_and_not_too_many(
    power: float, decades: float, most: int | None
) -> None:
    made, ((axes,),) = figure()
    axes.plot([0.0, 1.0], [10.0**power, 10.0 ** (power + decades)])
    numbered(axes.yaxis, most=most)
    made.draw_without_rendering()
    low_end, high_end = axes.get_ylim()
    ticks = zip(axes.get_yticks(), axes.get_yticklabels(), strict=True)
    shown = [(place, label.get_text()) for place, label in ticks if low_end <= place <= high_end]
    places, labels = [place for place, _ in shown], [label for _, label in shown]
    assert 2 <= len(labels) == len(set(labels)) <= 8 and all(labels)
    assert [float(label) for label in labels if label.isascii()] == [
        pytest.approx(place) for place, label in zip(places, labels, strict=True) if label.isascii()
    ]
