"""Identification: which runs, what is held fixed, what is known how well, and what counts as identified."""

from typing import Literal

from wristctl.config.given_files import columns_of_file, given_file, of_file
from wristctl.config.section import Section, choice, quantity


class Fixed(Section):
    """Parameters held at a value instead of found; null: found."""

    stiffness: float | None = quantity(None, "N m/rad", "bending stiffness of the whole wrist", gt=0)
    flexion_ratio: float | None = quantity(None, "", "stiffness toward flexion over that toward ulnar", gt=0)
    damping: float | None = quantity(None, "N m s/rad", "bending damping of the whole wrist", gt=0)
    tendon_stiffness: float | None = quantity(None, "N/m", "stiffness of one tendon", gt=0)
    friction: float | None = quantity(None, "", "capstan friction: coefficient times bend", ge=0)
    sheath_friction: float | None = quantity(None, "", "sheaths' friction: coefficient times angle", ge=0)
    presliding: float | None = quantity(None, "m", "path in which friction turns round", gt=0)
    delay: float | None = quantity(None, "s", "how much older a picture is than its time stamp")
    tendon_radius: float | None = quantity(None, "m", "radius of the tendons' circle, the pulley's as known", gt=0)
    inner_friction: float | None = quantity(
        None, "N m", "torque of friction inside the wrist, with model: hysteresis", ge=0
    )
    inner_presliding_deg: float | None = quantity(
        None, "deg", "bend in which that turns round, with model: hysteresis", gt=0
    )


class KnownBeforehand(Section):
    """Prior knowledge of the wrist of a loop of hysteresis; standard deviations, the relative ones logarithmic."""

    stiffness_error: float = quantity(0.1, "", "of wrist.stiffness, relative", "assumed", gt=0)
    damping_error: float = quantity(0.3, "", "of wrist.damping, relative", "assumed", gt=0)
    tendon_stiffness: float = quantity(20e3, "N/m", "stiffness of one tendon", "assumed", gt=0)
    tendon_stiffness_error: float = quantity(0.1, "", "of that, relative", "assumed", gt=0)
    run_up: float = quantity(
        2e-4, "m", "path after which bristles are bent fully; what comes before is not used", "10 presliding", gt=0
    )


class IdentifySettings(Section):
    """Parameters of a real wrist from its spools' logged positions and its marker's angles."""

    runs: tuple[str, ...] = choice(
        (), "hw-run runs: paths, ids or latest:hw-run; or open logs (documentation: The open log)"
    )
    logs: tuple[str, ...] = given_file("open logs (documentation: The open log)", ())
    columns: str | None = columns_of_file()
    trial: str | None = of_file("trial of a log that is the loop of hysteresis, where it has several")
    model: Literal["arcs", "wrist", "hysteresis"] = choice(
        "arcs",
        "what logs are of: any robot, as arcs without weight; the study's wrist, in two planes; or its hysteresis",
    )
    fix: Fixed = Fixed()
    known: KnownBeforehand = KnownBeforehand()
    torque_constant: float | None = quantity(
        None, "N m/A", "torque of a motor at its spool for an ampere, gears included; null: unknown", gt=0
    )
    spool_radius: float | None = quantity(
        None, "m", "radius of a motor's spool, with torque_constant; null: unknown", gt=0
    )
    segments: int = choice(4, "constant-curvature segments of the model", "as simulated", ge=1, le=8)
    step: float = quantity(1e-3, "s", "integration step", "as simulated", gt=0, le=5e-3)
    radius_error: float = quantity(
        0.01, "", "how well tendon_radius over pulley_radius is known: relative standard deviation", "assumed", gt=0
    )
    presliding_error: float = quantity(
        0.8, "", "how well the path is known in which friction turns round: relative (logarithm's) standard deviation",
        "assumed: 5-100 um", gt=0,
    )  # fmt: skip
    zero_error_deg: float = quantity(
        0.1, "deg", "how well the marker's zero is known in each run and plane: standard deviation", "assumed", gt=0
    )
    spool_error: float = quantity(
        2e-5, "m", "how well homing finds where each tendon is taut in each run: standard deviation", "assumed", gt=0
    )
    exposure: float | None = quantity(
        None, "s", "how long the shutter is open; null: the emulated camera's own, a real one's neglected", ge=0
    )
    holding_torque: float | None = quantity(
        None, "N m", "that the motors hold: a field gives way to its tendon's pull, the more so the harder it pulls; "
        "null: the emulated motors' own, a real rig's neglected", gt=0,
    )  # fmt: skip
    rotor_inertia: float | None = quantity(
        None, "kg m^2", "of a motor's rotor and its spool, with holding_torque: it swings about its field; null: the "
        "emulated motors' own, a real rig's neglected", gt=0,
    )  # fmt: skip
    rotor_damping: float = quantity(
        2e-3, "N m s/rad", "viscous, of an energised rotor that has inertia", "assumed, as the emulated motors'", ge=0
    )
    clock_error: float = quantity(
        3e-4, "s", "how well the times of spools and of pictures agree, beside the delay: standard deviation",
        "a frame of USB, 1 ms, at any place of which a tick may begin", ge=0,
    )  # fmt: skip
    turn_error_deg: float = quantity(
        0.05, "deg", "how well each view's turn about the wrist's axis is known, in two planes: standard deviation",
        "the emulated cameras', of ten rigs, whose pose is fitted at rest: 0.04", gt=0,
    )  # fmt: skip
    view_error: float = quantity(
        2e-4, "", "how well the scale of each view's bends is known, in two planes: relative standard deviation",
        "the emulated cameras', of ten rigs", gt=0,
    )  # fmt: skip
    widest: float = quantity(
        0.25, "", "half width of a 95 % interval, over the value, beyond which a parameter is not identified", gt=0
    )
    condition_limit: float = quantity(
        1000.0, "", "condition number of the scaled Jacobian beyond which nothing is identified", "assumed", gt=1
    )
    lack_of_fit: float = quantity(
        2.0, "", "variance of the residuals over that of the frames' own noise beyond which nothing is identified",
        "assumed", gt=1,
    )  # fmt: skip
    misfit: Literal["refuse", "tell"] = choice("refuse", "what to do with trials that the model does not fit")

    @property
    def fixed(self) -> dict[str, float]:
        """Values of the held parameters, by name."""
        return self.fix.model_dump(exclude_none=True)
