"""Which ramps a motor follows, and what slower ones cost: `python docs/ramps.py` writes tables of docs/hardware/rig.md.

A rotor of the emulated bench is pulled evenly, then goes to a step rate by jumps: one an update as its board makes them
of `actuator.ramp`, one a tick as its host makes them of `actuator.step_acceleration`. Whether it has kept its field is
seen half a second later. Costs are errors of simulated loops whose host and board both know their slower ramps.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from wristctl.arrays import Array
from wristctl.bench.motors import CYCLES, PERIOD, SpoolState, Stepper, spool_state_of, stepper_of, turn_spools
from wristctl.board.emulator.chip import FREQUENCY
from wristctl.config.bench import BenchSettings, Motors
from wristctl.config.hw_run import RAMPS
from wristctl.config.loop import TICK, Loop, Reference
from wristctl.config.plant import Actuator, Sensor
from wristctl.config.wrist import WristParameters
from wristctl.control.table import controller, gains_of
from wristctl.lanes.compiled import kernel
from wristctl.simulation.closed_loop import repeat
from wristctl.simulation.reference import motion
from wristctl.simulation.worlds import Draws

PAGE = Path(__file__).parent / "hardware" / "rig.md"
BEGIN, END = "<!-- made by docs/ramps.py -->", "<!-- end of docs/ramps.py -->"
SPOOLS = {"aluminium pulley": Motors().spool_inertia, "with a steel drum of 60 mm by 20 mm": 2e-4}
"""Inertia [kg m^2]; the drum is 0.44 kg."""
SPEEDS, SHARES = (5_000.0, 20_000.0), (0.0, 0.5, 0.8)
LOADED, SETTLING, TURNING = 1.0, 0.3, 0.5
"""Time [s] in which the pull comes, and for which it stays before the motor turns; time at its rate."""
SOFT = 1.0
"""Stiffness [N/m] of a tendon that pulls the same wherever its spool is."""
LEAST, MOST = RAMPS[0], 1e8
"""Ramps that are tried [steps/s^2]."""
SLOWER, STREAMS = (1.0, 0.5, 0.25, 0.1, 0.05), 5
LAW, MOVES, WRIST, HORIZON = ("smc-tracking", "hardware"), (1.0, 0.3), WristParameters(), 4.0


def turn(spools: Any, motor: Any, pulls: Any, edges: Any) -> None:
    """Turn spools under pulls [N] of each period by the changes of latches."""
    heard = 0
    for k in range(pulls.shape[0]):
        spools.pull[0] = pulls[k]
        heard = turn_spools(spools, motor, SOFT, edges, heard, k * CYCLES + CYCLES // 2)


_turn = kernel(turn)


def keeps(motors: Motors, share: float, speed: float, every: float, ramp: float) -> bool:
    """Whether a rotor pulled by a share of what it holds keeps its field up to a speed by `jumps`."""
    settings = BenchSettings(motors=motors)
    spools, motor, rates = spool_state_of(settings), stepper_of(settings), jumps(ramp, speed, every)
    start, seconds = LOADED + SETTLING, every * len(rates) + TURNING
    times = np.append(start + every * np.arange(len(rates)), start + seconds)
    places = np.append(0.0, np.cumsum(rates * np.diff(times)))
    steps = np.interp(np.arange(math.floor(places[-1] - 0.5)) + 0.5, places, times)
    cycles = np.repeat(np.round(FREQUENCY * steps).astype(np.int64), 2)
    values = np.tile(np.array([1, 0]), len(steps))
    pulses = np.stack([cycles, np.full(len(cycles), ord("A")), values], axis=1)
    edges = np.concatenate([np.array([[0, ord("C"), 0]]), pulses])
    pulled = share * motor.holding * np.clip(PERIOD * np.arange(round((start + seconds) / PERIOD)) / LOADED, 0.0, 1.0)
    _turn(spools, motor, pulled, edges)
    return lag(spools, motor) < 0.5


def lag(spools: SpoolState, motor: Stepper) -> float:
    """Electrical turns by which the first spool is behind its drive's count."""
    return float((spools.step[0] * spools.counted[0] - spools.slack[0] - spools.reeled[0]) / motor.turn)


