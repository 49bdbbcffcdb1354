"""The emulated bench of a wrist that bends in two planes, as the board's step pulses and the surroundings move it."""

from __future__ import annotations

import subprocess
import sys
from collections import Counter
from collections.abc import Callable
from typing import Any, Literal

import numpy as np
import pytest

from tests.bench.conftest import EXACT, TAUT, Host
from tests.bench.test_load_cells import CELLS, SCALE, Kept, newtons
from tests.oracles.spatial_energy import spatial_energy
from wristctl.bench.bench_wrist import Truth
from wristctl.bench.loads import SpatialLoad
from wristctl.bench.motors import spool_state_of, stepper_of
from wristctl.bench.virtual_bench import VirtualBench
from wristctl.board.messages import Target
from wristctl.config.bench import (
    BenchSettings,
    FaultKind,
    InjectedFault,
    RenderedCamera,
    StepperActuator,
    WeakenedPlant,
)
from wristctl.config.camera import Gates, Markers
from wristctl.config.plant import Disturbances, Push
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.simulation.worlds import plant_of
from wristctl.vision.camera import CameraError
from wristctl.vision.marker import Tracker
from wristctl.vision.scene import Scene
from wristctl.vision.two_views import bend_seen
from wristctl.wrist.directions import ACTIVE, TENDONS
from wristctl.wrist.spatial.spatial_model import spatial_terms
from wristctl.wrist.spatial.spatial_segments import spatial_values
from wristctl.wrist.spatial.spatial_statics import spatial_equilibrium
from wristctl.wrist.tendon_layout import TendonLayout, wound_by

pytestmark = pytest.mark.slow

WRIST, SECOND = WristParameters(), Markers(base=2, tip=3)
SLIDING = StepperActuator(friction=0.0)
BEND = (-110, -110, 130, 130)
"""Steps of the axes of tendons 1, 2, 4, 5: a bend of about 0.12 rad toward ulnar."""
ALL = (100, 100, 100, 100)
PUSH = Push(force=2.0, start=0.2, duration=0.3)


def hosted(wrist: WristParameters = WRIST, planes: int = 2, **settings: Any) -> Host:
    """A host of a bench whose tendons are taut at power-on."""
    bench = BenchSettings(**{"motors": TAUT, **settings})
    return Host(VirtualBench(bench, wrist, 0, None, SECOND if planes == 2 else None))


def course(steps: tuple[int, ...], push: Disturbances | None = None, planes: int = 2, **settings: Any) -> Truth:
    """Truth of a bench that reels in these steps and is pushed, and rests."""
    host = hosted(planes=planes, **settings)
    host.bench.begin(host.start, push or Disturbances(push=PUSH))
    host.reel(steps)  # type: ignore[arg-type]
    host.rest(0.8)
    return host.bench.truth()


def values_of(wrist: WristParameters, settings: BenchSettings) -> np.ndarray:
    """The plant's values as the bench has it."""
    plant = plant_of(wrist, settings.plant)
    layout = wound_by(plant, 4) or TendonLayout.four(plant.tendon_radius)
    return spatial_values(plant, layout, settings.segments, axis=np.radians(plant.stiffness_axis_deg))


@pytest.mark.parametrize(
    "wrist",
    [
        WRIST,
        WristParameters(gravity=(0.0, 9.81)),
        WristParameters(gravity=(0.0, 0.0), gravity_flexion=9.81),
        WristParameters(stiffness_axis_deg=30.0, flexion_ratio=2.0),
        WristParameters(tendons="three"),
    ],
)
def test_at_rest_it_stands_where_statics_put_it_under_the_same_pulls(wrist: WristParameters) -> None:
    settings = BenchSettings(motors=TAUT, actuator=SLIDING, plant=WeakenedPlant(payload=0.05))
    host = hosted(wrist, actuator=SLIDING, plant=settings.plant)
    host.reel((-300, -100, -80, 500) if wrist.tendons == "four" else (-300, 500, 250, 200))  # the last winds none
    host.rest(4.0)
    truth = host.bench.truth()
    assert truth.pull.shape[1] == (4 if wrist.tendons == "four" else 3)
    assert truth.angle.shape == (len(truth.time), 2) and truth.theta.shape == (len(truth.time), 8)
    resting = spatial_equilibrium(values_of(wrist, settings), settings.segments, truth.pull[-1], truth.theta[-1])
    assert np.abs(truth.angle[-1]).min() > 0.1 and np.abs(truth.theta[-1] - resting).max() < 1e-6


