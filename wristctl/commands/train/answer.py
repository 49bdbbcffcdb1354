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

    `errors` has a row for each inverse and place: name, place, R^2, RMSE [deg], largest error [deg]. `kept` is
    the name of the one of so many networks; `run` is the path of the run, empty in memory; `data` that of the run with
    the samples, empty where the training drew its own, of a wrist of so many segments. In two planes the last two
    columns are the RMSE of each.
    """
    from wristctl.learning.network_file import NETWORK

    name, networks = kept
    planes = 2 if errors.columns[-2:] == OF_PLANES else 1
    of_planes = [row[-2:] if planes == 2 else () for row in errors.rows]
    rows = [
        (row[0], row[1], _deg(row[3]), _deg(row[4]), *map(_deg, each))
        for row, each in zip(errors.rows, of_planes, strict=True)
    ]
    rmse, largest, *by_plane = next(row[2:] for row in rows if row[0] == "network")
    over = f" over both planes ({by_plane[0]} deg toward ulnar, {by_plane[1]} deg toward flexion)" if by_plane else ""
    sentence = (
        f"On {held_out} samples that it was not trained on the network{f' {name}' * (networks > 1)} has an RMSE of "
        f"{rmse} deg{over}, at most {largest} deg off."
    )
    closed, most, *_ = next(row[2:] for row in rows if row[0] == _CLOSED_FORM)
    sentence += f" The closed form {CLOSED_FORM[planes]} has one of {closed} deg, at most {most} deg off."
    named = [("closed form" if row[0] == _CLOSED_FORM else row[0], *row[1:]) for row in rows]
    heads = OF_PLANES if planes == 2 else ()
    notes = [f"It is the one of {networks} networks with the least validation loss."] * (networks > 1)
    if run:
        cut = ["--set", "loop.planes=2"] * (planes == 2) + ["--set", f"loop.plant_segments={segments}"] * (segments > 1)
        words = ["wristctl", "simulate", f"{data or run}/config.yaml", "--set", "reference.inverse=network", *cut]
        notes += ["Next, one motion of this wrist through this network:", f"$ {shlex.join([*words, '--network', run])}"]
    more = f"All tables: --all. The network: {run}/{NETWORK}" if run else "All tables: `.tables`."
    return Answer(
        sentence, Table("", ("inverse", "inputs", "RMSE [deg]", "largest error [deg]", *heads), named), notes, more
    )


def _deg(error_deg: float) -> str:
    return degrees(math.radians(error_deg)) if math.isfinite(error_deg) else "-"
