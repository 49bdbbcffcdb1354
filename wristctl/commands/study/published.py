"""Gains that a study publishes: of each controller those of its median tuning, with what they were found for."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import cache
from typing import TYPE_CHECKING, Any

from wristctl.commands.study.units import BASE, StudyPlace
from wristctl.config.families import Family, Range

if TYPE_CHECKING:
    from wristctl.comparison.tuned_ranking import TunedRanking
    from wristctl.tuning.search import Search

# File of a run with all that is published; `python docs/published_gains.py RUN` ships it.
PUBLISHED = "data/published.json"
_STIFFNESS = "actuator.tendon_stiffness"


def published_gains(ranking: TunedRanking, searches: Mapping[StudyPlace, Search]) -> dict[str, dict[str, float]]:
    """Gains of the median tuning of each controller on a family, by controller."""
    numbers = dict(zip(ranking.labels, ranking.published, strict=True))
    return {
        place.law: search.gains
        for place, search in searches.items()
        if (place.variant, place.family) == (BASE, ranking.name) and place.tuning == numbers.get(place.label)
    }


def published(ranking: TunedRanking, searches: Mapping[StudyPlace, Search]) -> dict[str, Any]:
    """What is published of a family: its conditions, and of each controller gains, errors [rad] and lost worlds.

    An interval that the tunings do not tell has no ends.
    """
    controllers = {}
    for law, gains in published_gains(ranking, searches).items():
        row = ranking.labels.index(f"{law}/tuned")
        mean, (least, largest) = ranking.means[row], ranking.spreads[row]
        ends = (mean.low, mean.high) if math.isfinite(mean.high) else (None, None)
        controllers[law] = {
            "gains": gains,
            "rmse": ranking.published_error(row),
            "rmse_low": ends[0],
            "rmse_high": ends[1],
            "tunings": [least, largest],
            "lost": ranking.standing.lost[row].times,
            "reliable": row not in ranking.standing.unusable,
        }
    family = ranking.family
    return {
        "about": family.about,
        "conditions": conditions(family),
        "family_sha256": family.settings_hash(),
        "drive": drive_version(family),
        "worlds": ranking.count,
        "controllers": controllers,
    }


def drive_version(family: Family) -> int | None:
    """Version of the simulated drive that a family's motors are; None where it has none."""
    from wristctl.simulation.simulated_drives import DRIVE

    return None if family.loop.actuator.level == "ideal" else DRIVE


def what_changed(name: str, family_sha256: str, drive: int | None) -> str:
    """What has changed since gains were found on a family with this hash and drive, in words; empty where nothing has.

    The present family is the shipped experiment of this name.
    """
    present = _shipped_family(name)
    if present is None:
        return f"the family {name} on which these gains were found is shipped no more"
    changed = [f"the family {name}"] * (present.settings_hash() != family_sha256)
    changed += ["the simulated drive"] * (drive_version(present) != drive)
    have = "have" if len(changed) > 1 else "has"
    return f"{' and '.join(changed)} {have} changed since these gains were found" if changed else ""


@cache
def _shipped_family(name: str) -> Family | None:
    from wristctl.study_files.load import load_study
    from wristctl.study_files.shipped import shipped

    file = shipped() / "scenarios" / f"{name}.yaml"
    return load_study([file]).families.get(name) if file.is_file() else None


def conditions(family: Family) -> dict[str, list[float]] | None:
    """Periods [s] and believed stiffness of a tendon [N/m] of a family with motors, tendons and a camera; else None."""
    loop = family.loop
    if loop.actuator.level != "tendon" or loop.sensor.level != "camera":
        return None
    drawn = family.draw.get(_STIFFNESS)
    stiffness = Range.read(drawn)[:2] if isinstance(drawn, str) else (loop.actuator.tendon_stiffness,) * 2
    return {"period": [loop.control_period] * 2, "tendon_stiffness": list(stiffness)}
