"""What is drawn into a frame says what was seen in it, and a few frames stand for a recording of any length."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from wristctl.vision.camera import Frame, VideoCamera
from wristctl.vision.marker import Sighting, SightingVerdict
from wristctl.vision.recordings import AnnotatedVideo, Picked, annotate

GREY = 100
BASE, TIP = ([[x, y], [x + 80.0, y], [x + 80.0, y + 80.0], [x, y + 80.0]] for x, y in ((100.0, 300.0), (400.0, 150.0)))
BLUE, GREEN, VERMILLION = (tuple(bytes.fromhex(each)[::-1]) for each in ("0072B2", "009E73", "D55E00"))
"""Of Okabe and Ito's palette, blue first as in OpenCV."""
BLANK = np.full((480, 640), GREY, np.uint8)


def sighting(verdict: SightingVerdict = SightingVerdict.OK, theta: float = 0.2) -> Sighting:
    usable = verdict is SightingVerdict.OK
    return Sighting(1.25, 7, theta if usable else math.nan, verdict, np.array([BASE, TIP]))


def colour(picture: NDArray[np.uint8], x: float, y: float) -> tuple[int, ...]:
    return tuple(int(each) for each in picture[round(y), round(x)])


def label(picture: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """The white label in the upper left corner, as far as it reaches."""
    painted = (picture != GREY).any(axis=2)
    return picture[: int(np.argmin(painted[:, 0])), : int(np.argmin(painted[0]))]


@pytest.mark.parametrize(("verdict", "tip"), [(SightingVerdict.OK, GREEN), (SightingVerdict.JUMP, VERMILLION)])
def test_both_markers_are_outlined_and_a_tip_that_cannot_be_used_stands_out(
    verdict: SightingVerdict, tip: tuple[int, ...]
) -> None:
    picture = annotate(BLANK, sighting(verdict))
    assert picture.shape == (480, 640, 3)
    for corners, expected in ((np.array(BASE), BLUE), (np.array(TIP), tip)):
        for one, other in zip(corners, np.roll(corners, -1, axis=0), strict=True):
            assert colour(picture, *(0.5 * (one + other))) == expected
        assert colour(picture, *corners.mean(axis=0)) == (GREY,) * 3  # and what is in them stays to be seen
        assert colour(picture, *(corners[0] + [-12.0, 0.0])) == (GREY,) * 3


def test_the_first_corner_is_told_from_the_others_by_a_dot() -> None:
    picture = annotate(BLANK, sighting())
    size = [(picture[y - 6 : y + 7, x - 6 : x + 7] == BLUE).all(axis=2).sum() for x, y in np.array(BASE).astype(int)]
    assert colour(picture, BASE[0][0] + 2.0, BASE[0][1] + 2.0) == BLUE
    assert size[0] > max(size[1:]) + 15


def test_a_marker_with_a_corner_unseen_is_not_outlined() -> None:
    corners = np.array([BASE, TIP])
    corners[0, 2] = math.nan
    picture = annotate(BLANK, sighting()._replace(corners=corners))
    assert not (picture[200:] == BLUE).all(axis=2).any()
    assert colour(picture, 440.0, 150.0) == GREEN


@pytest.mark.parametrize("verdict", [SightingVerdict.OK, SightingVerdict.NO_BASE])
def test_the_label_is_as_large_as_its_text_and_red_where_there_is_no_angle(verdict: SightingVerdict) -> None:
    found = label(annotate(BLANK, sighting(verdict)))
    ink: NDArray[np.bool_] = np.asarray(found.min(axis=2) < 128)
    rows, columns = np.flatnonzero(ink.any(axis=1)), np.flatnonzero(ink.any(axis=0))
    height, width = found.shape[:2]
    left, right = int(columns[0]), int(width - 1 - columns[-1])
    above, below = int(rows[0]), int(height - 1 - rows[-1])
    assert 3 <= left <= 12 and 3 <= right <= 12 and abs(left - right) <= 3
    assert 3 <= above <= 12 and 3 <= below <= 12
    assert tuple(found[0, 0]) == (255, 255, 255) and tuple(found[-1, -1]) == (255, 255, 255)
    reddest = int((found[..., 2].astype(int) - found[..., 0]).max())
    assert (reddest > 150) == (verdict is not SightingVerdict.OK)


def test_the_label_tells_the_angle_with_its_sign() -> None:
    first, again, other, later = (
        label(annotate(BLANK, each))
        for each in (sighting(), sighting(theta=0.2), sighting(theta=-0.2), sighting()._replace(time=1.75))
    )
    assert np.array_equal(first, again)
    assert not np.array_equal(first, other) and not np.array_equal(first, later)


def test_the_label_grows_with_the_picture_and_stays_legible_in_a_small_one() -> None:
    heights = [
        label(annotate(np.full((600, width), GREY, np.uint8), sighting())).shape[0] for width in (160, 1100, 2200)
    ]
    assert heights[0] >= 15
    assert heights[2] == pytest.approx(2 * heights[1], rel=0.1)


def shown(verdicts: list[SightingVerdict]) -> list[int]:
    """Numbers of the frames that are picked of a recording with these verdicts, told by their grey."""
    picked = Picked()
    for number, verdict in enumerate(verdicts):
        picked.offer(Frame(np.full((480, 640), number, np.uint8), float(number), number), sighting(verdict))
    return [int(each[-1, -1, 0]) for each in picked.pictures()]


@pytest.mark.parametrize("count", [1, 2, 6, 7, 8, 40, 63, 64, 65, 200])
def test_frames_of_a_recording_are_picked_evenly_whatever_its_length(count: int) -> None:
    numbers = shown([SightingVerdict.OK] * count)
    assert numbers[0] == 0 and min(count, 4) <= len(numbers) <= 6
    gap = numbers[1] - numbers[0] if len(numbers) > 1 else 1
    assert numbers == list(range(0, count, gap))


def test_the_first_frames_that_cannot_be_used_are_picked_of_three_kinds_at_most() -> None:
    verdicts = [SightingVerdict.OK] * 200
    for number, verdict in (
        (41, SightingVerdict.NO_TIP), (43, SightingVerdict.NO_TIP), (45, SightingVerdict.JUMP),
        (47, SightingVerdict.SHAPE), (49, SightingVerdict.TWICE),
    ):  # fmt: skip
        verdicts[number] = verdict
    numbers = shown(verdicts)
    assert numbers == sorted(numbers) and set(numbers) - set(shown([SightingVerdict.OK] * 200)) == {41, 45, 47}


def test_an_annotated_video_plays_at_its_rate_with_every_frame(tmp_path: Path) -> None:
    file = tmp_path / "annotated.avi"
    video = AnnotatedVideo(file, 25.0)
    for number in range(4):
        video.add(Frame(np.full((480, 640), 40 * number, np.uint8), number / 25.0, number), sighting())
    video.close()
    read = VideoCamera(file)
    assert read.frame_rate == pytest.approx(25.0)
    assert [int(frame.image[-1, -1]) for frame in read] == pytest.approx([0, 40, 80, 120], abs=3)
    assert next(iter(VideoCamera(file))).image.shape == (480, 640)


def test_a_video_of_no_frames_leaves_no_file(tmp_path: Path) -> None:
    AnnotatedVideo(tmp_path / "none.avi", 25.0).close()
    assert not (tmp_path / "none.avi").exists()
