"""What the world is and what its controller believes: each leaf moves the wrist, and the controller knows of none."""

from __future__ import annotations

import json
from pathlib import Path
from threading import Event
from typing import Any

import numpy as np
import pytest

from wristctl.commands.truth_table import truth_heading, truth_tables, truth_told
from wristctl.config.choices import PLANTS
from wristctl.config.loop import Loop, Reference
from wristctl.config.plant import Actuator, Plant, Sensor, TrueActuator, TrueSensor, actual
from wristctl.config.wrist import WristParameters
from wristctl.control.belief import Limits, belief_in_lanes
from wristctl.control.law import now_of
from wristctl.control.response import Controlled, Seen, respond, room_like
from wristctl.control.table import controller, gains_of
from wristctl.errors import UserError
from wristctl.lanes.compiled import kernel
from wristctl.lanes.lane import zero_like
from wristctl.lanes.rows import lanes_like, part, rows_of
from wristctl.simulation.actuator import Aim, actuate
from wristctl.simulation.batch import Batch, Lanes, batch
from wristctl.simulation.closed_loop import simulate
from wristctl.simulation.kernel import run_blocks
from wristctl.simulation.observer import Knowing, go_on, sense
from wristctl.simulation.reference import motion
from wristctl.simulation.rollout import advance_blocks, columns_of
from wristctl.simulation.simulated_drives import drive_in_lanes, winding_of
from wristctl.simulation.worlds import World, facing, mismatches, plant_of
from wristctl.study_files.load import load_study
from wristctl.study_files.resolved import config_hash, resolved_yaml
from wristctl.wrist.plant import kernel_of
from wristctl.wrist.statics import equilibrium
from wristctl.wrist.tendons import TENDONS_PER_SIDE

WRIST = WristParameters()
CAMERA = Sensor(level="camera")
LOOPS = {
    "tendon": Loop(actuator=Actuator(level="tendon"), sensor=CAMERA),
    "lagged": Loop(actuator=Actuator(level="lagged"), sensor=CAMERA),
}
LEAVES: dict[str, dict[str, Any]] = {
    **{name: {name: "x1.03"} for name in ("length", "mass", "hand_mass", "hand_offset", "stiffness", "damping")},
    "flexion_ratio": {"flexion_ratio": "x1.15"},
    "tendon_radius": {"tendon_radius": "x1.03"},
    "taper": {"taper": 1.5},
    "by value": {"stiffness": 0.5, "tendon_radius": 0.0195},
    "tendon_stiffness": {"actuator": {"tendon_stiffness": "x0.5"}},
    "lag": {"actuator": {"lag": "x3"}},
    "friction": {"actuator": {"friction": 0.3}},
    "pulley_radius": {"actuator": {"pulley_radius": "x1.02"}},
    "step_rate": {"actuator": {"step_rate": "x0.02"}},
    "step_acceleration": {"actuator": {"step_acceleration": "x0.1"}},
    "ramp": {"actuator": {"ramp": "x0.05"}},
    "command_delay": {"actuator": {"command_delay": 4e-3}},
    "update": {"actuator": {"update": "x2"}},
    "tilt_deg": {"tilt_deg": 3.0},
    "sheath": {"actuator": {"sheath": 2.0}},
    "presliding": {"actuator": {"presliding": "x4"}},
    "backlash": {"actuator": {"backlash": 1e-4}},
    "tendon creep": {"actuator": {"creep": 0.1, "creep_time": 0.3}},
    "broken_at": {"actuator": {"broken_at": 0.2}},
    "slips_at": {"actuator": {"slips_at": 0.2, "slip": 2e-4}},
    "torque": {"actuator": {"torque": 0.08}},
    "top_speed": {"actuator": {"torque": 0.2, "top_speed": 8e3}},
    "corner_speed": {"actuator": {"torque": 0.2, "top_speed": 8e3, "corner_speed": 4e3}},
    "creep": {"creep": 0.1, "creep_time": 0.3},
    "end stop": {"end_stop_deg": 31.0},
    "end stop's stiffness": {"end_stop_deg": 31.0, "end_stop_stiffness": 5.0},
    "end stop's dissipation": {"end_stop_deg": 31.0, "end_stop_dissipation": 0.0},
    "burst": {"sensor": {"dropped": 0.3, "burst": 4.0}},
    "delay_frames": {"sensor": {"delay_frames": 3.5}},
    "noise_deg": {"sensor": {"noise_deg": "x2"}},
    "dropped": {"sensor": {"dropped": 0.3}},
    "zero_deg": {"sensor": {"zero_deg": 1.0}},
}
SKEWED: dict[str, Any] = {"sensor": {"zero_deg": -4.0}}
BESIDE: dict[str, dict[str, Any]] = {
    "taper": {"model": "hinges"},
    "end stop": SKEWED,
    "corner_speed": {"actuator": {"torque": 0.2, "top_speed": 8e3}},
    **{f"end stop's {leaf}": SKEWED | {"end_stop_deg": 31.0} for leaf in ("stiffness", "dissipation")},
}
"""What both worlds have where a leaf is tried: a camera that lets the wrist go too far."""
STILL = {
    ("lagged", "friction"): "tendons pull without friction there",
    **{
        ("lagged", leaf): "tendons pull as commanded there"
        for leaf in (
            "sheath",
            "presliding",
            "backlash",
            "tendon creep",
            "slips_at",
            "torque",
            "top_speed",
            "corner_speed",
        )
    },
    ("lagged", "step_acceleration"): "motors change their pull at once there, no faster than the steps come",
    **{("lagged", leaf): "motors pull at once there" for leaf in ("ramp", "command_delay", "update")},
    ("tendon", "lag"): "a stepper has none",
    **{(level, "flexion_ratio"): "the motion is in the other plane" for level in ("tendon", "lagged")},
}
"""Leaves that are of another level, with the reason."""
OF_MOTORS = ("lag", "step_rate", "step_acceleration", "ramp", "command_delay", "update")
"""Leaves that say which steps motors make, by which their host counts."""
COLUMNS = {"theta": 0, "torque_wanted": 2, "tension_plus": 4, "tension_minus": 5, "seen": 8}


