"""What a controller gains by both planes at once: `python docs/coupling.py` writes its tables into docs/two-planes.md.

Each controller runs by plane, with and without what the planes do to each other added to its torques, and with both
planes at once: computed torque, its observer and MRAC with the inertia of the wrist in space for the acceleration that
they want, MPC with all that the tendons reach together over its horizon. The latter are controllers of this page alone.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from wristctl.config.loop import Loop, Reference, sample_period
from wristctl.config.wrist import WristParameters
from wristctl.control.clf_qp import least_acceleration
from wristctl.control.disturbance_observer import VALUES, disturbance, remember
from wristctl.control.law import Controller, ahead
from wristctl.control.model import one_segment
from wristctl.control.mpc import HORIZON, TURNS, riccati
from wristctl.control.table import controller, gains_of
from wristctl.lanes.compiled import compiled
from wristctl.lanes.functions import maximum
from wristctl.lanes.lane import where, zero_like
from wristctl.lanes.rows import lanes_like, part, square_like
from wristctl.simulation.closed_loop import scenario_of
from wristctl.simulation.motion import Motion
from wristctl.simulation.planes import bends_of
from wristctl.simulation.rollout import rollout
from wristctl.simulation.spatial_references import turned
from wristctl.simulation.worlds import Draws
from wristctl.wrist.spatial.posture import bend_segments, posture_like
from wristctl.wrist.spatial.spatial_dynamics import momenta_like, spatial_mass_matrix
from wristctl.wrist.spatial.spatial_segments import SpatialSegments

PAGE = Path(__file__).with_name("two-planes.md")
BEGIN, END = "<!-- made by docs/coupling.py -->", "<!-- end of docs/coupling.py -->"
SEEDS, HORIZON_S = 8, 4.0
_STEPS, _PLANES = (0,) * HORIZON, (0, 0)
_RELAXED, _LEAST_DAMPING = 1.6, 2.0**-0.5


def with_inertia_in_space(by_plane: Controller) -> Controller:
    """The controller with the inertia of the wrist in space for the acceleration that it wants beyond the reference's.

    For the reference's own acceleration the loop adds it, as to the torques of every controller.
    """
    inner = compiled(by_plane.law)

    def law(now: Any, wrist: Any, gains: Any, memory: Any, tendons: Any, torque: Any) -> None:
        bend, mass, more = lanes_like(torque), square_like(torque), lanes_like(torque)
        posture, momenta, one = posture_like(torque), momenta_like(torque), lanes_like(torque)
        for p in range(2):
            torque[p] = inner(now[p], wrist[p], gains, memory[p])
            bend[p] = now[p].theta
            inertia, load = one_segment(wrist[p], now[p].theta, now[p].rate)
            one[p] = inertia
            more[p] = (torque[p] - load) / inertia - now[p].acceleration_ref
        seen, none = wrist[0], zero_like(bend[0])
        body = SpatialSegments(
            seen.length, seen.mass, seen.hand_mass, seen.hand_offset, seen.spans,
            none, none, none, none, none, none, none, none, none, none, none, none,
        )  # fmt: skip
        tangent = bend_segments(body, bend, posture)
        spatial_mass_matrix(body, posture, tangent, mass, momenta)
        torque[0] = torque[0] + (mass[0, 0] - one[0]) * more[0] + mass[0, 1] * more[1]
        torque[1] = torque[1] + (mass[1, 1] - one[1]) * more[1] + mass[1, 0] * more[0]

    return replace(by_plane, name=f"{by_plane.name}-coupled", law=law, planes=2)


@compiled
def _plan_together(now: Any, weights: Any, base: Any, arms: Any, room: Any, memory: Any, out: Any) -> None:
    """`wristctl.control.mpc.plan` of both planes, its box replaced by what the tendons reach together."""
    w, zeta = weights[0], maximum(_LEAST_DAMPING, weights[1])
    h = now[0].period
    first = part(memory[0], VALUES, _STEPS)
    by_start, by_speed, share, shift = lanes_like(first), lanes_like(first), lanes_like(first), lanes_like(first)
    by_angle, by_rate, price, (end11, end12, end22) = riccati(h, (w, zeta), by_start, by_speed, share)
    wanted, off, none = lanes_like(out), lanes_like(out), lanes_like(out)
    zero = zero_like(h)
    none[0], none[1] = zero, zero
    relaxed = square_like(part(memory[0], 0, _STEPS))
    for _ in range(TURNS):
        for p in range(2):
            kept = part(memory[p], VALUES, _STEPS)
            lasting = part(memory[p], VALUES + HORIZON, _STEPS)
            angle_ref, rate_ref, _ = ahead(now[p], HORIZON)
            g1, g2 = end11 * angle_ref + end12 * rate_ref, end12 * angle_ref + end22 * rate_ref
            for step in range(HORIZON):
                k = HORIZON - 1 - step
                wished = now[p].acceleration_ref if k == 0 else ahead(now[p], k)[2]
                pull = h * (wished + price * (kept[k] - lasting[k])) + h * (0.5 * h * g1 + g2)
                shift[k] = share[k] * pull
                g1, g2 = g1 - by_start[k] * pull, h * g1 + g2 - by_speed[k] * pull
                if k > 0:
                    angle_ref, rate_ref, _ = ahead(now[p], k)
                    g1, g2 = g1 + by_angle * angle_ref, g2 + by_rate * rate_ref
            angle, rate = now[p].theta, now[p].rate
            for k in range(HORIZON):
                v = shift[k] - by_start[k] * angle - by_speed[k] * rate
                angle, rate = angle + h * (rate + 0.5 * h * v), rate + h * v
                relaxed[p, k] = _RELAXED * v + (1.0 - _RELAXED) * kept[k] + lasting[k]
        for k in range(HORIZON):
            for p in range(2):
                wanted[p] = relaxed[p, k]
                off[p] = base[p] - wanted[p]
            least_acceleration(zero, none, zero, off, arms, room, out)
            for p in range(2):
                planned = wanted[p] + out[p]
                memory[p][VALUES + k] = planned
                memory[p][VALUES + HORIZON + k] = wanted[p] - planned
    for p in range(2):
        out[p] = memory[p][VALUES]


def _mpc_together(now: Any, wrist: Any, gains: Any, memory: Any, tendons: Any, torque: Any) -> None:
    count = len(tendons.least)
    base, arms, room = lanes_like(torque), lanes_like(tendons.arms), lanes_like(tendons.least)
    inertias = lanes_like(torque)
    found, free, planned = lanes_like(torque), lanes_like(torque), lanes_like(torque)
    for t in range(count):
        room[t] = tendons.greatest[t] - tendons.least[t]
    for p in range(2):
        found[p] = disturbance(now[p], wrist[p], gains.wo, memory[p], 0)
        inertia, load = one_segment(wrist[p], now[p].theta, now[p].rate)
        inertias[p] = inertia
        free[p] = load - found[p]
        resting = now[p].torque_low - free[p]
        for t in range(count):
            arm = tendons.arms[count * p + t]
            resting = resting - where(arm < 0.0, arm, 0.0) * room[t]
            arms[count * p + t] = arm / inertia
        base[p] = resting / inertia
        for k in range(HORIZON - 1):
            memory[p][VALUES + k] = memory[p][VALUES + k + 1]
            memory[p][VALUES + HORIZON + k] = memory[p][VALUES + HORIZON + k + 1]
    _plan_together(now, (gains.w, gains.zeta), base, arms, room, memory, planned)
    for p in range(2):
        torque[p] = inertias[p] * planned[p] + free[p]
        remember(now[p], wrist[p], found[p], torque[p], memory[p], 0)


def together(name: str) -> Controller:
    """The controller of this name with both planes at once."""
    by_plane = controller(name)
    if name == "mpc":
        return replace(by_plane, name="mpc-joint", law=_mpc_together, planes=2)
    return with_inertia_in_space(by_plane)


MOTIONS: Mapping[str, Mapping[str, Any]] = {
    "circle of 30 deg in 1 s": {"kind": "circumduction", "angle_deg": 30.0, "turn": 1.0},
    "jump of 30 deg on the diagonal": {"kind": "step", "angle_deg": 30.0},
    "dart-thrower of 30 deg in 1 s": {"kind": "dart-thrower", "angle_deg": 30.0, "turn": 1.0},
}
# Direction of each motion from ulnar toward flexion [deg], beside its own.
TOWARD_DEG = {"circumduction": 0.0, "step": 45.0, "dart-thrower": 0.0}
SOFT = {"plant": {"stiffness_scale": 0.8}}
LOOPS: Mapping[str, tuple[str, Mapping[str, Any]]] = {
    "ideal": ("default", SOFT),
    "camera": (
        "hardware",
        SOFT | {"control_period": 0.01, "actuator": {"level": "tendon", "sheath": 1.0}, "sensor": {"level": "camera"}},
    ),
}
LAWS = ("computed-torque", "ct-dob", "mrac", "mpc")


def error(law: Controller, preset: str, motion: Mapping[str, Any], wrist: WristParameters, loop: Loop) -> str:
    """RMSE over both planes [deg]: the median over the seeds, or how many fail."""
    reference, period = Reference.model_validate(motion), sample_period(loop.control_period)
    path = turned(bends_of(reference, "ulnar", wrist, HORIZON_S, period), TOWARD_DEG[reference.kind])
    followed = Motion.of_bends(path, period, wrist.length)
    gains = gains_of(law, preset if preset in law.presets else "default")
    seeds = SEEDS if loop.sensor.level == "camera" else 1
    draws = Draws(0)
    streams = [draws.camera(scenario_of(reference, "ulnar"), seed) for seed in range(seeds)]
    which = np.zeros(seeds, np.int64)
    outcome = rollout(law, np.tile(gains, (seeds, 1)), [followed], which, loop, wrist, None, streams)
    if outcome.failed.any():
        return f"fails in {int(outcome.failed.sum())} of {seeds}"
    return f"{np.rad2deg(np.median(outcome.metrics['rmse'])):.3g}"


def rows() -> Sequence[Sequence[str]]:
    """A row for each loop, motion, layout and controller."""
    lines = []
    for place, (preset, changes) in LOOPS.items():
        for name, motion in MOTIONS.items():
            for tendons in ("three", "four"):
                wrist = WristParameters(tendons=tendons)
                cells = []
                for law in LAWS:
                    ignored, added = (
                        Loop.model_validate({**changes, "coupling": each}) for each in ("ignored", "compensated")
                    )
                    by_plane = controller(law)
                    tried = (by_plane, ignored), (by_plane, added), (together(law), added)
                    cells.append(" / ".join(error(each, preset, motion, wrist, loop) for each, loop in tried))
                lines.append([f"{place}, {tendons}: {name}", *cells])
    return lines


def main() -> None:
    """Write the table into the page."""
    heads = ["loop, tendons and motion", *LAWS]
    lines = [heads, ["---"] * len(heads), *rows()]
    table = "\n".join(f"| {' | '.join(line)} |" for line in lines)
    before, _, rest = PAGE.read_text(encoding="utf-8").partition(BEGIN)
    PAGE.write_text(f"{before}{BEGIN}\n\n{table}\n\n{END}{rest.partition(END)[2]}", encoding="utf-8")


if __name__ == "__main__":
    main()
