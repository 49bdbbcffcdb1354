"""What drifts from run to run of one rig: springs, tendons, pulleys, markers, by what each sealed run has measured.

Integral action makes up for a spring that softens or a pulley that wears, so that errors do not show it. What the
loop needs for it does: the load that the observer finds, the way of the spools, and what homing measures.
"""

import math
from collections.abc import Mapping, Sequence
from datetime import datetime
from typing import NamedTuple

import numpy as np
import pandas as pd
from pydantic import BaseModel
from scipy import stats

from wristctl.arrays import Array
from wristctl.config.hw_run import RigSettings
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.identification.unknowns import UNKNOWNS
from wristctl.records import Run
from wristctl.records.find import a_run
from wristctl.records.index import dated
from wristctl.trial.spools import on_plus_side
from wristctl.wrist.directions import ACTIVE, DIRECTIONS

KINDS = ("hw-run", "calibrate-wrist", "identify")
FEWEST = 3
"""Runs without which a drift has no interval."""
# Probability that a set of runs without any drift is said to have one.
FALSE_ALARM = 0.05
# Seconds at rest before a reading, least angle [rad] of the reference for one, and least number of its ticks.
_SETTLED, _BENT, _TICKS = 0.4, math.radians(5.0), 10


class Quantity(NamedTuple):
    """What is followed over runs."""

    unit: str
    size: float
    """Of the unit, in SI."""
    causes: str


class Reading(NamedTuple):
    """What one run has measured of its rig, in the units of the quantities."""

    run: str
    time: float
    """When the rig moved [s since 1970]."""
    values: Mapping[str, float]


class Trend(NamedTuple):
    """Straight line through a quantity's values."""

    name: str
    unit: str
    places: Array
    """Of the values: number of the run from 0, or days from the first one."""
    values: Array
    slope: float
    low: float
    high: float
    """Ends of the slope's 95 % interval."""
    drifts: bool
    """Whether it exceeds the scatter, with FALSE_ALARM for all quantities together."""

    @property
    def change(self) -> float:
        """By the line, from the first value to the last."""
        return self.slope * float(np.ptp(self.places))

    @property
    def share(self) -> float:
        """The change over the mean's size; nan where that is zero."""
        mean = abs(float(self.values.mean()))
        return self.change / mean if mean > 0.0 else math.nan


_SPRINGS = "springs that soften, or a pulley or tendon path that changes (see steps per radian)"
_WAY = "a worn pulley or tendon path, tendons that climb on the spool; springs hardly change it"
_SEEN = "the wrist's rest angle (springs set), a flag or the camera has moved"
_SLACK = "this tendon creeps or slips at its end, where motors stand from run to run; else how it was slackened"


def quantity_of(name: str) -> Quantity:
    """Unit and likely causes of a quantity of `reading_of`."""
    head, _, rest = name.partition(", ")
    if rest == "identified":
        return Quantity(UNKNOWNS[head].unit, 1.0, "see the run's intervals: wristctl runs show")
    return _QUANTITIES[" ".join(head.split(" ")[:-1]) if head.startswith("slack") else head]


_QUANTITIES = {
    "stiffness": Quantity("N m/rad", 1.0, _SPRINGS),
    "steps per radian": Quantity("1/rad", 1.0, _WAY),
    "following error": Quantity("deg", math.radians(1.0), "tendons, springs or pulleys other than believed"),
    "steps per radian at homing": Quantity("1/rad", 1.0, _WAY),
    "slack of tendon": Quantity("mm", 1e-3, _SLACK),
    "friction at homing": Quantity("mm", 1e-3, "sheaths or tendons that wear or want cleaning"),
    "marker's zero": Quantity("deg", math.radians(1.0), _SEEN),
}


