"""The answer of a data set: how many samples of what, with their ranges in deg and mm."""

from __future__ import annotations

import math
import shlex
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

from wristctl.commands.answer import Answer
from wristctl.commands.printed_table import Table, degrees, number
from wristctl.commands.quantities import Quantity

if TYPE_CHECKING:
    from wristctl.learning.measured_samples import RecordedCourse

SAMPLED = {
    quantity.name: quantity
    for quantity in (
        Quantity("x", "m", "tip position along the straight wrist", "tip, along the straight wrist", "mm"),
        Quantity("y", "m", "tip position across it, toward positive bending", "tip, aside", "mm"),
        Quantity("z", "m", "tip position toward flexion", "tip, toward flexion", "mm"),
        Quantity("theta", "rad", "bending angle", "bending angle", "deg"),
        Quantity("arc_length", "m", "length of the arc from the first to the last disc", shown="mm"),
        Quantity("pose", "rad", "tilt of the base from upright", "tilt of the wrist", "deg"),
        Quantity("roll", "rad", "direction of the tilt, from ulnar toward flexion", "direction of the tilt", "deg"),
        Quantity("bend", "rad", "size of the bend", "size of the bend", "deg"),
        Quantity("bend_ulnar", "rad", "bend, toward ulnar", "bend toward ulnar", "deg"),
        Quantity("bend_flexion", "rad", "bend, toward flexion", "bend toward flexion", "deg"),
        Quantity("hand_mass", "kg", "mass of hand and payload", "mass in the hand"),
        Quantity("held_out", "1", "0: not; held out of training by 1: its payload, 2: its pose"),
        Quantity("recording", "1", "which of the recordings it was measured in"),
    )
}
"""Quantities of samples, by name."""
# Quantities of samples beside further inputs, by the number of planes.
QUANTITIES = {
    1: ("theta", "arc_length", "x", "y"),
    2: ("bend", "bend_ulnar", "bend_flexion", "arc_length", "x", "y", "z"),
}
CLOSED_FORM = {1: "2 atan2(y, x)", 2: "2 atan2(hypot(y, z), x) toward (y, z)"}
"""The closed form of one arc, by the number of planes."""


class Measured(NamedTuple):
    """What was read of recordings."""

    samples: int
    """Rows with all of tip, angle and further inputs."""
    recordings: str
    """How many have samples, and how many rows were left out, in words."""


def measured_of(courses: Sequence[RecordedCourse]) -> Measured:
    """What recordings have."""
    counts, left_out = [len(course.theta) for course in courses], sum(course.left_out for course in courses)
    words = f" (left out: {counted(left_out, 'row')} without a tip or an angle)" * bool(left_out)
    return Measured(sum(counts), counted(sum(count > 0 for count in counts), "recording") + words)


def counted(count: int, name: str) -> str:
    """A number of things: 1 file, 2 files."""
    return f"{count} {name}{'s' * (count != 1)}"


def answer_of(
    ranges: Table,
    metrics: Mapping[str, float],
    run: str,
    split: str | None,
    measured: Measured | None = None,
    why_two: str = "",
) -> Answer:
    """What was drawn, or read of recordings.

    `ranges` has the quantities of the samples, `run` is the path of the run, empty in memory; `split` is how `train`
    can part the samples, None where it cannot; `why_two` says why the samples bend in two planes, where that is to be
    said.
    """
    count, planes = int(metrics["samples"]), 2 if "bend_max_deg" in metrics else 1
    source = ""
    if measured is not None:
        chosen = "all" if measured.samples == count else f"drawn from the {measured.samples}"
        source = f", {chosen} of {measured.recordings}"
    low, high = (metrics[f"{QUANTITIES[planes][0]}_{end}_deg"] for end in ("min", "max"))
    ends = f"from {number(low)} to {number(high)} deg"
    why = f" ({why_two})" if why_two else ""
    what = "bending angle" if planes == 1 else f"bend in two planes{why}"
    sentence = f"{count} samples of tip position and {what}, {ends}{source}."
    error, largest = (math.radians(metrics[f"exact_inverse_{name}"]) for name in ("rmse_deg", "max_error_deg"))
    notes = [
        f"The closed form {CLOSED_FORM[planes]} has an RMSE of {degrees(error)} deg there, "
        f"at most {degrees(largest)} deg off."
    ]
    held = [
        f"{100.0 * metrics[f'held_out_{name}_share']:.3g} % by their {name}"
        for name in ("payload", "pose")
        if metrics[f"held_out_{name}_share"] > 0.0
    ]
    notes += [f"Held out of training: {', '.join(held)}."] * bool(held)
    if run and split is not None:
        parted = ["--set", f"split={split}"] * (split != "recording")
        words = ["wristctl", "train", f"{run}/config.yaml", *parted, "--data", run]
        neighbours = ", which is tested by neighbours of what it was trained on" * bool(parted)
        notes += [f"Next, train a network on them{neighbours}:", f"$ {shlex.join(words)}"]
    more = f"The samples: {run}/data/samples.npz" if run else ""
    return Answer(sentence, ranges, notes, more)


def ranged(planes: int, inputs: Sequence[str]) -> list[Quantity]:
    """The quantities of samples in so many planes with these further inputs, in the order of a table."""
    quantities = [SAMPLED[name] for name in (*QUANTITIES[planes], *inputs)]
    aside = "tip, toward ulnar" if planes == 2 else "tip, aside"
    return [replace(each, heading=aside) if each.name == "y" else each for each in quantities]