def test_a_bend_in_one_plane_is_that_of_the_bench_in_one_plane() -> None:
    """But for the microseconds between the axes' steps, which may fall into the next millisecond."""
    flat, spatial = course(BEND, planes=1), course(BEND)
    assert np.ptp(flat.angle) > 0.1
    assert np.abs(spatial.theta[:, ::2] - flat.theta).max() < 1e-6
    assert np.abs(spatial.theta[:, 1::2]).max() < 1e-4
    assert np.abs(spatial.pull - flat.pull).max() < 0.01


def test_all_of_it_turned_by_a_right_angle_moves_alike() -> None:
    """Tendon 1 is turned to where 4 was, 2 to 1, 4 to 5 and 5 to 2."""
    steps = (-300, -100, -80, 500)
    turned = (steps[1], steps[3], steps[0], steps[2])
    first = course(steps, Disturbances(push=PUSH, toward_deg=20.0))
    second = course(turned, Disturbances(push=PUSH, toward_deg=110.0))
    assert np.ptp(first.angle, axis=0).min() > 0.1
    shared = min(len(first.time), len(second.time))
    assert np.abs(second.angle[:shared, 1] - first.angle[:shared, 0]).max() < 1e-3
    assert np.abs(second.angle[-1] - [-first.angle[-1, 1], first.angle[-1, 0]]).max() < 1e-5


def test_a_push_bends_it_toward_where_it_pushes() -> None:
    for toward in (0.0, 90.0, 130.0, 250.0):
        host = hosted()
        host.reel(ALL)
        start = host.bench.transport.now()
        host.bench.begin(start, Disturbances(load=3.0, toward_deg=toward))
        host.rest(0.5)
        angle = host.bench.truth().angle[-1]
        assert np.hypot(*angle) > 0.005
        along = np.array([np.cos(np.radians(toward)), np.sin(np.radians(toward))])
        assert angle / np.hypot(*angle) == pytest.approx(along, abs=0.03)


def test_in_one_plane_all_of_a_push_acts_in_that_plane() -> None:
    straight, none = course(BEND, Disturbances(push=PUSH), planes=1), course(BEND, Disturbances(), planes=1)
    aside = course(BEND, Disturbances(push=PUSH, toward_deg=90.0), planes=1)
    np.testing.assert_array_equal(aside.theta, straight.theta)
    assert np.abs(straight.theta - none.theta).max() > 0.01


@pytest.mark.parametrize("axis", range(4))
@pytest.mark.parametrize(("kind", "size"), [("tendon-detached", 1.0), ("tendon-slipped", 0.5), ("motor-stalled", 1.0)])
def test_a_tendon_that_gives_way_lets_the_others_bend_it_to_the_opposite_side(
    axis: int, kind: FaultKind, size: float
) -> None:
    host = hosted(faults=(InjectedFault(kind=kind, axis=axis, at=0.3, size=size),))
    if kind == "motor-stalled":
        host.bench.begin(host.bench.transport.now() - 0.3)
        host.reel(ALL)
    else:
        host.reel(ALL)
        host.bench.begin(host.bench.transport.now())
    host.rest(1.0)
    truth = host.bench.truth()
    assert np.abs(truth.angle[-1]).min() > np.radians(0.3)
    assert tuple(np.sign(truth.angle[-1])) == tuple(-np.array(TENDONS[ACTIVE[axis]]))


def test_a_tendon_breaks_in_a_trial_and_stays_broken() -> None:
    host = hosted(actuator=StepperActuator(broken_at=0.3, broken_tendon=3))
    host.reel(ALL)
    host.rest(0.5)
    assert host.bench.truth().pull[-1].min() > 1.0, "nothing breaks while it is homed"
    host.bench.begin(host.bench.transport.now())
    host.rest(0.5)
    host.bench.begin(host.bench.transport.now())
    host.rest(0.2)
    truth = host.bench.truth()
    assert truth.pull[-1, 2] == 0.0 and truth.pull[-1, [0, 3]].min() > 0.0
    assert truth.angle[-1, 0] < -0.01 and truth.angle[-1, 1] > 0.01