def reading_of(run: Run) -> Reading:
    """What a run has measured. Raises UserError of runs that measure no rig."""
    values: dict[str, float]
    if run.kind == "hw-run":
        values = {**_at_rest(run), **_homed(run, "data/zero.json")}
        if (apart := run.metrics.get("greatest_apart")) is not None and apart["value"] is not None:
            values["following error"] = float(apart["value"])
    elif run.kind == "calibrate-wrist":
        values = _homed(run, "data/wrist.json")
    elif run.kind == "identify":
        values = {
            f"{name}, identified": float(metric["value"])
            for name, metric in run.metrics.items()
            if name in UNKNOWNS and metric["value"] is not None
        }
    else:
        raise UserError(f"{a_run(run.kind)} measures no rig", str(run.path), f"runs of {', '.join(KINDS)}")
    return Reading(run.id, _moved(run), {name: value / quantity_of(name).size for name, value in values.items()})


def _moved(run: Run) -> float:
    """When the rig moved: of what was identified, when the trials were run."""
    trials = [dated(record.run) for record in run.manifest.inputs if record.kind == "hw-run"]
    latest = max(trials, default="") if run.kind == "identify" else ""
    return datetime.fromisoformat(latest or run.manifest.timing.started).timestamp()


def _homed(run: Run, name: str) -> dict[str, float]:
    """Slack, friction, steps per radian and marker's zero that homing has found; nothing where it found none."""
    if not run.has(name):
        return {}
    zero = run.json(name)
    numbers = range(1, 1 + len(zero["slack"])) if "targets" in zero else ACTIVE  # of a rig of one's own, of a board
    slack = {f"slack of tendon {tendon}": float(value) for tendon, value in zip(numbers, zero["slack"], strict=True)}
    means = {"steps per radian at homing": float(np.mean(zero["steps_per_radian"]))}
    if "friction" in zero:  # which runs of version 0.1.0 have not
        means["friction at homing"] = float(np.mean(zero["friction"]))
    return {**slack, **means, "marker's zero": float(zero["marker"])}


def _at_rest(run: Run) -> dict[str, float]:
    """Stiffness, and spool steps per radian, of each plane, by where trials without a push come to rest.

    At rest a torque tau bends the wrist by tau = K theta, and the observer, which believes K_b, finds the load
    (K_b - K) theta. Means over directions, so that a constant load cancels between both sides of a plane. Nothing of
    trials in two planes, and of other tendons than a board winds.
    """
    log, trials = run.data("log"), run.data("trials")
    spools_of_board = [f"position_{tendon}" for tendon in ACTIVE]
    if "theta" not in log or [name for name in map(str, log) if name.startswith("position_")] != spools_of_board:
        return {}
    sound = trials[(trials["outcome"] == "ok") & (trials["push"] == 0.0)]
    believed = run.config.wrist
    found = []
    for trial, name in zip(sound["trial"], sound["direction"], strict=True):
        if (rest := _rest(log[log["trial"] == trial])) is not None:
            plane, theta = DIRECTIONS[name].plane, float(rest["theta"].mean())
            spools = rest[spools_of_board].mean().to_numpy(float)
            plus = on_plus_side(plane)
            way = 0.5 * (spools[plus].mean() - spools[~plus].mean())
            stiff = believed.stiffness * (believed.flexion_ratio if plane == "flexion" else 1.0)
            found.append((plane, name, stiff - float(rest["load"].mean()) / theta, way / theta))
    table = pd.DataFrame(found, columns=["plane", "direction", "stiffness", "steps per radian"])
    means = table.groupby(["plane", "direction"]).mean().groupby("plane").mean()
    return {f"{name}, {plane}": float(row[name]) for plane, row in means.iterrows() for name in means.columns}


def _rest(ticks: pd.DataFrame) -> pd.DataFrame | None:
    """The last rest of a trial, once it has settled; None where there is none away from zero."""
    moving = ticks["time"][ticks["rate_ref"].abs() > 1e-9]
    settled = ticks[ticks["time"] > (float(moving.iloc[-1]) if len(moving) else 0.0) + _SETTLED]
    bent = settled[settled["theta_ref"].abs() > _BENT]
    return bent if len(bent) >= _TICKS else None


