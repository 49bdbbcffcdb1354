"""The page that goes with an exported law: when to call what, units, limits, constants."""

from collections.abc import Mapping
from string import Template

from wristctl.commands.export.law_programs import LEVELS, LawPrograms
from wristctl.commands.export.law_vectors import Vectors
from wristctl.simulation.batch import PLANES

_PAGE = Template("""\
# $title

$about

`$name.c` and `$name.h` are C99 for your firmware; `$name.py` is the same in NumPy. They have the controller, the
allocation of its torque to tendons within their limits, $parts. All numbers are doubles.
Nothing is allocated, and the number of operations of a tick does not depend on any value$frames_cost.
`vectors.csv` has $ticks ticks of a simulated loop.

    cc -std=c99 -O2 $name.c ${name}_test.c -lm -o law_test && ./law_test vectors.csv
    python $name.py vectors.csv

Both print the largest difference from that loop (of numbers above 1 as a share of them), and fail above 1e-9. Do not
compile with `-ffast-math`.

## Calls

1. `${name}_reset(&state)` once, with the wrist straight and at rest, and all tendons at their least pull.
2. Every $period s:
$calls
3. $send
4. `${name}_reset` again before a motion starts anew, or after a pause: the controller remembers.

## Units and signs

| value | meaning | unit |
|---|---|---|
$values

$places
$limits Where tendons cannot give all of `wanted`, `share` is below 1.

`${name}_withheld(&state)[p]` is the torque in plane p that your motors could not give of the last command [N m], + as
the bend. $withheld With it integrals do not wind up.

The vectors hold the arithmetic. They do not say that this law is stable on your wrist: `wristctl simulate`, `analyse`
and `recommend` do, for the wrist that was believed. What must stop a rig is not in here: a broken tendon, a wrist out
of its range, pictures that no longer come.

## Constants

At the top of `$name.c` and `$name.py`. Gains may be changed there$gains. The other numbers
are the wrist and the motors as they were believed.

| constant | value | meaning |
|---|---|---|
$constants
""")


def readme(programs: LawPrograms, vectors: Vectors, about: str, meanings: Mapping[str, str]) -> str:
    """Text of the page; `meanings` says what a constant is, by its name."""
    observer, name = programs.observer is not None, programs.name
    measured = "" if observer else "bend, rate, "
    calls = [f"   - for each picture that has come, the oldest first: `{name}_frame(&state, bend, age)`;"] * observer
    constants = [f"| `{key}` | {value:.6g} | {meanings.get(key, '')} |" for key, value in programs.constants.items()]
    limits = "; ".join(f"{low:.4g} to {high:.4g} N" for low, high in programs.limits)
    known = "The drive reckons it by itself; overwrite it where you know better."
    parts = (
        "what its motors are sent, and the observer behind its camera" if observer else "and what its motors are sent"
    )
    return _PAGE.substitute(
        title=f"{programs.title} for a firmware", about=about, name=name, ticks=len(vectors.rows),
        parts=parts,
        frames_cost=", but that a late picture costs a prediction for each tick of its age" * observer,
        period=f"{programs.period:g}", send=LEVELS[programs.level].send,
        calls="\n".join([*calls, f"   - `{name}_tick(&state, {measured}reference, &out)`."]),
        values="\n".join(_values(programs)), places=_places(programs),
        limits=f"`pull` stays within these limits: {limits}.",
        withheld="It is 0 unless you set it before a tick." if programs.level == "ideal" else known,
        gains="; the observer's gain is of the camera and stays" * observer, constants="\n".join(constants),
    )  # fmt: skip


def _values(programs: LawPrograms) -> list[str]:
    planes = "" if programs.planes == 1 else f" ({', then '.join(PLANES)})"
    ahead = f", then the same of each of the {programs.preview} periods to come" * bool(programs.preview)
    rows = [
        f"| `reference` | of each plane{planes}: angle, rate, acceleration{ahead} | rad, rad/s, rad/s^2 |",
        f"| `bend` | measured bend{planes} | rad |",
        "| `age` | time since the picture was taken | s |" if programs.observer else "| `rate` | its rate | rad/s |",
        "| `wanted`, `torque` | torque that is wanted, and that the pulls give | N m |",
        "| `pull`, `tension` | of all tendons of a place, and of one of them | N |",
    ]
    level = LEVELS[programs.level]
    of_motors = [("count", level.reckoned), *[(level.driven, level.sent)] * bool(programs.remembered)]
    return [*rows, *(f"| `{name}` | {words[:-1].replace(' [', ' | ')} |" for name, words in of_motors)]


def _places(programs: LawPrograms) -> str:
    counts = ", ".join(f"{count:g}" for count in programs.alike)
    if programs.planes == 1:
        return f"Places are the + side, which pulls toward positive bends, and the - side, with {counts} tendons."
    return f"Places are those of the study's tendons, in their order from ulnar, with {counts} tendons."
