"""Contract of every plant, behind which rollouts, the emulated bench and identification move a wrist.

A plant is one file: the NamedTuple of its parameters, and functions of lanes on them and on its coordinates q with
their rates. Compiled code is handed a PlantModel, reads its parameters by `parameters_of`, and calls the functions
below; which plant's they are follows from the parameters' type, so that each kernel is compiled for its plant alone.
`wristctl.wrist.pcc` is the first plant; a newcomer is a line in `wristctl.config.choices.PLANTS`, or `PLANTS_IN_SPACE`.
"""

import sys
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numba
import numpy as np
from numba.core.registry import CPUDispatcher
from numba.extending import NativeValue, models, overload, register_model, typeof_impl, unbox
from numpy.typing import ArrayLike

from wristctl.arrays import Array
from wristctl.config.choices import PLANTS as _TABLE
from wristctl.config.choices import PLANTS_IN_SPACE as _IN_SPACE
from wristctl.config.choices import Choices
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.lanes.compiled import by_type, implements, kernel, spelled_out
from wristctl.lanes.lane import where, zero_like
from wristctl.lanes.named_tuples import tuple_of
from wristctl.lanes.rows import entries, lanes_like, part, rows_of
from wristctl.wrist.kinematics import Backbone
from wristctl.wrist.tendon_mechanics import (
    WRAPPED,
    ElasticTendons,
    NoTendons,
    PulledTendons,
    RealTendons,
    X,
    paths_of,
    row_of,
    update_memory,
)


def _unknown(*_: Any) -> Any:
    raise NotImplementedError("a plant in two planes has no two sides, and no backbone in a plane")


def _unseen(*_: Any) -> Any:
    raise NotImplementedError("a plant in one plane has no frames in space")


@dataclass(frozen=True)
class PlantModel:
    """A kind of plant; the compiled functions have the arguments of this module's of the same name."""

    name: str
    parameters: Any
    """NamedTuple class of its parameters, all lanes; a class of its own, which tells plants apart."""
    coordinates: Callable[[int], int]
    """Number of coordinates q of a wrist cut into so many segments."""
    values: Callable[[WristParameters, int], Array]
    """The parameters' values of a wrist cut into so many segments, in their order."""
    advance: Any
    bend_of: Any
    within: Any
    disturbed: Any
    tips: Callable[[WristParameters, Array], Array]
    """Tips (T, P + 1) [m] at coordinates (T, q)."""
    travel: Any
    planes: int = 1
    """Number P of planes that it bends in."""
    frames: Callable[[WristParameters, Array, Array], tuple[Array, Array]] = _unseen
    """For pictures, of a plant in two planes: centres (m, 3) [m] and axes (m, 3, 3), as columns, of cross-sections at
    coordinates (q,) and at shares (m,) of the way from the base to the tip."""
    read: Any = None
    """Function (model, rows, pulls) of compiled code that reads the parameters; None: each is a row."""
    angle: Callable[[Array], Array] = _unknown
    """Bending angles (...) [rad] of the last disc at coordinates (..., q); in two planes its bends (..., 2)."""
    taut: Callable[[WristParameters, Array], Array] = _unknown
    """Lengths (2,) [m] of the + and the - side's taut tendons at coordinates (q,)."""
    backbone: Backbone = _unknown
    """For pictures."""
    equilibrium: Callable[[WristParameters, int, tuple[float, float]], Array] | None = None
    """Coordinates (q,) at rest under tensions [N per tendon, + and - side, which in two planes are one of all]; None
    where the plant cannot tell."""

    def __post_init__(self) -> None:
        for function in (advance, bend_of, travel, within, disturbed):
            if (body := getattr(self, function.__name__)) is not None:
                implements(function, self.parameters)(body)

    @property
    def sources(self) -> tuple[Path, ...]:
        """The files that define its parameters and each of its compiled functions, sorted."""
        functions = [value for value in vars(self).values() if isinstance(value, CPUDispatcher)]
        modules = {self.parameters.__module__, *(function.py_func.__module__ for function in functions)}
        return tuple(sorted(Path(str(sys.modules[module].__file__)) for module in modules))

    def rest(self, wrist: WristParameters, n: int, tensions: tuple[float, float]) -> Array:
        """`equilibrium`, and a UserError where the plant cannot tell it."""
        if self.equilibrium is None:
            raise UserError(f"plant {self.name} knows no equilibrium", "start", "start: straight")
        return self.equilibrium(wrist, n, tensions)


