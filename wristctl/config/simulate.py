"""Settings of `simulate`, one closed loop, and of `analyse`, the same loop linearised or its wrist alone."""

from typing import Literal

from wristctl.config.controller_row import BY_LOOP, CONTROLLER, GAINS, ControllerName, GainsChoice
from wristctl.config.loop import DirectionName, Loop, Reference
from wristctl.config.section import Section, choice, kept_settings, quantity


class SimulateSettings(Section):
    """One closed loop."""

    controller: ControllerName = choice("smc", CONTROLLER)
    gains: GainsChoice = choice(BY_LOOP, GAINS)
    loop: Loop = Loop()
    reference: Reference = Reference()
    direction: DirectionName = choice("ulnar", "direction of bending; the reference's angle counts toward it")
    start: Literal["straight", "equilibrium"] = choice(
        "straight", "state at rest before the move: straight, or the static equilibrium at pretension"
    )
    horizon: float = quantity(5.0, "s", "duration of one rollout", "assumed", gt=0)
    repetitions: int = choice(1, "rollouts, each with noise and a drawn plant of its own", ge=1, le=10_000)
    network: str | None = choice(None, "train run behind a reference with inverse: network")
    tuned: str | None = choice(None, "tune run behind gains: tuned")
    from_identified: str | None = choice(None, "identify run whose parameters replace the study's")
    kept: tuple[str, ...] = kept_settings()


class AnalyseSettings(Section):
    """The loop of the `simulate` section, linearised about where it rests; or the wrist's hysteresis by its section."""

    of: Literal["loop", "hysteresis"] = choice("loop", "simulate's closed loop, or the wrist without a controller")
    angles_deg: tuple[float, ...] = quantity(
        (), "deg", "resting angles toward the direction; none: straight, half way, and where the reference ends"
    )
    over: str = choice("loop", "of the root locus: loop (its gain), or a gain by its name")
    span: float = quantity(10.0, "", "the root locus goes from 1/span to span times that gain", gt=1, le=1000)
    friction: Literal["slipping", "stuck"] = choice("slipping", "how the friction of elastic tendons is linearised")
