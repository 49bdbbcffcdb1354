"""A robot of one's own as `recommend` draws it: its facts as they are believed, and ranges that some are drawn from.

What a fact has as a number is known; a `Spread` is drawn from its range, all of them together. What the facts do not
speak of, as friction and the springs, is drawn as for any rig.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from functools import cache
from typing import Any, NamedTuple

from wristctl.commands.recommend.study_file import own_rig, trial_of
from wristctl.config.choices import RIGS
from wristctl.config.families import Drawn, Family
from wristctl.config.hw_run import HwRunSettings
from wristctl.config.loop import Loop
from wristctl.config.recommend import RecommendSettings
from wristctl.config.study import Study
from wristctl.rig import Drive, Facts, Quantity, Spread, value
from wristctl.trial.experiment import spared
from wristctl.trial.rig_belief import layout_of_rig
from wristctl.trial.rig_settings import check_facts, settings_of, wrist_of
from wristctl.trial.trial_results import in_pairs

# Rigs whose facts are drawn; of these each simulated rig has one.
_ROWS = 32
_STIFFNESS = "plant.actuator.tendon_stiffness"
# What is drawn of any rig, and is a fact of this one.
_OF_FACTS = "plant.sensor.delay_frames", "plant.sensor.noise_deg"


class Spoken(NamedTuple):
    """A fact, in words and as it is drawn."""

    name: str
    quantity: Quantity
    unit: str
    size: float
    """Of the unit, in SI; 1 of a fact that is in it."""

    def __str__(self) -> str:
        """Its name with its value or range."""
        if isinstance(self.quantity, Spread):
            numbers = f"{self.quantity.low / self.size:.3g} to {self.quantity.high / self.size:.3g}"
        else:
            numbers = f"{self.quantity / self.size:.3g}"
        return f"{self.name} {numbers} {self.unit}"


def _spoken(facts: Facts) -> dict[str, Spoken]:
    """The facts that are believed, or drawn, of a rig."""
    drive, sensor = facts.drive, facts.sensor
    return {
        "delay": Spoken("drive delay", drive.delay, "ms", 1e-3),
        "lag": Spoken("lag", drive.lag, "ms", 1e-3),
        "resolution": Spoken("resolution", drive.resolution, "mm", 1e-3),
        "backlash": Spoken("backlash", drive.backlash, "mm", 1e-3),
        "stiffness": Spoken("tendon stiffness", drive.stiffness, "kN/m", 1e3),
        "rate": Spoken("sensor rate", sensor.rate, "1/s", 1.0),
        "age": Spoken("sensor delay", sensor.delay, "ms", 1e-3),
        "noise": Spoken("noise", sensor.noise_deg, "deg", 1.0),
    }


def _facts(study: Study) -> tuple[Facts, str]:
    """Facts of the study's rig, and its name. Raises UserError where they cannot be."""
    name = study.recommend.rig
    assert name is not None
    return check_facts(getattr(RIGS[name], "facts", None), name), name


def _trials(study: Study) -> HwRunSettings:
    """Settings of `hw-run` on this rig."""
    facts, name = _facts(study)
    return settings_of(facts, study.hw_run.model_copy(update={"rig": name}), name)


def with_facts(study: Study) -> Study:
    """The study with its rig's tendons, wrist, motors and sensor, where nobody gave others, and what is drawn of it.

    Raises UserError where the facts cannot be, or do not fit what was given.
    """
    facts, name = _facts(study)
    wrist = wrist_of(facts, study.wrist, name)
    settings, known = study.recommend, _trials(study).known_loop
    usual = RecommendSettings.model_fields["loop"].default
    changed: dict[str, Any] = {"planes": facts.planes}
    for section in ("actuator", "sensor"):
        given, default = getattr(settings.loop, section), getattr(usual, section)
        others = {key: entry for key, entry in given if entry != getattr(default, key)}
        changed[section] = getattr(known, section).model_copy(update=others)
    if settings.loop.control_period == usual.control_period:
        changed["control_period"] = known.control_period
    loop = settings.loop.model_copy(update=changed)
    draw = settings.draw if "draw" in settings.model_fields_set else drawn_by_facts(facts)
    return study.model_copy(
        update={"wrist": wrist, "recommend": settings.model_copy(update={"loop": loop, "draw": draw})}
    )


def drawn_by_facts(facts: Facts) -> dict[str, Drawn]:
    """What is drawn of any rig, but for what the facts of this one say."""
    draw = {key: drawn for key, drawn in RecommendSettings().draw.items() if key not in _OF_FACTS}
    stiffness = facts.drive.stiffness
    if isinstance(stiffness, Spread) and stiffness.low < stiffness.high:
        draw[_STIFFNESS] = f"x{stiffness.low / stiffness.value:.6g}..{stiffness.high / stiffness.value:.6g}"
    elif stiffness != Drive().stiffness:
        draw.pop(_STIFFNESS)
    return draw


