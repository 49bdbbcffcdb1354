"""The table of controllers: a newcomer is one file, and one line in `wristctl.config.choices`."""

import json
from collections.abc import Mapping
from pathlib import Path

from wristctl.config.choices import CONTROLLERS as _TABLE
from wristctl.config.choices import Choices
from wristctl.config.controller_row import BY_LOOP
from wristctl.config.former_names import preset_today
from wristctl.config.loop import Loop
from wristctl.control.law import Controller
from wristctl.control.shipped_gains import PREFIX, families, is_shipped, shipped_gains
from wristctl.control.vetting import law_of
from wristctl.errors import Call, UserError, meant
from wristctl.plain_files import read_json
from wristctl.records.files import write_text

CONTROLLERS: Choices[Controller] = _TABLE

# Gains by controller and name, as a tune run finds them.
TunedGains = Mapping[str, Mapping[str, float]]


def controller(name: str) -> Controller:
    """The controller of this name, or of this file.py:NAME; UserError with the nearest name if there is none."""
    entry = CONTROLLERS.named(name)
    return entry if isinstance(entry, Controller) else law_of(entry, name, {})


def preset_for(chosen: Controller, exact: bool) -> str:
    """Preset that a controller typed by its name alone has: `default` where all is `exact`, else `hardware`.

    A controller without that preset has the other, or else its first one; one without presets `default`.
    """
    names = ("default", "hardware") if exact else ("hardware", "default")
    return next((name for name in names if name in chosen.presets), next(iter(chosen.presets), "default"))


def gains_of(
    chosen: Controller, gains: str | Mapping[str, float], tuned: TunedGains | None = None, loop: Loop | None = None
) -> tuple[float, ...]:
    """Gains by name or by value, in the controller's order; UserError for what is unknown or missing.

    A name is a preset's, `tuned`, or `tuned:FAMILY` for the gains that a study found on a family of worlds, or
    `by-loop` for the preset that is for `loop`, or for a rig where there is none. `tuned` holds a tune run's gains by
    controller and name.
    """
    if gains == BY_LOOP:
        gains = preset_for(chosen, loop is not None and loop.is_exact)
    if gains == "tuned":
        if tuned is None or chosen.name not in tuned:
            fix = f"--tuned RUN, a tune run that tuned {chosen.name}"
            raise UserError(f"no tuned gains of {chosen.name}", "gains", fix)
        gains = tuned[chosen.name]
    if isinstance(gains, str) and is_shipped(gains):
        gains = shipped_gains(chosen.name, gains).gains
    if isinstance(gains, str):
        preset = preset_today(gains, chosen.presets)
        if preset not in chosen.presets:
            example = ",".join(f"{name}=1" for name in chosen.gains)
            by_name = f"every gain by name, such as {example}"
            shipped = [PREFIX + family for family in families()]
            fix = meant(gains, [*chosen.presets, "tuned", *shipped])
            if example:
                fix += f" Or {by_name}" if fix.endswith("?") else f"; or {by_name}"
            raise UserError(f"unknown gains '{gains}' of {chosen.name}", "gains", fix)
        return chosen.values(chosen.presets[preset])
    for name in gains:
        if name not in chosen.gains:
            raise UserError(f"unknown gain '{name}' of {chosen.name}", f"gains.{name}", meant(name, chosen.gains))
    below = [name for name, value in gains.items() if value < 0.0 <= chosen.gains[name].low]
    if below:
        problem = f"{gains[below[0]]:g} for {below[0]} of {chosen.name}, which pushes the wrong way"
        raise UserError(problem, f"gains.{below[0]}", "a gain is not negative")
    missing = [name for name in chosen.gains if name not in gains]
    if missing:
        raise UserError(f"missing gain {', '.join(missing)} of {chosen.name}", "gains", "give every gain by name")
    return chosen.values(gains)


Gains = Mapping[str, Mapping[str, float]]


def write_gains(path: Path, gains: Gains) -> None:
    """Write gains by controller and name; floats round-trip exactly."""
    write_text(path, json.dumps(gains, indent=2) + "\n")


def read_gains(path: Path) -> Gains:
    """Read a file of tuned gains; UserError if it is none."""
    try:
        gains = read_json(path)
        return {str(name): {str(k): float(v) for k, v in values.items()} for name, values in gains.items()}
    except (OSError, ValueError, AttributeError, TypeError) as error:
        raise UserError("not a file of tuned gains", str(path), ("name a run of `", Call("tune"), "`")) from error
