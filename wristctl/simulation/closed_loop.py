"""Closed loops out of rollouts: trajectories, and the loop of a study's `simulate` section, repeated."""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.config.loop import DirectionName, Loop, Reference, sample_period
from wristctl.config.study import Study
from wristctl.config.wrist import WristParameters
from wristctl.control.law import Controller, in_a_first_repetition
from wristctl.control.table import CONTROLLERS, controller, gains_of
from wristctl.errors import UserError
from wristctl.processes import cores
from wristctl.seeds import Entropy
from wristctl.simulation.batch import Start
from wristctl.simulation.metrics import of_trajectory
from wristctl.simulation.motion import Motion
from wristctl.simulation.outcome import Outcome
from wristctl.simulation.planes import Asked, motion_in, planes_of
from wristctl.simulation.reference import reference_name
from wristctl.simulation.repetitions import Gathered, Repeated, Simulation
from wristctl.simulation.rollout import check_two_planes, rollout
from wristctl.simulation.stationary_filter import beliefs_of, expected_error
from wristctl.simulation.trajectory import Trajectory
from wristctl.simulation.worlds import Draws, World, is_random, loop_facing, loops_of, plant_of
from wristctl.wrist.kinematics import Inverse
from wristctl.wrist.plant import plant_in
from wristctl.wrist.tendon_layout import TendonLayout

# Rollouts that are recorded at once.
_TOGETHER = 64
_LENGTH = WristParameters().length


