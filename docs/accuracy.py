"""How accurate simulated loops are: `python docs/accuracy.py` measures it and writes docs/accuracy.md (some minutes).

Each loop runs as a study runs it, and with twenty times the substeps. A row is within bounds where both root mean
squares of the error differ by at most 1 % or 0.001 deg; a row that swings is marked, not compared.
"""

from __future__ import annotations

import itertools
import sys
import textwrap
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from wristctl.config.loop import Loop, Reference
from wristctl.config.plant import Actuator, Sensor
from wristctl.config.wrist import WristParameters
from wristctl.control.table import controller, gains_of
from wristctl.simulation.closed_loop import repeat
from wristctl.simulation.oscillation import LIMIT_CYCLE
from wristctl.simulation.reference import motion
from wristctl.simulation.worlds import Draws
from wristctl.wrist.pcc import PCC
from wristctl.wrist.plant import integrate
from wristctl.wrist.segments import segments

PAGE = Path(__file__).with_name("accuracy.md")
WRIST, HORIZON, FINER = WristParameters(), 4.0, 20
LAWS = (("feedforward", "default"), ("smc-tracking", "camera"), ("computed-torque", "default"), ("pid", "printed"))
PERIODS, STIFFNESSES, SHEATHS = (1e-3, 5e-3, 10e-3), (2e3, 20e3, 100e3), (None, 3.0)
RELATIVE, ABSOLUTE = 0.01, np.deg2rad(0.001)


class Row(NamedTuple):
    """One loop: its RMSE as it is and with twenty times the substeps, the greater and the lesser oscillation [rad]."""

    law: str
    sensor: str
    period: float
    stiffness: float
    sheath: float | None
    rmse: float
    fine: float
    swing: float
    lesser: float
    finest: float
    """RMSE with twice as many again, of a row that is not within bounds."""

    @property
    def settled(self) -> bool:
        """Whether small steps agree with each other: a swing that is never the same has no RMSE to come to."""
        return _close(self.fine, self.finest)

    @property
    def compared(self) -> bool:
        """Whether it comes to rest."""
        return bool(self.swing <= LIMIT_CYCLE)

    @property
    def both_swing(self) -> bool:
        """Whether it swings with smaller steps too."""
        return bool(self.lesser > LIMIT_CYCLE)

    @property
    def within(self) -> bool:
        """Whether it is as accurate as it should be."""
        return _close(self.rmse, self.fine)


def _close(one: float, other: float) -> bool:
    return bool(abs(one - other) <= max(RELATIVE * other, ABSOLUTE))


def rows() -> Iterator[Row]:
    """Every combination."""
    for (name, gains), level, period, stiffness, sheath in itertools.product(
        LAWS, ("ideal", "camera"), PERIODS, STIFFNESSES, SHEATHS
    ):
        loop = Loop(
            control_period=period,
            actuator=Actuator(
                level="tendon",
                tendon_stiffness=stiffness,
                friction=0.1 if sheath is not None else 0.0,
                sheath=sheath or 0.0,
            ),
            sensor=Sensor(level="camera" if level == "camera" else "ideal"),
        )
        found = [_measured(name, gains, each) for each in (loop, finer(loop, FINER))]
        finest = found[1][0]
        if not _close(found[0][0], finest):
            finest = _measured(name, gains, finer(loop, 2 * FINER))[0]
        swings = [swing if np.isfinite(swing) else np.inf for _, swing in found]
        row = f"{name}/{gains}", level, period, stiffness, sheath, found[0][0], found[1][0]
        yield Row(*row, max(swings), min(swings), finest)


def finer(loop: Loop, times: int) -> Loop:
    """The same with so many times the substeps."""
    return loop.model_copy(update={"substeps": times * loop.steps})


def _measured(name: str, gains: str, loop: Loop) -> tuple[float, float]:
    law = controller(name)
    followed = motion(Reference(), WRIST, HORIZON, loop.control_period)
    given = np.array([gains_of(law, gains)])
    done = repeat(law, given, [followed], np.zeros(1, np.int64), loop, WRIST, ["accuracy"], Draws(0))[0]
    return float(done.metrics["rmse"][0]), float(done.metrics["oscillation"][0])


def of_the_step() -> Iterator[tuple[int, str, float, float, float]]:
    """Segments, which modes move, error [rad] in 0.2 s at steps of 1 ms and of 0.5 ms, and the order these show."""
    for n, modes in itertools.product((1, 2, 4, 8), ("slow", "all")):
        bent = np.full(n, 0.4 / n) if modes == "slow" else 0.4 / n * (-1.0) ** np.arange(n)
        still, pulls, times = np.zeros(n), (12.0, 8.0), 0.01 * np.arange(1, 21)
        exact, *coarse = (
            integrate(PCC, segments(WRIST, n), bent, still, pulls, times, h)[0] for h in (2.5e-5, 1e-3, 5e-4)
        )
        errors = [float(np.abs(each - exact).max()) for each in coarse]
        yield n, modes, errors[0], errors[1], float(np.log2(errors[0] / errors[1]))


