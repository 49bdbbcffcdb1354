"""The answer of a training: error of the kept network where it was not trained, beside the closed form."""

from __future__ import annotations

import math
import shlex

from wristctl.commands.answer import Answer
from wristctl.commands.printed_table import Table, degrees

# The closed form's name in the table of errors.
_CLOSED_FORM = "exact inverse"


def answer_of(
    errors: Table, held_out: int, kept: tuple[str, int], run: str, data: str = "", segments: int = 1
) -> Answer:
    """What the network is worth on `held_out` test samples.

    `errors` has a row for each inverse and place: name, place, R^2, RMSE [deg], largest error [deg]. `kept` is
    the name of the one of so many networks; `run` is the path of the run, empty in memory; `data` that of the run with
    the samples, empty where the training drew its own, of a wrist of so many segments.
    """
    from wristctl.learning.network_file import NETWORK

    name, networks = kept
    rows = [(row[0], row[1], _deg(row[3]), _deg(row[4])) for row in errors.rows]
    rmse, largest = next(row[2:] for row in rows if row[0] == "network")
    sentence = (
        f"On {held_out} samples that it was not trained on the network{f' {name}' * (networks > 1)} has an RMSE of "
        f"{rmse} deg, at most {largest} deg off."
    )
    closed, most = next(row[2:] for row in rows if row[0] == _CLOSED_FORM)
    sentence += f" The closed form 2 atan2(y, x) has one of {closed} deg, at most {most} deg off."
    named = [("closed form" if row[0] == _CLOSED_FORM else row[0], *row[1:]) for row in rows]
    notes = [f"It is the one of {networks} networks with the least validation loss."] * (networks > 1)
    if run:
        cut = ["--set", f"loop.plant_segments={segments}"] * (segments > 1)
        words = ["wristctl", "simulate", f"{data or run}/config.yaml", "--set", "reference.inverse=network", *cut]
        notes += ["Next, one motion of this wrist through this network:", f"$ {shlex.join([*words, '--network', run])}"]
    more = f"All tables: --all. The network: {run}/{NETWORK}" if run else "All tables: `.tables`."
    return Answer(sentence, Table("", ("inverse", "inputs", "RMSE [deg]", "largest error [deg]"), named), notes, more)


def _deg(error_deg: float) -> str:
    return degrees(math.radians(error_deg)) if math.isfinite(error_deg) else "-"
