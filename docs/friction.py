"""What friction of the tendons does to each law: `python docs/friction.py` measures it and writes docs/friction.md.

Every preset that states its conditions, behind steppers, elastic tendons and a camera; minimum-jerk moves of a second
to targets on both sides, and holds of a minute. Writes docs/images/friction.png too; four minutes on one core.
"""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

from wristctl.config.choices import CONTROLLERS
from wristctl.config.loop import Loop, Reference
from wristctl.config.plant import Actuator, Plant, Sensor, TrueSensor
from wristctl.config.wrist import WristParameters
from wristctl.control.table import controller, gains_of
from wristctl.simulation.closed_loop import repeat
from wristctl.simulation.oscillation import LIMIT_CYCLE
from wristctl.simulation.reference import motion
from wristctl.simulation.repetitions import Repeated
from wristctl.simulation.worlds import Draws

HERE = Path(__file__).parent
WRIST, NOMINAL = WristParameters(), (5e-3, 20e3)
TARGETS = tuple(sign * angle for angle in (5.0, 15.0, 30.0, 45.0) for sign in (1.0, -1.0))
WORLDS = {
    "no friction": (0.0, 0.0),
    "no sheath": (0.1, 0.0),
    "1 rad": (0.1, 1.0),
    "3 rad": (0.1, 3.0),
}
"""Coefficient of the tendons' friction, and the sheath's angle [rad]."""
MOVE, HOLD, STREAMS = 4.0, 61.0, 5
CLOSED = 0.01
"""Error [deg] below which a controller is said to have closed the dead band."""
MICROSTEP = 0.06
"""What a microstep of a spool turns the wrist by [deg]."""


class Measured(NamedTuple):
    """A preset in one world, all in degrees."""

    rmse: float
    """Of the error over 4 s, mean of all targets and streams."""
    steady: float
    """Mean error over the last 10 % of that, without its sign, mean of them all."""
    remains: float
    """What does not average out: the mean error over the second half of a minute's hold, mean of all targets."""
    oscillation: float
    """The largest at rest."""
    outermost: float
    """The same at the corners of the preset's conditions."""
    hunting: float
    """Half the peak-to-peak over the second half of a minute's hold, trend removed, the camera without noise: the
    largest."""


def loop_of(world: str, period: float, stiffness: float, noisy: bool = True) -> Loop:
    """A camera of 60 Hz, two frames late, and steppers with elastic tendons."""
    friction, sheath = WORLDS[world]
    tendons = Actuator(level="tendon", tendon_stiffness=stiffness, friction=friction, sheath=sheath)
    plant = Plant() if noisy else Plant(sensor=TrueSensor(noise_deg=0.0, dropped=0.0))
    return Loop(control_period=period, actuator=tendons, sensor=Sensor(level="camera"), plant=plant)


def driven(name: str, gains: str, loop: Loop, horizon: float, streams: int = 1) -> list[Repeated]:
    """The preset, to every target."""
    law = controller(name)
    motions = [motion(Reference(angle_deg=each), WRIST, horizon, loop.control_period) for each in TARGETS]
    given, names = np.repeat([gains_of(law, gains)], len(motions), axis=0), [str(each) for each in TARGETS]
    return repeat(law, given, motions, np.arange(len(motions)), loop, WRIST, names, Draws(0), streams)


def presets() -> list[tuple[str, str]]:
    """Those whose stated conditions hold the rig on which all are tried."""
    return [each for each in stated() if within(*each)]


def stated() -> list[tuple[str, str]]:
    """Those that state the conditions that they are made for."""
    return [(name, gains) for name in CONTROLLERS for gains in controller(name).conditions]


def within(name: str, gains: str) -> bool:
    """Whether period and stiffness of the rig on which all are tried are within a preset's conditions."""
    conditions = controller(name).conditions[gains]
    ranges = (conditions.period, conditions.tendon_stiffness)
    return all(low <= value <= high for value, (low, high) in zip(NOMINAL, ranges, strict=True))


def corners(name: str, gains: str) -> list[tuple[float, float]]:
    """Shortest and longest period with softest and stiffest tendons of a preset's conditions."""
    conditions = controller(name).conditions[gains]
    return [(period, stiffness) for period in conditions.period for stiffness in conditions.tendon_stiffness]


