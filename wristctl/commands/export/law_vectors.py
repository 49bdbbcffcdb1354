"""Test vectors of a law: what it is given and what it answers at each tick of a simulated loop."""

from typing import NamedTuple

import numpy as np

from wristctl.arrays import Array
from wristctl.commands.export.law_programs import LawPrograms
from wristctl.config.study import Study
from wristctl.control.law import NOW, REFERENCE, Controller
from wristctl.errors import UserError
from wristctl.simulation.batch import PLANES, Batch, Lanes, batch
from wristctl.simulation.closed_loop import asked_of
from wristctl.simulation.kernel import Span, parts_of_sample, run_blocks
from wristctl.simulation.observer import NoCamera
from wristctl.simulation.rollout import columns_of, worlds_of
from wristctl.simulation.stepped_loops import places_of
from wristctl.wrist.plant import kernel_of, plant_in

_SEEN, _REFERENCE = NOW.index("theta"), NOW.index("theta_ref")


class Vectors(NamedTuple):
    """Columns by name, and rows (T, columns): age of the picture that arrives, what is measured, the reference, then
    the torque that is wanted, the tension of one tendon of each place, and what the motors are sent."""

    columns: tuple[str, ...]
    rows: Array

    @property
    def text(self) -> str:
        """The table as CSV, every number to its last bit."""
        rows = (self.columns, *(map(repr, row) for row in self.rows.tolist()))
        return "".join(f"{','.join(row)}\n" for row in rows)


def loop_of(study: Study, controller: Controller, gains: Array, most: int) -> Batch:
    """One rollout of the study's `simulate` section, whose samples are its ticks, of at most so many.

    `gains` (1, g) are the controller's. Raises UserError for what no such loop has.
    """
    chosen = study.simulate
    period = chosen.loop.control_period
    horizon = min(chosen.horizon, most * period)
    asked = study.model_copy(update={"simulate": chosen.model_copy(update={"horizon": horizon})})
    wrist, loop, motion = asked_of(asked, period)
    model, (worlds, which) = plant_in(motion.planes, loop.plant.model), worlds_of(loop, wrist, 1)
    columns = columns_of(True, model.coordinates(loop.plant_segments), model.planes, places_of(wrist, model.planes))
    lanes = Lanes(np.zeros(1, np.int64), which, [(study.seed,)])
    made = batch(controller, gains, [motion], worlds, lanes, model, None, columns)
    return made._replace(setup=made.setup._replace(ticks=1))


def vectors_of(programs: LawPrograms, rollout: Batch) -> Vectors:
    """Run a rollout that records everything at every tick, and keep what its law saw and did.

    It ends where the wrist fails, if it does. A picture that shows no wrist has bends that are not a number, a tick
    without one an age of -1.
    """
    kernel, scratch, rows = kernel_of(run_blocks, rollout.setup.plant), rollout.scratch(), list[Array]()
    parts = parts_of_sample(programs.planes, programs.places)
    for tick in range(rollout.samples):
        arrived = _arrived(rollout)
        kernel(rollout.setup, rollout.course, rollout.world, rollout.state, scratch, Span(0, 1, tick, tick + 1))
        record = rollout.state.record[0, tick]
        if np.isnan(record[parts["bend"]]).any():
            break
        signals = scratch.now.reshape(programs.planes, -1)
        if isinstance(rollout.state.watch, NoCamera):
            measured = np.concatenate([[-1.0], signals[:, _SEEN], signals[:, _SEEN + 1]])
        else:
            measured = _picture(rollout, arrived, tick, programs.planes)
        now = signals[:, _REFERENCE : _REFERENCE + len(REFERENCE)]
        reference = np.concatenate([now, signals[:, len(NOW) :]], axis=1).ravel()
        sent = record[parts["delivered"]]
        if programs.remembered:  # the newest rate or target of each spool
            first = 2 * (programs.places + programs.planes)
            sent = rollout.state.motors.reshape(-1)[first :: programs.remembered]
        answer = record[parts["torque_wanted"]], record[parts["tension"]], sent
        rows.append(np.concatenate([measured, reference, *answer]))
    if not rows:
        raise UserError("the wrist fails at once in this loop", "simulate.loop", "`wristctl simulate` shows how")
    return Vectors(_columns(programs), np.array(rows))


def _arrived(rollout: Batch) -> int:
    """Number of pictures that have arrived so far."""
    watch = rollout.state.watch
    return 0 if isinstance(watch, NoCamera) else int(watch.turn[0].reshape(2, -1)[1, 0])


def _picture(rollout: Batch, before: int, tick: int, planes: int) -> Array:
    """Age [s] and bends of the picture that has arrived at this tick, if one has."""
    if _arrived(rollout) == before:
        return np.array([-1.0, *[np.nan] * planes])
    watch, schedule = rollout.state.watch, rollout.world.schedule
    captured = max(tick - int(np.ravel(schedule.believed[0])[0]), 0)
    shown = watch.readings[0].reshape(-1, planes + 1)[before, planes] != 0.0
    bends = watch.pictures[0].reshape(-1, planes)[before] if shown else np.full(planes, np.nan)
    return np.array([(tick - captured) * rollout.setup.period, *bends])


def _columns(programs: LawPrograms) -> tuple[str, ...]:
    ends = [""] if programs.planes == 1 else [f"_{plane}" for plane in PLANES]
    places = [f"_{t + 1}" for t in range(programs.places)]
    seen = ("bend",) if programs.observer else ("bend", "rate")
    periods = ["", *(f"_in_{k}" for k in range(1, programs.preview + 1))]
    reference = [f"{kind}{ahead}{end}" for end in ends for ahead in periods for kind in REFERENCE]
    answer = [f"wanted{end}" for end in ends] + [f"tension{place}" for place in places]
    answer += [f"{programs.driven}{place}" for place in places]
    return ("age", *(f"{kind}{end}" for kind in seen for end in ends), *reference, *answer)