PLANTS: Choices[PlantModel] = _TABLE
PLANTS_IN_SPACE: Choices[PlantModel] = _IN_SPACE


def plant_in(planes: int, name: str) -> PlantModel:
    """Plant of this name that bends in so many planes; UserError if there is none."""
    return (PLANTS if planes == 1 else PLANTS_IN_SPACE).named(name)


class PlantType(numba.types.Type):
    """A plant model in compiled code: nothing but a type."""

    def __init__(self, parameters: Any, read: Any) -> None:
        self.parameters, self.read = parameters, read
        super().__init__(name=f"plant({parameters.__module__}.{parameters.__qualname__})")


register_model(PlantType)(models.OpaqueModel)


@typeof_impl.register(PlantModel)
def _type_of(model: PlantModel, context: Any) -> PlantType:
    return PlantType(model.parameters, model.read)


@unbox(PlantType)
def _nothing(kind: PlantType, model: Any, context: Any) -> NativeValue:
    return NativeValue(context.context.get_dummy_value())


def parameters_of(model: Any, rows: Any, pulls: Any = ()) -> Any:
    """The model's parameters, read from rows of lanes; `pulls` is a tuple with an entry for each place of tendons."""
    raise NotImplementedError("compiled code only")


@overload(parameters_of)
def _parameters_of(model: Any, rows: Any, pulls: Any = ()) -> Any:
    if not isinstance(model, PlantType):
        return None
    if model.read is not None:
        return model.read
    read = tuple_of(model.parameters)

    def parameters(model: Any, rows: Any, pulls: Any = ()) -> Any:
        return read(rows)

    return parameters


@by_type
def advance(plant: Any, q: Any, rate: Any, spool_input: Any, tendons: Any, h: Any) -> Any:
    """Move coordinates and rates on by h [s] with `spool_input` held.

    It is what the spools of both sides hold, (plus, minus) or twice that: by the type of `tendons` pulls [N] or lengths
    reeled in [m]. Pulls at any place are `wristctl.wrist.tendon_mechanics.pulls_along`'s, and end stops are
    `wristctl.wrist.integrator`'s. Returns an estimate of the step's error in the bending angle and in its rate
    [rad, rad/s], as an embedded solution of lower order gives it.
    """


@by_type
def bend_of(plant: Any, q: Any, rate: Any, bend: Any, speed: Any) -> None:
    """Write the bend of the last disc [rad] and its rate [rad/s], a row for each plane."""


@by_type
def travel(plant: Any, q: Any) -> Any:
    """Shortening of the + and the - side's tendon paths from the straight wrist [m], and the bend that they are wrapped
    by [rad]; in two planes the shortening of each place's, then the bend that each is wrapped by."""


@by_type
def within(plant: Any, q: Any) -> Any:
    """Lanes in which the coordinates are ones that the plant can have."""


@by_type
def disturbed(plant: Any, force: Any, scale: Any) -> Any:
    """The plant with a force (3) on the last disc [N] and its stiffness scaled.

    The force is along the straight wrist, across it toward positive bends, and aside, which one plane does not feel.
    """


@by_type
def path_along(tendons: Any, plant: Any, q: Any) -> Any:
    """Path of the tendons at coordinates q, as the plant's `travel`; zeros where pulls are held, which need none."""


@by_type
def path_before(tendons: Any, plant: Any, q: Any) -> Any:
    """Path of the tendons before a step, at coordinates q; real tendons remember it from the step before."""


@implements(path_before, NoTendons, PulledTendons)
@implements(path_along, NoTendons, PulledTendons)
def _no_path(tendons: Any, plant: Any, q: Any) -> Any:
    zero = zero_like(q[0])
    return zero, zero, zero


