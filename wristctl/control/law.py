"""Controllers: a law, its gains with units and search boxes, and presets.

A law is a function of lanes, written once: `law(now, wrist, gains, memory) -> torque`. It runs in rollouts, in
batches for tuning and on hardware. `now` has the fields of NOW, and `ahead` reads the reference to come where the
controller asks for a preview; `wrist` is the Segments of the controller's one-segment model, `gains` the controller's
own by name; `memory` is indexed, and the law may write it. What a law may call is in docs/lanes.md.

Such a law runs once for each plane that the wrist bends in. One of a controller with `planes=2` runs once for all of
them: `law(now, wrist, gains, memory, tendons, torque)`. `now`, `wrist` and `memory` are then tuples with an entry for
each plane, `tendons` is what the tendons can do together (Tendons), and the law writes `torque[p]`. In a loop of one
plane it has one entry of each.

A law may learn over repetitions of a motion: of a controller with `learning=8` the eighth repetition is evaluated. The
first `learned` values of its memory are kept from one repetition to the next, but for `memory[0]`.
"""

import keyword
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

from numba.core import types
from numba.core.ccallback import CFunc
from numba.core.errors import NumbaError
from numba.core.sigutils import normalize_signature

from wristctl.config.foreign import PLAIN
from wristctl.config.section import Parameter
from wristctl.control.plain_law import PlainLaw, Shape
from wristctl.errors import UserError
from wristctl.lanes import functions, lane
from wristctl.lanes.blocks import width
from wristctl.lanes.compile_time import COMPILE_TIME
from wristctl.lanes.compiled import compiled, frozen_values, keep
from wristctl.lanes.rows import part, rows_named, stack_named, stacked
from wristctl.lanes.types import LaneType, RowsType
from wristctl.wrist.segments import Segments

# Signals of a law: measured angle and rate, the reference with two derivatives, the torques that the tendons can
# reach now [N m], the control period [s], the load torque [N m] that the observer behind a camera makes out (nothing
# where sensors are ideal), and the torque [N m] of the last command that the motors were too slow to deliver, or the
# tendons had no pull left for beside the other plane's (nothing where all of it came). The reference of the periods to
# come follows, as many as the controller's `preview`.
NOW = (
    "theta", "rate", "theta_ref", "rate_ref", "acceleration_ref", "torque_low", "torque_high", "period", "load",
    "withheld",
)  # fmt: skip

REFERENCE = ("theta_ref", "rate_ref", "acceleration_ref")


class Tendons(NamedTuple):
    """Places of tendons as a law of both planes sees them: the torque in plane p is the sum of arm times pull.

    In compiled code `arms` are rows: a plane's T arms after the other's; in plain Python an array (P, T).
    """

    arms: Any
    """Moment arms at the present bend [m]."""
    least: Any
    """Least pull of all tendons at a place (T,) [N]."""
    greatest: Any
    """Greatest pull at a place (T,) [N]."""


now_of, wrist_of = rows_named(NOW), rows_named(Segments._fields)
now_at, wrist_at = stack_named(NOW), stack_named(Segments._fields)

Law = Callable[..., Any]
_OF_A_WRIST = len(Segments._fields)

# Control period [s] below which no comparison runs plain Python: a second of such a loop takes a second or more.
LEAST_PLAIN_PERIOD = 1e-5

# Origin of presets for the rig.
BY_TRIAL = "behind a 60 Hz camera, steppers and tendons of 8 to 100 kN/m: by trial at the corners of docs/margins.py"
BY_STUDY = (
    "behind a 60 Hz camera, steppers and tendons of 8 to 100 kN/m: tuned for camera, with the motions and the drive "
    "that it had then (documentation: Gains that are shipped), in few digits"
)


def signals_of(preview: int) -> int:
    """Number of signals of a law that looks so many periods ahead."""
    return len(NOW) + len(REFERENCE) * preview


@compiled
def ahead(now: Any, periods: int) -> Any:
    """The reference so many periods from now, of those in the preview: angle, rate and acceleration."""
    first = len(NOW) + len(REFERENCE) * (periods - 1)
    return now[first], now[first + 1], now[first + 2]


@dataclass(frozen=True)
class Gain:
    """One gain: its unit, meaning, and the box in which a search looks for it (log10)."""

    unit: str
    meaning: str
    low: float
    high: float


class Conditions(NamedTuple):
    """Behind motors, elastic tendons and a camera: where a preset comes to rest (docs/margins.md), ends included.

    At any sheath of up to 3 rad, with up to 0.1 deg of noise, and where tendons are as believed.
    """

    period: tuple[float, float]
    """[s]"""
    tendon_stiffness: tuple[float, float]
    """Believed, of one tendon [N/m]."""


class Surface(NamedTuple):
    """Sliding surface that a law's switching term reads: sigma = a e + b de/dt + c int(e), 0 on the surface.

    `weights` gives a, b and c by the law's gains, `layer` the size of sigma within which the term is about a line.
    """

    weights: Callable[[Mapping[str, float]], tuple[float, float, float]]
    layer: Callable[[Mapping[str, float]], float]
    of_error: bool = True
    """Whether de/dt is the rate of the error, and not, as in the paper's law, that of the angle (C9)."""