def prepared(plant: Plant, loop: Loop, horizon: float = 0.6) -> Batch:
    """One rollout, each tick of it recorded."""
    law, followed = controller("smc-tracking"), motion(Reference(duration=0.3), WRIST, horizon, 1e-3)
    world = World(loop.model_copy(update={"plant": plant}), WRIST)
    lanes = Lanes(np.zeros(1, np.int64), np.zeros(1, np.int64), [(4, 2)])
    gains, columns = np.array([gains_of(law, "camera")]), columns_of(True, loop.plant_segments)
    return batch(law, gains, [followed], [world], lanes, PLANTS[plant.model], None, columns)


def finished(plant: Plant, loop: Loop, horizon: float = 0.6) -> Batch:
    """The same, run to its end."""
    done = prepared(plant, loop, horizon)
    advance_blocks(done, kernel_of(run_blocks, PLANTS[plant.model]), 1, lambda share: None, Event())
    return done


def column(done: Batch, name: str) -> np.ndarray:
    record: np.ndarray = done.state.record[0, :, COLUMNS[name]]
    return record.ravel()


@kernel
def _controller_side(setup: Any, course: Any, world: Any, state: Any, scratch: Any, out: Any) -> None:
    """What `run_blocks` does of one lane without a plant: frames and their dates are given."""
    known, drive = belief_in_lanes(world.belief), drive_in_lanes(world.drive)
    control = Controlled(setup.law, scratch.now, world.belief.models, world.gains, state.memory, scratch.target)
    bound, motor, target = rows_of(world.limits), rows_of(state.motors), rows_of(scratch.target[0])
    limits = Limits(part(bound, 0, setup.pulls), part(bound, 2, setup.pulls))
    bend, pulls, counts = lanes_like(part(bound, 0, setup.bend)), lanes_like(limits.least), lanes_like(limits.least)
    still, wish, wish_rate = lanes_like(bend), lanes_like(bend), lanes_like(bend)
    rows = lanes_like(part(motor, 0, setup.seen))
    seen = Seen(rows, part(motor, 4, setup.bend), part(motor, 5, setup.bend))
    room = room_like(bend, pulls)
    aim, knowing = Aim(wish, wish_rate, lanes_like(pulls)), Knowing(known, drive, bend, pulls, pulls)
    zero, view = zero_like(bound[0]), now_of(scratch.now[0])
    still[0] = zero
    for tick in range(out.shape[0]):
        for value in range(3):
            target[value] = course.references[0, value, tick] + zero
        sense(state.watch, world.schedule, knowing, tick, still, still, setup.period, rows)
        respond(control, known, seen, limits, room, 0.0, setup.period, pulls)
        row = rows_of(out[tick])
        row[0], row[1], row[2] = room.wanted[0], pulls[0], pulls[1]
        wish[0], wish_rate[0] = view.theta_ref, view.rate_ref
        actuate(drive, motor, known, aim, pulls, setup.period, counts)
        go_on(state.watch, knowing, tick, counts, setup.period)