@implements(path_before, ElasticTendons)
@implements(path_along, ElasticTendons, RealTendons)
def _travelled(tendons: Any, plant: Any, q: Any) -> Any:
    return travel(plant, q)


@implements(path_before, RealTendons)
def _remembered_path(tendons: Any, plant: Any, q: Any) -> Any:
    path = lanes_like(part(tendons.state, 0, tendons.path))
    shortened = paths_of(path)
    for i in range(len(path)):
        path[i] = tendons.state[row_of(i, X) if i < shortened else row_of(i - shortened, WRAPPED)]
    return entries(path)


@cache
def kernel_of(function: Any, model: PlantModel) -> Any:
    """A function of Python as a kernel that moves plants of this model; its cache goes by that one's sources too."""
    return kernel(function, *model.sources)


def _path_at(model: Any, values: Any, state: Any, out: Any, cut: Any, pulls: Any) -> None:
    path, row = travel(parameters_of(model, rows_of(values), pulls), part(rows_of(state), 0, cut)), rows_of(out)
    for i in range(len(path)):
        row[i] = path[i]


def path_at(model: PlantModel, values: Array, q: Array, places: int) -> Array:
    """The plant's `travel` at coordinates (q,) of a wrist with these values and so many places of tendons."""
    out = np.empty(3 if model.planes == 1 else 2 * places)
    kernel_of(_path_at, model)(model, values, np.ascontiguousarray(q, float), out, (0,) * len(q), (0,) * places)
    return out


def _integrate(model: Any, values: Any, pulls: Any, h: float, steps: Any, out: Any, cut: Any, places: Any) -> None:
    plant, held, m = parameters_of(model, rows_of(values), places), part(rows_of(pulls), 0, places), len(cut)
    for sample in range(steps.shape[0]):
        state, before = rows_of(out[sample + 1]), rows_of(out[sample])
        for i in range(2 * m):
            state[i] = before[i]
        q, rate = part(state, 0, cut), part(state, m, cut)
        for _ in range(steps[sample]):
            advance(plant, q, rate, held, NoTendons(), h + zero_like(held[0]))


def integrate(
    model: PlantModel, values: Array, q: ArrayLike, rate: ArrayLike, pulls: ArrayLike, times: ArrayLike, h: float = 1e-3
) -> tuple[Array, Array]:
    """Motion from one state under held pulls [N] of each place: coordinates and rates (K, q) at K times [s].

    Steps of h; every time must be a whole number of steps.
    """
    counts = np.rint(np.asarray(times, float) / h).astype(np.int64)
    if not np.allclose(counts * h, times, rtol=0, atol=1e-9 * h):
        raise ValueError(f"times must be whole numbers of steps of {h} s")
    begin, held = np.concatenate([q, rate]).astype(float), np.ascontiguousarray(pulls, float)
    out, m = np.empty((len(counts) + 1, len(begin))), len(begin) // 2
    out[0] = begin
    shapes = (0,) * m, (0,) * len(held)
    kernel_of(_integrate, model)(model, values, held, h, np.diff(counts, prepend=0), out, *shapes)
    return out[1:, :m], out[1:, m:]


@spelled_out
def advance_or_stop(plant: Any, q: Any, rate: Any, spool_input: Any, tendons: Any, h: Any, alive: Any) -> Any:
    """`advance`, but a plant that leaves what it can be stays where it was for good.

    Returns which are still alive, and an estimate of the step's error as an angle [rad]: of a plant that leaves what it
    can be in this step 1, of one that is not alive 0.
    """
    before = lanes_like(q)
    for i in range(len(q)):
        before[i] = q[i]
    of_bend, of_rate = advance(plant, q, rate, spool_input, tendons, h)
    zero = zero_like(alive)
    well = where(within(plant, q), alive, zero)
    error = where(well > zero, abs(of_bend) + h * abs(of_rate), alive)
    for i in range(len(q)):
        q[i] = where(well > zero, q[i], before[i])
        rate[i] = where(well > zero, rate[i], zero)
    update_memory(tendons, q, spool_input, path_along(tendons, plant, q))
    return well, error
