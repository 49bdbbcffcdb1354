"""What columns may be by their authors' names and units, in English, German and French."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Callable, Collection, Sequence
from typing import NamedTuple

UNIT_WORDS = {
    **dict.fromkeys(
        ("s", "sec", "secs", "second", "seconds", "sek", "sekunde", "sekunden", "seconde", "secondes"), "s"
    ),
    **dict.fromkeys(("ms", "msec", "msecs", "millis", "millisecond", "milliseconds", "millisekunden"), "ms"),
    **dict.fromkeys(("us", "µs", "usec", "micros", "microseconds", "mikrosekunden"), "us"),
    **dict.fromkeys(("ns", "nsec", "nanos", "nanoseconds", "nanosekunden"), "ns"),
    **dict.fromkeys(("deg", "°", "degs", "degree", "degrees", "grad", "degre", "degres", "degré", "degrés"), "deg"),
    **dict.fromkeys(("rad", "rads", "radian", "radians", "radiant"), "rad"),
    **dict.fromkeys(("m", "meter", "meters", "metre", "metres"), "m"),
    **dict.fromkeys(("mm", "millimeter", "millimeters", "millimetre", "millimetres"), "mm"),
    **dict.fromkeys(("cm", "centimeter", "centimetre"), "cm"),
    **dict.fromkeys(("um", "µm", "micron", "microns"), "um"),
    **dict.fromkeys(("n", "newton", "newtons"), "N"),
    **dict.fromkeys(("kg", "kilogram", "kilogramm"), "kg"),
    **dict.fromkeys(("g", "gram", "gramm", "gramme", "grammes"), "g"),
}
"""Units by what people write for them; German `Grad` is a degree."""

_KINDS = {"s": "time", "ms": "time", "us": "time", "ns": "time", "deg": "angle", "rad": "angle", "m": "length",
          "mm": "length", "cm": "length", "um": "length", "N": "force", "kg": "mass", "g": "mass"}  # fmt: skip
# Parts of names, of four letters or more wherever they stand in a word; shorter ones are whole words.
_OTHERS = (
    "velocity",
    "speed",
    "geschw",
    "vitesse",
    "accel",
    "gyro",
    "temperat",
    "ref",
    "soll",
    "cmd",
    "command",
    "target",
    "ziel",
    "consigne",
    "setpoint",
    "desired",
    "goal",
)
_WORDS = {
    "time": ("time", "zeit", "temps", "stamp", "horodat", "epoch", "datum", "clock", "t", "ms", "sec", "date"),
    "tension": ("tension", "force", "kraft", "zugkraft", "loadcell", "effort", "traction", "f", "load", "zug"),
    "mass": ("mass", "gewicht", "weight", "poids", "payload", "nutzlast", "last"),
    "bend": ("angle", "winkel", "bend", "bieg", "beug", "theta", "flexion", "courb", "inclin", "neigung", "pitch",
             "imu", "tilt", "roll", "yaw"),
    "spool": ("spool", "seil", "sehne", "cable", "kabel", "cord", "tendon", "wire", "draht", "rope", "motor", "moteur",
              "encod", "codeur", "winch", "winde", "treuil", "servo", "spule", "bobine", "laenge", "lange", "length",
              "longueur", "stepper", "enc", "fil", "m", "l"),
    "trial": ("trial", "versuch", "essai", "episode", "run", "lauf"),
}  # fmt: skip
_OF_TIP = ("tip", "spitze", "pointe", "pos", "position", "ee")
_MINUS = ("minus", "neg", "right", "rechts", "droit", "droite", "b")
_COMMON = {"time": "s", "bend": "deg", "spool": "mm", "tension": "N", "mass": "kg", "tip": "mm", "trial": ""}
_OF_KIND = {"time": ("time",), "angle": ("bend",), "length": ("spool", "tip"), "force": ("tension",), "mass": ("mass",)}


class Guess(NamedTuple):
    """What a column may be: its name in an open log, and its unit."""

    name: str
    unit: str
    unsure: bool
    """Whether the unit is a guess."""
    standing: bool
    """Whether its name and unit are those of an open log already."""


class _Read(NamedTuple):
    words: list[str]
    number: int | None
    unit: str


def guesses(heads: Sequence[str], taken: Collection[str], known: Callable[[str], Guess | None]) -> list[Guess | None]:
    """What each column may be, None of one that nothing is known of.

    Parameters
    ----------
    heads
        Names, with units in brackets where they have them.
    taken
        Names in an open log that other columns have.
    known
        What a column is whose name is one of an open log.
    """
    found: list[Guess | None] = [known(head) for head in heads]
    used = {*taken, *(guess.name for guess in found if guess)}
    reads = [_read(head) for head in heads]
    kinds = [None if guess else _kind(read) for guess, read in zip(found, reads, strict=True)]
    for quantity in ("spool", "tension"):
        places = [place for place, kind in enumerate(kinds) if kind == quantity]
        for place, number in zip(places, _numbers([reads[place] for place in places]), strict=True):
            if f"{quantity}_{number}" not in used:
                used.add(f"{quantity}_{number}")
                found[place] = _guess(f"{quantity}_{number}", quantity, reads[place])
    for place, kind in enumerate(kinds):
        if kind in (None, "spool", "tension"):
            continue
        name = _named(kind, reads[place], used)
        if name is not None and name not in used:
            used.add(name)
            found[place] = _guess(name, kind, reads[place])
    return found


def _guess(name: str, quantity: str, read: _Read) -> Guess:
    """With the unit that was read where it is one of the quantity's; of a motor's angle, as with a winch of 10 mm."""
    if quantity == "spool" and read.unit in ("deg", "rad"):
        return Guess(name, "0.1745 mm" if read.unit == "deg" else "10 mm", True, False)
    fits = read.unit and quantity in _OF_KIND[_KINDS[read.unit]]
    unit = read.unit if fits else _COMMON[quantity]
    return Guess(name, unit, not fits and quantity != "trial", False)


def _read(head: str) -> _Read:
    """Words, number and unit of a name: `Seil1_mm`, `Winkel (Grad)`, `motorAngle2 [deg]`, `ms`."""
    plain = unicodedata.normalize("NFKD", head.replace("ß", "ss").replace("°", " deg ").replace("µ", "u"))
    plain = "".join(letter for letter in plain if not unicodedata.combining(letter))
    parts = re.findall(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|\d+", plain)
    words = [part.lower() for part in parts if not part.isdigit()]
    numbers = [int(part) for part in parts if part.isdigit() and len(part) < 4]
    spelt = UNIT_WORDS.get(words[-1], "") if words else ""
    # One letter is a unit in brackets or after a mark alone: m1 is a motor, x_m is in metres.
    apart = spelt and (len(words[-1]) > 1 or re.search(r"[^A-Za-z0-9]\W*[A-Za-z]\W*$", plain) is not None)
    if not apart or (len(words) == 1 and len(words[0]) == 1):
        spelt = ""
    left = words[:-1] if spelt and len(words) > 1 else words
    return _Read(left, numbers[0] if numbers else None, spelt)


def _kind(read: _Read) -> str | None:
    """Quantity by the words, of several the one that the unit is of; by the unit where no word says it."""
    if any(_has(word, _OTHERS) for word in read.words):
        return None
    fitting = _OF_KIND[_KINDS[read.unit]] if read.unit else ()
    by_words = [kind for kind, parts in _WORDS.items() if any(_has(word, parts) for word in read.words)]
    of_place = read.words and read.words[-1] in ("x", "y", "z")
    if of_place and (len(read.words) == 1 or any(word in _OF_TIP for word in read.words)):
        by_words.insert(0, "tip")
    both = [kind for kind in by_words if kind in fitting]
    if both:
        return both[0]
    if "spool" in by_words and read.unit in ("deg", "rad"):
        return "spool"
    if fitting and (len(fitting) == 1 or read.number is not None):  # of lengths, numbered ones alone are spools
        return fitting[0]
    return by_words[0] if by_words else None


def _has(word: str, parts: Sequence[str]) -> bool:
    return any(part in word if len(part) > 3 else part == word for part in parts)


def _named(kind: str, read: _Read, used: Collection[str]) -> str | None:
    if kind == "tip":
        return f"tip_{read.words[-1]}"
    if kind != "bend":
        return kind
    if "z" in read.words or "yaw" in read.words or "bend_y" in used:
        return "bend_z"
    return "bend_y"


def _numbers(reads: Sequence[_Read]) -> list[int]:
    """Numbers of tendons from 1 on: those of their names, else by their sides or in their order."""
    numbers = [read.number for read in reads]
    written = [number for number in numbers if number is not None]
    if len(written) == len(reads) and len(set(written)) == len(reads):
        return [number + (min(written) == 0) for number in written]
    sides = [any(word in _MINUS for word in read.words) for read in reads]
    if len(reads) == 2 and sides == [True, False]:
        return [2, 1]
    return list(range(1, len(reads) + 1))