def check_one_rig(runs: Sequence[Run]) -> None:
    """Raise UserError where runs are not of one rig, by the settings that readings depend on: which are of which."""
    rigs: list[tuple[dict[str, object], list[str]]] = []
    for run in runs:
        if (rig := _rig(run)) is not None:
            alike = next((names for known, names in rigs if known == rig), None)
            if alike is None:
                rigs.append((rig, [run.id]))
            else:
                alike.append(run.id)
    if len(rigs) < 2:
        return
    leaves = [_leaves(rig) for rig, _ in rigs]
    differ = [name for name in leaves[0] if any(one.get(name) != leaves[0][name] for one in leaves[1:])]
    listed = []
    for one, (_, names) in zip(leaves, rigs, strict=True):
        told = [f"{name} {one.get(name)}" for name in differ[:_TOLD]] + ["..."] * (len(differ) > _TOLD)
        more = f" and {len(names) - _TOLD} more" * (len(names) > _TOLD)
        listed.append(f"of {', '.join(told)}: {', '.join(names[:_TOLD])}{more}")
    most = max((names for _, names in rigs), key=len)
    fix = f"name the runs of one rig, for example: wristctl runs trend {' '.join(most)}"
    raise UserError(f"these runs are of {len(rigs)} rigs", "; ".join(listed), fix)


# Settings that differ between rigs, and runs of each rig, that an error names.
_TOLD = 3


def _leaves(rig: Mapping[str, object]) -> dict[str, object]:
    """What a rig is by dotted key; a list is one value."""
    values = {name: part.model_dump() if isinstance(part, BaseModel) else part for name, part in rig.items()}
    found: dict[str, object] = {}
    for name, value in values.items():
        inner = {f"{name}.{key}": each for key, each in value.items()} if isinstance(value, dict) else {name: value}
        found |= _leaves(inner) if isinstance(value, dict) else inner
    return found


def _rig(run: Run) -> dict[str, object] | None:
    study = run.config
    settings: RigSettings | None = {"hw-run": study.hw_run, "calibrate-wrist": study.calibrate_wrist}.get(run.kind)
    if settings is None:
        return None
    wrist: WristParameters = study.wrist
    emulated = "emulated" if settings.port is None else "real"
    return {"kind of rig": emulated, "wrist": wrist, "actuator": settings.actuator, "markers": settings.markers}


def trends_of(readings: Sequence[Reading], per_day: bool = False) -> list[Trend]:
    """Lines through every quantity that enough readings have, over runs in order of time or over days.

    A drift is one whose slope differs from zero, by Holm's procedure over all quantities. Values are taken to scatter
    independently and evenly about their line. Raises UserError of fewer than FEWEST readings.
    """
    ordered = sorted(readings, key=lambda reading: reading.time)
    names = list(dict.fromkeys(name for reading in ordered for name in reading.values))
    series = {name: [reading for reading in ordered if name in reading.values] for name in names}
    series = {name: several for name, several in series.items() if len(several) >= FEWEST}
    if not series:
        count = len(ordered)
        problem = f"{count} run{'s' * (count != 1)}: a drift with its interval takes {FEWEST} that measure the same"
        raise UserError(problem, fix="name more runs of the rig: hw-run, calibrate-wrist or identify")
    lines = []
    for name, several in series.items():
        days = np.array([(reading.time - several[0].time) / 86400.0 for reading in several])
        places = days if per_day else np.arange(len(several), dtype=float)
        if not np.ptp(places) > 0.0:
            raise UserError("runs of one moment have no drift per day", fix="leave out --per day")
        lines.append(_line(name, places, np.array([reading.values[name] for reading in several])))
    order = sorted(range(len(lines)), key=lambda k: lines[k][1])
    trends, sure = [line for line, _ in lines], True
    for rank, k in enumerate(order):
        sure = sure and lines[k][1] < FALSE_ALARM / (len(lines) - rank)
        trends[k] = trends[k]._replace(drifts=sure)
    return trends


def _line(name: str, places: Array, values: Array) -> tuple[Trend, float]:
    """A quantity's line, and the probability of such a slope without a drift."""
    unit = quantity_of(name).unit
    if not np.ptp(values) > 0.0:
        return Trend(name, unit, places, values, 0.0, 0.0, 0.0, False), 1.0
    fitted = stats.linregress(places, values)
    half = float(stats.t.ppf(0.975, len(values) - 2)) * float(fitted.stderr)
    slope = float(fitted.slope)
    return Trend(name, unit, places, values, slope, slope - half, slope + half, False), float(fitted.pvalue)
