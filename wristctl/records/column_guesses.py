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
    **dict.fromkeys(("amp", "amps", "ampere", "amperes"), "A"),
    **dict.fromkeys(("ma", "milliamp", "milliamps", "milliampere", "milliamperes"), "mA"),
    **dict.fromkeys(("kg", "kilogram", "kilogramm"), "kg"),
    **dict.fromkeys(("g", "gram", "gramm", "gramme", "grammes"), "g"),
}
"""Units by what people write for them; German `Grad` is a degree."""

_KINDS = {"s": "time", "ms": "time", "us": "time", "ns": "time", "deg": "angle", "rad": "angle", "m": "length",
          "mm": "length", "cm": "length", "um": "length", "N": "force", "A": "current", "mA": "current",
          "kg": "mass", "g": "mass"}  # fmt: skip
# Parts of names, of four letters or more wherever they stand in a word; shorter ones are whole words.
_OTHERS = (
    "velocity",
    "speed",
    "geschw",
    "vitesse",
    "accel",
    "gyro",
    "temperat",
)
# Commands are passed over where there is what they command.
_COMMANDS = (
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
    "current": ("current", "strom", "courant", "ampere", "iq"),
    "spool": ("spool", "seil", "sehne", "cable", "kabel", "cord", "tendon", "wire", "draht", "rope", "motor", "moteur",
              "encod", "codeur", "winch", "winde", "treuil", "servo", "spule", "bobine", "laenge", "lange", "length",
              "longueur", "stepper", "enc", "fil", "m", "l"),
    "trial": ("trial", "versuch", "essai", "episode", "run", "lauf"),
    "quat": ("quat", "quaternion", "qw", "qx", "qy", "qz", "q"),
    "gravity": ("gravity", "grav", "schwerkraft", "pesanteur"),
}  # fmt: skip
# Words beside which "current" is no motor's.
_NOW = ("pos", "position", "time", "state", "trial", "run")
# Of a log without a bend, the direction of gravity in slow motion.
_ACCELERATION = ("accel", "beschleunig", "acc")
_RATE = re.compile(r"(?:(deg|grad|°|d)|(rad))\s*(?:/|p|per)\s*s(?:ec)?(?![a-z])", re.IGNORECASE)
_OF_TIP = ("tip", "spitze", "pointe", "pos", "position", "ee")
_MINUS = ("minus", "neg", "right", "rechts", "droit", "droite", "b")
_COMMON = {"time": "s", "bend": "deg", "spool": "mm", "tension": "N", "current": "mA", "mass": "kg", "tip": "mm",
           "trial": "", "quat": "", "gravity": ""}  # fmt: skip
_OF_KIND = {"time": ("time",), "angle": ("bend",), "length": ("spool", "tip"), "force": ("tension",),
            "current": ("current",), "mass": ("mass", "gravity")}  # fmt: skip
# Quantities without a unit that is asked for.
_PLAIN = ("trial", "quat", "gravity")


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
    there = {kind for kind in kinds if kind} | {name.partition("_")[0] for name in used}
    if not there & {"spool", "tension", "current"}:
        commands = [_kind(read, _OTHERS) if guess is None else None for guess, read in zip(found, reads, strict=True)]
        kinds = [kind or (other if other in ("tension", "current") else None)
                 for kind, other in zip(kinds, commands, strict=True)]  # fmt: skip
    if not there & {"bend", "quat", "gravity", "inclination", "tip"}:
        shaken = [guess is None and any(_has(word, _ACCELERATION) for word in read.words)
                  for guess, read in zip(found, reads, strict=True)]  # fmt: skip
        kinds = ["gravity" if is_shaken else kind for is_shaken, kind in zip(shaken, kinds, strict=True)]
    for quantity in ("spool", "tension", "current"):
        places = [place for place, kind in enumerate(kinds) if kind == quantity]
        for place, number in zip(places, _numbers([reads[place] for place in places]), strict=True):
            if f"{quantity}_{number}" not in used:
                used.add(f"{quantity}_{number}")
                found[place] = _guess(f"{quantity}_{number}", quantity, reads[place])
    for place, kind in enumerate(kinds):
        if kind in (None, "spool", "tension", "current"):
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
    if quantity == "rate":
        return Guess(name, read.unit, False, False)
    fits = read.unit in _KINDS and quantity in _OF_KIND[_KINDS[read.unit]]
    unit = read.unit if fits else _COMMON[quantity]
    return Guess(name, unit, not fits and quantity not in _PLAIN, False)


def _read(head: str) -> _Read:
    """Words, number and unit of a name: `Seil1_mm`, `Winkel (Grad)`, `motorAngle2 [deg]`, `ms`."""
    rate = _RATE.search(head)
    head = _RATE.sub(" ", head) if rate else re.sub(r"(?<![A-Za-z])mA(?![A-Za-z])", " milliamps", head)
    head = re.sub(r"[\[(]\s*A\s*[\])]", " amps", head)
    plain = unicodedata.normalize("NFKD", head.replace("ß", "ss").replace("°", " deg ").replace("µ", "u"))
    plain = "".join(letter for letter in plain if not unicodedata.combining(letter))
    parts = re.findall(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|\d+", plain)
    words = [part.lower() for part in parts if not part.isdigit()]
    if rate:
        return _Read(words, None, "rad/s" if rate[2] else "deg/s")
    numbers = [int(part) for part in parts if part.isdigit() and len(part) < 4]
    spelt = UNIT_WORDS.get(words[-1], "") if words else ""
    # One letter is a unit in brackets or after a mark alone: m1 is a motor, x_m is in metres.
    apart = spelt and (len(words[-1]) > 1 or re.search(r"[^A-Za-z0-9]\W*[A-Za-z]\W*$", plain) is not None)
    if not apart or (len(words) == 1 and len(words[0]) == 1):
        spelt = ""
    left = words[:-1] if spelt and len(words) > 1 else words
    return _Read(left, numbers[0] if numbers else None, spelt)


def _kind(read: _Read, others: Sequence[str] = (*_OTHERS, *_COMMANDS)) -> str | None:
    """Quantity by the words, of several the one that the unit is of; by the unit where no word says it."""
    if read.unit in ("deg/s", "rad/s"):
        bends = any(_has(word, _WORDS["bend"]) for word in read.words)
        return "rate" if bends and read.words[-1] in ("y", "z") else None
    if any(_has(word, others) for word in read.words):
        return None
    fitting = _OF_KIND[_KINDS[read.unit]] if read.unit else ()
    by_words = [kind for kind, parts in _WORDS.items() if any(_has(word, parts) for word in read.words)]
    of_place = read.words and read.words[-1] in ("x", "y", "z")
    if "current" in by_words and any(word in _NOW for word in read.words):
        by_words.remove("current")
    elif read.words == ["i"] and read.number is not None:
        by_words.insert(0, "current")
    if of_place and (len(read.words) == 1 or any(word in _OF_TIP for word in read.words)):
        by_words.insert(0, "tip")
    if not read.unit and {"quat", "gravity"} & set(by_words):
        return "quat" if "quat" in by_words else "gravity"
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
    if kind in ("tip", "rate"):
        return f"{kind}_{read.words[-1]}"
    if kind in ("quat", "gravity"):
        axis = read.words[-1].removeprefix("q")
        return f"{kind}_{axis}" if axis in ("x", "y", "z", "w")[: 4 if kind == "quat" else 3] else None
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