def test_a_tendon_slips_in_a_trial_by_itself() -> None:
    host = hosted(actuator=StepperActuator(slips_at=0.3, slip=1e-3, slipping_tendon=3, friction=0.0), motors=EXACT)
    host.reel(ALL)
    host.bench.begin(host.bench.transport.now())
    host.rest(0.5)
    truth = host.bench.truth()
    lost = (
        0.5 * 1e-3 * SLIDING.tendon_stiffness
    )  # the wrist bends, and shares it out to the tendon and the opposite one
    assert truth.pull[-1] == pytest.approx(truth.pull[-400] - lost * np.array([0.0, 1.0, 1.0, 0.0]), abs=0.1)
    assert truth.angle[-1, 0] < -1e-2 and truth.angle[-1, 1] > 1e-2


@pytest.mark.parametrize(
    "plant", [{"inner_friction": 0.05}, {"creep": 0.3, "creep_time": 0.2}, {"end_stop_deg": 4.0}], ids=str
)
def test_a_bend_in_one_plane_is_the_planar_bench_with_all_that_the_wrist_has(plant: dict[str, Any]) -> None:
    flat, spatial = (course((300, 300, -300, -300), planes=planes, plant=plant) for planes in (1, 2))
    plain = course((300, 300, -300, -300))
    assert np.abs(spatial.angle[-1, 0] - flat.angle[-1]).max() < 1e-4
    assert abs(plain.angle[-1, 0] - spatial.angle[-1, 0]) > 1e-3


def test_backlash_holds_back_a_tendon_that_is_paid_out() -> None:
    pulls = []
    for backlash in (0.0, 2e-4):
        host = hosted(actuator=StepperActuator(backlash=backlash, friction=0.0), motors=EXACT)
        host.reel((120, 120, 120, 120))
        host.reel((110, 110, 110, 110))  # 0.15 mm less
        host.rest(0.2)
        pulls.append(host.bench.truth().pull[-1])
    step = SLIDING.step_length
    np.testing.assert_allclose(pulls[0], 110 * step * SLIDING.tendon_stiffness, rtol=1e-4)
    np.testing.assert_allclose(pulls[1], 120 * step * SLIDING.tendon_stiffness, rtol=1e-4)


def test_released_motors_let_go_and_nothing_faces_another_plane() -> None:
    host = hosted()
    host.reel((-300, -100, -80, 500))
    host.rest(3.0)
    held = host.bench.truth()
    before = held.theta[-1]
    host.bench.face("flexion")
    host.rest(0.1)
    np.testing.assert_allclose(host.bench.truth().theta[-1], before, atol=1e-4)
    host.board.emergency_stop()
    host.bench.transport.wait(2.0)
    after, detent = host.bench.truth(), 0.03 / SLIDING.pulley_radius
    assert held.pull[-1].max() > 3.0 * detent and after.pull[-1].max() == pytest.approx(detent, rel=0.05)
    assert (np.diff(after.reeled, axis=0)[-1900:] <= 0.0).all()


def moved(settings: BenchSettings, substeps: int, wrist: WristParameters = WRIST, load: float = 4.0) -> np.ndarray:
    """Rows of a second of spools that are held, after a load that ends at 0.3 s, with so many steps in a period."""
    spools, periods = spool_state_of(settings), 1000
    hanging = SpatialLoad(settings, wrist, (0,), spools, substeps)
    spools.energised[:], spools.counted[:] = 1, (-100, 60, 40, 400)
    rows = np.full((periods, 2 * hanging.coordinates + 9), np.nan)
    for first, last, force in ((0, 300, load), (300, periods, 0.0)):
        time = 1e-3 * np.arange(first, last, dtype=np.float64)
        acting = Disturbances(load=force, toward_deg=50.0), time
        hanging.follow(
            spools, stepper_of(settings), acting, np.empty((0, 3), np.int64), first, np.inf, rows[first:last]
        )  # fmt: skip
    assert np.isfinite(rows).all() and not rows[:, -1].any(), "nothing bends out of both planes"
    return rows


def test_a_step_of_a_millisecond_is_fine_enough() -> None:
    """Where spools turn at once and a force of 4 N comes and goes at once, which no rig does."""
    settings = BenchSettings(motors=TAUT)
    exact = moved(settings, 16)[:, :8]
    off = [np.degrees(np.abs(moved(settings, steps)[:, :8] - exact).max()) for steps in (1, 2, 4)]
    assert off[0] < 0.02 and off[1] < 0.6 * off[0] and off[2] < 0.6 * off[1]
    assert np.degrees(np.abs(moved(settings, 1)[-1, :8] - exact[-1]).max()) < 2e-3


