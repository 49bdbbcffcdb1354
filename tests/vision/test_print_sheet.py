"""What is printed is as large as it says: in the PDF's own numbers, and as a detector measures a scan of it."""

from __future__ import annotations

import re
import zlib
from pathlib import Path

import cv2
import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from wristctl.commands.calibrate.print_sheet import PAPERS, board_page, marker_page, write_sheets
from wristctl.config.camera import CharucoBoard, Markers
from wristctl.errors import UserError
from wristctl.vision.charuco import BoardFinder
from wristctl.vision.detector import Detector

POINT = 25.4 / 72.0
DPI = 200


def scanned(page: Figure) -> np.ndarray:
    canvas = FigureCanvasAgg(page)
    page.set_dpi(DPI)
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[..., 0].copy()


@pytest.fixture(scope="module")
def sheets(tmp_path_factory: pytest.TempPathFactory) -> Path:
    file = tmp_path_factory.mktemp("sheets") / "a4.pdf"
    write_sheets(file, "a4", CharucoBoard(), Markers())
    return file


@pytest.mark.slow
def test_the_pdf_has_two_pages_of_the_papers_size(sheets: Path, tmp_path: Path) -> None:
    write_sheets(tmp_path / "letter.pdf", "letter", CharucoBoard(), Markers())
    for file in (sheets, tmp_path / "letter.pdf"):
        boxes = re.findall(rb"/MediaBox \[ 0 0 ([\d.]+) ([\d.]+) \]", file.read_bytes())
        assert len(boxes) == 2
        for box in boxes:
            assert [POINT * float(each) for each in box] == pytest.approx(PAPERS[file.stem], abs=0.01)


def test_squares_ruler_and_markers_in_the_pdf_measure_what_they_should(sheets: Path) -> None:
    packed = re.findall(rb"stream\r?\n(x.*?)endstream", sheets.read_bytes(), re.DOTALL)
    text = b"\n".join(zlib.decompressobj().decompress(each) for each in packed).decode("latin1")
    at = r"(-?[\d.]+) (-?[\d.]+)"
    lines, boxes = (
        POINT * np.array(re.findall(pattern, text), float)
        for pattern in (rf"{at} m\n{at} l\n(?=-?[\d.]+ -?[\d.]+ m|\nS)", rf"{at} m\n{at} l\n{at} l\n{at} l\nh\n\nf")
    )
    lengths = np.hypot(*(lines[:, 2:] - lines[:, :2]).T)
    assert np.sum(np.abs(lengths - 100.0) < 0.001) == 2  # a ruler on each page
    wide, tall = boxes[:, 2] - boxes[:, 0], np.abs(boxes[:, 5] - boxes[:, 3])
    assert np.sum((np.abs(wide - 25.0) < 0.001) & (np.abs(tall - 25.0) < 0.001)) == 32  # the black squares of 7 x 9
    assert np.sum((np.abs(wide - 20.0) < 0.001) & (np.abs(tall - 20.0 / 6) < 0.001)) >= 12  # rims of six markers


@pytest.mark.parametrize("paper", PAPERS)
def test_a_scan_of_the_board_is_a_board_of_that_size(paper: str) -> None:
    board = CharucoBoard(square=0.0245, marker=0.017)
    seen = BoardFinder(board).find(scanned(board_page(paper, board)), "scan")  # type: ignore[arg-type]
    assert seen is not None and len(seen.corners) == (board.columns - 1) * (board.rows - 1)
    assert (seen.corners - seen.corners[0]) * 25.4e-3 / DPI == pytest.approx(seen.places - seen.places[0], abs=1e-4)


def test_a_scan_of_the_markers_finds_both_at_their_size_with_a_white_rim() -> None:
    markers = Markers(base=4, tip=7, side=0.025)
    image = scanned(marker_page("a4", markers))
    cv2.setNumThreads(1)
    found = Detector().everywhere(image)
    assert set(found) == {4, 7} and {len(each) for each in found.values()} == {3}
    for corners in (each for places in found.values() for each in places):
        sides = np.linalg.norm(corners - np.roll(corners, 1, axis=0), axis=1) * 25.4e-3 / DPI
        assert sides == pytest.approx(0.025, abs=1.5e-4)
        low, high = corners.min(axis=0).astype(int) - 10, corners.max(axis=0).astype(int) + 10
        around = image[low[1] : high[1], low[0] : high[0]].copy()
        around[8:-8, 8:-8] = 255
        assert around.min() == 255


def test_a_board_larger_than_the_paper_is_refused() -> None:
    with pytest.raises(UserError, match="does not fit on letter"):
        board_page("letter", CharucoBoard(square=0.03, marker=0.02))