@dataclass(frozen=True)
class Controller:
    """A named law with its gains; `memory` is the number of values it carries from tick to tick, and `preview` that of
    the control periods ahead whose reference it looks at.

    The law reads a gain by its name, `gains.Kp`; where that is a Python word, such as lambda, by `gains.lambda_`.

    A `plain` law is Python that does not compile (docs/your-own-controller.md): a function of the same four, or a class
    of which every rollout and trial makes one for itself. Its name ends in (py), in every table.
    """

    name: str
    law: Any
    source: str
    gains: Mapping[str, Gain]
    presets: Mapping[str, Mapping[str, float]]
    """Every gain by name, of each preset."""
    memory: int = 0
    preview: int = 0
    notes: Mapping[str, str] = field(default_factory=dict)
    """Remarks that a reader should know about a preset."""
    conditions: Mapping[str, Conditions] = field(default_factory=dict)
    """Conditions of presets that are for motors, tendons and a camera too; the others are for tensions as commanded."""
    surface: Surface | None = None
    """Surface of the sliding laws, for where their rate is that of the error."""
    plain: bool = False
    period: float | None = None
    """Control period that it was written for [s]; None: it goes by that of its loop."""
    planes: int = 1
    """1 for a law that runs once for each plane, 2 for one that sees all planes at once."""
    learning: int = 1
    """Repetitions of a motion from the first to the one that is evaluated; above 1 for a law that learns over them."""
    learned: int = 0
    """Values at the beginning of the memory of each plane that stay from one repetition to the next.

    All others are 0 again at the first tick of a repetition, and so is the first, by which a law may tell that tick.
    """
    settings: Mapping[str, Parameter] = field(default_factory=dict)
    """Settings that it was made from (`wristctl.control.design`): its own section of a study."""

    def __post_init__(self) -> None:
        """ValueError for a preset that does not give every gain and no other, for conditions of none, and for a name
        that cannot be a file's."""
        if not re.fullmatch(r"[A-Za-z0-9][\w.+-]*", self.name.removesuffix(PLAIN)):
            raise ValueError(f"{self.name!r} is no name for a controller: letters, digits, dots and dashes")
        if self.planes not in (1, 2):
            raise ValueError(f"{self.name} states planes={self.planes}: 1 sees one plane, 2 sees both")
        if self.learning < 1 or not 0 <= self.learned <= self.memory or (self.learning > 1 and self.learned < 2):
            problem = f"learning={self.learning} and learned={self.learned} of {self.memory} values of memory"
            raise ValueError(f"{self.name} states {problem}: what it learns stands in memory[1] and after")
        if self.plain and not self.name.endswith(PLAIN):
            object.__setattr__(self, "name", f"{self.name}{PLAIN}")
        if unknown := set(self.conditions) - set(self.presets):
            raise ValueError(f"{self.name} has conditions for {', '.join(unknown)}, and no such preset")
        for preset, preset_gains in self.presets.items():
            if not isinstance(preset_gains, Mapping) or set(preset_gains) != set(self.gains):
                raise ValueError(f"preset {preset} of {self.name} must give {', '.join(self.gains)} by name")

    def values(self, gains: Mapping[str, float]) -> tuple[float, ...]:
        """Gains by name in the order in which compiled code holds them."""
        return tuple(float(gains[name]) for name in self.gains)

    def keeps_up(self, period: float) -> bool:
        """Whether a comparison runs it in a loop with this control period [s]: plain Python not in the fastest."""
        return not self.plain or period >= LEAST_PLAIN_PERIOD

    def compiled(self, count: int = 1, planes: int = 1, places: int = 2) -> Any:
        """The law as what every kernel of as many rollouts can call: native code, or a way out to plain Python.

        It answers for all of so many planes and places of tendons at once. Raises UserError where it does not compile.
        """
        names = tuple(f"{name}_" if keyword.iskeyword(name) else name for name in self.gains)
        shape = Shape(planes, places if self.planes > 1 else 0, self.preview, max(1, self.memory))
        if self.plain:
            return PlainLaw(self.name, self.law, (NOW, Segments, names, Tendons), shape, self.memory, _signature(1))
        return _native(self.law, width(count), names, shape)


def in_a_first_repetition(controller: Controller) -> Controller:
    """A controller as it is in the first repetition of a motion, in which it has learned nothing."""
    return replace(controller, learning=1)


