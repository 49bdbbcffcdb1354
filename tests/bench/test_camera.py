"""What the bench's camera sees, and when."""

from __future__ import annotations

import numpy as np
import pytest

from tests.bench.conftest import TAUT, Host, HostOn
from wristctl.bench.emulated_rig import EmulatedRig
from wristctl.bench.virtual_bench import BenchTransport, VirtualBench, VirtualCamera
from wristctl.config.bench import BenchSettings, FaultKind, InjectedFault, RenderedCamera
from wristctl.config.camera import Gates, Markers
from wristctl.config.wrist import WristParameters
from wristctl.vision.camera import Frame
from wristctl.vision.marker import SightingVerdict, Tracker
from wristctl.vision.scene import Scene

WRIST = WristParameters()
TICK = 0.005


class Sketch(Scene):
    """Draws nothing but its own noise, and remembers what it was to draw."""

    def __init__(self) -> None:
        self.drawn: list[tuple[np.ndarray, bool, bool]] = []

    def render(
        self, theta: np.ndarray, rng: np.random.Generator, covered: bool = False, swapped: bool = False,
        across: float = 0.0, turned: float = 0.0,
    ) -> np.ndarray:  # fmt: skip
        self.drawn.append((theta, covered, swapped))
        return rng.integers(0, 256, (4, 4), np.uint8)


class Stage:
    """A bench whose camera sketches."""

    def __init__(self, camera: RenderedCamera, *faults: InjectedFault, seed: int = 0) -> None:
        self.rig = EmulatedRig(BenchSettings(motors=TAUT, camera=camera, faults=faults), WRIST, seed)
        self.rig.eyes[0].scene = self.sketch = Sketch()
        self.transport = BenchTransport(self.rig.chip, self.rig.faults)
        self.camera = VirtualCamera(self.rig)

    def look(self, seconds: float, every: float = TICK) -> list[tuple[float, Frame]]:
        """The frames that come, each with the time at which it was there."""
        seen = []
        for _ in range(round(seconds / every)):
            self.transport.wait(every)
            if (frame := self.camera.newest()) is not None:
                seen.append((self.transport.now(), frame))
        return seen


@pytest.mark.parametrize("delay_frames", [0.0, 0.5, 2.0])
@pytest.mark.slow
def test_frames_come_at_the_frame_rate_each_late_by_the_delay(delay_frames: float) -> None:
    stage = Stage(RenderedCamera(dropped=0.0, delay_frames=delay_frames))
    seen = stage.look(1.0, every=0.001)
    numbers = np.array([frame.number for _, frame in seen])
    late = np.array([now - frame.time for now, frame in seen])
    assert (np.diff(numbers) == 1).all() and len(numbers) == pytest.approx(60 - delay_frames, abs=1.5)
    np.testing.assert_allclose([frame.time for _, frame in seen], numbers / 60.0)
    delay = max(delay_frames / 60.0, 0.002)  # half the exposure at least
    assert delay - 1e-9 <= late.min() and late.max() <= delay + 0.0021


@pytest.mark.slow
def test_the_wanted_share_of_frames_is_dropped() -> None:
    numbers = [frame.number for _, frame in Stage(RenderedCamera(dropped=0.3)).look(20.0, every=0.016)]
    assert len(numbers) == pytest.approx(0.7 * 1200, abs=4 * np.sqrt(1200 * 0.3 * 0.7))


def test_the_newest_frame_wins_and_no_other_is_drawn() -> None:
    stage = Stage(RenderedCamera(dropped=0.0))
    stage.transport.wait(1.01)
    frame = stage.camera.newest()
    assert frame is not None and frame.number == 58  # which arrived at 1.0 s
    assert stage.camera.newest() is None
    assert len(stage.sketch.drawn) == 1


@pytest.mark.slow
def test_a_frame_is_the_same_whoever_looked_before_and_another_under_another_seed() -> None:
    often = {f.number: f.image.tobytes() for _, f in Stage(RenderedCamera()).look(2.0)}
    seldom = {f.number: f.image.tobytes() for _, f in Stage(RenderedCamera()).look(2.0, every=0.1)}
    other = {f.number: f.image.tobytes() for _, f in Stage(RenderedCamera(), seed=1).look(2.0)}
    assert 15 <= len(seldom) < len(often) and seldom.items() <= often.items()
    assert all(often[number] != other[number] for number in often.keys() & other.keys())


def test_an_exposure_averages_the_motion_around_its_middle_and_needs_one_instant_at_rest() -> None:
    stage = Stage(RenderedCamera(dropped=0.0, exposure=0.016))
    host = Host(stage)  # type: ignore[arg-type]
    stage.look(0.05)
    host.board.ping()
    assert {len(theta) for theta, _, _ in stage.sketch.drawn} == {1}
    moving = len(stage.sketch.drawn)
    times = []
    for _ in range(60):
        host.board.turn((-1500.0, -1500.0, 1500.0, 1500.0))
        if (frame := stage.camera.newest()) is not None:
            times.append(frame.time)
    truth = stage.rig.wrist.truth()
    smeared = [theta for theta, _, _ in stage.sketch.drawn[moving:]]
    assert max(map(len, smeared)) >= 3
    for time, theta in zip(times, smeared, strict=True):
        open_ = time + np.linspace(-0.008, 0.008, 401)
        mean = np.interp(open_, truth.time, truth.theta.sum(axis=1)).mean()
        assert theta.sum(axis=1).mean() == pytest.approx(mean, abs=1e-5)


