"""The answer of a training: error of the kept network where it was not trained, beside the closed form."""

from __future__ import annotations

import math
import shlex

from wristctl.commands.answer import Answer
from wristctl.commands.gen_data.answer import CLOSED_FORM
from wristctl.commands.printed_table import Table, degrees

# Heads of the errors in each of two planes, last in the table of errors.
OF_PLANES = ("ulnar [deg]", "flexion [deg]")

# The closed form's name in the table of errors.
_CLOSED_FORM = "exact inverse"


def answer_of(
    errors: Table, held_out: int, kept: tuple[str, int], run: str, data: str = "", segments: int = 1
) -> Answer:
    """What the network is worth on `held_out` test samples.

    `errors` has a row for each inverse and place, as `error_table` makes it. `kept` is the name of the one of so many
    networks; `run` is the path of the run, empty in memory; `data` that of the run with the samples, empty where the
    training drew its own, of a wrist of so many segments.
    """
    from wristctl.learning.network_file import NETWORK

    name, networks = kept
    planes = 2 if errors.columns[-2:] == OF_PLANES else 1
    network, closed = (next(row for row in errors.rows if row[0] == inverse) for inverse in ("network", _CLOSED_FORM))
    over = ""
    if planes == 2:
        ulnar, flexion = map(_deg, network[-2:])
        over = f" over both planes ({ulnar} deg toward ulnar, {flexion} deg toward flexion)"
    sentence = (
        f"On {held_out} samples that it was not trained on the network{f' {name}' * (networks > 1)} has an RMSE of "
        f"{_deg(network[3])} deg{over}, at most {_deg(network[4])} deg off. The closed form {CLOSED_FORM[planes]} has "
        f"one of {_deg(closed[3])} deg, at most {_deg(closed[4])} deg off."
    )
    notes = [f"It is the one of {networks} networks with the least validation loss."] * (networks > 1)
    if run:
        cut = ["--set", "loop.planes=2"] * (planes == 2) + ["--set", f"loop.plant_segments={segments}"] * (segments > 1)
        words = ["wristctl", "simulate", f"{data or run}/config.yaml", "--set", "reference.inverse=network", *cut]
        notes += ["Next, one motion of this wrist through this network:", f"$ {shlex.join([*words, '--network', run])}"]
    more = f"All tables: --all. The network: {run}/{NETWORK}" if run else "All tables: `.tables`."
    return Answer(sentence, errors, notes, more)


def _deg(error_deg: float) -> str:
    return degrees(math.radians(error_deg)) if math.isfinite(error_deg) else "-"