def only(values: Any) -> Any:
    """The only block of named arrays of blocks."""
    if type(values) is tuple:
        return values
    return type(values)(*(map(only, values))) if hasattr(values, "_fields") else values[0]


def commands_from(recorded: Batch, loop: Loop, speeds: TrueActuator) -> np.ndarray:
    """Torque and both pulls (T, 3) of a controller that gets the frames of another run, and has only its belief."""
    fresh, watch = prepared(Plant(actuator=speeds), loop), recorded.state.watch
    start, delivered = fresh.state.watch.observer, np.zeros_like(watch.observer.delivered)
    given = watch._replace(
        turn=np.array([[[recorded.world.schedule.captures.shape[1]], [0]]]),
        observer=start._replace(delivered=delivered),
    )
    out = np.zeros((recorded.samples, 3))
    world, state = fresh.world._replace(schedule=recorded.world.schedule), fresh.state._replace(watch=given)
    _controller_side(fresh.setup, fresh.course, only(world), only(state), fresh.scratch(), out)
    return out


@pytest.mark.parametrize("leaf", LEAVES)
@pytest.mark.parametrize("level", LOOPS)
@pytest.mark.slow
def test_a_leaf_moves_the_wrist_and_the_controller_knows_only_its_frames_and_steps(level: str, leaf: str) -> None:
    loop, beside = LOOPS[level], BESIDE.get(leaf, {})
    without, plant = (
        load_study([], [f"simulate.loop.plant={json.dumps(each)}"]).simulate.loop.plant
        for each in (beside, beside | LEAVES[leaf])
    )
    believed, actual = finished(without, loop), finished(plant, loop)
    moved = np.abs(column(actual, "theta") - column(believed, "theta")).max()
    if (level, leaf) in STILL:
        assert moved == 0.0, STILL[level, leaf]
    else:
        assert moved > 1e-6
    own = plant.actuator
    speeds = TrueActuator(**{name: getattr(own, name) for name in OF_MOTORS})
    again = commands_from(actual, loop, speeds)
    for number, name in enumerate(("torque_wanted", "tension_plus", "tension_minus")):
        own_side = again[:, number] / (TENDONS_PER_SIDE if number else 1.0)
        assert own_side.tobytes() == column(actual, name).tobytes()


def test_each_plane_has_its_own_truth() -> None:
    """What is stiffer toward flexion alone is there what is stiffer everywhere, and elsewhere as ever."""
    loop = LOOPS["tendon"]

    def course(direction: str, **plant: Any) -> bytes:
        own = loop.model_copy(update={"plant": Plant(**plant)})
        chosen = {"direction": direction, "loop": own, "horizon": 0.3, "controller": "smc-tracking", "gains": "camera"}
        study = load_study()
        done = simulate(study.model_copy(update={"simulate": study.simulate.model_copy(update=chosen)}))
        return done.first.trajectory.theta.tobytes()

    for flexion, ulnar in (("flexion", "ulnar"), ("extension", "radial")):
        assert course(flexion, flexion_ratio=1.25) == course(flexion, stiffness="x1.25") != course(flexion)
        assert course(flexion, flexion_ratio=1.25, stiffness="x0.8") == course(flexion)
        assert course(ulnar, flexion_ratio=1.25) == course(ulnar)


