"""What rollouts cost here, by controller and world, and what a cluster adds: `python docs/cost.py` writes docs/cost.md.

Processor time of this process and its threads, which a busy machine changes little; the best of three.
"""

from __future__ import annotations

import platform
import sys
import textwrap
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import numpy as np

from wristctl.commands.inputs import Inputs
from wristctl.commands.printed_table import joined
from wristctl.commands.study.command import plan
from wristctl.commands.study.units import search_units
from wristctl.comparison.world_ranking import RANKED
from wristctl.config.study import Study
from wristctl.control.shipped_gains import PREFIX, shipped_gains
from wristctl.control.table import CONTROLLERS, controller
from wristctl.processes import cores
from wristctl.simulation.cases import Case, measure
from wristctl.simulation.drawn_worlds import drawn_cases
from wristctl.study_files.load import load_study
from wristctl.work.executors import Workers

HERE = Path(__file__).parent
WORLDS, ROWS, TRIES, CORES = 40, 4, 3, cores()
MANY = 1e9
SLEEPS, TAKES = 40, 0.25
"""Units without work, and the seconds that each takes."""


def cost(law: str, family: str, cases: list[Case], study: Study) -> float:
    """Seconds of one core for a rollout of a controller with the gains shipped for a family, as a study measures it.

    With gains that chatter it takes many times that: it is repeated with shorter steps until its numbers settle.
    """
    chosen = controller(law)
    values = shipped_gains(law, f"{PREFIX}{family}").gains if chosen.gains else {}
    gains = np.array([chosen.values(values)] * ROWS)
    measure(chosen, gains[:1], cases[:20], study.wrist, RANKED)
    return min(_processor(lambda: measure(chosen, gains, cases, study.wrist, RANKED)) for _ in range(TRIES)) / (
        ROWS * len(cases)
    )


def _processor(work: Callable[[], object]) -> float:
    begun = time.process_time()
    work()
    return time.process_time() - begun


def overheads() -> dict[str, float]:
    """Seconds that an executor adds to a unit, on one worker: of units that wait, the rest of what they take."""
    sys.path.append(str(HERE.parent / "benchmarks"))
    from scaling import a_second, ends, help_workers_find_this, on_dask

    def added(workers: Workers) -> float:
        return 1.0 / a_second(ends(workers, SLEEPS, TAKES)) - TAKES

    help_workers_find_this()
    found = {named: added(Workers.of(named)) for named in ("serial", "processes:1")}
    with suppress(ImportError), on_dask(1) as workers:
        found["Dask, one worker"] = added(workers)
    return found


def main() -> None:
    """Measure, and write the page."""
    study = load_study([HERE.parent / "experiments" / "fair_study.yaml"], ["study.budget=full"])
    families = study.study.families
    laws = [name for name in CONTROLLERS if name == "feedforward" or name in study.study.laws]
    known = {each: drawn_cases(study.families[each], each, "test", 0, WORLDS, study.wrist) for each in families}
    costs = {family: {law: cost(law, family, cases, study) for law in laws} for family, cases in known.items()}
    lines = [f"| controller | {' | '.join(families)} |", f"| --- |{' --- |' * len(families)}"]
    for law in laws:
        lines.append(f"| {law} | {' | '.join(f'{1.0 / costs[family][law]:.0f}' for family in families)} |")
    means = {family: float(np.mean(list(own.values()))) for family, own in costs.items()}
    lines.append(f"| mean | {' | '.join(f'{1.0 / means[family]:.0f}' for family in families)} |")
    added = overheads()
    unit = 8000 * means["camera"]
    dearest = max(added.values())
    many = [
        f"| {family} | {MANY * each / 3600.0:.0f} | {MANY * each / 3600.0 / CORES / 24.0:.1f} "
        f"| {MANY * each / 3600.0 / 1000.0 * (1.0 + dearest / unit):.2g} |"
        for family, each in means.items()
    ]
    page = _begin(study) + lines + _MANY + many + _over(added, unit) + _study(study, costs)
    (HERE / "cost.md").write_text("\n".join(page).rstrip() + "\n")


def _over(added: dict[str, float], unit: float) -> list[str]:
    rows = [f"| {named} | {1e3 * each:.1f} | {100.0 * each / unit:.2g} |" for named, each in added.items()]
    return [
        "", "## What an executor adds", "",
        f"To a unit of work, measured on {SLEEPS} units that only wait, the file written and synced included; beside a",
        f"unit of tests on `camera`, 8,000 rollouts or {unit:.1f} s of one core.", "",
        "| executor | ms a unit | % of a unit |", "| --- | --- | --- |", *rows,
    ]  # fmt: skip


def _study(study: Study, costs: dict[str, dict[str, float]]) -> list[str]:
    """What the full study takes, from the costs measured above."""
    from wristctl.comparison.world_ranking import noises_of

    budget = study.study.budgets["full"]
    searched = sum(unit.size * costs[at.family][at.law] for at, unit in search_units(study).items())
    judged = 0.0
    for family in study.study.families:
        known = study.families[family]
        each = len(known.references) * noises_of(known, budget.noises) * budget.worlds
        laws = [*study.study.laws * budget.tunings, *(row.controller for row in study.study.presets)]
        judged += sum(each * costs[family][law] for law in laws)
    minutes = (searched + judged) / 60.0 / CORES
    return [
        "", "## The full study", "",
        f"`--budget full`: {plan(study, Inputs())}.", "",
        f"By the costs above {searched / 60.0:.0f} core-minutes of searches and",
        f"{judged / 60.0:.0f} of tests: {minutes:.0f} minutes on {CORES} cores, an estimate.",
        "A run of it: [study](study.md).",
    ]  # fmt: skip


def _cpu() -> str:
    with open("/proc/cpuinfo", encoding="utf-8") as file:
        names = [line.partition(":")[2].strip() for line in file if line.startswith("model name")]
    return names[0] if names else platform.machine()


def _begin(study: Study) -> list[str]:
    """Head of the page, with what a rollout of each family is: duration, rate of the loop, integration step."""
    of_loops: dict[str, list[str]] = {}
    for name in study.study.families:
        family = study.families[name]
        period, step = family.loop.control_period, family.loop.control_period / family.loop.steps
        words = f"{family.horizon:g} s of a loop of {1.0 / period:g} Hz, integrated by {1e3 * step:g} ms"
        of_loops.setdefault(words, []).append(f"`{name}`")
    rollouts = "; ".join(f"{joined(names)}: {words}" for words, names in of_loops.items())
    told = f"""With all metrics of a ranking and the gains that are shipped for the family, {ROWS} rows on {WORLDS}
        worlds of it at once; {_cpu()}, processor time, the best of {TRIES} tries. Gains that chatter cost many times as
        much: a rollout is repeated with shorter steps until its numbers [settle](convergence.md). {rollouts}."""
    return [
        "# What rollouts cost", "",
        "Made by `python docs/cost.py`.", "",
        "## Rollouts per core-second", "",
        *textwrap.wrap(" ".join(told.split()), 120), "",
    ]  # fmt: skip


_MANY = [
    "", f"## {MANY:.0e} rollouts", "",
    "At the mean of all controllers, with the dearest executor's share on the cluster.", "",
    f"| family | core-hours | days on these {CORES} cores | hours on 1,000 cores |", "| --- | --- | --- | --- |",
]  # fmt: skip


if __name__ == "__main__":
    main()