def test_frames_are_lost_for_as_long_as_the_fault_lasts() -> None:
    stage = Stage(RenderedCamera(dropped=0.0), InjectedFault(kind="frames-dropped", at=0.5, duration=0.25))
    stage.rig.begin(0.0)
    captured = np.array([frame.time for _, frame in stage.look(1.0)])
    lost = (captured >= 0.5) & (captured < 0.75)
    assert not lost.any() and (captured > 0.75).any() and (captured < 0.5).any()


@pytest.mark.parametrize(("kind", "which"), [("marker-covered", 1), ("markers-swapped", 2)])
def test_markers_are_covered_or_swapped_while_the_fault_lasts(kind: FaultKind, which: int) -> None:
    stage = Stage(RenderedCamera(dropped=0.0), InjectedFault(kind=kind, at=0.3, duration=0.2))
    stage.rig.begin(0.0)
    for (_, frame), drawn in zip(stage.look(1.0), stage.sketch.drawn, strict=True):
        assert drawn[which] == (0.3 <= frame.time < 0.5)
        assert not drawn[3 - which]


def test_a_frozen_camera_repeats_its_last_picture_under_new_times() -> None:
    stage = Stage(RenderedCamera(dropped=0.0), InjectedFault(kind="camera-frozen", at=0.5, duration=0.3))
    stage.rig.begin(0.0)
    seen = [frame for _, frame in stage.look(1.0)]
    frozen = [frame.image.tobytes() for frame in seen if 0.5 <= frame.time < 0.8]
    free = [frame.image.tobytes() for frame in seen if not 0.5 <= frame.time < 0.8]
    assert len(frozen) >= 17 and len(set(frozen)) == 1
    assert len(set(free)) == len(free)
    assert len({frame.time for frame in seen}) == len(seen)


def test_a_dropped_frame_and_a_covered_marker_may_come_together() -> None:
    faults = (
        InjectedFault(kind="frames-dropped", at=0.2, duration=0.2),
        InjectedFault(kind="marker-covered", at=0.3, duration=0.3),
    )
    stage = Stage(RenderedCamera(dropped=0.0), *faults)
    stage.rig.begin(0.0)
    times = [frame.time for _, frame in stage.look(0.8)]
    covered = [time for time, (_, hidden, _) in zip(times, stage.sketch.drawn, strict=True) if hidden]
    assert covered and min(covered) >= 0.4 and max(covered) < 0.6


@pytest.mark.slow
def test_the_angle_found_in_rendered_pictures_is_the_one_the_wrist_had(host_on: HostOn) -> None:
    settings = BenchSettings(motors=TAUT, camera=RenderedCamera(dropped=0.0))
    host = host_on(settings)
    tracker = Tracker(Markers(), Scene(settings.camera.scene, WRIST).view, Gates())
    host.bench.cameras[0].newest()
    errors = []
    for _ in range(40):
        host.board.turn((-300.0, -300.0, 350.0, 350.0))
        host.bench.transport.wait(TICK)
        if (frame := host.bench.cameras[0].newest()) is not None:
            sighting = tracker.see(frame)
            assert sighting.verdict == SightingVerdict.OK
            truth = host.bench.truth(frame.time - 1e-3)
            errors.append(sighting.theta - truth.theta[0].sum())
    assert host.bench.truth().theta[-1].sum() > 0.1
    assert np.abs(np.rad2deg(errors)).max() < 0.5


def test_a_camera_with_an_exposure_beyond_its_frame_is_refused() -> None:
    with pytest.raises(ValueError, match="longer than a frame"):
        RenderedCamera(exposure=0.02)


def test_the_whole_bench_gives_the_same_bytes_in_every_run() -> None:
    runs = []
    for _ in range(2):
        bench = VirtualBench(BenchSettings(), WRIST, seed=5)
        bench.transport.wait(0.1)
        frame = bench.cameras[0].newest()
        assert frame is not None
        runs.append(frame.image.tobytes() + bench.truth().theta.tobytes())
    assert runs[0] == runs[1]


@pytest.mark.slow
def test_frames_that_jitter_come_in_order_each_by_its_own_delay() -> None:
    jitter = 0.9 / 60.0
    stage = Stage(RenderedCamera(dropped=0.1, jitter=jitter))
    seen = stage.look(3.0, every=0.001)
    numbers, delay = [frame.number for _, frame in seen], 2.0 / 60.0
    late = np.array([now - frame.time for now, frame in seen]) - delay
    assert (np.diff(numbers) > 0).all() and len(numbers) > 150
    assert late.min() >= -1e-9 and 0.8 * jitter < late.max() <= jitter + 0.0021 and np.std(late) > 0.2 * jitter
