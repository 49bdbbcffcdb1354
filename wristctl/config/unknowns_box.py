"""Unknowns of the paper as a box: a range or named alternatives for each leaf, with the reason."""

import math
from collections.abc import Mapping
from typing import Any, NamedTuple, Self

from pydantic import ValidationError, model_validator

from wristctl.config.families import Drawn, cannot_draw, drawn_value, put_leaf
from wristctl.config.loop import Loop, Reference
from wristctl.config.section import Section, choice, quantity
from wristctl.config.wrist import WristParameters

# Sources of angle and rate for the law: true values, the rate as a difference of angles, or both from the observer.
MEASURED = ("ideal", "differenced", "observer")

_ROOTS = ("wrist", "loop", "reference")
# Unknowns that rollouts of one batch share: every combination of them is drawn as often.
STRATA = ("loop.plant_segments", "loop.control_period", "measured")


class Unstated(Section):
    """One thing that is not given: values of a setting, or alternatives that set several settings; and why so."""

    draw: Drawn | None = None
    one_of: dict[str, dict[str, Any]] | None = choice(None, "alternatives by name, each with its settings")
    unless: dict[str, Any] | None = choice(None, "beside a draw: settings that do without it")
    odds: float = choice(0.0, "share of the settings without it", ge=0, lt=1)
    why: str = choice("", "why this range")

    @model_validator(mode="after")
    def _is_one_of_both(self) -> Self:
        if (self.draw is None) == (not self.one_of):
            raise ValueError("give draw: or one_of:")
        if bool(self.unless) != (self.odds > 0.0) or (self.unless and self.draw is None):
            raise ValueError("unless: stands beside draw: and has odds:")
        return self

    def at(self, share: float) -> tuple[Any, Mapping[str, Any] | None]:
        """Value at a share of [0, 1), and the leaves that an alternative sets."""
        if self.draw is None:
            assert self.one_of
            name = list(self.one_of)[min(int(share * len(self.one_of)), len(self.one_of) - 1)]
            return name, self.one_of[name]
        if share >= 1.0 - self.odds:
            return math.inf, self.unless
        return drawn_value(self.draw, share / (1.0 - self.odds)), None


class PaperSetting(NamedTuple):
    """One point of the box: all that a simulation of the paper has to assume."""

    wrist: WristParameters
    loop: Loop
    reference: Reference
    horizon: float
    measured: str
    values: Mapping[str, Any]
    """Values of the unknowns, by name."""


class Box(Section):
    """The unknowns, how many settings are drawn, and over which horizon they run."""

    unknowns: dict[str, Unstated] = choice({}, "what the paper leaves open; experiments/unknowns.yaml has all")
    draws: int = choice(1008, "settings drawn, each for every controller", ge=8, le=1_000_000)
    continuous: tuple[int, ...] = choice((100, 25), "settings in nearly continuous time: of one segment, of four")
    horizon: float = quantity(6.0, "s", "longest horizon", "assumed", gt=0)

    def setting(self, wrist: WristParameters, shares: Mapping[str, float]) -> PaperSetting:
        """The setting at these shares of each unknown."""
        data: dict[str, dict[str, Any]] = {"wrist": wrist.model_dump(), "loop": {}, "reference": {}, "": {}}
        values = {}
        for name, unknown in self.unknowns.items():
            values[name], leaves = unknown.at(shares[name])
            for leaf, value in ({name: values[name]} if leaves is None else leaves).items():
                root, _, below_root = leaf.partition(".")
                put_leaf(data[root] if root in _ROOTS else data[""], below_root if root in _ROOTS else leaf, value)
        measured, horizon = data[""].pop("measured", "ideal"), data[""].pop("horizon", self.horizon)
        for leaf in data[""]:
            raise cannot_draw(leaf, f"there is no setting {leaf}")
        loop = Loop.model_validate(data["loop"])
        if measured == "observer":  # behind a camera without noise, delay or lost frames
            perfect = {"level": "camera", "delay_frames": 0.0, "noise_deg": 0.0, "dropped": 0.0}
            loop = loop.model_copy(update={"sensor": loop.sensor.model_copy(update=perfect)})
        wrist = WristParameters.model_validate(data["wrist"])
        return PaperSetting(wrist, loop, Reference.model_validate(data["reference"]), horizon, measured, values)

    @model_validator(mode="after")
    def _all_settings_can_be(self) -> Self:
        for key in self.unknowns:
            for share in (0.0, 1.0 - 1e-12):
                try:
                    setting = self.setting(WristParameters(), dict.fromkeys(self.unknowns, 0.5) | {key: share})
                except ValidationError as error:
                    why = error.errors()[0]
                    leaf, missing = ".".join(map(str, why["loc"])), why["type"] == "extra_forbidden"
                    reason = f"there is no setting {leaf}" if missing else f"{leaf}: {why['msg']}"
                    raise cannot_draw(key, reason) from error
                if setting.measured not in MEASURED or setting.horizon > self.horizon:
                    choices = ", ".join(MEASURED)
                    raise cannot_draw(key, f"measured is one of {choices}, and horizon at most {self.horizon:g} s")
        return self
