"""Residuals of a rig: what the model of it does not explain. One table: unit, limit, time and causes of each.

Every tick has a value of each residual. One that is beyond its limit for long enough stops the motors; one that comes
near it is worth a word. Both are computed from values and limits alone, so that a run's files give them again.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from wristctl.config.hw_run import HwRunSettings
from wristctl.plain_files import read_json
from wristctl.trial.rig_words import AGAINST, CELL, LOST, PUSHED, REPEATS


class Shown(NamedTuple):
    """How people read a value: unit, its size, and the format of a number of them."""

    unit: str
    size: float
    form: str

    def __call__(self, value: float) -> str:
        """The value with its unit."""
        return f"{value / self.size:{self.form}}{' ' * bool(self.unit)}{self.unit}"


_N = Shown("N", 1.0, ".0f")
_MS, _DEG, _MM = Shown("ms", 1e-3, ".0f"), Shown("deg", math.radians(1.0), ".1f"), Shown("mm", 1e-3, ".1f")
_SHARE, _COUNT = Shown("%", 0.01, ".0f"), Shown("", 1.0, ".0f")


class Residual(NamedTuple):
    """A line of the table. `stops` and `odd` are templates of `value` and `limit`."""

    shown: Shown
    meaning: str
    limit: Callable[[HwRunSettings], float]
    """In the unit of the log; inf: it never stops."""
    odd: float
    """Share of the limit, or where there is none the value itself, beyond which a trial was odd; inf: never."""
    causes: str
    """Likeliest first, and advice."""
    stops: str = ""
    notes: str = ""
    lasting: bool = False
    """Whether it may exceed its limit for `safety.odd_for`; others stop at once."""
    weighed: bool = False
    """Whether it needs load cells: without them it has no line."""
    by_size: bool = False
    """Whether it goes by a marker's size: where two cameras see the bend it has no line."""


def _never(settings: HwRunSettings) -> float:
    return math.inf


_CALMER = "gentler gains or reference, or widen safety.{}"
_TENDONS = f"tendons, motors or the tip's marker do otherwise than the board believes; {PUSHED}"
_CAMERA = "the camera's light, focus, cable or mode; what covers a marker"
_CABLE = "close other programs, or see that the cable and its plugs are sound"
_LINK = "the USB adapter's latency timer or a hub: wristctl hw check --rig; or a longer control_period"

