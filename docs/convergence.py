"""Whether numbers depend on the integration step: `python docs/convergence.py` writes docs/convergence.md (minutes).

Settings drawn from what the paper leaves open, and loops drawn in two planes, run as a study runs them and with twenty
times the steps; every row of the shipped comparisons runs again with four times the steps that it took. Fails where
more than 1 % of a controller's loops are off and not marked.
"""

from __future__ import annotations

import sys
import textwrap
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wristctl.comparison.best_case import overshoot_of_a_tick
from wristctl.comparison.combinations import ComparedRow, compare
from wristctl.comparison.unknowns_sampling import drawn_settings
from wristctl.config.loop import Loop, Reference, sample_period
from wristctl.config.study import Study
from wristctl.config.unknowns_box import PaperSetting
from wristctl.config.wrist import WristParameters
from wristctl.control.differenced import differenced
from wristctl.control.table import controller, gains_of
from wristctl.simulation.convergence import tolerance
from wristctl.simulation.outcome import Outcome
from wristctl.simulation.planes import motion_in
from wristctl.simulation.reference import REFERENCES, motion
from wristctl.simulation.rollout import rollout, structure
from wristctl.study_files.load import load_study

HERE = Path(__file__).parent
PAGE, EXPERIMENTS = HERE / "convergence.md", HERE.parent / "experiments"
ROWS = (("smc", "exchanged"), ("pid", "printed"), ("ct-dob", "default"), ("smc-tracking", "default"))
SETTINGS, SEED, FINER = 200, 7, 20
IN_SPACE = ("smc", "exchanged"), ("ct-dob", "default"), ("pid-ff", "default"), ("smc-tracking", "default")
PLANES = 144
"""Settings in two planes."""
MOST = 0.01
"""Share of a controller's loops that may be off without a mark: chaos may agree twice by chance."""
PERIODS, LIMITS = (1e-3, 2e-3, 5e-3, 1e-2), (40.0, 100.0)
COMPARED, AGAIN, SHORTEST = ("quick", "controllers"), 4, 1e-4


class Drawn(NamedTuple):
    """One controller in the drawn settings, (settings,) each."""

    label: str
    one_off: NDArray[np.bool_]
    """Whether its RMSE at one step a period is off by more than 2 % or 0.002 deg."""
    off: NDArray[np.bool_]
    marked: NDArray[np.bool_]
    steps: NDArray[np.int64]
    apart: NDArray[np.float64]
    """How far its RMSE is from that at the finest steps [rad]."""

    @property
    def silent(self) -> int:
        """How many are off and not marked."""
        return int((self.off & ~self.marked).sum())

    @property
    def farthest(self) -> float:
        """The largest of these RMSEs' errors [deg]."""
        return float(np.degrees(np.max(self.apart, where=self.off & ~self.marked, initial=0.0)))


def settings() -> list[PaperSetting]:
    """What the paper leaves open, at these periods and limits."""
    rng, found = np.random.default_rng(SEED), []
    drawn = drawn_settings(load_study([EXPERIMENTS / "unknowns.yaml"]).audit.box, WristParameters(), SEED)
    for number in rng.permutation(len(drawn))[:SETTINGS]:
        each, period = drawn[number], float(rng.choice(PERIODS))
        limit = float(np.exp(rng.uniform(*np.log(LIMITS))))
        loop = each.loop.model_copy(update={"control_period": period, "limits": True})
        found.append(each._replace(loop=loop, wrist=each.wrist.model_copy(update={"tension_limit": limit})))
    return found


# Drives and cameras of the loops in two planes.
RIGS: tuple[Mapping[str, Any], ...] = (
    {},
    {"actuator": {"level": "lagged"}},
    {"actuator": {"level": "tendon", "friction": 0.0}},
    {"actuator": {"level": "tendon", "sheath": 1.0}, "sensor": {"level": "camera"}},
)
LAYOUTS = ("three", "four", tuple({"angle_deg": 60.0 * k + 15.0} for k in range(6)))
PATHS = ("circle", "figure-of-8", "circumduction", "dart-thrower")


