"""The answer of a data set: how many samples of what, with their ranges in deg and mm."""

from __future__ import annotations

import math
import shlex
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

from wristctl.commands.answer import Answer
from wristctl.commands.printed_table import Table, degrees, number

if TYPE_CHECKING:
    from wristctl.learning.measured_samples import RecordedCourse

# Factor and unit in which a quantity is shown; of others 1e3 and mm.
RANGES = dict.fromkeys(("theta", "bend", "bend_ulnar", "bend_flexion", "pose", "roll"), (180.0 / math.pi, "deg")) | {
    "hand_mass": (1.0, "kg")
}
# Quantities of samples beside further inputs, by the number of planes.
QUANTITIES = {
    1: ("theta", "arc_length", "x", "y"),
    2: ("bend", "bend_ulnar", "bend_flexion", "arc_length", "x", "y", "z"),
}
CLOSED_FORM = {1: "2 atan2(y, x)", 2: "2 atan2(hypot(y, z), x) toward (y, z)"}
"""The closed form of one arc, by the number of planes."""
# Quantities in words.
_WORDS = {"theta": "bending angle", "arc_length": "arc length", "x": "tip, along the straight wrist", "y": "tip, aside",
          "bend": "size of the bend", "bend_ulnar": "bend toward ulnar", "bend_flexion": "bend toward flexion",
          "z": "tip, toward flexion", "pose": "tilt of the wrist", "roll": "direction of the tilt",
          "hand_mass": "mass in the hand"}  # fmt: skip


class Measured(NamedTuple):
    """What was read of recordings."""

    recordings: int
    """Recordings with samples."""
    samples: int
    """Rows with all of tip, angle and further inputs."""
    left_out: int
    """Rows without some of these."""

    @property
    def left_out_words(self) -> str:
        """How many rows were left out, in brackets; empty where none was."""
        return f" (left out: {counted(self.left_out, 'row')} without a tip or an angle)" if self.left_out else ""


def measured_of(courses: Sequence[RecordedCourse]) -> Measured:
    """What recordings have."""
    counts = [len(course.theta) for course in courses]
    return Measured(sum(count > 0 for count in counts), sum(counts), sum(course.left_out for course in courses))


def counted(count: int, name: str) -> str:
    """A number of things: 1 file, 2 files."""
    return f"{count} {name}{'s' * (count != 1)}"


def answer_of(
    inputs: Sequence[str],
    metrics: Mapping[str, float],
    run: str,
    split: str | None,
    measured: Measured | None = None,
    why_two: str = "",
) -> Answer:
    """What was drawn, or read of recordings.

    `inputs` are those beside the tip, `run` is the path of the run, empty in memory; `split` is how `train` can part
    the samples, None where it cannot; `why_two` says why the samples bend in two planes, where that is to be said.
    """
    count, planes = int(metrics["samples"]), 2 if "bend_max_deg" in metrics else 1
    source = ""
    if measured is not None:
        named = counted(measured.recordings, "recording")
        chosen = "all" if measured.samples == count else f"drawn from the {measured.samples}"
        source = f", {chosen} of {named}{measured.left_out_words}"
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
    return Answer(
        sentence, Table("", ("quantity", "least", "greatest", "unit"), _rows(planes, inputs, metrics)), notes, more
    )


def _rows(planes: int, inputs: Sequence[str], metrics: Mapping[str, float]) -> list[tuple[str, float, float, str]]:
    rows, words = [], _WORDS | ({"y": "tip, toward ulnar"} if planes == 2 else {})
    for name in (*QUANTITIES[planes], *inputs):
        unit = RANGES.get(name, (1e3, "mm"))[1]
        rows.append((words.get(name, name), metrics[f"{name}_min_{unit}"], metrics[f"{name}_max_{unit}"], unit))
    return rows