def repeat(
    law: Controller,
    gains: Array,
    motions: Sequence[Motion],
    which: NDArray[np.int64],
    loop: Loop,
    wrist: WristParameters,
    scenarios: Sequence[str],
    draws: Draws,
    repetitions: int = 1,
    start: Start | None = None,
    progress: Callable[[float], None] | None = None,
) -> list[Repeated]:
    """Repeat loops: rows of gains (count, g) with the motion `which` (count,), as often as asked for.

    `scenarios` are the names of the motions' scenarios, which their noise goes by. Where nothing is drawn a repetition
    could not differ from another: such loops run once.
    """
    rows, times = len(gains), repetitions if is_random(loop) else 1
    loops = loops_of(loop, [draws.plant(repetition) for repetition in range(times)])
    repetitions_at_once = max(1, _TOGETHER // rows)
    layout = TendonLayout.of(wrist) if motions[0].planes == 2 else None
    beliefs = beliefs_of(World(loop, wrist), layout) if loop.sensor.level == "camera" else []
    expected = np.array([expected_error(belief) for belief in beliefs])
    gathered: list[Gathered] = [Gathered() for _ in range(rows)]
    for first in range(0, times, repetitions_at_once):
        now = range(first, min(first + repetitions_at_once, times))

        def report(share: float, now: range = now) -> None:
            if progress is not None:
                progress((now.start + share * len(now)) / times)

        lane_loops = loop if len(now) == 1 and loops[now[0]] is loop else [loops[k] for k in now for _ in range(rows)]
        streams = [draws.camera(scenarios[motion], k) for k in now for motion in which]
        outcome = rollout(
            law, np.tile(gains, (len(now), 1)), motions, np.tile(which, len(now)), lane_loops, wrist, start, streams,
            record=True, progress=report,
        )  # fmt: skip
        _refuse_nan(law, outcome, motions[0].time)
        for lane, k in enumerate(k for k in now for _ in range(rows)):
            plant, row = plant_of(wrist, loops[k].plant), lane % rows
            course = trajectory(outcome, lane, motions[which[row]], plant, loop, expected)
            gathered[row].add(simulation(outcome, lane, course))
    return [row_results.repeated(wrist) for row_results in gathered]


def _refuse_nan(law: Controller, outcome: Outcome, time: Array) -> None:
    """UserError where a law from elsewhere answered nan while the wrist was well: that is no failure of the wrist."""
    origin = CONTROLLERS.origin(law.name)
    if origin is None:
        return
    for lane in range(len(outcome.failed)):
        for theta, wanted in zip(outcome.part("bend", lane).T, outcome.part("torque_wanted", lane).T, strict=True):
            bad = np.flatnonzero(np.isfinite(theta) & np.isnan(wanted))
            if len(bad):
                problem = f"{law.name} returned nan at {time[bad[0]]:.4g} s, theta = {theta[bad[0]]:.3g} rad"
                raise UserError(problem, origin.reference, "return a finite torque [N m] whatever it sees")


def simulation(outcome: Outcome, index: int, course: Trajectory) -> Simulation:
    """The recorded rollout `index`, its `trajectory`, with all its metrics."""
    metrics = {name: float(values[index]) for name, values in outcome.metrics.items()}
    failed, until = bool(outcome.failed[index]), float(outcome.until[index])
    return Simulation(course, metrics | of_trajectory(course), failed, until)


def trajectory(
    outcome: Outcome,
    index: int,
    followed: Motion,
    plant: WristParameters,
    loop: Loop,
    expected: Array | Sequence[float] = (),
) -> Trajectory:
    """The recorded rollout `index` of a loop as a Trajectory; `plant` is the wrist as it is.

    `expected` is the standard deviation of its observer's error in each plane by what that believes [rad].
    """
    planes = followed.planes

    def of(kind: str) -> Array:
        values = outcome.part(kind, index)
        return values[:, 0] if planes == 1 else values

    coordinates, observed, wound = outcome.coordinates(index), loop.sensor.level == "camera", loop.actuator.winds
    return Trajectory(
        label="",
        time=followed.time,
        theta=of("bend"),
        segment_theta=coordinates,
        rate=of("rate"),
        theta_ref=followed.theta_ref,
        theta_desired=followed.theta_desired,
        tip=plant_in(planes, loop.plant.model).tips(plant, coordinates),
        tip_desired=followed.tip_desired,
        torque_wanted=of("torque_wanted"),
        torque=of("torque"),
        tension=outcome.part("tension", index),
        acting=outcome.part("acting", index),
        seen=of("seen"),
        load=of("load") if observed else None,
        share=outcome.part("share", index)[:, 0] if planes == 2 else None,
        expected=np.asarray(expected) if len(expected) else math.nan,
        substeps=int(outcome.steps[index]),
        drift=float(outcome.drift[index]),
        outside=followed.outside,
        spools=outcome.part("delivered", index) if wound else None,
    )


def scenario_of(reference: Reference, direction: DirectionName) -> str:
    """The name that a scenario's noise goes by: its reference, on a wrist of the default length, and direction."""
    return f"{reference_name(reference.in_metres(_LENGTH))}, {direction}"


def equilibrium(loop: Loop, planes: int = 1) -> Start:
    """Equilibrium at which a plant of this loop in so many planes rests at pretension."""
    model, n = plant_in(planes, loop.plant.model), loop.plant_segments
    return lambda plant: model.rest(plant, n, (plant.pretension, plant.pretension))


def asked_of(
    study: Study, period: float, network: Inverse | None = None, later: bool = False
) -> tuple[WristParameters, Loop, Motion]:
    """Wrist, loop and motion, on the grid of `period` [s], of the study's `simulate` section.

    In one plane they are as its direction's plane sees them; `later` is as `motion_in` has it. Raises UserError for
    what no such loop has.
    """
    chosen, wrist, loop = study.simulate, study.wrist, study.simulate.loop
    planes = planes_of(wrist, [Asked(loop, chosen.reference, chosen.direction)])
    if planes == 1:
        wrist, loop = loop_facing(wrist, loop, chosen.direction)
    else:
        check_two_planes([World(loop, wrist)])
    motion = motion_in(planes, chosen.reference, chosen.direction, wrist, chosen.horizon, period, network, later)
    return wrist, loop, motion


def follow(
    law: Controller,
    gains: Array,
    followed: Motion,
    wrist: WristParameters | None = None,
    loop: Loop | None = None,
    force: Array | None = None,
    stream: Entropy = (0,),
) -> Simulation:
    """Follow one motion from the straight wrist at rest, in the planes that it bends in.

    Parameters
    ----------
    law, gains
        A controller and its gains (g,), the same for each plane.
    followed
        The motion, of `wristctl.simulation.reference.motion` or `Motion.of_bends`.
    wrist
        The wrist as its controller knows it; None: the paper's.
    loop
        Plant, motors, tendons, camera and timing; None: four segments, ideal motors and sensors.
    force
        Force on the tip (3,) or (3, T) [N], along the base, toward ulnar, toward flexion, beside the loop's own
        disturbances; the laws do not know it.
    stream
        Entropy of the camera's noise.

    Raises UserError for what no loop in these planes has.
    """
    loop, wrist = loop or Loop(), wrist or WristParameters()
    rows, which = np.reshape(np.asarray(gains, float), (1, -1)), np.zeros(1, np.int64)
    outcome = rollout(law, rows, [followed], which, loop, wrist, None, [stream], record=True, force=force)
    course = trajectory(outcome, 0, followed, plant_of(wrist, loop.plant), loop)
    return simulation(outcome, 0, course)


def simulate(
    study: Study,
    network: Inverse | None = None,
    tuned: Mapping[str, Mapping[str, float]] | None = None,
    progress: Callable[[float], None] | None = None,
    learns: bool = True,
) -> Repeated:
    """Run the study's `simulate` section: one closed loop, as often as it says.

    Of a law that learns over repetitions it is the one that is evaluated, or without `learns` the first of them.
    `network` is needed where the reference has `inverse: network`, `tuned` (gains by controller and name) where the
    gains are `tuned`. Raises UserError for an unknown controller or preset, a reference out of reach, or a start in
    equilibrium of a wrist that buckles.
    """
    chosen, draws = study.simulate, Draws(study.seed)
    law = controller(chosen.controller) if learns else in_a_first_repetition(controller(chosen.controller))
    gains = np.array([gains_of(law, chosen.gains, tuned, chosen.loop)])
    wrist, loop, followed = asked_of(study, sample_period(chosen.loop.control_period), network)
    start = equilibrium(loop, followed.planes) if chosen.start == "equilibrium" else None
    scenario = scenario_of(chosen.reference, chosen.direction)
    which = np.zeros(1, np.int64)
    (repeated,) = repeat(
        law, gains, [followed], which, loop, wrist, [scenario], draws, chosen.repetitions, start, progress
    )  # fmt: skip
    name = chosen.gains if isinstance(chosen.gains, str) else "given"
    return repeated.labelled(f"{law.name}/{name}")


# Integration steps of one rollout: an hour and more.
MOST_STEPS = 1e10
FEWEST = 5
"""Control periods of a rollout."""
# Integration steps of all rollouts: a month on one core.
MOST_IN_ALL = 1e13
# Integration steps a second on a core, of four segments side by side.
RATE = 3e6
# Bytes for the courses that one rollout leaves, in memory and on their way to a file.
MOST_BYTES = 4e9
# Numbers a sample has then: recorded, as a trajectory, and as columns of its table.
_COLUMNS = 40


class Size(NamedTuple):
    """Rollouts over `horizon` [s], as many of each of the loops."""

    loops: Sequence[Loop]
    horizon: float
    rollouts: float = 1.0

    @property
    def steps(self) -> float:
        """Integration steps of all, where none needs a shorter step."""
        steps = [_steps(loop, self.horizon) for loop in self.loops]
        return self.rollouts * sum(steps) / len(steps)


def _steps(loop: Loop, horizon: float) -> float:
    """Integration steps of one rollout over `horizon` [s]."""
    return horizon / loop.control_period * loop.steps


def check_one_plane(loop: Loop) -> None:
    """UserError for a loop that asks for two planes where there is one."""
    tendons = loop.plant.actuator
    asked = {
        "planes": loop.planes == 2, "disturbances.toward_deg": loop.disturbances.toward_deg,
        "plant.actuator.slack": any(tendons.slack), "plant.actuator.broken_tendon": tendons.broken_tendon > 1,
        "plant.actuator.slipping_tendon": tendons.slipping_tendon > 1,
    }  # fmt: skip
    for key in (key for key, is_asked in asked.items() if is_asked):
        fix = "leave it out, or `wristctl simulate`, which bends in two planes too"
        raise UserError("this loop bends in one plane", f"loop.{key}", fix)


def check_size(size: Size, planes: int = 1) -> None:
    """UserError, with the most that there is room for, where rollouts ask for too much one by one or together, or none.

    Also for loops of two planes where all that is run has one.
    """
    horizon = size.horizon
    for loop in size.loops:
        if planes == 1:
            check_one_plane(loop)
        if horizon < FEWEST * loop.control_period * (1.0 - 1e-9):
            fix = f"at least {FEWEST * loop.control_period:g} s"
            raise UserError(f"{horizon:g} s hold fewer than {FEWEST} control periods of the loop", "horizon", fix)
        steps = _steps(loop, horizon)
        if steps > MOST_STEPS:
            most, problem = MOST_STEPS * loop.control_period / loop.steps, f"{steps:.2g} integration steps of a rollout"
            fix = f"at most {most:.3g} s with this control_period and substeps, or a longer control_period"
            raise UserError(f"{problem}, {_lasting(steps, 1)}, are more than {MOST_STEPS:g}", "horizon", fix)
        bytes_ = 8.0 * (_COLUMNS + loop.plant_segments) * horizon / sample_period(loop.control_period)
        if bytes_ > MOST_BYTES:
            problem = f"a course of {horizon:g} s needs {bytes_ / 1e9:.2g} GB, more than {MOST_BYTES / 1e9:g}"
            raise UserError(problem, "horizon", f"at most {horizon * MOST_BYTES / bytes_:.3g} s")
    check_steps(size.steps, size.rollouts)


def check_steps(steps: float, rollouts: float) -> None:
    """UserError where so many steps of so many rollouts together are too many."""
    if steps > MOST_IN_ALL:
        demand = f"{steps:.2g} integration steps of {rollouts:.3g} rollouts, {_lasting(steps, cores())}"
        fix = f"at most {rollouts * MOST_IN_ALL / steps:.2g} such rollouts, fewer substeps, or a shorter horizon"
        raise UserError(f"{demand}, are more than {MOST_IN_ALL:g}", "", fix)


def _lasting(steps: float, many: int) -> str:
    hours = steps / (RATE * many * 3600.0)
    duration = f"{hours:.2g} hours" if hours < 48.0 else f"{hours / 24.0:.2g} days"
    return f"some {duration} on {many} core{'s' * (many > 1)}"