def test_a_plane_is_faced_with_what_is_believed_of_it_and_true_of_it() -> None:
    believed = WRIST.model_copy(update={"flexion_ratio": 1.5, "gravity": (-3.0, 5.0), "gravity_flexion": -2.0})
    own, plant = facing(believed, Plant(stiffness="x0.8", flexion_ratio=2.0, length="x1.1", payload=0.1), "extension")
    assert own.stiffness == pytest.approx(1.5 * WRIST.stiffness) and own.gravity == (-3.0, -2.0)
    actual = plant_of(own, plant)
    assert actual.stiffness == pytest.approx(0.8 * 2.0 * WRIST.stiffness) and actual.length == pytest.approx(0.088)
    assert actual.hand_mass == pytest.approx(0.4) and actual.damping == WRIST.damping and actual.gravity == own.gravity
    assert facing(believed, plant, "radial") == (believed, plant)


def test_what_is_given_as_it_is_believed_changes_no_bit() -> None:
    for loop in LOOPS.values():
        names = [name for name in TrueActuator.model_fields if name in Actuator.model_fields]
        given = TrueActuator(**{name: getattr(loop.actuator, name) for name in names})
        same = Plant(length=WRIST.length, tendon_radius="x1", actuator=given, sensor=TrueSensor(noise_deg="x1.0"))
        assert column(finished(same, loop), "theta").tobytes() == column(finished(Plant(), loop), "theta").tobytes()


def test_steps_mean_what_the_worlds_pulley_makes_of_them() -> None:
    """At rest an ideal controller's spools stand where it counts them; a pulley 2 % larger has reeled in 2 % more."""
    believed, own = Actuator(level="tendon"), Actuator(level="tendon", pulley_radius=1.02 * Actuator().pulley_radius)
    winding = winding_of(believed, own, 4.0)
    home = 4.0 / believed.tendon_stiffness
    assert winding.scale == pytest.approx(1.02)
    assert winding.scale * home + winding.offset == pytest.approx(home, rel=1e-12), "homed at the same pull"
    steps = 500 * believed.step_length
    reeled = winding.scale * (home + steps) + winding.offset
    assert reeled - home == pytest.approx(500 * own.step_length, rel=1e-9)
    softer = winding_of(believed, Actuator(level="tendon", tendon_stiffness=10e3), 4.0)
    assert softer.scale == 1.0 and home + softer.offset == pytest.approx(4.0 / 10e3)


def test_a_zero_that_is_wrong_by_a_degree_costs_a_degree_and_is_not_seen() -> None:
    done = finished(Plant(sensor=TrueSensor(zero_deg=1.0)), LOOPS["tendon"], horizon=4.0)
    theta, seen = (np.degrees(column(done, name)[-1000:].mean()) for name in ("theta", "seen"))
    assert seen - theta == pytest.approx(1.0, abs=0.05) and theta < 29.7


@pytest.mark.parametrize(
    ("given", "expected"),
    [(None, 2.0), (3.0, 3.0), ("x1.5", 3.0), ("X 0.5", 1.0), ("x1e-1", 0.2)],
)
def test_a_leaf_is_a_value_or_a_multiple(given: float | str | None, expected: float) -> None:
    assert actual(2.0, given) == pytest.approx(expected)


@pytest.mark.parametrize("given", ["tendon_radius=x-1", "tendon_radius=x0", "stiffness=0", "sensor.noise_deg=-1",
    "length=1.05x", "actuator.lag=many", "tendon_radiu=1", "actuator.level=tendon", "tension_limit=3"])  # fmt: skip
def test_what_a_leaf_cannot_be_is_refused(given: str) -> None:
    with pytest.raises(UserError, match=r"simulate\.loop\.plant\."):
        load_study([], [f"simulate.loop.plant.{given}"])


def test_the_wrist_as_it_is_has_its_leaves_then_scales_and_payload() -> None:
    plant = Plant(stiffness="x0.9", stiffness_scale=0.5, hand_mass=0.2, payload=0.1, length="x1.1")
    own = plant_of(WRIST, plant)
    assert own.stiffness == pytest.approx(0.45 * WRIST.stiffness) and own.hand_mass == pytest.approx(0.3)
    assert own.length == pytest.approx(0.088) and own.tendon_radius == WRIST.tendon_radius


