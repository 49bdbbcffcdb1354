"""The wrist in motion, for the README: `python docs/motion_gif.py` simulates a swing and writes images/motion.gif."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from matplotlib.animation import FuncAnimation, PillowWriter
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

import wristctl
from wristctl.plotting.style import BLUE, GREY
from wristctl.plotting.wrist_drawing import draw_wrist

FILE = Path(__file__).parent / "images" / "motion.gif"
MOTION = "simulate={controller: ct-dob, reference: {kind: two-sided-sine, frequency: 0.5, angle_deg: 30}, horizon: 4.0}"
# Frames a second, and the time [s] from which on they are shown: the wrist is then in its swing.
RATE, BEGIN = 15, 2.0


def frames(time: NDArray[np.float64]) -> NDArray[np.intp]:
    """Samples of a trajectory that are shown: one swing, at RATE frames a second."""
    return np.searchsorted(time, np.arange(BEGIN, time[-1], 1.0 / RATE))


def animated(file: Path = FILE) -> None:
    """Write the animation."""
    done = wristctl.simulate(wristctl.load_study(None, MOTION))
    course, wrist = done.trajectory, done.study.wrist
    shown = frames(course.time)
    figure = Figure(figsize=(5.6, 2.4), layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=(1, 1.6))

    def draw(index: int) -> None:
        _wrist(left, index)
        right.clear()
        seconds = course.time[shown] - course.time[shown[0]]
        now = shown <= index
        right.plot(seconds, np.degrees(course.theta_ref[shown]), color=GREY, linewidth=1.0, label="wanted")
        right.plot(seconds[now], np.degrees(course.theta[shown][now]), color=BLUE, label="simulated")
        right.set(xlabel="time [s]", ylabel="angle [deg]", ylim=(-40.0, 40.0))
        right.legend(loc="lower left", frameon=False, fontsize=8)

    def _wrist(axes: Axes, index: int) -> None:
        axes.clear()
        draw_wrist(axes, course.segment_theta[index], wrist)
        reach = 1.1e3 * (wrist.length + 2.0 * wrist.hand_offset)
        axes.set(xlim=(-0.7 * reach, 0.7 * reach), ylim=(-0.1 * reach, reach), aspect="equal")
        axes.set_title(f"{math.degrees(course.theta[index]):.0f} deg", fontsize=9)
        axes.axis("off")

    FuncAnimation(figure, draw, frames=[int(index) for index in shown]).save(file, PillowWriter(fps=RATE), dpi=90)


if __name__ == "__main__":
    animated()
