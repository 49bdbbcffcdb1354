"""Whether a held tick of full pull moves the tip faster than the sliding law wants: then it does not arrive.

The hand is a point mass, so turning the tip about it is held back by the dampers alone. At full pull one held tick
turns the tip by 2 c F (q / D + h / (2 M)) / (P3 / P1) times what the law's own limit of rate, P3 / P1, would: from
about 1 on the sign turns every tick, the mean torque is none, and the wrist stays. q = 1 - mean(j)^2 / mean(j^2) over
the segments' lever arms j to the hand, M the inertia of one segment, h the period. Ours, found and tried by rollouts
(docs/best_case.md), whose limits are 3 to 10 % higher (docs/convergence.md), the more so the longer the period; it needs
a tick that lasts longer than the fast modes, 0.1 ms, and knows nothing of the size of the move.
"""

from __future__ import annotations

import math

import numpy as np

from wristctl.config.unstated import PaperSetting
from wristctl.control.smc import SMC
from wristctl.wrist.compiled_model import terms
from wristctl.wrist.holding import shortfall
from wristctl.wrist.segments import segments


def overshoot_of_a_tick(setting: PaperSetting, gains: str = "exchanged") -> float:
    """How many times too far one held tick goes; infinite without a tension limit."""
    wrist, loop, own = setting.wrist, setting.loop, SMC.presets[gains]
    if not loop.limits:
        return math.inf
    n = loop.plant_segments
    arms = wrist.length * (n - np.arange(n) - 0.5) / n + wrist.hand_offset
    turned = 1.0 - float(arms.mean() ** 2 / (arms**2).mean())
    inertia = float(terms(segments(wrist, 1), [0.0], [0.0]).mass[0, 0])
    pull = 2.0 * wrist.tendon_offset * wrist.tension_limit
    return pull * (turned / wrist.damping + 0.5 * loop.control_period / inertia) / (own["P3"] / own["P1"])


def holds(setting: PaperSetting) -> bool:
    """Whether the tendons can hold 30 deg toward the reference's side."""
    theta = math.radians(setting.reference.end_deg)
    return not setting.loop.limits or shortfall(setting.wrist, theta, theta) is None


def arrives_by_rule(setting: PaperSetting, gains: str = "exchanged") -> bool:
    """Strong enough to hold, and no tick too far."""
    return holds(setting) and overshoot_of_a_tick(setting, gains) < 1.0