def settings_in_space() -> list[PaperSetting]:
    """Wrists, drives and motions in two planes."""
    rng, found = np.random.default_rng(SEED), []
    for number in range(PLANES):
        rig, period = RIGS[number % len(RIGS)], float(rng.choice(PERIODS))
        loop = Loop.model_validate({
            **rig, "control_period": period, "plant_segments": int(rng.choice((1, 2, 4))),
            "coupling": str(rng.choice(("compensated", "ignored"))),
            "plant": {"stiffness_scale": float(rng.uniform(0.7, 1.3))},
        })  # fmt: skip
        wrist = WristParameters.model_validate({
            "tendons": LAYOUTS[number // len(RIGS) % len(LAYOUTS)], "flexion_ratio": float(rng.uniform(0.7, 1.6)),
            "stiffness_axis_deg": float(rng.uniform(0.0, 90.0)),
            "tension_limit": float(np.exp(rng.uniform(*np.log(LIMITS)))),
        })  # fmt: skip
        reference = Reference.model_validate({
            "kind": str(rng.choice(PATHS)), "angle_deg": float(rng.uniform(5.0, 30.0)),
            "turn": float(rng.uniform(1.0, 4.0)), "toward_deg": float(rng.uniform(0.0, 360.0)),
        })  # fmt: skip
        found.append(PaperSetting(wrist, loop, reference, 2.0, "ideal", {}))
    return found


def ran(row: tuple[str, str], alike: Sequence[PaperSetting], steps: int | None) -> Outcome:
    """One controller in settings that run side by side, at so many integration steps in a period."""
    law = controller(row[0])
    gains = np.tile(gains_of(law, row[1], None), (len(alike), 1))
    if alike[0].measured == "differenced":
        law = differenced(law)
    horizon, period = max(each.horizon for each in alike), sample_period(alike[0].loop.control_period)
    planes = REFERENCES[alike[0].reference.kind].planes
    motions = [motion_in(planes, each.reference, "ulnar", each.wrist, horizon, period) for each in alike]
    loops = [each.loop.model_copy(update={"substeps": steps}) for each in alike]
    return rollout(law, gains, motions, np.arange(len(alike)), loops, [each.wrist for each in alike])


def off(found: Outcome, fine: Outcome) -> NDArray[np.bool_]:
    """Rollouts whose RMSE is off by more than 2 % or 0.002 deg, or that fail in one of both only."""
    one, other = found.metrics["rmse"], fine.metrics["rmse"]
    apart = np.abs(one - other) > np.fmax(tolerance(other), 0.02 * other)
    lost: NDArray[np.bool_] = np.where(found.failed | fine.failed, found.failed != fine.failed, apart)
    return lost


def drawn(rows: Sequence[tuple[str, str]], found: Sequence[PaperSetting]) -> Iterator[Drawn]:
    """Each controller in all settings; what is finer takes FINER times a loop's own steps."""
    groups: dict[tuple[object, ...], list[PaperSetting]] = {}
    for each in found:
        key = *structure(each.loop), each.measured, str(each.wrist.tendons), each.loop.coupling
        groups.setdefault((*key, each.loop.actuator.friction > 0.0), []).append(each)
    for row in rows:
        parts = []
        for alike in groups.values():
            least = alike[0].loop.steps
            fine, one, own = (ran(row, alike, steps) for steps in (FINER * least, least, None))
            apart = np.nan_to_num(np.abs(own.metrics["rmse"] - fine.metrics["rmse"]))
            parts.append((off(one, fine), off(own, fine), own.unconverged, own.steps, apart))
        yield Drawn("/".join(row), *(np.concatenate(part) for part in zip(*parts, strict=True)))


class Changed(NamedTuple):
    """A row of a shipped comparison whose RMSE [deg] changes by more than 1 % or 0.002 deg."""

    study: str
    row: str
    rmse: float
    fine: float
    marked: bool


def shipped(name: str) -> tuple[int, int, list[Changed]]:
    """Rows of a shipped comparison with presets, how many of them are marked, and those that change."""
    study = load_study([EXPERIMENTS / f"{name}.yaml"])
    chosen = study.compare
    rows = [row for row in chosen.rows if row.gains != "tuned"]
    loops = {key: loop for key, loop in chosen.loops.items() if loop.control_period >= SHORTEST}
    asked = study.model_copy(update={"compare": chosen.model_copy(update={"rows": tuple(rows), "loops": loops})})
    found = compare(asked)
    changed = []
    for steps in {int(each.repeated.metrics["substeps"][0]) for each in found}:
        took = [each for each in found if each.repeated.metrics["substeps"][0] == steps]
        fine = {_key(each): each for each in _at(asked, took, AGAIN * steps)}
        for each in took:
            one, other = (float(row.repeated.metrics["rmse"][0]) for row in (each, fine[_key(each)]))
            if not (np.isnan(one) and np.isnan(other)) and not abs(one - other) <= tolerance(np.array(other)):
                row = f"{each.label}, {each.loop}, {each.reference}"
                changed.append(Changed(name, row, np.degrees(one), np.degrees(other), each.repeated.drift > 0.0))
    return len(found), sum(each.repeated.drift > 0.0 for each in found), changed


def _key(row: ComparedRow) -> tuple[str, ...]:
    return row.label, row.loop, row.reference, row.inverse


def _at(study: Study, took: Sequence[ComparedRow], steps: int) -> list[ComparedRow]:
    """The comparison of these rows on their loops at so many steps."""
    chosen, names = study.compare, {each.loop for each in took}
    loops = {name: loop.model_copy(update={"substeps": steps}) for name, loop in chosen.loops.items() if name in names}
    labels = {each.label for each in took}
    rows = tuple(row for row in chosen.rows if row.label in labels)
    return compare(study.model_copy(update={"compare": chosen.model_copy(update={"rows": rows, "loops": loops})}))


def thresholds() -> Iterator[tuple[float, ...]]:
    """Segments, period [s], and up to which limit [N] exchanged gains arrive, at one step, and by the held tick."""
    law, limits = controller("smc"), np.arange(30.0, 100.5, 0.5)
    gains, wrists = gains_of(law, "exchanged"), [WristParameters(tension_limit=float(each)) for each in limits]
    for n in (2, 4, 8):
        for period in (5e-4, 1e-3, 2e-3):
            loop = Loop(plant_segments=n, control_period=period)
            followed = motion(Reference(), wrists[0], 4.0, sample_period(period))
            arrived = []
            for steps in (None, 1):
                loops = [loop.model_copy(update={"substeps": steps})] * len(limits)
                many = np.tile(gains, (len(limits), 1))
                done = rollout(law, many, [followed], np.zeros(len(limits), np.int64), loops, wrists)
                arrived.append(float(limits[done.metrics["steady_state"] < np.deg2rad(1.0)].max()))
            rule = [overshoot_of_a_tick(PaperSetting(each, loop, Reference(), 4.0, "ideal", {})) for each in wrists]
            yield n, period, *arrived, float(np.interp(1.0, rule, limits))


def table(found: Sequence[Drawn]) -> list[str]:
    """How many of each controller's loops are off, marked, and take how many steps."""
    lines = [
        "| controller | off at the first step | off and not marked | marked | steps taken: loops |",
        "| --- | --- | --- | --- | --- |",
    ]
    for each in found:
        counts = ", ".join(f"{steps}: {count}" for steps, count in sorted(Counter(each.steps.tolist()).items()))
        lines.append(
            f"| {each.label} | {int(each.one_off.sum())} | {each.silent} | {int(each.marked.sum())} | {counts} |"
        )
    return lines


def page(
    found: list[Drawn], in_space: list[Drawn], rows: dict[str, tuple[int, int, list[Changed]]],
    limits: list[tuple[float, ...]],
) -> str:  # fmt: skip
    """The page."""
    total, one = sum(len(each.off) for each in found), sum(int(each.one_off.sum()) for each in found)
    unmarked = sum(each.silent for each in found)
    said = (
        f"Of {total} drawn loops {one} have an RMSE that is off by more than 2 % or 0.002 deg where one integration "
        f"step is taken in a control period. With `substeps: null`, the default, {unmarked} of them "
        + (f"(by at most {max(each.farthest for each in found):.1g} deg) " if unmarked else "")
        + "remain so without the mark `NOT CONVERGED`. Loops that need no more than one step keep it, to the bit."
    )
    lines = ["# Convergence: numbers and the integration step", "", *textwrap.wrap(said, 120), ""]
    made = f"""Made by `python docs/convergence.py`: {SETTINGS} settings drawn from experiments/unknowns.yaml at periods
    of 1, 2, 5 and 10 ms and limits of 40 to 100 N, against twenty times the steps."""
    lines += [
        *textwrap.wrap(" ".join(made.split()), 120),
        "",
        *table(found),
    ]
    space = f"""{PLANES} loops in two planes: wrists with three, four and six tendons, springs along any axis, ideal and
    lagging motors, spools that wind elastic tendons, with friction and a camera too, periods of 1, 2, 5 and 10 ms, and
    paths of 5 to 30 deg. Loops with spools begin with a step of at most 1 ms."""
    how = """A rollout is in doubt where the sum of its steps' estimated errors is large beside what is shown of its
    RMSE; they count eight times where its tensions chatter, or, with friction or end stops, rise from nothing to their
    largest more than 0.8 times a second, and forty times where, with these, they go so often through all that the
    tendons bear: kinks and jumps hide a part of the error from the estimate. It runs again with
    2, 4, 8, ... 64 times the steps until RMSE (0.5 % or 0.001 deg) and the error at the end (ten times as much) stay
    what they are twice in a row; the longest of these steps is taken. Where that never happens the loop is chaotic:
    the row is marked `NOT CONVERGED`, with by how much it still changes, and is ranked no better than a limit cycle.
    Steps given by hand stay, and are marked alike. `tune` verifies in this way only gains that would be its best: it
    never ends with what the step makes good, and may pass over what the step makes bad."""
    limit = """A 30 deg minimum jerk in 1 s, ideal measurement; above the limit a held tick turns the tip too far and
    the wrist stays (`wristctl/comparison/best_case.py`). Within some newtons of it the RMSE is chaotic. One step a tick
    puts the limit elsewhere, and we believed it: [what we corrected](corrected.md)."""
    lines += [
        "",
        *textwrap.wrap(" ".join(how.split()), 120),
        "",
        "## In two planes",
        "",
        *textwrap.wrap(" ".join(space.split()), 120),
        "",
        *table(in_space),
        "",
        "## The shipped comparisons at four times the steps",
        "",
    ]
    for name, (count, marked, changed) in rows.items():
        silent = [each for each in changed if not each.marked]
        told = f"experiments/{name}.yaml, rows with presets: {count} rows, {marked} marked; {len(changed)} change by "
        told += f"more than 1 % or 0.002 deg, {len(silent)} of them not marked."
        lines += [*textwrap.wrap(told, 120), ""]
        if silent:
            lines += ["| row | RMSE [deg] | at four times the steps |", "| --- | --- | --- |"]
            lines += [f"| {each.row} | {each.rmse:.4g} | {each.fine:.4g} |" for each in silent] + [""]
    lines += [
        "## Up to which limit the exchanged gains move the wrist",
        "",
        *textwrap.wrap(" ".join(limit.split()), 120),
        "",
        "| segments | period | arrives up to | at one step a tick | by the rule of the held tick |",
        "| --- | --- | --- | --- | --- |",
    ]
    lines += [f"| {n} | {1e3 * p:g} ms | {own:.1f} N | {one:.1f} N | {rule:.1f} N |" for n, p, own, one, rule in limits]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    drawn_rows, in_space = list(drawn(ROWS, settings())), list(drawn(IN_SPACE, settings_in_space()))
    compared = {name: shipped(name) for name in COMPARED}
    PAGE.write_text(page(drawn_rows, in_space, compared, list(thresholds())))
    sys.exit(any(each.silent > MOST * len(each.off) for each in [*drawn_rows, *in_space]))
