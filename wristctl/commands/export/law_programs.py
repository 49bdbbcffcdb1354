"""The tick of a closed loop as straight-line programs: its answer, what drives its motors, what its observer predicts.

They are traced from the functions that simulated loops and trials run (`wristctl.control.response`,
`wristctl.simulation.actuator`, `wristctl.simulation.observer`), so that there is no second version of any law.
"""

import keyword
import re
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from wristctl.control.belief import Belief, Ignored, Limits
from wristctl.control.law import NOW, REFERENCE, Controller, of_all_planes, signals_of
from wristctl.control.plain_law import Shape
from wristctl.control.response import OF_A_PLANE, Controlled, Room, Seen, respond
from wristctl.errors import UserError
from wristctl.lanes.straight_line import Program, Tracer
from wristctl.lanes.symbols import Stack, SymbolRows
from wristctl.simulation.actuator import Aim, actuate
from wristctl.simulation.batch import PLANES, Batch
from wristctl.simulation.observer import Knowing, NoCamera, propagate
from wristctl.simulation.simulated_drives import IdealDrive, LaggedDrive, Motor, ServoDrive, SpoolDrive, commands_of
from wristctl.simulation.spool_timing import Timing
from wristctl.wrist.segments import Segments
from wristctl.wrist.spatial.spatial_segments import OF_A_TENDON, SpatialSegments, SpatialWrist


class Level(NamedTuple):
    """How motors are driven: what they are sent, and what is reckoned of them, each with its unit."""

    driven: str
    """Name of what each motor is sent."""
    sent: str
    reckoned: str
    send: str
    """What is to be done with it."""


LEVELS = {
    "ideal": Level("count", "", "the pull again [N]", "Command `tension` to each tendon, or `pull` to each place."),
    "lagged": Level(
        "count", "", "pull that the motors are reckoned to have come to [N]",
        "Command `tension` to each tendon. `count` is what the motors are reckoned to have come to.",
    ),
    "tendon": Level(
        "spool_speed", "rate to send to each spool's motor, + reels in [m/s]",
        "length that each spool is reckoned to have reeled in, in the middle of this period [m]",
        "Send `spool_speed` to the motor of each spool at once, which holds it until the next tick. From these rates "
        "the controller reckons where the spools are.",
    ),
}  # fmt: skip
LEVELS["servo"] = LEVELS["tendon"]._replace(
    driven="spool_target",
    sent="length that each spool's motor is to reel in, from where the tendon is taut [m]",
    send="Send `spool_target` to the motor of each spool at once. From these targets the controller reckons where the "
    "spools are.",
)
"""By the level of the motors."""


class Function(NamedTuple):
    """A program with the arrays that it reads and writes, by name and length; those that it writes come last."""

    program: Program
    arrays: Mapping[str, int]
    """Arrays by name, with their lengths."""
    written: tuple[str, ...]


class Observed(NamedTuple):
    """The observer: its gain (3 P,), its estimates at rest (3 P,), ticks that it remembers, and how it predicts."""

    gain: tuple[float, ...]
    start: tuple[float, ...]
    remembered: int
    propagate: Function


class LawPrograms(NamedTuple):
    """A controller as programs, with its constants by name, and the state that its motors begin with."""

    name: str
    """Of its functions and files."""
    title: str
    """The controller as tables have it."""
    planes: int
    places: int
    preview: int
    period: float
    memory: int
    motors: tuple[float, ...]
    remembered: int
    """Rates or targets that each spool remembers; 0 without spools."""
    alike: tuple[float, ...]
    """Tendons at each place."""
    limits: tuple[tuple[float, float], ...]
    """Least and greatest pull of each place [N]."""
    level: str
    """Level of the motors: ideal, lagged, tendon or servo."""
    constants: Mapping[str, float]
    respond: Function
    actuate: Function
    observer: Observed | None

    @property
    def of_a_plane(self) -> int:
        """Values of a plane's reference: angle, rate and acceleration, now and at each period of the preview."""
        return len(REFERENCE) * (1 + self.preview)

    @property
    def inputs(self) -> int:
        """Columns of a test vector before those that are expected: age of a picture, what is measured, reference."""
        return 1 + self.planes * ((1 if self.observer else 2) + self.of_a_plane)

    @property
    def driven(self) -> str:
        """What the motors are sent: `spool_speed`, `spool_target`, or `count`."""
        return LEVELS[self.level].driven

    @property
    def functions(self) -> dict[str, Function]:
        """Functions by name."""
        both = {"respond": self.respond, "actuate": self.actuate}
        return both if self.observer is None else both | {"propagate": self.observer.propagate}


