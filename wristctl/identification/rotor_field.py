"""Rotors of steppers between the place where a drive counts and the tendon: each hangs on a magnetic field.

The field is a spring that softens: a rotor that its tendon pulls stands turn/(2 pi) asin(pull/holding) behind it, as a
length of tendon, and swings about that place (Acarnley, Stepping Motors, 4th ed., ch. 4). To first order a standing
rotor is a spring in series with the tendon, and part of the tendon stiffness that is found. What is beyond it is known
where the motors' holding torque is, and the swing where the rotors' inertia and damping are known too.
"""

import math
from typing import Any, NamedTuple

from wristctl.config.bench import Motors
from wristctl.config.identify import IdentifySettings
from wristctl.config.plant import Actuator
from wristctl.lanes.compiled import by_type, compiled, implements
from wristctl.lanes.functions import clip, minimum, sin
from wristctl.lanes.lane import zero_like
from wristctl.simulation.nonideal import electrical_turn
from wristctl.wrist.tendon_mechanics import spool_pull

# Largest phase [rad] of a rotor's swing in one substep: leapfrog's frequency is off by its square over 24, 4e-4.
_PHASE = 0.1


class Rotors(NamedTuple):
    """Motors as far as they are known: holding torque [N m], inertia of a rotor and its spool [kg m^2], and damping
    [N m s/rad]. Holding infinitely they stand where their drives count; without inertia they do not swing."""

    holding: float = math.inf
    inertia: float = 0.0
    damping: float = 0.0

    @property
    def swing(self) -> bool:
        """Whether they are known to swing."""
        return self.inertia > 0.0 and math.isfinite(self.holding)


class Field(NamedTuple):
    """Constants of a place's rotors and their field; lanes.

    Length of tendon in one radian of the field [m], one over the pull that it holds [1/N], or of winches the pull for
    one that counts; of swinging rotors the inverse of their mass [1/kg], and damping over mass [1/s].
    """

    radian: Any
    per_newton: Any
    per_mass: Any
    decay: Any


class Standing(NamedTuple):
    """Rotors that stand where field and pull are balanced."""


class Swinging(NamedTuple):
    """Rotors that swing about that, in so many substeps of an integration step."""

    substeps: int


class Winches(NamedTuple):
    """Motors that keep a pull: each is a spool behind a tendon so soft that nothing the wrist does in a step changes
    it, reeled in anew before the next one."""


def rotors_of(settings: IdentifySettings) -> Rotors:
    """Motors as far as somebody says what they are."""
    if settings.holding_torque is None:
        return Rotors()
    return Rotors(settings.holding_torque, settings.rotor_inertia or 0.0, settings.rotor_damping)


def with_rotors(settings: IdentifySettings, motors: Motors) -> IdentifySettings:
    """The settings with these motors' own rotors, unless they say already what a motor holds."""
    if settings.holding_torque is not None or motors.rotor_inertia == 0.0:
        return settings
    return settings.model_copy(
        update={
            "holding_torque": motors.holding_torque,
            "rotor_inertia": motors.rotor_inertia + motors.spool_inertia,
            "rotor_damping": motors.damping,
        }
    )


def field_of(motors: Actuator, rotors: Rotors, alike: float = 1.0) -> Field:
    """The field of a place with so many motors alike."""
    mass = alike * rotors.inertia / motors.pulley_radius**2
    return Field(
        radian=electrical_turn(motors) / (2.0 * math.pi),
        per_newton=motors.pulley_radius / (alike * rotors.holding),
        per_mass=1.0 / mass if mass else 0.0,
        decay=rotors.damping / rotors.inertia if mass else 0.0,
    )


def own_stiffness(motors: Actuator, rotors: Rotors) -> float:
    """Stiffness [N/m] of a tendon between wrist and rotor; `motors` have that of tendon and field in series where the
    rotors swing. It is at most a hundred times as stiff as both, where these are stiffer than the field alone."""
    if not rotors.swing:
        return motors.tendon_stiffness
    field = field_of(motors, rotors)
    compliance = 1.0 / motors.tendon_stiffness
    own = max(compliance - float(field.radian * field.per_newton), 0.01 * compliance)
    return 1.0 / own


def motion_of(motors: Actuator, rotors: Rotors, step: float) -> Standing | Swinging:
    """How rotors move over integration steps [s]."""
    if not rotors.swing:
        return Standing()
    field = field_of(motors, rotors)
    frequency = math.sqrt(field.per_mass / (field.radian * field.per_newton))
    return Swinging(max(1, math.ceil(step * frequency / _PHASE)))


@by_type
def turn_rotor(
    rotors: Any, field: Any, tendons: Any, counted: Any, state: Any, t: int, shortened: Any, h: float
) -> Any:
    """Length [m] that a tendon has on its spool at the end of a step of h [s].

    Parameters
    ----------
    counted : lengths [m] at which the field stands at the step's begin and its end; of winches what stands for pulls
    shortened : what its path is shorter by in the middle of the step [m]
    state : rows of place [m] and speed [m/s] of each rotor
    """


@implements(turn_rotor, Standing)
@compiled
def _stand(rotors: Any, field: Any, tendons: Any, counted: Any, state: Any, t: int, shortened: Any, h: float) -> Any:
    """Less than where the field stands, by what is beyond the first order.

    asin(s) - s by its series up to the ninth order: within 0.002 of a radian up to three quarters of what it holds.
    """
    _, spooled = counted
    pull = spool_pull(tendons, spooled, t, shortened)
    share = minimum(pull * field.per_newton, zero_like(pull) + 1.0)
    square = share * share
    beyond = 1.0 / 6.0 + square * (3.0 / 40.0 + square * (15.0 / 336.0 + square * (105.0 / 3456.0)))
    return spooled - field.radian * (share * square * beyond)


@implements(turn_rotor, Winches)
@compiled
def _wind(rotors: Any, field: Any, tendons: Any, counted: Any, state: Any, t: int, shortened: Any, h: float) -> Any:
    _, pull = counted
    return pull * field.per_newton / tendons.stiffness[t] + shortened


@implements(turn_rotor, Swinging)
@compiled
def _swing(rotors: Any, field: Any, tendons: Any, counted: Any, state: Any, t: int, shortened: Any, h: float) -> Any:
    """Leapfrog: mass dv/dt = holding sin((field - place)/radian) - pull - damping v.

    Beyond a quarter of a turn the field holds on as there: a rotor that loses steps is another rig.
    """
    before, after = counted
    step = h / rotors.substeps
    place, speed = state[2 * t], state[2 * t + 1]
    resisting = 0.5 * step * field.decay
    keep, push = (1.0 - resisting) / (1.0 + resisting), step * field.per_mass / (1.0 + resisting)
    holds, quarter = 1.0 / field.per_newton, zero_like(place) + 0.5 * math.pi
    for part in range(rotors.substeps):
        stands = before + (after - before) * ((part + 0.5) / rotors.substeps)
        place = place + 0.5 * step * speed
        pull = spool_pull(tendons, place, t, shortened)
        speed = keep * speed + push * (holds * sin(clip((stands - place) / field.radian, -quarter, quarter)) - pull)
        place = place + 0.5 * step * speed
    state[2 * t] = place
    state[2 * t + 1] = speed
    return place