def jumps(ramp: float, speed: float, every: float) -> Array:
    """Rates [1/s] of a motor that is told a speed: jumps of so much [1/s^2], one in so long [s].

    A board makes one an update (`wristctl.simulation.spool_timing`). A host makes one a tick, which the board then
    makes at once: its ramp is four times the host's, its update less than a third of a tick.
    """
    count = max(1, math.ceil(speed / (ramp * every) - 1e-9))
    rates: Array = np.minimum(ramp * every * np.arange(1, count + 1), speed)
    return rates


def largest(follows: Callable[[float], bool]) -> str:
    """Largest of the ramps [1000 steps/s^2] that is followed, to two digits; a dash where none is."""
    if follows(MOST):
        return "any"
    if not follows(LEAST):
        return "-"
    low, high = LEAST, MOST
    while high > 1.01 * low:
        middle = math.sqrt(low * high)
        low, high = (middle, high) if follows(middle) else (low, middle)
    return f"{float(f'{1e-3 * low:.2g}'):,g}"


def limits() -> Iterator[list[str]]:
    """Rows: spool, pull, and for each speed the largest step_acceleration and ramp."""
    between = TICK, Actuator().update
    for name, inertia in SPOOLS.items():
        motors = Motors(spool_inertia=inertia)
        for share in SHARES:
            row = [name, f"{share * stepper_of(BenchSettings(motors=motors)).holding:.0f} N"]
            for speed in SPEEDS:
                row += [largest(partial(keeps, motors, share, speed, every)) for every in between]
            yield row


def costs() -> Iterator[list[str]]:
    """Rows: step_acceleration, ramp, and for each duration of a move of 30 deg its RMSE and settling."""
    board, law = Actuator(), controller(LAW[0])
    for scale in SLOWER:
        acceleration, ramp = scale * board.step_acceleration, scale * board.ramp
        row = [f"{1e-3 * each:,g}" for each in (acceleration, ramp)]
        actuator = Actuator(level="tendon", step_acceleration=acceleration, ramp=ramp)
        loop = Loop(control_period=TICK, actuator=actuator, sensor=Sensor(level="camera"))
        for lasts in MOVES:
            followed = motion(Reference(duration=lasts), WRIST, HORIZON, TICK)
            done = repeat(
                law, np.array([gains_of(law, LAW[1])]), [followed], np.zeros(1, np.int64), loop, WRIST, ["ramps"],
                Draws(0), STREAMS,
            )  # fmt: skip
            for name, unit, digits in (("rmse", 180.0 / math.pi, 3), ("settling", 1.0, 2)):
                row.append(f"{unit * np.median([each.metrics[name][0] for each in done]):.{digits}f}")
        yield row


def table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table of a page."""
    return "\n".join(f"| {' | '.join(row)} |" for row in (heads, ["---"] * len(heads), *rows))


def tables() -> str:
    """Both tables."""
    speeds = [f"{kind} to {speed:,.0f} steps/s" for speed in SPEEDS for kind in ("`step_acceleration`", "`ramp`")]
    moves = [f"{what} in {lasts:g} s" for lasts in MOVES for what in ("RMSE [deg]", "settling [s]")]
    return "\n\n".join(
        (
            "Largest changes of a rate that a motor follows from rest, in 1000 steps/s^2. Any: it takes up the rate\n"
            "at once. A dash: it cannot pull so hard at that rate, however slowly it comes to it.",
            table(["spool", "pull", *speeds], limits()),
            "What slower ones [1000 steps/s^2] cost a move of 30 deg in 1 s and in 0.3 s, in `simulate` with motors\n"
            f"and camera: {'/'.join(LAW)}, medians of {STREAMS} draws.",
            table(["`step_acceleration`", "`ramp`", *moves], costs()),
        )
    )


def main() -> None:
    """Write them."""
    before, _, rest = PAGE.read_text(encoding="utf-8").partition(BEGIN)
    PAGE.write_text(f"{before}{BEGIN}\n\n{tables()}\n\n{END}{rest.partition(END)[2]}", encoding="utf-8")


if __name__ == "__main__":
    main()