def swing(done: Sequence[Repeated]) -> float:
    """The largest oscillation [deg]; infinite where a loop failed."""
    if any(each.failed.any() for each in done):
        return np.inf
    return float(np.degrees(np.nanmax(np.concatenate([each.metrics["oscillation"] for each in done]))))


def measured(name: str, gains: str, world: str) -> Measured:
    """A preset in a world."""
    moved = driven(name, gains, loop_of(world, *NOMINAL), MOVE, STREAMS)
    rmse, steady = (
        float(np.degrees(np.mean([each.metrics[metric] for each in moved]))) for metric in ("rmse", "steady_state")
    )
    held = driven(name, gains, loop_of(world, *NOMINAL, noisy=False), HOLD)
    half = round(0.5 * (HOLD - 1.0) / NOMINAL[0])
    ends = np.degrees([each.first.trajectory.error[-half:] for each in held]).T
    place = np.linspace(-1.0, 1.0, half)
    left = ends - np.polynomial.polynomial.polyval(place, np.polynomial.polynomial.polyfit(place, ends, 1)).T
    outermost = max(swing(driven(name, gains, loop_of(world, *each), MOVE, STREAMS)) for each in corners(name, gains))
    remains, hunting = float(np.abs(ends.mean(axis=0)).mean()), float(np.ptp(left, axis=0).max() / 2.0)
    return Measured(rmse, steady, remains, swing(moved), outermost, hunting)


Found = dict[tuple[str, str], list[Measured]]


def draw(found: Found) -> None:
    """Each preset a row, each world a mark."""
    panels = {
        "rmse": "RMSE of a move [deg]", "remains": "left after a minute [deg]", "oscillation": "oscillation [deg]",
        "hunting": "hunting, no noise [deg]",
    }  # fmt: skip
    figure, axes = plt.subplots(
        1, len(panels), figsize=(12.0, 0.34 * len(found) + 1.6), sharey=True, layout="constrained"
    )
    rows = np.arange(len(found))[::-1]
    marks = dict(zip(WORLDS, (("#7F7F7F", "s"), ("#56B4E9", "o"), ("#0072B2", "D"), ("#D55E00", "^")), strict=True))
    for panel, (what, label) in zip(axes, panels.items(), strict=True):
        for at, (world, (colour, marker)) in enumerate(marks.items()):
            values = np.array([getattr(each[at], what) for each in found.values()]).clip(1e-4)
            panel.plot(values, rows, marker, color=colour, markersize=5.0, label=world)
        panel.set(xscale="log", xlabel=label)
        panel.grid(True, color="#D9D9D9", linewidth=0.6)
        panel.set_axisbelow(True)
    axes[0].set_xticks([0.02, 0.05, 0.1, 0.2, 0.5], ["0.02", "0.05", "0.1", "0.2", "0.5"])
    axes[0].xaxis.minorticks_off()
    axes[2].axvline(np.degrees(LIMIT_CYCLE), color="black", linewidth=0.8)
    axes[0].set_yticks(rows, [f"{name} / {gains}" for name, gains in found])
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=len(WORLDS), frameon=False)
    figure.savefig(HERE / "images" / "friction.png", dpi=110)


