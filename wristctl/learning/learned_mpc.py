"""Model predictive control over a network of the wrist's dynamics, which `wristctl train` makes of transitions.

What soft robots are run with elsewhere: the dynamics learned, the motion planned over them (Gillespie et al., RoboSoft
2018; Bruder et al., IEEE T-RO 37 (2021) 948). The plan is that of `mpc`, in accelerations; the network takes the place
of the one-segment model in all that it does there: the box of the accelerations, the torque for the first of them, and
what the observer of the disturbance expects. So the wrist's parameters play no part.
"""

from typing import Any

import numpy as np

from wristctl.control.law import BY_TRIAL, Conditions, Controller, Gain
from wristctl.control.mpc import HORIZON, MPC, TURNS, plan
from wristctl.errors import UserError
from wristctl.lanes.compiled import compiled
from wristctl.lanes.functions import clip, expm1_of_negative, maximum, tanh
from wristctl.lanes.lane import where, zero_like
from wristctl.lanes.rows import beyond, lanes_like, part
from wristctl.learning.learned_dynamics import Dynamics
from wristctl.learning.network import LEAK

NAME = "learned-mpc"
_KINDS = ("tanh", "sigmoid", "silu", "relu", "leaky-relu")
# Places in a plane's memory: disturbance [rad/s^2], whether it has begun, bend, rate and torque of the last period.
_DISTURBANCE, _BEGUN, _BEND, _RATE, _TORQUE, _PLAN = range(6)
# Points of the learned region at which torques must move the wrist their own way, and the least share of the mean.
_POINTS, _LEAST = 2000, 0.05


@compiled
def _activated(kind: int, z: Any) -> Any:
    """Value and slope of an activation."""
    value, slope = z, z
    if kind == 0:
        value = tanh(z)
        slope = 1.0 - value * value
    elif kind < 3:
        share = 0.5 + 0.5 * tanh(0.5 * z)
        value = share if kind == 1 else z * share
        slope = share * (1.0 - share) if kind == 1 else share * (1.0 + z * (1.0 - share))
    else:
        slope = where(z > 0.0, 1.0 + zero_like(z), (0.0 if kind == 3 else LEAK) + zero_like(z))
        value = z * slope
    return value, slope


@compiled
def accelerations(net: Any, shape: Any, inputs: Any, out: Any, slopes: Any) -> None:
    """Write the network's accelerations (P) and their slopes with the torques (P P), of inputs (3 P).

    Inputs outside the learned region count as those at its edge, and torques add by their slope there. `net` and
    `shape` are those of `_compilable`.
    """
    packed, sizes, ends, kind = net
    planes, _, _, values, columns = shape
    count, zero = len(planes), zero_like(inputs[0])
    before, after = lanes_like(part(inputs, 0, values)), lanes_like(part(inputs, 0, values))
    columns_before, columns_after = lanes_like(part(inputs, 0, columns)), lanes_like(part(inputs, 0, columns))
    for j in range(3 * count):
        before[j] = clip(inputs[j], ends[2 * j] + zero, ends[2 * j + 1] + zero)
        for q in range(count):
            columns_before[count * j + q] = (1.0 if j == 2 * count + q else 0.0) + zero
    position = 0
    for layer in range(1, len(sizes)):
        for i in range(sizes[layer]):
            total = packed[position] + zero
            position += 1
            for q in range(count):
                columns_after[count * i + q] = zero
            for j in range(sizes[layer - 1]):
                total = total + packed[position] * before[j]
                for q in range(count):
                    old = columns_after[count * i + q]
                    columns_after[count * i + q] = old + packed[position] * columns_before[count * j + q]
                position += 1
            after[i] = total
        for i in range(sizes[layer]):
            value, slope = after[i], 1.0 + zero
            if layer < len(sizes) - 1:
                value, slope = _activated(kind, after[i])
            before[i] = value
            for q in range(count):
                columns_before[count * i + q] = slope * columns_after[count * i + q]
    for p in range(count):
        out[p] = before[p]
        for q in range(count):
            torque, edge = inputs[2 * count + q], 2 * (2 * count + q)
            over = torque - clip(torque, ends[edge] + zero, ends[edge + 1] + zero)
            slopes[count * p + q] = columns_before[count * p + q]
            out[p] = out[p] + slopes[count * p + q] * over


@compiled
def _solved(slopes: Any, least: float, wanted: Any, out: Any) -> None:
    """Write the torques (P) that change the accelerations (P) by what is wanted."""
    if len(wanted) == 1:
        out[0] = wanted[0] / maximum(slopes[0], least + zero_like(slopes[0]))
    else:
        size = maximum(slopes[0] * slopes[3] - slopes[1] * slopes[2], least * least + zero_like(slopes[0]))
        out[0] = (slopes[3] * wanted[0] - slopes[1] * wanted[1]) / size
        out[1] = (slopes[0] * wanted[1] - slopes[2] * wanted[0]) / size


