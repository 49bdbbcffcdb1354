"""The answer of an identification: parameters with intervals and units, or what the trials do not tell."""

from __future__ import annotations

import math
import shlex
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from wristctl.commands.answer import Answer
from wristctl.commands.printed_table import Table, degrees, joined, number

if TYPE_CHECKING:
    from wristctl.identification.arc_fit import Told
    from wristctl.identification.fit import Fit
    from wristctl.identification.identifiability import Addition
    from wristctl.identification.intervals import Knowledge
    from wristctl.identification.lack_of_fit import Suspicion


# What the log of a robot of one's own does not say.
_OWN = " (on a robot of your own also --rig my_rig.py:RIG)"


def recommendation_for(run: str, known: str) -> str:
    """Command that finds gains for the wrist that a run found, of a study file with what was known of it."""
    return shlex.join(["wristctl", "recommend", known, "--from-identified", run])


def recommendation_by_ratios(run: str, scaled: bool) -> list[str]:
    """What is next after a log that tells ratios; `scaled`: it tells the stiffness too, which else has to be given."""
    command = recommendation_for(run, f"{run}/config.yaml")
    if scaled:
        return [f"Next, find its gains{_OWN}:", f"$ {command}"]
    return [
        f"Next, find its gains{_OWN}; VALUE is its bending stiffness in N m/rad, measured or known:",
        f"$ {command} --set wrist.stiffness=VALUE",
    ]


# Delay [s] below which a fit has ended at none, the least that it looks for.
_NO_DELAY = 1e-4


def bound_of_delay(told: Mapping[str, Told]) -> list[str]:
    """A sentence where the delay is at the bound of the search: none, or a negative one that no wrist has."""
    delay = told.get("delay")
    if delay is None or not delay.known or delay.value > _NO_DELAY:
        return []
    return [
        "The delay is at its lower bound, 0, and its interval is worth no more: unless bends are read at once, they "
        "are dated too early or the motors too late, and other parameters make up for it. See to the clocks first."
    ]


def simulation_of(run: str, known: str) -> str:
    """Command that simulates the wrist that a run found, of a study file with what was known of it."""
    return shlex.join(["wristctl", "simulate", known, "--from-identified", run])


def comparison_on(run: str) -> str:
    """Command that compares controllers on the wrists that a run leaves possible."""
    return shlex.join(["wristctl", "compare", f"{run}/data/posterior.yaml", "--set", "worlds.family=posterior"])


def found_answer(fit: Fit, knowledge: Knowledge, suspected: Sequence[Suspicion], run: str, known: str) -> Answer:
    """What was found; `run` is the path of its run, empty in memory, `known` a study file with the wrist's geometry."""
    trials, frames = len(fit.problem.trials), sum(map(len, fit.residuals))
    count = len(fit.problem.free)
    sentence = (
        f"{count} parameter{'s' * (count > 1)} identified from {trials} trial{'s' * (trials > 1)} ({frames} frames). "
        f"The model leaves over {degrees(float(fit.noise))} deg of the marker's angle (standard deviation)."
    )
    notes = [*_misses(knowledge, suspected)]
    if run:
        notes += [
            "Next, find its gains, simulate it, or compare controllers on all that the trials leave possible:",
            f"$ {recommendation_for(run, known)}",
            f"$ {simulation_of(run, known)}",
            f"$ {comparison_on(run)}",
        ]
    more = f"All tables: --all. Study file: {run}/data/identified.yaml" if run else ""
    return Answer(sentence, parameter_table(fit, knowledge, {}), notes, more)


def refused_answer(
    fit: Fit, knowledge: Knowledge, lacking: Mapping[str, float], suspected: Sequence[Suspicion],
    offered: Sequence[Addition], runs: Sequence[str] = (),
) -> Answer:  # fmt: skip
    """What the trials do not tell, how well each is told, and the commands that record the rest.

    `runs` are the paths of the runs that were identified; the first one's study is that of the trials to come.
    """
    more = "All tables are in the run's README.md."
    if not lacking:
        sentence = "Nothing to rely on: the model does not fit these trials."
        return Answer(sentence, parameter_table(fit, knowledge, lacking), _misses(knowledge, suspected), more)
    from wristctl.identification.identifiability import widest, width_text, worst

    settings, free = fit.problem.settings, fit.problem.free
    halves = {name: float(knowledge.half_widths[index]) for index, name in enumerate(free)}
    wide = [name for name in lacking if halves[name] > widest(name, settings)]
    if wide:
        sentence = f"Nothing to rely on: these trials do not tell {joined(wide)} well enough"
        sentence += ", nor the others beside them." if len(lacking) > len(wide) else "."
    else:
        sentence = f"Nothing to rely on: of {joined(list(lacking))} these trials tell a mixture, none by itself."
    best = next((each for each in offered if each.enough), min(offered, key=worst, default=None))
    heads = ["parameter", "told to within", "asked for", *["with more trials"] * (best is not None)]
    asked = {name: widest(name, settings) for name in lacking}
    rows = [
        (
            name,
            width_text(name, halves[name]),
            width_text(name, asked[name]) if math.isfinite(asked[name]) else "-",
            *([width_text(name, best.half_widths[name])] if best else []),
        )
        for name in lacking
    ]
    notes: list[str | Table] = [*_misses(knowledge, suspected)]
    if best is not None:
        notes.append(f"More trials: {best.what}{'' if best.enough else ', several times'}.")
    if runs:
        mass = fit.problem.trials[0].wrist.hand_mass
        lighter = mass - 0.2 if mass > 0.25 else mass + 0.2
        study = f"{runs[0]}/config.yaml"
        typed = [
            ["hw-run", study, "identify", "--label", "hand"],
            ["hw-run", study, "identify", "--label", "other-hand", "--set", f"wrist.hand_mass={lighter:.3g}"],
            ["identify", *runs, "latest:hw-run:hand", "latest:hw-run:other-hand"],
        ]
        notes += [
            f"Quick steps tell damping from delay, and a second known mass, here {lighter:.3g} kg, tells springs from "
            "tendons. Record both, then identify all together:",
            *(f"$ {shlex.join(['wristctl', *words])}" for words in typed),
        ]
    return Answer(sentence, Table("", tuple(heads), rows), notes, more)


def parameter_table(fit: Fit, knowledge: Knowledge, lacking: Mapping[str, float]) -> Table:
    """Parameters with their 95 % intervals; a dash where the trials do not tell."""
    from wristctl.commands.identify.tables import parameter_rows

    rows = []
    for name, value, low, high, unit, believed, verdict in parameter_rows(fit, knowledge, lacking):
        if verdict == "not identified":
            value_text, interval_text = "-", "-"
        else:
            value_text = number(value)
            interval_text = "fixed" if verdict == "fixed" else f"{number(low)} to {number(high)}"
        remark = "no better known than assumed" if verdict == "as assumed" else ""
        rows.append((name, value_text, interval_text, unit, number(believed), remark))
    return Table("", ("parameter", "value", "95 % interval", "unit", "in the first run's study", ""), rows)


def _misses(knowledge: Knowledge, suspected: Sequence[Suspicion]) -> list[str]:
    """Signs that the model lacks something, for which the intervals are widened."""
    lines = [
        f"The trials look like {suspicion.told}, which the model has not."
        for suspicion in suspected
        if suspicion.evident
    ]
    if knowledge.misses_something:
        lines.append("Neighbouring residuals are alike, so the model misses something.")
    return [f"{' '.join(lines)} The intervals are widened for it."] if lines else []