# In the order in which they are looked at: what a late tick sees is late as well.
RESIDUALS: Mapping[str, Residual] = {
    "late": Residual(
        _MS, "delay of a tick", lambda s: s.safety.late, 0.6, "close other programs, or a longer control_period",
        "a tick came {value} late", "a tick {value} late (limit {limit})",
    ),
    "lapses": Residual(
        _COUNT, "step rates in the last second that came too late to the board", lambda s: 2.0, math.inf, _CABLE,
        "step rates came too late to the board {value} times in 1 s",
    ),
    "no_number": Residual(
        _COUNT, "values of the observer's estimate that are not finite", lambda s: 0.0, math.inf,
        "see the frames in data/frames.csv", "the observer's estimate is not a number",
    ),
    "angle": Residual(
        _DEG, "bending angle as estimated", lambda s: math.radians(s.safety.angle_deg), math.inf,
        _CALMER.format("angle_deg"), "angle {value} beyond +-{limit}",
    ),
    "rate": Residual(
        Shown("rad/s", 1.0, ".1f"), "bending rate as estimated", lambda s: s.safety.rate, math.inf,
        _CALMER.format("rate"), "rate {value} beyond +-{limit}",
    ),
    "age": Residual(
        _MS, "time since the capture of a usable marker angle", lambda s: s.safety.stale, 0.6, _CAMERA,
        "no usable marker angle for {value}", "no usable marker angle for {value} (limit {limit})",
    ),
    "pull": Residual(
        _N, "largest tension by spool position and estimated angle",
        lambda s: s.safety.tension, math.inf,
        "more load than declared (hw-run.payload), a held wrist, motors that do not turn, or wrong zero positions",
        "tension of about {value} beyond {limit}",
    ),
    "cell_age": Residual(
        _MS, "time since the last reading of a load cell, of the oldest", lambda s: s.safety.cell_age, math.inf,
        CELL.format("an amplifier"),
        "no reading of a load cell for {value} (limit {limit})", weighed=True,
    ),
    "measured_pull": Residual(
        _N, "largest pull by load cell", lambda s: min(s.safety.tension, s.safety.motor_pull), 0.8,
        f"{AGAINST}; something holds the wrist; the drives' current is above safety.motor_pull",
        "a tendon pulls {value} by its load cell, beyond {limit}", "a pull of {value} by load cell (limit {limit})",
        True, weighed=True,
    ),
    "excess_pull": Residual(
        _N, "pull by load cell beyond what its spool explains", lambda s: s.safety.excess_pull, 0.8,
        f"{AGAINST}, are caught or stiffer than safety.stiffest; a cell's zero: wristctl hw weigh",
        "a tendon pulls {value} more than its spool explains, beyond {limit}",
        "{value} of pull that no spool explains (limit {limit})", True, weighed=True,
    ),
    "missing_pull": Residual(
        _N, "pull that a spool should make at least, of a tendon whose load cell shows less than a quarter",
        lambda s: s.safety.missing_pull, 0.8, LOST.format("a tendon"),
        "a tendon does not pull: its spool should make {value} at least, beyond {limit}",
        "{value} that a spool should make and no load cell shows (limit {limit})", True, weighed=True,
    ),
    "travel": Residual(
        _MM, "spool furthest from zero", lambda s: s.safety.travel, math.inf,
        "a smaller reference, or widen safety.travel", "a spool {value} from zero, beyond {limit}",
    ),
    "disabled": Residual(
        _COUNT, "1 where the board is not ENABLED", lambda s: 0.0, math.inf, "home again", "the board is not ENABLED"
    ),
    "jump": Residual(
        _DEG, "marker against where spools should have it, change between two frames",
        lambda s: math.radians(s.safety.jump_deg), 0.5, "the tip's marker has slipped; pictures shown or dated wrongly",
        "the marker's angle jumps by {value} off its motors, beyond {limit}",
        "{value} of jump off its motors (limit {limit})",
    ),
    "doubted": Residual(
        _SHARE, "share of a second's pictures that tell no bend across", lambda s: 0.9, 0.3,
        "light that changes (a fixed exposure, LEDs on DC), dirt or glare on a marker, focus or zoom",
        "{value} of a second's pictures tell no bend across: markers change their size or grey level as no wrist does",
        "{value} of a second's pictures told no bend across: light, dirt, focus or zoom", by_size=True,
    ),
    "across": Residual(
        _DEG, "bend across the plane, by the size of the tip's marker", lambda s: math.radians(s.safety.across_deg),
        0.8, "one tendon of two is lost or pulls alone; motors exchanged; a camera that is not square",
        "the wrist bends {value} across its plane, beyond {limit}", "{value} across the plane (limit {limit})", True,
        by_size=True,
    ),
    "load": Residual(
        Shown("N m", 1.0, ".2f"), "load torque as estimated", lambda s: s.safety.load, 0.6, _TENDONS,
        "the wrist does not follow its motors: a load of {value}, beyond {limit}", "a load of {value} (limit {limit})",
        True,
    ),
    "apart": Residual(
        _DEG, "marker against where spools should have it", lambda s: math.radians(s.safety.follow_deg), 0.35, _TENDONS,
        "the wrist does not follow its motors: it is {value} from where they should have it, beyond {limit}",
        "{value} off its motors (limit {limit})", True,
    ),
    "round_trip": Residual(
        Shown("ms", 1e-3, ".1f"), "median time of half a second's commands until the board's answer",
        lambda s: s.safety.round_trip * s.control_period, 0.9, _LINK,
        "the board's answers take {value}, beyond {limit}", "the board's answers took {value} (limit {limit})",
    ),
    "skipped": Residual(
        _SHARE, "share of half a second's ticks that were skipped", lambda s: s.safety.skipped, 0.1,
        "close other programs; a longer control_period", "{value} of the last half second's ticks were skipped",
        "{value} of half a second's ticks skipped (limit {limit})",
    ),
    "unseen": Residual(
        _SHARE, "share of the believed usable angles that did not come, over two seconds", _never, 0.12, _CAMERA,
        notes="{value} of the angles that the camera should give did not come: marker not seen, or pictures lost",
    ),
    "repeated": Residual(
        _COUNT, "pictures in the last second that were no news, or whose time cannot be", _never, 3.0,
        REPEATS,
        notes="{value} pictures within a second were no news",
    ),
    "resent": Residual(
        _COUNT, "commands in the last two seconds that had to be sent again", _never, 1.0, "see the cable",
        notes="{value} commands within two seconds sent again: see the cable",
    ),
    "moved": Residual(
        _SHARE, "the base's marker from its first place, over its side", _never, 0.03, "camera or clamp is loose",
        notes="the base's marker moved by {value} of its side: camera or clamp is loose",
    ),
    "lag": Residual(
        _MS, "least time by which the marker comes after its motors, in this motion so far", _never, 0.015,
        "pictures older than their stamps say, soft tendons or friction",
        notes="the marker comes {value} or more after its motors: pictures older than dated, soft tendons or friction",
    ),
}  # fmt: skip