@compiled
def controlled(net: Any, shape: Any, least: float, now: Any, gains: Any, memory: Any, torque: Any) -> None:
    """Write the torques of as many planes as `now` has, of one network of as many or more."""
    planes, pairs, state, _, _ = shape
    count, bent, zero = len(planes), len(now), zero_like(now[0].theta)
    row = part(memory[0], 0, planes)
    first, wanted, change = lanes_like(row), lanes_like(row), lanes_like(row)
    inputs, slopes = lanes_like(part(memory[0], 0, state)), lanes_like(part(memory[0], 0, pairs))
    for j in range(3 * count):
        inputs[j] = zero
    for p in range(bent):
        inputs[p], inputs[count + p] = memory[p][_BEND], memory[p][_RATE]
        inputs[2 * count + p] = memory[p][_TORQUE] - now[p].withheld
    accelerations(net, shape, inputs, first, slopes)
    for p in range(bent):
        view, kept = now[p], memory[p]
        gained = (view.rate - kept[_RATE]) / view.period - first[p] - kept[_DISTURBANCE]
        share = -expm1_of_negative(-gains.wo * view.period)
        kept[_DISTURBANCE] = kept[_DISTURBANCE] + where(kept[_BEGUN] > 0.0, share * gained, zero)
        inputs[p], inputs[count + p] = view.theta, view.rate
        inputs[2 * count + p] = clip(kept[_TORQUE], view.torque_low, view.torque_high)
    accelerations(net, shape, inputs, first, slopes)
    for q in range(count):
        wanted[q] = zero
    for p in range(bent):
        view, kept = now[p], beyond(memory[p], _PLAN)
        slope = maximum(slopes[count * p + p], least + zero)
        base = first[p] + memory[p][_DISTURBANCE] - slope * inputs[2 * count + p]
        for k in range(HORIZON - 1):
            kept[k], kept[HORIZON + k] = kept[k + 1], kept[HORIZON + k + 1]
        box = base + slope * view.torque_low, base + slope * view.torque_high
        wanted[p] = plan(view, (view.theta, view.rate), (gains.w, gains.zeta), box, kept, TURNS)
        wanted[p] = wanted[p] - memory[p][_DISTURBANCE]
    for turn in range(2):  # Newton's steps
        for p in range(count):
            first[p] = wanted[p] - first[p] if p < bent else zero
        _solved(slopes, least, first, change)
        for p in range(bent):
            inputs[2 * count + p] = inputs[2 * count + p] + change[p]
        if turn == 0:
            accelerations(net, shape, inputs, first, slopes)
    for p in range(bent):
        view, kept = now[p], memory[p]
        torque[p] = inputs[2 * count + p]
        kept[_BEGUN], kept[_BEND], kept[_RATE] = 1.0 + zero, view.theta, view.rate
        kept[_TORQUE] = clip(torque[p], view.torque_low, view.torque_high)


def _compilable(dynamics: Dynamics) -> tuple[Any, Any]:
    """A network as compiled code holds it, and the sizes of its scratch as tuples of so many entries.

    Scaling is folded into the first and the last layer; of each neuron the offset comes first, then its weights.
    """
    network, planes = dynamics.network, dynamics.planes
    packed = np.concatenate([np.column_stack([bias, weight]).ravel() for weight, bias in network.folded()])
    ends, kind = np.column_stack([dynamics.low, dynamics.high]).ravel(), _KINDS.index(network.activation)
    lengths = (planes, planes * planes, 3 * planes, max(network.sizes), planes * max(network.sizes))
    return (packed, np.array(network.sizes), ends, kind), tuple((0,) * length for length in lengths)


def _mean_slope(dynamics: Dynamics) -> float:
    """Mean slope of an acceleration with its torque in the learned region.

    Raises UserError where a torque moves the wrist the other way somewhere there: no plan could use that network.
    """
    points = np.random.default_rng(0).uniform(dynamics.low, dynamics.high, (_POINTS, len(dynamics.low)))
    slopes = dynamics.gain(points)
    least = np.linalg.eigvalsh(0.5 * (slopes + slopes.transpose(0, 2, 1)))[:, 0]
    mean = float(np.mean(np.trace(slopes, axis1=1, axis2=2)) / dynamics.planes)
    share = float(np.mean(least <= 0.0))
    if mean <= 0.0 or share > _LEAST:
        problem = f"by this network torques move the wrist the wrong way in {100.0 * share:.3g} % of what it learned"
        raise UserError(problem, NAME, "train it on more samples, for longer, or with --preset recommended")
    return mean


def learned_mpc(dynamics: Dynamics, name: str = NAME) -> Controller:
    """The controller over a network. Raises UserError for one that is of no use.

    A network of one plane is used for each plane by itself, one of two planes for both together, or for one.
    """
    net, shape = _compilable(dynamics)
    packed, sizes, ends, kind = net
    least = _LEAST * _mean_slope(dynamics)

    def law(now: Any, wrist: Any, gains: Any, memory: Any) -> Any:
        """u with N(theta, rate, u) + d = v: N the network, v the plan's first acceleration, d what N has left out."""
        torque = lanes_like(part(memory, 0, (0,)))
        controlled((packed, sizes, ends, kind), shape, least, (now,), gains, (memory,), torque)
        return torque[0]

    def law_of_both(now: Any, wrist: Any, gains: Any, memory: Any, tendons: Any, torque: Any) -> None:
        """u with N(theta, rate, u) + d = v: N the network, v the plan's first accelerations, d what N has left out."""
        controlled((packed, sizes, ends, kind), shape, least, now, gains, memory, torque)

    return Controller(
        name=name,
        law=law if dynamics.planes == 1 else law_of_both,
        source="learned dynamics as Gillespie et al., RoboSoft 2018; planned as mpc",
        gains={
            "w": MPC.gains["w"],
            "zeta": MPC.gains["zeta"],
            "wo": Gain("rad/s", "bandwidth of the observer of what the network leaves out", 1e-1, 1e5),
        },
        presets={
            "default": {"w": 50.0, "zeta": 1.0, "wo": 50.0},
            "hardware": {"w": 45.0, "zeta": 0.8, "wo": 20.0},
        },
        memory=_PLAN + 2 * HORIZON,
        preview=HORIZON,
        planes=dynamics.planes,
        notes={"hardware": BY_TRIAL},
        conditions={"hardware": Conditions((5e-3, 1e-2), (8e3, 1e5))},
    )