def told(found: Found) -> list[str]:
    """What the numbers say, in words."""
    none, _, one, three = (np.array([each[at] for each in found.values()]) for at in range(4))
    names = [f"{name}/{gains}" for name, gains in found]
    rmse = Measured._fields.index("rmse")
    remains, swings = Measured._fields.index("remains"), Measured._fields.index("oscillation")
    closing = three[:, remains] < CLOSED
    open_ = three[~closing, remains]
    first, last = int(np.argmin(none[:, rmse])), int(np.argmin(three[:, rmse]))
    better = int(np.sum(three[:, swings] < none[:, swings]))
    outermost = max(float(each.outermost) for row in found.values() for each in row)
    hunting = np.array([[each.hunting for each in row] for row in found.values()])
    most = np.unravel_index(int(hunting[:, 1:].argmax()), hunting[:, 1:].shape)
    return [
        f"Of {len(names)} presets {int(closing.sum())} close the dead band: after a minute's hold less than {CLOSED:g} "
        f"deg is left, with 3 rad of sheath too ({', '.join(np.array(names)[closing])}). The others stay where "
        f"friction holds them, {open_.min():.2g} to {open_.max():.2g} deg off on average.",
        f"A move's RMSE grows by {_growth(one[:, rmse] / none[:, rmse])} with 1 rad of sheath and by "
        f"{_growth(three[:, rmse] / none[:, rmse])} with 3 rad. The lowest is {none[first, rmse]:.2g} deg without "
        f"friction ({names[first]}) and {three[last, rmse]:.2g} deg with 3 rad ({names[last]}).",
        f"Friction damps: {better} of {len(names)} presets swing less at rest with 3 rad of sheath than without "
        f"friction. Nowhere inside their conditions do they swing by more than {outermost:.2g} deg.",
        f"{_hunting(dict(zip(names, hunting[:, 1:].max(axis=1), strict=True)))} Over the second half of a minute, with "
        f"a camera without noise, friction leaves at most {hunting[:, 1:].max():.2g} deg of movement "
        f"({names[most[0]]}).",
    ]


def _hunting(moved: dict[str, float]) -> str:
    """Which presets move by more than a spool's microstep, as half a peak-to-peak has it [deg]."""
    more = [name for name, size in moved.items() if size > MICROSTEP]
    if more:
        hunt = "hunt" if len(more) > 1 else "hunts"
        return f"{', '.join(more)} {hunt}: by more than a microstep of a spool, {MICROSTEP:g} deg."
    return (
        f"None hunts by more than a microstep of a spool, {MICROSTEP:g} deg: a spool "
        "holds, and stick-slip has little to feed on."
    )


def _growth(ratios: np.ndarray) -> str:
    return f"a factor of {ratios.min():.2g} to {ratios.max():.2g}"


_HOW = """
What closes the band is an integral of the error, or what is adapted; stiffness and feedback alone do not. Every preset
whose stated conditions hold tendons of 20 kN/m and a period of 5 ms (a rig ticks every 10 ms), behind steppers and a
camera of 60 Hz, two frames late with 0.1 deg of noise; minimum-jerk moves of 1 s to 5, 15, 30 and 45 deg on both
sides, 5 streams of noise, 4 s each.{others} Columns have four numbers: without friction, and with a
coefficient of 0.1 and no sheath, 1 rad and 3 rad of it. `left` is the mean error over the second half of a minute's
hold, `hunting` half the peak-to-peak there, trend removed, both with a camera without noise; `corners` is the largest
oscillation at the corners of the preset's conditions. What friction does to the wrist itself:
[hysteresis.md](hysteresis.md). Made by `python docs/friction.py`.
"""


def _others() -> str:
    """Which presets are not here, as this rig is not within their conditions."""
    others = [f"{name}/{gains}" for name, gains in stated() if not within(name, gains)]
    return f" Not within its conditions there, and so not here: {', '.join(others)}." if others else ""


def page(found: Found) -> str:
    """The page."""
    lines = ["# Friction of the tendons: what it does to each controller", ""]
    for each in told(found):
        first, *rest = textwrap.wrap(each, 117)
        lines += [f"- {first}", *(f"  {line}" for line in rest)]
    lines += [
        "",
        "![Errors of each preset without friction and with three angles of sheath](images/friction.png)",
        "",
        *textwrap.wrap(_HOW.format(others=_others()).strip(), 119, break_on_hyphens=False, break_long_words=False),
        "",
        "| preset | RMSE [deg] | steady state [deg] | left [deg] | oscillation [deg] | corners [deg] | hunting [deg] |",
        "| --- | --- | --- | --- | --- | --- | --- |",
    ]
    for (name, gains), row in found.items():
        cells = (" ".join(f"{getattr(each, what):.3f}" for each in row) for what in Measured._fields)
        lines.append(f"| {name}/{gains} | {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    everything = {each: [measured(*each, world) for world in WORLDS] for each in presets()}
    draw(everything)
    (HERE / "friction.md").write_text(page(everything))