@pytest.mark.parametrize(("damping", "share"), [(0.105, 1e-3), (1e-4, 0.02)])
def test_energy_goes_to_damping_alone(damping: float, share: float) -> None:
    """Of the wrist and its stretched tendons on held spools, without friction; of one that hardly damps at last too."""
    holding = EXACT.model_copy(update={"holding_torque": 1.0})  # of the 118 N of the first period too
    wrist, settings = WristParameters(damping=damping), BenchSettings(motors=holding, actuator=SLIDING)
    rows, values = moved(settings, 1, wrist)[301:], values_of(wrist, settings)
    q, rate, reeled = rows[:, :8], rows[:, 8:16], rows[:, 20:24]
    stretch = np.maximum(0.0, reeled - WRIST.length + spatial_terms(values, q, rate).lengths)
    energy = spatial_energy(values, q, rate, np.zeros(4)) + 0.5 * SLIDING.tendon_stiffness * (stretch**2).sum(axis=1)
    lost, taken = energy[0] - energy[-1], settings.segments * damping * 1e-3 * (rate**2).sum()
    assert lost > 1e-3 and np.diff(energy).max() < 1e-3 * lost
    assert lost == pytest.approx(taken, rel=share)


def test_the_same_seed_gives_the_same_bytes_however_often_one_looks() -> None:
    courses = []
    for looks in (1, 7):
        bench = VirtualBench(BenchSettings(), WRIST, 3, None, SECOND)
        for _ in range(looks):
            bench.transport.wait(0.35 / looks)
            bench.truth()
        bench.transport.wait(0.5 - bench.transport.now())
        courses.append(b"".join(column.tobytes() for column in bench.truth()))
    assert courses[0] == courses[1]


def test_load_cells_show_the_pulls() -> None:
    host, cells = hosted(load_cells=CELLS), Kept()
    host.reel((-100, 60, 40, 200))
    host.rest(2.0)
    host.board.cells = cells
    host.board.read()
    true = host.bench.truth().pull[-1]
    assert true.max() > 5.0 and newtons(cells.pulls[0]) == pytest.approx(true, abs=2.0 / SCALE.min())


@pytest.mark.parametrize(
    ("settings", "key"),
    [
        ({"actuator": {"slips_at": 1.0, "slipping_tendon": 6}}, "bench.actuator.slipping_tendon"),
        ({"actuator": {"broken_at": 1.0, "broken_tendon": 5}}, "bench.actuator.broken_tendon"),
    ],
)
def test_what_it_does_not_have_is_refused(settings: dict[str, Any], key: str) -> None:
    with pytest.raises(UserError) as refused:
        VirtualBench(BenchSettings.model_validate(settings), WRIST, 0, None, SECOND)
    assert refused.value.where == key and refused.value.exit_code == 2


@pytest.mark.parametrize("axis", [0, 3])
def test_the_first_and_the_last_tendon_break_when_they_should(axis: int) -> None:
    """It bends to the side of the opposite one, which has nothing to pull against then."""
    truth = course(ALL, Disturbances(), actuator={"broken_at": 0.6, "broken_tendon": axis + 1})
    assert truth.pull[500].min() > 20.0 and truth.pull[-1, axis] == 0.0 and truth.pull[-1, [1, 2]].min() > 20.0
    place = TENDONS[ACTIVE[axis]]
    assert np.abs(truth.angle[500]).max() < 0.01 and (truth.angle[-1] * place < -0.005).all()