def page(found: list[Row], steps: list[tuple[int, str, float, float, float]]) -> str:
    """The page."""
    wandering = [row for row in found if row.compared and not row.settled]
    compared = [row for row in found if row.compared and row.settled]
    missed = [row for row in compared if not row.within]
    worst = max(abs(row.rmse / row.fine - 1.0) for row in compared)
    close, swinging = len(compared) - len(missed), [row for row in found if not row.compared]
    told = (
        f"Of {len(found)} loops with elastic tendons {len(compared)} come to rest; of these {close} have an RMSE "
        f"within 1 % or 0.001 deg of that of the same loop with {FINER} times the substeps (worst: {100 * worst:.2g} "
        "%), without anybody choosing substeps: where tendons are elastic a step is 1 ms at most (0.5 ms above "
        "50 kN/m), and tendons with their friction are evaluated, and linearised, at each of its stages. The other "
        f"{len(swinging)} swing, and are not compared: {sum(row.both_swing for row in swinging)} of them in both ways."
        f" {len(wandering)} {'swings' if len(wandering) == 1 else 'swing'} by less, but so that no step, however "
        "small, tells their RMSE."
    )
    lines = [
        "# How accurate a simulated loop is: its numerical error",
        "",
        *textwrap.wrap(told, 120),
        "",
        "Made by `python docs/accuracy.py`: a 30 deg minimum jerk, 4 s, 4 segments, friction off or 0.1 with a sheath",
        "of 3 rad, periods of 1, 5 and 10 ms, tendons of 2, 20 and 100 kN/m: 9 loops in each cell.",
        "",
        "| controller | sensing | worst, friction off | worst, sheath of 3 rad | swing, friction off | swing, sheath |",
        "| --- | --- | --- | --- | --- | --- |",
    ]
    for law, sensor in dict.fromkeys((row.law, row.sensor) for row in found):
        own = [row for row in found if (row.law, row.sensor) == (law, sensor)]
        off, on = (_worst(row for row in own if (row.sheath is None) == free) for free in (True, False))
        swings = [each for each in own if not each.compared]
        cells = " | ".join(_told([e for e in swings if (e.sheath is None) == free]) for free in (True, False))
        lines.append(f"| {law} | {sensor} | {off} | {on} | {cells} |")
    for said, rows_ in (("Not within bounds", missed), ("Without an RMSE that smaller steps come to", wandering)):
        for row in rows_:
            apart = 100.0 * abs(row.rmse / row.fine - 1.0), 100.0 * abs(row.finest / row.fine - 1.0)
            what = f"{row.law}, {row.sensor}, {1e3 * row.period:g} ms, {row.stiffness / 1e3:g} kN/m"
            told = f"{said}: {what}, off by {apart[0]:.2g} % of the same with {FINER} times the substeps, which is off "
            told += f"by {apart[1]:.2g} % of that with {2 * FINER}; swings by {np.degrees(row.swing):.2g} deg."
            lines += ["", *textwrap.wrap(told, 120)]
    lines += [
        "",
        "## The step itself",
        "",
        "Angles in 0.2 s from a bend that only the slow modes have, and from one that moves the fast ones (1e4 to 1e5",
        "1/s) as well, under held pulls, against steps of 25 us.",
        "",
        "| segments | modes | error at 1 ms | error at 0.5 ms | order |",
        "| --- | --- | --- | --- | --- |",
    ]
    lines += [
        f"| {n} | {modes} | {one:.1e} rad | {half:.1e} rad | {order:.1f} |" for n, modes, one, half, order in steps
    ]
    return "\n".join(lines) + "\n"


def _told(swinging: list[Row]) -> str:
    where = ", ".join(f"{1e3 * row.period:g} ms {row.stiffness / 1e3:g} kN/m" for row in swinging)
    return "none" if not swinging else where if len(swinging) <= 3 else f"{len(swinging)} of 9"


def _worst(own: Iterator[Row]) -> str:
    differences = [100.0 * abs(row.rmse / row.fine - 1.0) for row in own if row.compared and row.settled]
    return f"{max(differences):.2g} %" if differences else "-"


if __name__ == "__main__":
    measured = list(rows())
    PAGE.write_text(page(measured, list(of_the_step())))
    sys.exit(any(row.compared and row.settled and not row.within for row in measured))
