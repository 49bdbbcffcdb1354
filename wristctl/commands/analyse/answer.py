"""The answer of the analysis of a loop: whether it is stable, and its least margins; what its quantities are."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from wristctl.commands.answer import Answer, rest
from wristctl.commands.printed_table import joined
from wristctl.commands.quantities import Quantity, table_of

if TYPE_CHECKING:
    from wristctl.stability.linear_range import LinearityLimit
    from wristctl.stability.loop_analysis import LoopAnalysis


_EACH = "factor of one plane's gain {} to which it is stable, whatever the other's up to its own"
_QUANTITIES = {
    quantity.name: quantity
    for quantity in (
        Quantity("angle_deg", "deg", "where the loop rests, toward the direction", "at rest"),
        Quantity("torque", "N m", "that holds it there"),
        Quantity("stable", "", "whether small swings die out"),
        Quantity("growth", "1/s", "of the least stable mode"),
        Quantity("gain_margin", "dB"),
        Quantity("gain_most", "", "factor of the loop's gain up to which it is stable"),
        Quantity("gain_most_frequency", "Hz", "with which it begins to oscillate there", "at"),
        Quantity("gain_least", "", "factor of the loop's gain down to which it is stable", "least factor"),
        Quantity("gain_least_frequency", "Hz", "with which it begins to oscillate there", "least factor at"),
        Quantity("phase_margin", "rad", "smallest where the loop gain is 1"),
        Quantity("delay_margin", "s", "least delay more that makes it unstable", shown="ms"),
        Quantity("delay_frequency", "Hz", "with which it begins to oscillate then", "then at"),
        Quantity("sensitivity", "", "Ms, largest |1/(1 + L)|", "Ms"),
        Quantity("complementary", "", "Mt, largest |L/(1 + L)|", "Mt"),
        Quantity("rise", "s", "of a small step from 10 to 90 %", "rise 10-90 %", "ms"),
        Quantity("overshoot", "", "of a small step, as a share of where it ends", shown="%"),
        Quantity("settling", "s", "of a small step to 2 %", shown="ms"),
        Quantity("final", "", "share of a small step at which the angle arrives", "arrives at", "%"),
        Quantity("toward_deg", "deg", "direction of the resting bend, from ulnar toward flexion"),
        Quantity("each_least", "", _EACH.format("down"), "least factor"),
        Quantity("each_most", "", _EACH.format("up"), "largest factor"),
        Quantity("each_phase", "rad", "phase that each plane bears by itself", "phase"),
    )
}  # fmt: skip
# Name of the limit of linearity that only adds to a swing.
NOISE = "the camera's noise"


def listed(angles: Iterable[float]) -> str:
    """Angles [deg] as text: 0, 15 and 30 deg."""
    texts = [f"{round(angle, 6):g}" for angle in angles]
    return f"{joined(texts)} deg"


def picked(*names: str) -> list[Quantity]:
    """Quantities of a resting loop by name."""
    return [_QUANTITIES[name] for name in names]


def decibels(factor: float) -> float:
    """A factor of the gain in dB; -inf for 0."""
    return 20.0 * math.log10(factor) if factor > 0.0 else -math.inf


def answer_of(label: str, records: Sequence[Mapping[str, Any]], analyses: Sequence[LoopAnalysis], run: str) -> Answer:
    """The answer for one screen; `records` are rows of the main table, one for each resting angle.

    `run` is the path of the run, empty for a result in memory.
    """
    angles = [record["angle_deg"] for record in records]
    more = rest("Root locus, limits of linearity and all columns", run)
    stable = all(record["stable"] for record in records)
    if all(analysis.is_open for analysis in analyses):
        said = f"{label} feeds nothing back: there is no loop, and no margin; the plant alone is shown"
        return Answer(f"{said}{'' if stable else ', and it is UNSTABLE'}.", None, (), more)
    table = table_of("", picked(*_ON_A_SCREEN), map(_of_a_stable_loop, records))
    if not stable:
        bad = [k for k, record in enumerate(records) if not record["stable"]]
        worst = analyses[max(bad, key=lambda k: records[k]["growth"])]
        swing = _three(worst.linear.closed.modes()[0].frequency)
        said = f"{label} is UNSTABLE at {listed(angles[k] for k in bad)}: a swing of {swing} Hz grows by e in "
        return Answer(f"{said}{_time(1.0 / worst.margins.growth)}; {_mended(worst)}.", table, (), more)
    most, delay = (min(record[name] for record in records) for name in ("gain_most", "delay_margin"))
    least = max(record["gain_least"] for record in records)
    gain = (
        f"gain margin {_three(decibels(most))} dB ({_three(most)} times the loop gain)"
        if math.isfinite(most)
        else "any larger loop gain is stable"
    )
    margin = f"delay margin {_time(delay)}" if math.isfinite(delay) else "any delay is stable"
    notes = [f"Below {_three(least)} times the loop gain it is unstable."] * (least > 0.0)
    notes += [f"Margins are of both planes together; {each}." for each in _of_each_plane(analyses)]
    for swings in _linear_range(analyses[-1]):
        holds = f"these margins hold {swings}" if swings.startswith("for ") else swings
        notes.append(f"At {listed(angles[-1:])} {holds}.")
    return Answer(f"{label} is stable at {listed(angles)}: {gain}, {margin}.", table, notes, more)


# Columns of the answer's table, and what they are where the loop is stable.
_ON_A_SCREEN = ("angle_deg", "gain_margin", "phase_margin", "delay_margin", "settling", "overshoot")


def _of_a_stable_loop(record: Mapping[str, Any]) -> dict[str, Any]:
    """The record; of an unstable loop its angle alone."""
    return dict(record) if record["stable"] else {"angle_deg": record["angle_deg"]}


def _of_each_plane(analyses: Sequence[LoopAnalysis]) -> list[str]:
    """What each of two planes bears by itself, in words."""
    if analyses[0].linear.planes == 1:
        return []
    each = max((analysis.margins for analysis in analyses), key=lambda margins: margins.sensitivity.value).of_each
    factors = f"{_three(each.least)} to {_three(each.most)} times its gain"
    return [f"each plane by itself bears {factors}, or a phase of {_three(math.degrees(each.phase))} deg"]


def _linear_range(analysis: LoopAnalysis) -> list[str]:
    """Swings for which the loop is linear, in words; noise only adds to them."""
    finite = [limit for limit in analysis.limits if math.isfinite(limit.swing) and limit.what != NOISE]
    low = max((limit for limit in finite if not limit.above), key=lambda limit: limit.swing, default=None)
    high = min((limit for limit in finite if limit.above), key=lambda limit: limit.swing, default=None)
    ends = [_end(limit, "above" if limit is low else "below") for limit in (low, high) if limit is not None]
    if low is not None and high is not None and low.swing >= high.swing:
        return [f"no swing is linear, which it would be {' and '.join(ends)}"]
    return [f"for swings {' and '.join(ends)}"] if ends else []


def _end(limit: LinearityLimit, side: str) -> str:
    return f"{side} {_three(math.degrees(limit.swing))} deg ({limit.what})"


def _mended(worst: LoopAnalysis) -> str:
    least, most = worst.margins.least, worst.margins.most
    if math.isnan(least.value):
        return "no other loop gain makes it stable (--over NAME tries a gain of the controller)"
    if least.value == 0.0:
        return f"it is stable up to {_three(most.value)} times the loop gain"
    above = "" if math.isinf(most.value) else f" to {_three(most.value)}"
    return f"it is stable from {_three(least.value)}{above} times the loop gain"


def _time(seconds: float) -> str:
    return f"{_three(seconds)} s" if seconds >= 1.0 else f"{_three(1e3 * seconds)} ms"


def _three(value: float) -> str:
    return f"{value:.3g}"