def test_a_bench_in_one_plane_loads_no_kernel_of_two() -> None:
    code = (
        "import sys\n"
        "from wristctl.bench.virtual_bench import VirtualBench\n"
        "from wristctl.config.bench import BenchSettings\n"
        "from wristctl.config.wrist import WristParameters\n"
        "VirtualBench(BenchSettings(), WristParameters(), 0).transport.wait(0.01)\n"
        "sys.exit('wristctl.wrist.spatial.spatial_step' in sys.modules)\n"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def looked(host: Host, seconds: float) -> list[list[Any]]:
    """Frames of both cameras over so long, looked for every 2 ms."""
    frames: list[list[Any]] = [[], []]
    for tick in range(round(seconds / 2e-3)):
        if tick % 20 == 0:
            host.board.ping()
        host.bench.transport.wait(2e-3)
        for camera, seen in zip(host.bench.cameras, frames, strict=True):
            if (frame := camera.newest()) is not None:
                seen.append((host.bench.transport.now(), frame))
    return frames


def off_the_truth(host: Host, move: Callable[[tuple[int, int, int, int]], object], seconds: float) -> list[list[float]]:
    """By how much each camera's angles are off the true bend of its plane [rad], so long from two moves on."""
    trackers = [
        Tracker(markers, eye.scene.view, Gates(), plane=plane)  # type: ignore[arg-type]
        for plane, (markers, eye) in enumerate(zip((Markers(), SECOND), host.bench.eyes, strict=True))
    ]
    off: list[list[float]] = [[], []]
    for steps in ((-300, -100, -80, 500), (300, -600, 900, -100)):
        move(steps)
        for plane, frames in enumerate(looked(host, seconds)):
            truth = host.bench.truth()
            for _, frame in frames:
                true = [np.interp(frame.time, truth.time, column) for column in truth.angle.T]
                sighting = trackers[plane].see(frame)
                off[plane].append(bend_seen(sighting, trackers[plane].view, true[1 - plane]) - true[plane])
    assert np.ptp(host.bench.truth().angle, axis=0).min() > 0.2
    return off


def test_each_camera_tells_the_true_bend_of_its_plane() -> None:
    host = hosted()
    off = off_the_truth(host, lambda steps: host.board.send(Target(steps, (2000,) * 4)), 0.5)
    assert min(map(len, off)) > 40 and np.degrees(np.abs(np.concatenate(off)).max()) < 0.3


def test_cameras_run_by_clocks_of_their_own() -> None:
    second = RenderedCamera(frame_rate=50.0, phase=0.4, delay_frames=1.0, dropped=0.0)
    host = hosted(camera=RenderedCamera(dropped=0.3), camera_2=second)
    first, other = looked(host, 1.0)
    numbers = np.array([frame.number for _, frame in other])
    assert (np.diff(numbers) == 1).all()
    np.testing.assert_allclose([frame.time for _, frame in other], (numbers + 0.4) / 50.0)
    late = np.array([now - frame.time for now, frame in other])
    assert late.min() >= 0.02 - 1e-9 and late.max() < 0.0241
    assert len(first) < 50
    assert all(abs(frame.time * 60.0 - frame.number) < 1e-9 for _, frame in first)


@pytest.mark.parametrize("camera", [1, 2])
def test_a_fault_of_one_camera_leaves_the_other_as_it_is(camera: Literal[1, 2]) -> None:
    faults = (InjectedFault(kind="frames-dropped", at=0.0, since="power-on", camera=camera),)
    dropped, seen = sorted(looked(hosted(faults=faults), 0.3), key=len)
    assert len(dropped) == 0 and len(seen) > 10
    lost = hosted(faults=(InjectedFault(kind="camera-lost", at=0.0, since="power-on", camera=camera),))
    with pytest.raises(CameraError):
        lost.bench.cameras[camera - 1].newest()
    lost.bench.cameras[2 - camera].newest()
    covered = hosted(faults=(InjectedFault(kind="marker-covered", at=0.0, since="power-on", camera=camera),))
    kinds = Counter(
        tracker.see(frame).verdict.value
        for plane, frames in enumerate(looked(covered, 0.2))
        for tracker in [Tracker((Markers(), SECOND)[plane], Scene(covered.bench.settings.camera.scene, WRIST).view,
                                Gates(), plane=plane)]  # type: ignore[arg-type]
        for _, frame in frames
    )  # fmt: skip
    assert kinds["ok"] > 3 and kinds["no tip"] > 3


@pytest.mark.parametrize(
    ("kind", "size"),
    [
        ("direction-flipped", 1.0), ("direction-stuck", 1.0), ("motor-stalled", 1.0), ("drive-off", 1.0),
        ("supply-off", 1.0), ("drive-rescaled", 0.5), ("motors-exchanged", 3.0), ("torque-lost", 5.0),
        ("tendon-detached", 1.0), ("tendon-slipped", 0.4), ("tendon-creeps", 0.3),
    ],
)  # fmt: skip
def test_faults_of_motors_and_tendons_act_as_on_the_bench_in_one_plane(kind: FaultKind, size: float) -> None:
    """On the spools alike, and in the plane within a degree, where the bend across is small; without them otherwise."""
    fault = (InjectedFault(kind=kind, axis=0, at=0.02, size=size),)
    sound, flat, spatial = course(BEND), course(BEND, planes=1, faults=fault), course(BEND, faults=fault)
    assert np.abs(spatial.reeled[-1] - flat.reeled[-1]).max() < 6.0 * SLIDING.step_length
    assert np.degrees(abs(spatial.angle[-1, 0] - flat.angle[-1])) < 1.0
    assert np.degrees(np.abs(spatial.angle - sound.angle).max()) > 0.2
