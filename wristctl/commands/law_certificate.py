"""Is a law fit for all that a law is used for? Checks of one, each with what was found."""

import tempfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np
from pydantic import ValidationError

from wristctl.arrays import Array
from wristctl.commands.adoption import adopted
from wristctl.commands.hw_run.command import HW_RUN
from wristctl.commands.perform import carry_out
from wristctl.comparison.step_cost import step_time
from wristctl.config.controller_row import Row
from wristctl.config.study import Study
from wristctl.config.wrist import WristParameters
from wristctl.control.law import NOW, Controller, signals_of
from wristctl.control.table import controller
from wristctl.control.vetting import call_law, vet
from wristctl.errors import UserError
from wristctl.study_files.error_messages import explained

# Angle from which a law should bend the wrist back [rad], and ticks in which its memory may take that in.
_BENT, _SETTLED = 0.1, 20


class LawCheck(NamedTuple):
    """Check of a law: its subject, its outcome (None: not checked), and the measured values."""

    asked: str
    passed: bool | None
    found: str


def certificate(name: str, laws: Mapping[str, Mapping[str, float]], on_board: bool = True) -> Iterator[LawCheck]:
    """Check a law by its file.py:NAME or its name, made of the settings in `laws` where it has some.

    Raises UserError where it cannot be loaded, or does not even keep to what a law is: see `vetting.vet`.
    """
    row = {"controller": name, "gains": "default"}
    try:
        study = Study.model_validate(
            {"hw-run": {"rows": (row,)}, "controller-settings": {key: dict(v) for key, v in laws.items()}}
        )
    except ValidationError as error:
        raise explained(error, {}).at(name) from error
    resolved, foreign = adopted(study, "hw-run")
    law = controller(resolved.hw_run.rows[0].controller)
    for origin in foreign:
        for file, digest in origin.files.items():
            yield LawCheck("source", None, f"{file.relative_to(origin.root)} sha256 {digest}")
    if not foreign:
        yield LawCheck("source", None, "wristctl's own")
    tried = vet(law, name)
    states = f"{len(tried.torques)} random states"
    yield LawCheck("finite", True, f"torques of {np.ptp(tried.torques):.3g} N m from least to largest, {states}")
    yield LawCheck("memory", True, f"{law.memory} values, {law.preview} periods of preview, as declared")
    if law.plain:
        yield LawCheck("compiles", None, "plain Python: one rollout at a time, and no analyse")
    else:
        wide = call_law(law, tried.signals, tried.gains, wide=True)
        same = bool(np.array_equal(wide, tried.torques))
        yield LawCheck("compiles", same, f"at widths 1 and 8, with {'the same' if same else 'OTHER'} bits")
        yield LawCheck("takes and changes", True, "no memory of the system, nothing that it is shown")
    yield _restoring(law)
    gains = ", ".join(
        f"{gain_name} [{gain.unit or '1'}] {gain.low:g} to {gain.high:g}" for gain_name, gain in law.gains.items()
    )
    yield LawCheck("gains", True, f"{gains or 'none'}; presets {', '.join(law.presets) or 'none'}")
    cost = step_time(law, tuple(_gains(law)), WristParameters())
    yield LawCheck("time per tick", None, f"{cost.median:.3g} us, 99 % within {cost.p99:.3g} us, on this machine")
    yield _on_board(law, resolved) if on_board else LawCheck("emulated board", None, "not asked")


def _gains(law: Controller) -> Array:
    """Gains of the last preset, which is for the hardest conditions; the middle of the box without presets."""
    presets = list(law.presets.values())
    return np.array(law.values(presets[-1])) if presets else _middle(law)


def _middle(law: Controller) -> Array:
    return np.array([np.sqrt(gain.low * gain.high) for gain in law.gains.values()])


def _restoring(law: Controller) -> LawCheck:
    """At rest, bent to either side of a straight reference: does its torque, less what holds the wrist there, bend it
    back? With every preset, and in the middle of the box, where a law is stiffer than the wrist itself."""
    sides = np.array([_BENT, -_BENT])
    held = _torques(controller("feedforward"), np.zeros(0), theta_ref=sides)
    presets = {name: np.array(law.values(preset)) for name, preset in law.presets.items()}
    presets["middle"] = _middle(law)
    net = {name: _torques(law, gains, theta=sides) - held for name, gains in presets.items()}
    torques = "; ".join(f"{name} {low:.3g}, {high:.3g}" for name, (low, high) in net.items())
    finding = f"at {_BENT:g} and {-_BENT:g} rad, beyond what holds it there [N m]: {torques}"
    return LawCheck("bends the wrist back", all(low < 0.0 < high for low, high in net.values()), finding)


def _torques(law: Controller, gains: Array, **angles: Array) -> Array:
    (sides,) = angles.values()
    signals = np.zeros((len(sides), signals_of(law.preview)))
    signals[:, NOW.index("torque_low")], signals[:, NOW.index("torque_high")] = -2.0, 2.0
    signals[:, NOW.index("period")] = 1e-3
    for name, values in angles.items():
        signals[:, NOW.index(name)] = values
    return call_law(law, signals, np.tile(gains, (len(sides), 1)), times=_SETTLED)


def _on_board(law: Controller, study: Study) -> LawCheck:
    """A short trial on the emulated rig, with the gains of the last preset."""
    gains = dict(zip(law.gains, map(float, _gains(law)), strict=True))
    preset = list(law.presets)[-1] if law.presets else gains
    trial = {
        "rows": (Row(controller=law.name, gains=preset),),
        "directions": ("ulnar",),
        "horizon": 1.5,
        "push": study.hw_run.push.model_copy(update={"force": 0.0}),
    }
    trial_study = study.model_copy(update={"hw_run": study.hw_run.model_copy(update=trial)})
    with tempfile.TemporaryDirectory(prefix="wristctl-check-") as scratch:
        try:
            result = carry_out(HW_RUN, trial_study, {}, Path(scratch), "", None)
        except UserError as error:
            return LawCheck("emulated board", False, f"gains {preset}: {error.what}")
    rmse = float(np.rad2deg(result.frame()["rmse"].iloc[0]))
    return LawCheck("emulated board", True, f"a trial with gains {preset}: RMSE {rmse:.2g} deg")