class _NativeLaw(types.WrapperAddressProtocol):
    """A compiled law as kernels know laws, all of one type: that its rows of gains have names is its own affair."""

    def __init__(self, law: Law, lanes: int, names: tuple[str, ...], shape: Shape) -> None:
        self._lanes = lanes
        frozen, imported = frozen_values(law)
        self._code: Any = CFunc(
            of_all_planes(law, shape), normalize_signature(_signature(lanes, names)), locals={}, options={}
        )
        keep(self._code, law, Path(__file__), *imported, frozen=frozen + repr(shape).encode())
        try:
            with COMPILE_TIME.counted():
                self._code.compile()
        except NumbaError as error:
            raise _refused(law, error) from error

    def __wrapper_address__(self) -> int:
        """Address of the code."""
        return int(self._code.address)

    def signature(self) -> Any:
        """Signature that kernels call."""
        return _signature(self._lanes)

    def check(self) -> None:
        """Nothing can have gone wrong in native code."""


def of_all_planes(law: Law, shape: Shape) -> Law:
    """The torques of all planes by a law of one plane, or, where `shape` has places of tendons, of both."""
    return _of_both_planes(law, shape) if shape.places else _of_each_plane(law, shape)


def _of_each_plane(law: Law, shape: Shape) -> Law:
    """All planes' torques by a law of one plane."""
    inner, planes, seen, kept = compiled(law), (0,) * shape.planes, signals_of(shape.preview), shape.memory

    def run(now: Any, wrist: Any, gains: Any, memory: Any, arms: Any, least: Any, greatest: Any, torque: Any) -> None:
        each_now, each_wrist = stacked(now, seen, planes), stacked(wrist, _OF_A_WRIST, planes)
        each_memory = stacked(memory, kept, planes)
        for p in range(len(planes)):
            torque[p] = inner(each_now[p], each_wrist[p], gains, each_memory[p])

    return run


def _of_both_planes(law: Law, shape: Shape) -> Law:
    """All planes' torques by a law of both planes."""
    inner, planes, seen, kept = compiled(law), (0,) * shape.planes, signals_of(shape.preview), shape.memory
    places, lever_arms = (0,) * shape.places, (0,) * (shape.planes * shape.places)

    def run(now: Any, wrist: Any, gains: Any, memory: Any, arms: Any, least: Any, greatest: Any, torque: Any) -> None:
        tendons = Tendons(part(arms, 0, lever_arms), part(least, 0, places), part(greatest, 0, places))
        each_now, each_wrist = stacked(now, seen, planes), stacked(wrist, _OF_A_WRIST, planes)
        inner(each_now, each_wrist, gains, stacked(memory, kept, planes), tendons, part(torque, 0, planes))

    return run


# Functions of Python and NumPy that have another name for lanes.
_OTHER_NAMES = {"arctan2": "atan2", "pow": "power", "min": "minimum", "max": "maximum"}

# Patterns in numba's messages, and their meaning.
_TOLD = (
    (r"(?:bool|truth)\((?:Mask|Lane)Type",
     "it branches on a value, which differs from rollout to rollout: use where(condition, yes, no)"),
    (r"Unknown attribute '(\w+)' of type rows\(.*?, \d+, ([\w,]*)\)", "there is no '{0}' among {1}"),
    (r"No implementation of function Function\((?:<(?:built-in function |function |ufunc '))?(\w+).*?\) found",
     "it calls {0}, which does not compile"),
    (r"Cannot cast none to LaneType", "it returns no torque"),
)  # fmt: skip


def _refused(law: Law, error: NumbaError) -> UserError:
    """Explain in a line, at the law's own line, what a law does that compiled code cannot."""
    text, file = re.sub(r"\x1b\[[0-9;]*m", "", str(error)), law.__code__.co_filename
    lines = [message.strip() for message in text.splitlines() if message.strip()]
    reasons = [message for message in lines if not message.startswith(("Failed in", "During", "File", ">>>", "-", "^"))]
    why = reasons[0] if reasons else type(error).__name__
    explanations = [(match, words) for pattern, words in _TOLD if (match := re.search(pattern, text))]
    fix = "call what a controller may (documentation: Compiled code), or state plain=True: it then runs as plain Python"
    if explanations:
        match, words = explanations[0]
        why = words.format(*match.groups())
        fix = (_import_of(match[1]) if match.lastindex == 1 else "") or fix
    numbers = re.findall(rf'File "[^"]*{re.escape(Path(file).name)}", line (\d+)', text)
    line = numbers[-1] if numbers else law.__code__.co_firstlineno
    return UserError(f"the controller does not compile: {why}", f"{file}:{line}", fix)


def _import_of(name: str) -> str:
    """The import of what a law calls in place of a function of Python or NumPy; empty for what lanes do not have."""
    lanes_name = _OTHER_NAMES.get(name, name)
    modules = [module for module in (lane, functions) if callable(getattr(module, lanes_name, None))]
    return f"from {modules[0].__name__} import {lanes_name}" if modules else ""


@cache
def _signature(lanes: int, gains: tuple[str, ...] = ()) -> Any:
    number = LaneType(lanes)
    now, wrist, named = (RowsType(number, None, fields=fields) for fields in (NOW, Segments._fields, gains))
    return types.void(now, wrist, named, *[RowsType(number, None)] * 5)


@cache
def _native(law: Law, lanes: int, names: tuple[str, ...], shape: Shape) -> _NativeLaw:
    return _NativeLaw(law, lanes, names, shape)
