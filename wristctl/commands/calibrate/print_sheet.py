"""The calibration board and the wrist's markers at true scale, as vectors in a PDF."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal

import cv2
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_pdf import PdfPages
from matplotlib.collections import PatchCollection
from matplotlib.figure import Figure
from matplotlib.patches import PathPatch, Rectangle
from matplotlib.path import Path as Outline
from numpy.typing import NDArray

from wristctl.config.camera import CharucoBoard, Markers
from wristctl.errors import UserError
from wristctl.plotting.style import BLACK, GREY
from wristctl.records.formats import own_look
from wristctl.vision.charuco import DICTIONARY as BOARD_DICTIONARY
from wristctl.vision.detector import print_of

# Width and height [mm].
PAPERS = {"a4": (210.0, 297.0), "letter": (215.9, 279.4)}
# Length [mm] of the ruler on each page.
RULER = 100.0
_INCH, _MARGIN = 25.4, 8.0
_COPIES = 3
# Height of what hides the seam between two rows of cells, in cells.
_SEAM = 0.1

_BOARD_NOTES = (
    "Print at 100 % (no 'fit to page'); the ruler must measure 100 mm. Glue it, without bubbles, on a flat plate.",
    "If the squares do not measure {square:g} mm, say what they do: hw calibrate camera --set board.square=...  [m]",
)
_MARKER_NOTES = (
    "Cut along the grey lines: the white rim belongs to the marker. Glue each on a flat stiff flag in front of the",
    "bending plane, facing the camera, 'hand' toward the hand: the base's on the clamp, the tip's on the last disc,",
    "both as far in front, clear of the tendons. Matt paper, no gloss. If a black square does not measure {side:g} mm,",
    "say what it does: --set markers.side=...  [m]. The copies are spares.",
)

Cells = NDArray[np.bool_]


def write_sheets(file: Path, paper: Literal["a4", "letter"], board: CharucoBoard, markers: Markers) -> None:
    """Two pages: the board, the markers. Raises UserError where the board is larger than the paper, OSError."""
    with own_look(pdf__fonttype=42):
        sheets = board_page(paper, board), marker_page(paper, markers)
        with PdfPages(file, metadata={"CreationDate": None}) as pages:
            for page in sheets:
                pages.savefig(page)


def board_page(paper: Literal["a4", "letter"], board: CharucoBoard) -> Figure:
    """The ChArUco board, a ruler and what to do."""
    width, height = PAPERS[paper]
    across, down, square = 1e3 * board.columns * board.square, 1e3 * board.rows * board.square, 1e3 * board.square
    if across > width - 2 * _MARGIN or down > height - 2 * _MARGIN - 20.0:
        problem = f"a board of {across:g} x {down:g} mm does not fit on {paper}"
        raise UserError(problem, "calibrate-camera.board", "fewer or smaller squares: --set board.square=0.02")
    picture, axes = mm_page(paper)
    left, top = 0.5 * (width - across), _MARGIN
    chess = (np.add.outer(np.arange(board.rows), np.arange(board.columns)) % 2) == 0
    _paint(axes, chess, left, top, square)
    dictionary, inset = cv2.aruco.getPredefinedDictionary(BOARD_DICTIONARY), 0.5 * (square - 1e3 * board.marker)
    cells = dictionary.markerSize + 2
    for number, (row, column) in enumerate(np.argwhere(~chess)):
        ink = cv2.aruco.generateImageMarker(dictionary, number, cells) == 0
        _paint(axes, ink, left + column * square + inset, top + row * square + inset, 1e3 * board.marker / cells)
    below = top + down + 6.0
    draw_ruler(axes, left, below)
    caption = (
        f"ChArUco {board.columns} x {board.rows}, squares {square:g} mm, markers {1e3 * board.marker:g} mm, 5x5_50"
    )
    axes.text(left + RULER + 5.0, below + 2.0, caption, fontsize=7.5, va="center")
    write_lines(axes, left, below + 12.0, [line.format(square=square) for line in _BOARD_NOTES])
    return picture


def marker_page(paper: Literal["a4", "letter"], markers: Markers) -> Figure:
    """The base's and the tip's marker with their white rims, some spares, a ruler and what to do."""
    picture, axes = mm_page(paper)
    side = 1e3 * markers.side
    cell = side / (len(print_of(0)) - 2)
    flag, top = side + 2 * cell, 20.0
    step = flag + 22.0
    if 20.0 + _COPIES * step > PAPERS[paper][0]:
        problem = f"markers of {side:g} mm do not fit {_COPIES} in a row on {paper}"
        raise UserError(problem, "track.markers.side", "print smaller markers, and bring the camera nearer")
    for row, (name, number) in enumerate((("base", markers.base), ("tip", markers.tip))):
        for copy in range(_COPIES):
            left, upper = 20.0 + copy * step, top + row * (flag + 22.0)
            axes.add_patch(Rectangle((left, upper), flag, flag, fill=False, edgecolor=GREY, linewidth=0.4))
            _paint(axes, print_of(number) == 0, left, upper, cell)
            middle: dict[str, Any] = {"ha": "center", "va": "center", "fontsize": 7.5}
            axes.text(left + 0.5 * flag, upper - 2.5, "\u2191 hand", **middle)
            axes.text(left + 0.5 * flag, upper + flag + 3.0, f"{name}: 4x4_50, id {number}, {side:g} mm", **middle)
    below = top + 2 * (flag + 22.0)
    draw_ruler(axes, 20.0, below)
    write_lines(axes, 20.0, below + 12.0, [line.format(side=side) for line in _MARKER_NOTES])
    return picture


def mm_page(paper: str) -> tuple[Figure, Axes]:
    """A page whose axes are in mm from its upper left corner."""
    width, height = PAPERS[paper]
    picture = Figure(figsize=(width / _INCH, height / _INCH))
    axes = picture.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set_axis_off()
    axes.set(xlim=(0.0, width), ylim=(height, 0.0))
    return picture, axes


def _paint(axes: Axes, ink: Cells, left: float, top: float, cell: float) -> None:
    """Black cells as rectangles that run along rows, and narrow ones that hide the seams between rows."""
    rows = [(row, cells, 1.0) for row, cells in enumerate(ink)]
    seams = [(row - 0.5 * _SEAM, cells, _SEAM) for row, cells in enumerate(ink[:-1] & ink[1:], start=1)]
    bars = []
    for row, cells, height in (*rows, *seams):
        edges = np.flatnonzero(np.diff(np.concatenate([[False], cells, [False]]).astype(int)))
        bars += [
            Rectangle((left + start * cell, top + row * cell), (end - start) * cell, height * cell)
            for start, end in edges.reshape(-1, 2)
        ]
    axes.add_collection(PatchCollection(bars, facecolor=BLACK, edgecolor="none", antialiased=False))


def draw_ruler(axes: Axes, left: float, top: float, length: float = RULER) -> None:
    """A ruler of so many millimetres across a page."""
    ticks = [(mm, 5.0 if mm % 10 == 0 else 3.5 if mm % 5 == 0 else 2.2) for mm in range(int(length) + 1)]
    lines = [((0.0, 0.0), (length, 0.0)), *(((mm, 0.0), (mm, tall)) for mm, tall in ticks)]
    points = np.array(lines, float).reshape(-1, 2) + np.array([left, top])
    outline = Outline(points, [Outline.MOVETO, Outline.LINETO] * len(lines))
    axes.add_patch(PathPatch(outline, fill=False, edgecolor=BLACK, linewidth=0.3, capstyle="butt", gid="ruler"))
    axes.text(left + 0.5 * length, top + 7.3, f"{length:g} mm", fontsize=7.5, ha="center", va="center")


def write_lines(axes: Axes, left: float, top: float, lines: Sequence[str]) -> None:
    """Lines of text below each other on a page."""
    for number, line in enumerate(lines):
        axes.text(left, top + 4.0 * number, line, fontsize=7.5, va="center")