def test_a_study_without_truth_is_written_and_hashed_as_before(tmp_path: Path) -> None:
    plain, told = load_study(), load_study([], ["simulate.loop.plant={length: x1.05, sensor: {zero_deg: 0.5}}"])
    assert "zero_deg" not in resolved_yaml(plain, "simulate")
    assert "length" not in plain.simulate.loop.plant.model_dump()
    text = resolved_yaml(told, "simulate")
    assert "length: x1.05" in text and "zero_deg: 0.5" in text
    assert config_hash(told, "simulate") != config_hash(plain, "simulate")
    (tmp_path / "told.yaml").write_text(text)
    assert load_study([tmp_path / "told.yaml"]).simulate == told.simulate


def test_what_differs_is_listed_with_what_is_believed() -> None:
    plant = Plant(tendon_radius="x1.03", payload=0.1, sensor=TrueSensor(zero_deg=0.5, delay_frames=3.0))
    loop = LOOPS["tendon"].model_copy(update={"plant": plant})
    found = {each.key: (each.believed, each.actual, each.unit) for each in mismatches(World(loop, WRIST))}
    assert found == {
        "tendon_radius": (0.02, pytest.approx(0.0206), "m"),
        "hand_mass": (0.3, pytest.approx(0.4), "kg"),
        "sensor.delay_frames": (2.0, 3.0, ""),
        "sensor.zero_deg": (0.0, 0.5, "deg"),
    }
    assert mismatches(World(LOOPS["tendon"], WRIST)) == []


def test_a_trials_twin_has_all_that_its_bench_has() -> None:
    tendons = "actuator: {backlash: 1.0e-4, sheath: 2.0}, motors: {holding_torque: 0.9}"
    bench = f"hw-run.bench={{plant: {{creep: 0.1, end_stop_deg: 48}}, {tendons}}}"
    plant = load_study([], [bench]).hw_run.loop.plant
    assert (plant.creep, plant.end_stop_deg, plant.stiffness_scale) == (0.1, 48.0, 0.7)
    own = plant.actuator
    assert (own.backlash, own.sheath, own.torque, own.friction) == (1e-4, 2.0, 0.9, None)


@pytest.mark.parametrize("leaf", LEAVES)
def test_every_leaf_is_told_before_and_after_a_run(leaf: str) -> None:
    plant = load_study([], [f"simulate.loop.plant={json.dumps(LEAVES[leaf])}"]).simulate.loop.plant
    loops = {"own": LOOPS["tendon"].model_copy(update={"plant": plant})}
    (table,) = truth_tables(WRIST, loops)
    told = truth_told(WRIST, loops)
    names = []
    for key, each in LEAVES[leaf].items():
        names += [f"{key}.{name}" for name in each] if isinstance(each, dict) else [key]
    assert {row[1] for row in table.rows} == set(names) and all(f"own: {name} is" in told for name in names)


def test_a_figure_names_what_differs() -> None:
    plant = Plant(tendon_radius="x1.03", length="x1.1", end_stop_deg=45.0, sensor=TrueSensor(zero_deg=0.5, burst=3.0))
    told = truth_heading(WRIST, LOOPS["tendon"].model_copy(update={"plant": plant}))
    assert told == "not as believed: length, tendon_radius, end_stop_deg, burst, 1 more"
    assert truth_heading(WRIST, LOOPS["tendon"]) == ""


def test_a_base_that_leans_lets_the_wrist_hang_to_that_side() -> None:
    """By 90 deg: gravity is what it would be of a wrist that is held level."""
    own = plant_of(WRIST, Plant(tilt_deg=90.0))
    np.testing.assert_allclose(own.gravity, (0.0, 9.81), atol=1e-12)
    leaning = plant_of(WRIST, Plant(tilt_deg=5.0))
    assert equilibrium(leaning, 4, (8.0, 8.0)).sum() > 0.01 and plant_of(WRIST, Plant()) == WRIST
