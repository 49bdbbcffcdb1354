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
RANGES = {"theta": (180.0 / math.pi, "deg"), "pose": (180.0 / math.pi, "deg"), "hand_mass": (1.0, "kg")}
# Quantities in words.
_WORDS = {"theta": "bending angle", "arc_length": "arc length", "x": "tip, along the straight wrist", "y": "tip, aside",
          "pose": "tilt of the wrist", "hand_mass": "mass in the hand"}  # fmt: skip


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
    inputs: Sequence[str], metrics: Mapping[str, float], run: str, split: str | None, measured: Measured | None = None
) -> Answer:
    """What was drawn, or read of recordings.

    `inputs` are those beside the tip, `run` is the path of the run, empty in memory; `split` is how `train` can part
    the samples, None where it cannot.
    """
    count = int(metrics["samples"])
    low, high = (metrics[f"theta_{end}_deg"] for end in ("min", "max"))
    source = ""
    if measured is not None:
        named = counted(measured.recordings, "recording")
        chosen = "all" if measured.samples == count else f"drawn from the {measured.samples}"
        source = f", {chosen} of {named}{measured.left_out_words}"
    sentence = f"{count} samples of tip position and bending angle, from {number(low)} to {number(high)} deg{source}."
    error, largest = (math.radians(metrics[f"exact_inverse_{name}"]) for name in ("rmse_deg", "max_error_deg"))
    notes = [
        f"The closed form 2 atan2(y, x) has an RMSE of {degrees(error)} deg there, at most {degrees(largest)} deg off."
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
    return Answer(sentence, Table("", ("quantity", "least", "greatest", "unit"), _rows(inputs, metrics)), notes, more)


def _rows(inputs: Sequence[str], metrics: Mapping[str, float]) -> list[tuple[str, float, float, str]]:
    rows = []
    for name in ("theta", "arc_length", "x", "y", *inputs):
        unit = RANGES.get(name, (1e3, "mm"))[1]
        rows.append((_WORDS.get(name, name), metrics[f"{name}_min_{unit}"], metrics[f"{name}_max_{unit}"], unit))
    return rows
