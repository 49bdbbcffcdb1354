"""Views of a board tell the lens and the bending plane, and views that cannot are refused with what to do."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.vision.conftest import bent
from wristctl.config.camera import CalibrateCameraSettings, CharucoBoard, Gates, Markers, SceneSettings
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.vision.camera import Frame
from wristctl.vision.charuco import Album, BoardFinder, CameraCalibration, calibrate, least_seen, plane_tilt
from wristctl.vision.marker import SightingVerdict, Tracker
from wristctl.vision.scene import Scene, board_shots
from wristctl.vision.view import FILE, Pinhole, View

SCENE = SceneSettings(tilt_deg=10.0, pan_deg=-4.0)
SETTINGS = CalibrateCameraSettings(scene=SCENE, views=10)
SIZE = SCENE.width, SCENE.height


@pytest.fixture(scope="module")
def shots() -> list[Frame]:
    return list(board_shots(SCENE, CharucoBoard(), SETTINGS.views, np.random.default_rng(0)))


@pytest.fixture(scope="module")
def album(shots: list[Frame]) -> Album:
    made = Album(CharucoBoard())
    for frame in shots:
        made.look(frame, str(frame.number))
    return made


@pytest.fixture(scope="module")
def found(album: Album) -> CameraCalibration:
    return calibrate(album.views, album.last, SIZE, SETTINGS)


@pytest.mark.slow
def test_lens_is_found_within_four_standard_deviations(found: CameraCalibration) -> None:
    true = Pinhole(SCENE, "right")
    values = [*found.view.camera_matrix[[0, 1, 0, 1], [0, 1, 2, 2]], *found.view.distortion]
    expected = np.array([*true.matrix[[0, 1, 0, 1], [0, 1, 2, 2]], *true.distortion])
    assert np.all(np.abs(values - expected) < 4.0 * found.deviation)
    assert found.deviation[0] < 2.0 and found.error < 0.2


def test_tilt_of_the_bending_plane_is_found(found: CameraCalibration) -> None:
    true = math.acos(math.cos(math.radians(10.0)) * math.cos(math.radians(4.0)))
    assert plane_tilt(found.view) == pytest.approx(true, abs=math.radians(0.3))
    assert plane_tilt(Scene(SCENE, WristParameters()).view) == pytest.approx(true, abs=1e-9)
    assert found.plane_error < 3e-4


def test_a_calibrated_camera_corrects_its_tilt_to_a_seventh_of_a_degree(found: CameraCalibration) -> None:
    scene = Scene(SCENE, WristParameters())
    tracker, rng, off = Tracker(Markers(), found.view, Gates()), np.random.default_rng(0), []
    for number, degrees in enumerate(np.linspace(-45.0, 45.0, 30)):
        seen = tracker.see(Frame(scene.render(bent(degrees), rng), number / 60.0, number))
        assert seen.verdict is SightingVerdict.OK
        off.append(math.degrees(seen.theta) - degrees)
    assert np.sqrt(np.mean(np.square(off))) <= 0.15


def test_a_saved_view_reads_back_exactly(found: CameraCalibration, tmp_path: object) -> None:
    file = tmp_path / FILE.split("/")[-1]  # type: ignore[operator]
    found.view.save(file, note="more")
    again = View.load(file)
    points = np.random.default_rng(0).uniform(0.0, 480.0, (20, 2))
    assert np.array_equal(again.rectify(points), found.view.rectify(points)) and again.size == found.view.size
    file.write_text("{}")
    with pytest.raises(UserError, match="not a camera calibration"):
        View.load(file)


def test_residuals_are_what_the_error_is_made_of(found: CameraCalibration, album: Album) -> None:
    squares = np.concatenate(found.residuals)
    assert np.sqrt((squares**2).sum(axis=1).mean()) == pytest.approx(found.error, rel=1e-4)
    assert [len(each) for each in found.residuals] == [len(view.corners) for view in album.views]


@pytest.mark.parametrize(
    ("views", "said"),
    [
        (slice(0, 5), "5 different views of the board, 8 are needed"),
        ([0] * 8, "of the picture, 60% are needed - calibration - fix: show it nearer, and toward the edges"),
    ],
)
def test_too_few_and_too_central_views_are_refused(album: Album, views: object, said: str) -> None:
    chosen = album.views[views] if isinstance(views, slice) else [album.views[k] for k in views]  # type: ignore[attr-defined]
    with pytest.raises(UserError, match=said) as caught:
        calibrate(chosen, None, SIZE, SETTINGS)
    assert caught.value.exit_code == 3


def test_views_square_to_the_camera_are_refused(album: Album) -> None:
    with pytest.raises(UserError, match="no view is tilted by 59 deg"):
        calibrate(album.views, None, SIZE, SETTINGS.model_copy(update={"tilt_deg": 59.0}))


def test_a_large_reprojection_error_is_refused_and_the_worst_view_named(album: Album) -> None:
    spoilt = [view._replace(places=view.places * (1.0, 1.3)) if k == 4 else view for k, view in enumerate(album.views)]
    with pytest.raises(UserError, match=r"reprojection error .* px \(worst: view 4\)"):
        calibrate(spoilt, None, SIZE, SETTINGS)


def test_only_new_views_are_kept_and_only_so_many(shots: list[Frame]) -> None:
    kept = Album(CharucoBoard(), most=2)
    assert [kept.look(shots[k], str(k)) for k in (0, 0, 1, 2)] == [True, False, True, False]
    assert kept.last is not None and kept.last.name == "2"


def test_pictures_of_different_size_are_refused(album: Album) -> None:
    with pytest.raises(UserError, match="pictures of 100 x 50 and of 640 x 480"):
        album.look(Frame(np.zeros((50, 100), np.uint8), 0.0, 0), "odd")


def test_no_board_is_seen_in_a_picture_of_the_wrist(scene: Scene) -> None:
    assert BoardFinder(CharucoBoard()).find(scene.render(bent(0.0), np.random.default_rng(0)), "wrist") is None


def test_the_least_seen_part_is_named() -> None:
    seen = np.ones((6, 8), bool)
    seen[4:, :3] = False
    assert least_seen(seen) == "lower left"