def identifier(name: str) -> str:
    """A name of a controller or a gain as C and Python know names."""
    plain = re.sub(r"\W", "_", name)
    return plain if plain[0].isalpha() else f"law_{plain}"


def programs_of(controller: Controller, batch: Batch) -> LawPrograms:
    """The programs of a controller in the loop of a batch of one rollout.

    Raises UserError, at the law's own line, for a law that has no straight-line form: plain Python, one that learns
    over repetitions, or one that branches on a value.
    """
    if controller.plain:
        fix = "write it for compiled code (documentation: Compiled code), without plain=True"
        raise UserError(f"{controller.name} is plain Python, of which no C is written", _place(controller), fix)
    if controller.learning > 1:
        what = f"{controller.name} learns over {controller.learning} repetitions, and its memory is of one motion"
        raise UserError(what, _place(controller), "another controller: `wristctl list controllers` shows them")
    return _Loop(controller, batch).programs()


def _place(controller: Controller) -> str:
    code = getattr(controller.law, "__code__", None)
    return f"{code.co_filename}:{code.co_firstlineno}" if code else controller.name


_LEVELS = {LaggedDrive: "lagged", SpoolDrive: "tendon", ServoDrive: "servo"}


class _Loop:
    """A batch of one rollout, taken apart into named constants and programs."""

    def __init__(self, controller: Controller, batch: Batch) -> None:
        self.controller, self.batch = controller, batch
        setup, world = batch.setup, batch.world
        self.planes, self.places, self.preview = len(setup.bend), len(setup.pulls), setup.preview
        self.spatial, self.drive = self.planes > 1, world.drive
        gains = [f"{name}_" if keyword.iskeyword(name) else name for name in controller.gains]
        self._constants = {"PERIOD": float(setup.period)}
        self._gains = tuple(gains)
        self._named([f"GAIN_{identifier(name)}" for name in controller.gains], world.gains)
        ends = [f"{plane.upper()}_" for plane in PLANES] if self.spatial else ["WRIST_"]
        self._models = [f"{end}{field.upper()}" for end in ends for field in Segments._fields]
        self._named(self._models, world.belief.models)
        self._alike = self._places("TENDONS_AT_", world.belief.alike)
        limits = world.limits[0].reshape(-1)
        self._least = self._places("LEAST_PULL_", limits[: self.places])
        self._greatest = self._places("GREATEST_PULL_", limits[self.places : 2 * self.places])
        self._lead = self._named(["LEAD"], world.lead)
        self._space = list[str]()
        if self.spatial:
            tendons = [f"TENDON_{end}_{t + 1}" for t in range(self.places) for end in ("Y", "Z", "ALONG")]
            fields = [f"SPACE_{field.upper()}" for field in SpatialSegments._fields]
            self._space = self._named(fields + tendons, world.belief.wrist)
        self._level = "ideal"
        if not isinstance(self.drive, IdealDrive):
            self._level = _LEVELS[type(self.drive)]
            self._motor = self._named([f"MOTOR_{field.upper()}" for field in Motor._fields], self.drive.motor)
            self._stiffness = self._places("STIFFNESS_", self.drive.stiffness)
        if isinstance(self.drive, SpoolDrive | ServoDrive):
            known: Sequence[str] = Timing._fields if isinstance(self.drive, SpoolDrive) else Motor._fields
            self._board = self._named([f"BOARD_{field.upper()}" for field in known], self.drive.believed)

    def _named(self, names: Sequence[str], values: Any) -> list[str]:
        self._constants |= dict(zip(names, map(float, np.ravel(values)), strict=True))
        return list(names)

    def _of(self, names: Sequence[str]) -> tuple[float, ...]:
        return tuple(self._constants[name] for name in names)

    def _places(self, begin: str, values: Any) -> list[str]:
        return self._named([f"{begin}{t + 1}" for t in range(self.places)], values)

    def programs(self) -> LawPrograms:
        """All of them."""
        state, watch = self.batch.state, self.batch.state.watch
        observer = None
        if not isinstance(watch, NoCamera):
            seen = watch.observer
            observer = Observed(
                tuple(seen.gain.ravel().tolist()),
                tuple(seen.now.ravel().tolist()),
                seen.delivered.shape[1],
                self._propagate(),
            )
        functions = self._respond(), self._actuate()
        every = [*functions, *([observer.propagate] if observer else [])]
        used = {"LEAD", *(["PERIOD"] if observer else []), *(name for each in every for name in _inputs(each))}
        constants = {name: value for name, value in self._constants.items() if name in used}
        return LawPrograms(
            f"{identifier(self.controller.name)}_law", self.controller.name, self.planes, self.places, self.preview,
            float(self.batch.setup.period), self.planes * max(1, self.controller.memory),
            tuple(state.motors.ravel().tolist()), commands_of(self.drive),
            self._of(self._alike), tuple(zip(self._of(self._least), self._of(self._greatest), strict=True)),
            self._level, constants, *functions, observer,
        )  # fmt: skip

    def _belief(self, tracer: Tracer) -> Belief:
        models = tracer.inputs(self._models)
        count, coupling = len(Segments._fields), getattr(self.batch.world.belief, "coupling", Ignored())
        of_planes = tuple(_view(models, count * p, count, Segments._fields) for p in range(self.planes))
        alike = tracer.inputs(self._alike)
        if not self.spatial:
            return Belief(Segments(*models), Stack(of_planes), alike, coupling)
        fields = len(SpatialSegments._fields)
        values = tracer.inputs(self._space)
        wrist = SpatialWrist(
            SpatialSegments(*(values[k] for k in range(fields))), values.part(fields, OF_A_TENDON * self.places)
        )
        return Belief(wrist, Stack(of_planes), alike, coupling)

    def _drive(self, tracer: Tracer) -> Any:
        if isinstance(self.drive, IdealDrive):
            return self.drive
        motor, stiffness = Motor(*tracer.inputs(self._motor)), tracer.inputs(self._stiffness)
        if isinstance(self.drive, LaggedDrive):
            return LaggedDrive(motor, stiffness)
        if isinstance(self.drive, ServoDrive):
            return ServoDrive(motor, stiffness, Motor(*tracer.inputs(self._board)), self.drive.sent)
        return SpoolDrive(motor, stiffness, Timing(*tracer.inputs(self._board)), self.drive.sent)

    def _respond(self) -> Function:
        tracer, planes, places = Tracer(), self.planes, self.places
        seen, reach = signals_of(self.preview), len(REFERENCE) * (1 + self.preview)
        memory, kept = max(1, self.controller.memory), planes * max(1, self.controller.memory)
        arrays = {
            "seen": OF_A_PLANE * planes, "reference": reach * planes, "motors": self.batch.state.motors.size,
            "memory": kept, "wanted": planes, "torque": planes, "pulls": places, "share": 1,
        }  # fmt: skip
        given = {name: _array(tracer, name, size) for name, size in arrays.items()}
        signals = tracer.scratch(seen * planes)
        for p in range(planes):
            for i in range(seen - len(NOW)):
                signals[seen * p + len(NOW) + i] = given["reference"][reach * p + len(REFERENCE) + i]
        known = self._belief(tracer)
        shape = Shape(planes, places if self.controller.planes > 1 else 0, self.preview, memory)
        control = Controlled(
            tracer.lifted(of_all_planes(self.controller.law, shape)),
            Stack(tuple(_view(signals, seen * p, seen, NOW) for p in range(planes))),
            known.models,
            tracer.inputs([f"GAIN_{identifier(name)}" for name in self.controller.gains], self._gains),
            Stack(tuple(given["memory"].part(memory * p, memory) for p in range(planes))),
            Stack(tuple(given["reference"].part(reach * p, len(REFERENCE)) for p in range(planes))),
        )
        withheld = given["motors"].part(2 * places, planes)
        missed = given["motors"].part(2 * places + planes, planes)
        room = Room(*[tracer.scratch(planes) for _ in Room._fields])._replace(arms=tracer.scratch(planes * places))
        limits = Limits(tracer.inputs(self._least), tracer.inputs(self._greatest))
        pulls = tracer.scratch(places)
        share = tracer.runs(
            respond, control, known, Seen(given["seen"], withheld, missed), limits, room, 0.0,
            tracer.input("PERIOD"), pulls,
        )  # fmt: skip
        outputs = _results({"motors": given["motors"], "memory": given["memory"]})
        outputs |= _results({"wanted": room.wanted, "torque": room.torque, "pulls": pulls}) | {"share[0]": share}
        return Function(tracer.program(outputs), arrays, ("motors", "memory", "wanted", "torque", "pulls", "share"))

    def _actuate(self) -> Function:
        tracer, planes, places = Tracer(), self.planes, self.places
        arrays = {
            "bend": planes, "rate": planes, "pulls": places, "motors": self.batch.state.motors.size, "counts": places,
        }  # fmt: skip
        given = {name: _array(tracer, name, size) for name, size in arrays.items()}
        aim, counts = Aim(given["bend"], given["rate"], tracer.scratch(planes * places)), tracer.scratch(places)
        tracer.runs(
            actuate, self._drive(tracer), given["motors"], self._belief(tracer), aim, given["pulls"],
            tracer.input("PERIOD"), counts,
        )  # fmt: skip
        outputs = _results({"motors": given["motors"], "counts": counts})
        return Function(tracer.program(outputs), arrays, ("motors", "counts"))

    def _propagate(self) -> Function:
        tracer, planes, places = Tracer(), self.planes, self.places
        arrays = {"counts": places, "x": OF_A_PLANE * planes}
        given = {name: _array(tracer, name, size) for name, size in arrays.items()}
        knowing = Knowing(
            self._belief(tracer), self._drive(tracer), tracer.scratch(planes), tracer.scratch(places),
            tracer.scratch(planes * places),
        )  # fmt: skip
        tracer.runs(propagate, knowing, given["x"], given["counts"], tracer.input("PERIOD"))
        return Function(tracer.program(_results({"x": given["x"]})), arrays, ("x",))


def _array(tracer: Tracer, name: str, size: int) -> SymbolRows:
    return tracer.inputs([f"{name}[{k}]" for k in range(size)])


def _view(of: SymbolRows, start: int, size: int, fields: tuple[str, ...]) -> SymbolRows:
    view = of.part(start, size)
    view.fields = fields
    return view


def _results(arrays: Mapping[str, SymbolRows]) -> dict[str, Any]:
    """Values of arrays by the names of their entries."""
    return {f"{name}[{k}]": rows[k] for name, rows in arrays.items() for k in range(len(rows))}


def _inputs(function: Function) -> set[str]:
    program = function.program
    return {program.operations[k].value for k in program.used if program.operations[k].name == "input"}
