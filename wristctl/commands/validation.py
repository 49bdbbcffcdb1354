"""What `validate` says of recordings of real robots: which there are, and how well the model predicts one."""

from __future__ import annotations

from pathlib import Path

from wristctl.commands.answer import Answer
from wristctl.commands.printed_table import Table
from wristctl.records.data_sets import DATA_SETS, data_set

# RMS error [deg] of the authors' geometry in the open loop with 500 g, 20 to 70 s; doi 10.3389/frobt.2020.00027.
_AUTHORS = 2.31


def data_sets_table() -> Table:
    """Each set, where it is, its licence, and how many of its files have a hash here."""
    rows = [(name, one.place, one.licence, one.columns, len(one.hashes)) for name, one in DATA_SETS.items()]
    return Table("", ("robot", "where", "licence", "--columns", "hashes"), rows)


def checked_set(name: str, folder: Path) -> str:
    """Sentence on the files in a folder. Raises UserError for one that is missing or differs, or an unknown set."""
    chosen = data_set(name)
    files = len(chosen.checked(folder))
    if not files:
        return f"{name}: no hashes are known of its files, so they are not checked."
    return f"{name}: {files} files are as published (SHA-256), licence {chosen.licence}."


def soft_neck_answer(folder: Path) -> Answer:
    """The third load of UC3M's soft neck predicted from the other two, beside the authors' geometry."""
    from wristctl.identification.soft_neck import ASKED_LOAD, FITTED_LOADS, ZEROS_UNTIL, predict_third_load

    result = predict_third_load(folder)
    rows: list[tuple[str, float, float | None, float | None]] = [
        ("authors' geometry", _AUTHORS, None, None),
        ("linear map of the motors", result.linear, None, None),
        ("one arc, elastic tendons", result.error, result.low, result.high),
    ]
    fitted = " and ".join(f"{error:.2f} deg at {load} g" for load, error in result.fitted.items())
    better = "smaller than" if result.high < _AUTHORS else "not told apart from"
    sentence = (
        f"The model predicts the bend with {ASKED_LOAD} g to {result.error:.2f} deg RMS (95 % {result.low:.2f} to "
        f"{result.high:.2f}), {better} the {_AUTHORS} deg of the authors' geometry."
    )
    notes = (
        f"Fitted: {' and '.join(map(str, FITTED_LOADS))} g, where {fitted} are left; the first {ZEROS_UNTIL:g} s of "
        f"{ASKED_LOAD} g give its zeros and slack. The interval is by blocks of 5 s of this one recording.",
        "The neck's three tendons act in its plane of bending by effective arms; friction and inertia are left out. "
        "The model has more free numbers than the authors' geometry.",
        Table("", ("parameter", "value"), list(result.parameters.items())),
    )
    return Answer(sentence, Table("", ("500 g, 20-70 s", "RMS error [deg]", "low", "high"), rows), notes)
