"""Figures of a tracked recording show its angle and the frames that were refused."""

from __future__ import annotations

import numpy as np
import pytest

from wristctl.commands.track.figures import angle, frames
from wristctl.vision.marker import Sighting, SightingVerdict

CORNERS = np.zeros((2, 4, 2))


def sighting(number: int, verdict: SightingVerdict = SightingVerdict.OK) -> Sighting:
    theta = 0.01 * number if verdict is SightingVerdict.OK else np.nan
    return Sighting(0.02 * number, number, theta, verdict, CORNERS)


def test_the_angle_is_in_degrees_over_seconds() -> None:
    above, below = angle([sighting(k) for k in range(5)]).axes
    np.testing.assert_allclose(np.asarray(above.lines[0].get_xdata()), [0.0, 0.02, 0.04, 0.06, 0.08])
    np.testing.assert_allclose(np.asarray(above.lines[0].get_ydata()), np.degrees([0.0, 0.01, 0.02, 0.03, 0.04]))
    assert (above.get_ylabel(), below.get_xlabel()) == ("bending angle [deg]", "time [s]")


def test_frames_that_were_refused_are_marked_by_why_in_a_row_each() -> None:
    kinds = {1: SightingVerdict.FROZEN, 3: SightingVerdict.NO_TIP, 4: SightingVerdict.NO_TIP}
    _, below = angle([sighting(k, kinds.get(k, SightingVerdict.OK)) for k in range(6)]).axes
    assert [label.get_text() for label in below.get_yticklabels()] == ["no tip", "frozen"]
    tip, frozen = below.lines
    np.testing.assert_allclose(np.asarray(tip.get_data()), [[0.06, 0.08], [0.0, 0.0]])
    np.testing.assert_allclose(np.asarray(frozen.get_data()), [[0.02], [1.0]])
    assert tip.get_color() != frozen.get_color() and not below.texts
    low, high = below.get_ylim()
    assert low > 1.0 and high < 0.0, "the first above, both within"
    assert not any(line.get_visible() for line in below.get_ygridlines())


def test_every_reason_has_a_row_and_a_colour_and_makes_the_figure_taller() -> None:
    bad = list(SightingVerdict)[1:]
    made = angle([sighting(k, verdict) for k, verdict in enumerate(bad)])
    assert [label.get_text() for label in made.axes[1].get_yticklabels()] == [str(each) for each in bad]
    assert len({str(line.get_color()) for line in made.axes[1].lines}) == len(bad)
    more = made.get_figheight() - angle([sighting(0)]).get_figheight()
    assert 0.1 * len(bad) < more < 0.4 * len(bad)


def test_a_recording_without_a_bad_frame_says_so() -> None:
    _, below = angle([sighting(0), sighting(1)]).axes
    assert [text.get_text() for text in below.texts] == ["every frame was used"]
    assert not below.lines and not len(below.get_yticks())


@pytest.mark.parametrize(("count", "shape"), [(1, (1, 1)), (2, (1, 2)), (3, (1, 3)), (4, (2, 3)), (6, (2, 3))])
def test_frames_stand_three_in_a_row_as_they_were_taken(count: int, shape: tuple[int, int]) -> None:
    pictures = [np.zeros((60, 120, 3), np.uint8) for _ in range(count)]
    for k, each in enumerate(pictures):
        each[:30, :, 0], each[30:, :, 2] = 200, 10 * (k + 1)  # blue above, red below
    made = frames(pictures)
    grid = made.axes[0].get_subplotspec()
    assert grid is not None and grid.get_gridspec().get_geometry() == shape
    assert len(made.axes) == shape[0] * shape[1]
    drawn = [axes.images[0].get_array() for axes in made.axes if axes.images]
    assert len(drawn) == count
    for k, shown in enumerate(drawn):
        picture = np.asarray(shown)
        assert picture.shape == (240, 480, 3)
        assert list(picture[10, 10]) == [0, 0, 200] and list(picture[-10, 10]) == [10 * (k + 1), 0, 0]
    width, height = made.get_size_inches()
    assert height == pytest.approx(width * shape[0] / shape[1] / 2.0)
    assert all(not len(axes.get_xticks()) for axes in made.axes)
