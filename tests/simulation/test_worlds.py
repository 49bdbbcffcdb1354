"""Many worlds in one batch, and the noise and plants that repetitions draw: what belongs to whom."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from wristctl.comparison.combinations import ComparedRow, compare
from wristctl.config.loop import Loop, Reference
from wristctl.config.plant import Actuator, Disturbances, Plant, Push, Sensor
from wristctl.config.study import Study
from wristctl.config.wrist import WristParameters
from wristctl.control.table import controller, gains_of
from wristctl.errors import UserError
from wristctl.simulation.cases import measure
from wristctl.simulation.closed_loop import simulate
from wristctl.simulation.reference import motion
from wristctl.simulation.rollout import rollout
from wristctl.simulation.worlds import Draws, drawn
from wristctl.study_files.load import load_study
from wristctl.tuning.search import tuning_cases

WRIST = WristParameters()
WORLDS = [
    (Loop(), WRIST),
    (Loop(plant=Plant(stiffness_scale=0.7)), WRIST),
    (Loop(plant=Plant(payload=0.1)), WristParameters(tension_limit=20.0)),
    (Loop(limits=False, disturbances=Disturbances(push=Push(force=1.0, start=0.1))), WRIST),
    (Loop(), WristParameters(stiffness=0.5, tendon_radius=0.022, pretension=3.0)),
]
MOTORS = [
    Actuator(level="tendon"),
    Actuator(level="tendon", tendon_stiffness=8e3, friction=0.3),
    Actuator(level="tendon", microstep=8),
]
CAMERAS = [
    Sensor(level="camera", **own) for own in ({}, {"noise_deg": 0.3}, {"load_drift": 0.1}, {"delay_frames": 3.0})
]


def samples(loops: Any, wrists: Any, count: int, streams: list[tuple[int, ...]] | None = None) -> np.ndarray:
    law = controller("smc-tracking")
    gains, followed = np.tile(gains_of(law, "camera"), (count, 1)), motion(Reference(), WRIST, 0.4, 1e-3)
    done = rollout(law, gains, [followed], np.zeros(count, np.int64), loops, wrists, streams=streams, record=True)
    assert done.samples is not None
    return done.samples


def test_each_lanes_world_is_its_own_whatever_stands_beside_it() -> None:
    loops, wrists = ([pair[side] for pair in WORLDS * 4] for side in (0, 1))
    together = samples(loops, wrists, len(loops))
    for lane, (loop, wrist) in enumerate(WORLDS):
        alone = samples(loop, wrist, 1)
        assert together[lane].tobytes() == together[lane + len(WORLDS)].tobytes() == alone[0].tobytes()
    assert len({lane.tobytes() for lane in together}) == len(WORLDS)


def test_motors_and_cameras_are_one_a_lane_even_where_frames_come_at_other_ticks() -> None:
    loops = [Loop(actuator=motors, sensor=camera) for motors in MOTORS for camera in CAMERAS]
    streams: list[tuple[int, ...]] = [(1, 2)] * len(loops)
    together = samples(loops, WRIST, len(loops), streams)
    for lane, loop in enumerate(loops):
        assert together[lane].tobytes() == samples(loop, WRIST, 1, streams[:1])[0].tobytes()
    assert len({lane.tobytes() for lane in together}) == len(loops)


def test_loops_of_another_structure_are_refused_in_one_batch() -> None:
    for other in (Loop(plant_segments=2), Loop(control_period=2e-3), Loop(actuator=MOTORS[0]), Loop(sensor=CAMERAS[0])):
        with pytest.raises(ValueError, match="differ in segments, plant, timing"):
            samples([Loop(), other], WRIST, 2)


def study(*overrides: str) -> Study:
    """Behind a camera, with a plant of its own in each repetition."""
    return load_study([], [
        "compare.controllers=[{controller: smc-tracking, gains: camera}, "
        "{controller: pid, gains: {Kp: 20, Ki: 5, Kd: 0.5}}]",
        "compare.references=[{kind: step}, {kind: minimum-jerk, duration: 0.3}]",
        "compare.loops={camera: {sensor: {level: camera}, plant: {stiffness_spread: 0.2}}}",
        "compare.inverses=[none]", "compare.horizon=0.5", "compare.repetitions=3", *overrides,
    ])  # fmt: skip


def bytes_of(results: list[ComparedRow]) -> dict[tuple[str, ...], bytes]:
    """Metrics and errors of every repetition, by row."""
    return {
        (each.loop, each.reference, each.controller, each.gains): each.repeated.errors.tobytes()
        + b"".join(values.tobytes() for values in each.repeated.metrics.values())
        for each in results
    }


def test_another_row_loop_or_reference_changes_no_byte_of_those_that_were_there() -> None:
    before = bytes_of(compare(study()))
    more = bytes_of(compare(study(
        "compare.controllers=[{controller: feedforward, gains: default}, "
        "{controller: pid, gains: {Kp: 20, Ki: 5, Kd: 0.5}}, "
        "{controller: smc-tracking, gains: hardware}, {controller: smc-tracking, gains: camera}]",
        "compare.references=[{kind: step, angle_deg: 10}, {kind: minimum-jerk, duration: 0.3}, {kind: step}]",
        "compare.loops={soft: {sensor: {level: camera}, plant: {stiffness_scale: 0.7}}, "
        "camera: {sensor: {level: camera}, plant: {stiffness_spread: 0.2}}}",
    )))  # fmt: skip
    assert len(before) == 4 and len(more) == 24
    assert all(more[row] == before[row] for row in before)


def test_fewer_repetitions_are_the_first_of_more() -> None:
    three, two = (compare(study(f"compare.repetitions={count}")) for count in (3, 2))
    for more, fewer in zip(three, two, strict=True):
        for name, values in fewer.repeated.metrics.items():
            np.testing.assert_array_equal(more.repeated.metrics[name][:2], values)


def test_in_a_repetition_all_rows_meet_the_same_noise_and_plant() -> None:
    """Two rows with equal gains are equal in each repetition, though no two repetitions are."""
    gains = ("{Kp: 20, Ki: 5, Kd: 0.5}", "{Kp: 20, Kd: 0.5, Ki: 5}")
    twice = study(f"compare.controllers=[{', '.join(f'{{controller: pid, gains: {each}}}' for each in gains)}]")
    first, second = (each.repeated for each in compare(twice) if each.reference.startswith("step"))
    assert first.errors.tobytes() == second.errors.tobytes()
    assert len({each.tobytes() for each in first.errors}) == 3


def test_the_root_seed_reaches_the_camera_and_the_drawn_plant() -> None:
    def rmse(seed: int, loop: str) -> float:
        own = load_study([], [f"seed={seed}", "simulate.controller=smc-tracking", "simulate.gains=camera",
                              f"simulate.loop={loop}", "simulate.horizon=0.5"])  # fmt: skip
        return simulate(own).first.metrics["rmse"]

    for loop in ("{sensor: {level: camera}}", "{plant: {stiffness_spread: 0.3}}", "{plant: {payload_spread: 0.2}}"):
        assert len({rmse(seed, loop) for seed in range(3)}) == 3
        assert rmse(1, loop) == rmse(1, loop)
    assert rmse(0, "{}") == rmse(1, "{}")


def test_a_simulation_meets_the_noise_that_a_comparison_of_the_same_scenario_meets() -> None:
    compared = next(each for each in compare(study()) if each.controller == "smc-tracking")
    alone = simulate(load_study([], [
        "simulate.controller=smc-tracking", "simulate.gains=camera", "simulate.reference={kind: step}",
        "simulate.loop={sensor: {level: camera}, plant: {stiffness_spread: 0.2}}", "simulate.horizon=0.5",
        "simulate.repetitions=3",
    ]))  # fmt: skip
    assert alone.errors.tobytes() == compared.repeated.errors.tobytes()


def test_gains_are_tuned_under_other_noise_than_they_are_judged_under() -> None:
    assert Draws(0, "tuning").camera("step 30 deg, ulnar", 0) != Draws(0).camera("step 30 deg, ulnar", 0)
    assert Draws(0).camera("step 30 deg, ulnar", 0) != Draws(0).camera("step 30 deg, ulnar", 1)
    assert Draws(0).camera("step 30 deg, ulnar", 0) != Draws(0).camera("step 30 deg, radial", 0)


@pytest.mark.parametrize("converge", [True, False])
def test_what_is_told_of_measuring_only_grows_and_ends_with_all(converge: bool) -> None:
    """Two loops of other structures are a batch each; where all converge at once there is no further pass."""
    law, told = controller("smc-tracking"), list[float]()
    gains = np.tile([[20.0, 250.0, 100.0, 10.0]], (40, 1))
    base = [
        "tune.scenarios=[{loop: camera}, {loop: exact}]", "tune.horizon=0.3",
        "tune.loops={camera: {sensor: {level: camera}}, exact: {}}", "tune.repetitions=1",
    ]  # fmt: skip
    cases, _ = tuning_cases(load_study([], base))
    measure(law, gains, cases, WRIST, ["rmse"], told.append, converge)
    assert told == sorted(told) and told[-1] == 1.0 and 0.5 in told
    assert any(0.16 < share < 0.5 for share in told) is not converge and any(0.0 < share < 0.5 for share in told)


def test_an_objective_over_repetitions_is_the_mean_of_theirs() -> None:
    law, gains = controller("smc-tracking"), np.array([[20.0, 250.0, 100.0, 10.0], [30.0, 250.0, 80.0, 10.0]])
    base = [
        "tune.scenarios=[{loop: camera, reference: {kind: step, angle_deg: 20}}]", "tune.horizon=0.5",
        "tune.loops={camera: {sensor: {level: camera}}}",
    ]  # fmt: skip
    cases, others = tuning_cases(load_study([], [*base, "tune.repetitions=4"]))
    found = measure(law, gains, cases, WRIST, ["rmse"]).metrics["rmse"]
    draws, followed = Draws(0, "tuning"), motion(Reference(kind="step", angle_deg=20.0), WRIST, 0.5, 1e-3)
    each = [
        rollout(law, gains, [followed], np.zeros(2, np.int64), Loop(sensor=Sensor(level="camera")), WRIST,
                streams=[draws.camera("step 20 deg, ulnar", k)] * 2).metrics["rmse"]
        for k in range(4)
    ]  # fmt: skip
    np.testing.assert_array_equal(found, np.transpose(each))
    assert len(others) == 20 and not {case.stream for case in cases} & {case.stream for case in others}


def test_drawn_plants_lie_evenly_within_their_spreads_and_keep_no_spread() -> None:
    plant = Plant(stiffness_scale=0.8, stiffness_spread=0.25, damping_spread=0.5, payload=0.1, payload_spread=0.2)
    many = [drawn(plant, (3, k)) for k in range(400)]
    stiffness, damping, payload = np.array([(p.stiffness_scale, p.damping_scale, p.payload) for p in many]).T
    for values, low, high in ((stiffness, 0.6, 1.0), (damping, 0.5, 1.5), (payload, 0.1, 0.3)):
        assert low <= values.min() < low + 0.02 * (high - low) and high - 0.02 * (high - low) < values.max() <= high
        assert values.mean() == pytest.approx(0.5 * (low + high), abs=0.05 * (high - low))
    assert np.abs(np.corrcoef([stiffness, damping, payload])[np.triu_indices(3, 1)]).max() < 0.15
    assert all(each == drawn(each, (9, 9)) for each in many[:3])


@pytest.mark.parametrize("angle", [20.0, -20.0])
def test_an_end_stop_within_a_references_range_is_refused(angle: float) -> None:
    law, wrist = controller("pid-ff"), WristParameters()
    gains, which = np.array([gains_of(law, "default")]), np.zeros(1, np.int64)
    followed = [motion(Reference(angle_deg=angle, duration=0.02), wrist, 0.05, 1e-3)]
    for stop in (15.0, 20.0):
        loop = Loop(plant=Plant(end_stop_deg=stop))
        with pytest.raises(UserError, match=rf"the end stop at {stop:g} deg lies inside the reference's range, 20 deg"):
            rollout(law, gains, followed, which, loop, wrist)
    assert not rollout(law, gains, followed, which, Loop(plant=Plant(end_stop_deg=20.5)), wrist).failed.any()
