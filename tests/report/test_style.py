"""One look: a controller keeps its colour, its gains differ in dashes."""

from __future__ import annotations

import pytest

from wristctl.control.table import CONTROLLERS
from wristctl.report.style import colour, figure, legend_below, line


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
    for each in axes.flat:
        each.plot([0.0, 1.0], label="smc/tuned")
    legend_below(made)
    assert [text.get_text() for text in made.legends[0].get_texts()] == ["smc/tuned"]
