"""What of the `simulate` section's loop is looked at, once it is linearised."""

from __future__ import annotations

from typing import Literal

from wristctl.config.section import Section, choice, quantity


class AnalyseSettings(Section):
    """The loop of the `simulate` section, linearised about where it rests."""

    angles_deg: tuple[float, ...] = quantity(
        (), "deg", "resting angles toward the direction; none: straight, half way, and where the reference ends"
    )
    over: str = choice("loop", "what the root locus goes over: loop (its gain), or a gain of the law by its name")
    span: float = quantity(10.0, "", "the root locus goes from 1/span to span times that gain", gt=1, le=1000)
    friction: Literal["slipping", "stuck"] = choice("slipping", "how the friction of elastic tendons is linearised")