_SENSOR = "the sensor, its cable or program, and what look() returns: wristctl check-rig"
_TARGETS = f"tendons, motors or the sensor do otherwise than the facts say; {PUSHED}"
# What a robot of one's own has no part for: a board that counts, markers and their pictures, load cells.
_NO_PART = (
    "lapses", "disabled", "doubted", "across", "resent", "moved", "cell_age", "measured_pull", "excess_pull",
    "missing_pull",
)  # fmt: skip
_OF_A_RIG: Mapping[str, Mapping[str, str]] = {
    "no_number": {"causes": "see the bends in data/frames.csv"},
    "age": {
        "meaning": "time since the newest bend was true", "causes": _SENSOR, "stops": "no new bend for {value}",
        "notes": "no new bend for {value} (limit {limit})",
    },
    "pull": {"meaning": "largest tension by where the motors are and the estimated bend"},
    "travel": {"meaning": "target furthest from zero", "stops": "a target {value} from zero, beyond {limit}"},
    "jump": {
        "meaning": "bend against where targets should have it, change between two looks",
        "causes": "the sensor has slipped; bends dated wrongly",
        "stops": "the bend jumps by {value} from one look to the next, beyond {limit}",
        "notes": "{value} of jump between looks (limit {limit})",
    },
    "load": {"causes": _TARGETS},
    "apart": {"meaning": "bend against where targets should have it", "causes": _TARGETS},
    "round_trip": {
        "meaning": "median time of half a second's send()", "causes": "the robot's link; or a longer control_period",
        "stops": "send() takes {value}, beyond {limit}", "notes": "send() took {value} (limit {limit})",
    },
    "unseen": {
        "meaning": "share of the bends by sensor.rate of the facts that did not come, over two seconds",
        "causes": _SENSOR,
        "notes": "{value} of the bends that sensor.rate promises did not come: no number, or look() brings no news",
    },
    "repeated": {
        "meaning": "looks in the last second that were dated ahead of the clock", "causes": _SENSOR,
        "notes": "{value} looks within a second were dated ahead of the clock",
    },
    "lag": {
        "meaning": "least time by which the bend comes after its targets, in this motion so far",
        "causes": "bends older than they are dated, motors slower than drive.delay and drive.lag, or friction",
        "notes": "the bend comes {value} or more after its targets: bends older than dated, slow motors or friction",
    },
}  # fmt: skip
# Measured over modelled tension beyond which a trial was odd.
_STIFFER = 2.0
RESIDUALS_OF_A_RIG: Mapping[str, Residual] = {
    **{
        name: line._replace(**_OF_A_RIG.get(name, {}))  # type: ignore[arg-type]
        for name, line in RESIDUALS.items()
        if name not in _NO_PART
    },
    "tension_ratio": Residual(
        Shown("", 1.0, ".2g"), "tension that look() gives over that by motors and estimated bend, of all pulled "
        "tendons together", _never, _STIFFER, "a zero of its force sensors; facts.drive.stiffness; friction",
        notes="tendons pull {value} times as much as motors and bend explain: the zero of their sensors, "
        "facts.drive.stiffness, or friction",
    ),
}  # fmt: skip
"""The table of a robot of one's own."""


class Limit(NamedTuple):
    """Limit of a residual for one run; SI units."""

    name: str
    unit: str
    limit: float
    held: float
    """Time for which it may be exceeded [s]; half as long if twice."""
    odd: float
    """Value from which a trial was odd."""


def limits_of(settings: HwRunSettings) -> tuple[Limit, ...]:
    """The table for these settings."""
    limits = []
    for name, line in _lines(settings.planes, settings.load_cells is not None, settings.rig is not None).items():
        most, held = line.limit(settings), settings.safety.odd_for if line.lasting else 0.0
        odd = line.odd * most if math.isfinite(most) and math.isfinite(line.odd) else line.odd
        limits.append(Limit(name, _SI.get(line.shown.unit, line.shown.unit), most, held, odd))
    return tuple(limits)