def narrowed(study: Study, told: Collection[str] | None) -> Study:
    """The study of an identified wrist, whose rigs differ by what the `told` settings leave open; None: all."""
    settings = study.recommend
    own = {} if settings.rig is None else {"usual": drawn_by_facts(_facts(study)[0])}
    return study.model_copy(update={"recommend": settings.measured(told, **own)})


def on_the_rig(study: Study) -> Study:
    """The study as `hw-run` simulates its trials; one that is simulated alone as it is.

    Tensions stay below what the motors hold. On a robot of one's own models in one plane have two tendons on either
    side, in place of as many as it has.
    """
    if study.recommend.rig is None:
        on_the_board = own_rig(study) is None and trial_of(study) == "hw-run"
        return study.model_copy(update={"wrist": spared(study.wrist, study.hw_run)}) if on_the_board else study
    trials, settings = _trials(study), study.recommend
    wrist, loop = spared(study.wrist, trials), settings.loop
    layout = layout_of_rig(trials, wrist)
    if layout is not None and trials.planes == 1:
        wrist, loop = in_pairs(wrist, layout, loop)
    return study.model_copy(update={"wrist": wrist, "recommend": settings.model_copy(update={"loop": loop})})


def drawn_of_facts(study: Study, family: Family) -> Family:
    """The family with the facts of its rigs drawn together, but for what the study draws itself."""
    facts, _ = _facts(study)
    rows = _rows(study, facts)
    together = tuple(
        row for row in ({key: entry for key, entry in row.items() if key not in family.draw} for row in rows) if row
    )
    return family.model_copy(update={"together": together})


def _rows(study: Study, facts: Facts) -> list[dict[str, float]]:
    """Facts of so many rigs, evenly from all ranges, as leaves of a loop; none where nothing is to be drawn."""
    quantities = {name: fact.quantity for name, fact in _spoken(facts).items() if name != "stiffness"}
    spreads = {name: quantity for name, quantity in quantities.items() if isinstance(quantity, Spread)}
    known = {name: float(quantity) for name, quantity in quantities.items() if not isinstance(quantity, Spread)}
    rows = []
    for shares in _even(len(spreads)) if spreads else [()]:
        drawn = {
            name: q.low + share * (q.high - q.low) for (name, q), share in zip(spreads.items(), shares, strict=True)
        }
        rows.append(_row(drawn, known, facts, study.recommend.loop))
    return rows


# Leaves of a loop that a fact is as it stands; resolution is what the controller believes, too.
_LEAVES = {
    "lag": "plant.actuator.lag", "resolution": "actuator.resolution", "noise": "plant.sensor.noise_deg",
}  # fmt: skip


def _row(drawn: Mapping[str, float], known: Mapping[str, float], facts: Facts, loop: Loop) -> dict[str, float]:
    """One rig's facts as leaves of the loop; the rate is what the controller believes, too."""
    at, row = {**known, **drawn}, {leaf: drawn[name] for name, leaf in _LEAVES.items() if name in drawn}
    if at["backlash"]:
        row["plant.actuator.backlash"] = at["backlash"]
    if "delay" in drawn:
        row["plant.actuator.command_delay"] = min(0.1, at["delay"])
    rate = loop.sensor.frame_rate
    if "rate" in drawn:
        row["sensor.frame_rate"] = rate = min(at["rate"], 1.0 / loop.control_period)
    if drawn.keys() & {"rate", "age"}:
        row["sensor.delay_frames"] = min(20.0, value(facts.sensor.delay) * rate)
        row["plant.sensor.delay_frames"] = min(20.0, at["age"] * rate)
    return row


@cache
def _even(count: int) -> tuple[tuple[float, ...], ...]:
    """Shares in [0, 1) of so many ranges, evenly spread (Halton)."""
    from scipy.stats.qmc import Halton

    return tuple(tuple(row) for row in Halton(count, scramble=False).random(_ROWS + 1)[1:].tolist())


def said_of_facts(study: Study) -> str:
    """Which facts are believed of a rig, and which are drawn, in two sentences."""
    facts, name = _facts(study)
    spoken = _spoken(facts)
    drawn = [str(fact) for fact in spoken.values() if isinstance(fact.quantity, Spread)]
    fixed = [str(fact) for key, fact in spoken.items() if not isinstance(fact.quantity, Spread) and _counts(key, facts)]
    counts = f"{len(facts.tendons)} tendons of up to {facts.limits.tension:g} N in {facts.planes} plane"
    words = f"From the facts of {name}: {counts}{'s' * (facts.planes == 2)}, {', '.join(fixed)}."
    if drawn:
        return f"{words} Drawn from their ranges: {', '.join(drawn)}."
    return f"{words} No fact is a Spread: the simulated rigs have them all as they are."


def _counts(key: str, facts: Facts) -> bool:
    """Whether a fact that is a number is worth a word: it is not at the default that stands for none."""
    return key in ("rate", "age", "noise") or getattr(facts.drive, key) != getattr(Drive(), key)