_SI = {"ms": "s", "mm": "m", "deg": "rad", "%": ""}


def columns(planes: int, weighed: bool, own: bool = False) -> dict[str, tuple[str, str]]:
    """Unit and meaning of each residual, as the log has them.

    Of a rig in so many planes, with load cells or without, or of one's `own` robot.
    """
    lines = _lines(planes, weighed, own)
    return {name: (_SI.get(line.shown.unit, line.shown.unit), line.meaning) for name, line in lines.items()}


def residual(name: str, own: bool = False) -> Residual:
    """A line of the table of the board, or of one's `own` robot."""
    return (RESIDUALS_OF_A_RIG if own else RESIDUALS)[name]


def _lines(planes: int, weighed: bool, own: bool) -> dict[str, Residual]:
    if own:
        return dict(RESIDUALS_OF_A_RIG)
    return {
        name: line
        for name, line in RESIDUALS.items()
        if (weighed or not line.weighed) and (planes == 1 or not line.by_size)
    }


class Judge:
    """Applies limits to one tick after the other."""

    def __init__(self, limits: Sequence[Limit]) -> None:
        self._limits, self._since, self._last = limits, dict[str, float](), -math.inf

    def beyond(self, clock: float, values: Mapping[str, float]) -> Limit | None:
        """The first limit, in the table's order, that is to stop the motors at this tick; nan is no evidence."""
        if clock - self._last > _APART:
            self._since.clear()
        self._last = clock
        for limit in self._limits:
            size = abs(values[limit.name])
            if not size > limit.limit:
                self._since.pop(limit.name, None)
            elif limit.held == 0.0 or clock - self._since.setdefault(limit.name, clock) >= (
                limit.held * limit.limit / size
            ):
                return limit
        return None


# Seconds between two ticks of different motions.
_APART = 0.5


def worst(values: Mapping[str, float], most: Mapping[str, float]) -> dict[str, float]:
    """The larger size of each residual; of `lag`, which sums a motion up, the newest."""
    sizes = {name: 0.0 if math.isnan(value) else abs(value) for name, value in values.items()}
    return {name: sizes[name] if name == "lag" else max(sizes[name], most.get(name, 0.0)) for name in values}


def notes(most: Mapping[str, float], limits: Sequence[Limit], own: bool = False) -> list[str]:
    """What was odd of a trial with these largest values, in words."""
    odd = [(residual(limit.name, own), limit) for limit in limits if most.get(limit.name, 0.0) > limit.odd]
    return [
        line.notes.format(value=line.shown(most[limit.name]), limit=_limit(line, limit.limit)) for line, limit in odd
    ]


def stopped_by(limit: Limit, value: float, own: bool = False) -> str:
    """Say which limit stopped the motors."""
    line = residual(limit.name, own)
    signed = value if limit.name in ("angle", "rate") else abs(value)
    return line.stops.format(value=line.shown(signed), limit=_limit(line, limit.limit))


def _limit(line: Residual, limit: float) -> str:
    shown = line.shown
    return f"{limit / shown.size:.3g}{' ' * bool(shown.unit)}{shown.unit}"


FILE, SCHEMA = "data/limits.json", "wristctl.limits/1"


def plain(limits: Sequence[Limit], own: bool = False) -> dict[str, Any]:
    """For JSON; a limit that never stops is null."""
    rows = [
        {name: value if not isinstance(value, float) or math.isfinite(value) else None
         for name, value in limit._asdict().items()}
        | {"meaning": line.meaning, "causes": line.causes}
        for limit, line in ((limit, residual(limit.name, own)) for limit in limits)
    ]  # fmt: skip
    return {"schema": SCHEMA, "limits": rows}


def load(file: Path) -> tuple[Limit, ...]:
    """Read what `plain` has given. Raises OSError, ValueError and KeyError."""
    table = read_json(file)
    if table["schema"] != SCHEMA:
        raise ValueError(table["schema"])
    limits = []
    for row in table["limits"]:
        limit, held, odd = (math.inf if row[name] is None else float(row[name]) for name in ("limit", "held", "odd"))
        limits.append(Limit(row["name"], row["unit"], limit, held, odd))
    return tuple(limits)
