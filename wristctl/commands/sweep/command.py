"""A command at many values of its settings, in one run directory with one long table."""

from __future__ import annotations

import json
import logging
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import wraps
from typing import TYPE_CHECKING, Any, TypeVar, cast

from wristctl.commands import adoption, loop_warnings
from wristctl.commands.adoption import with_presets
from wristctl.commands.answer import Answer
from wristctl.commands.identified_wrist import identified
from wristctl.commands.inputs import Inputs
from wristctl.commands.inputs_of_loops import (
    asked_of_comparison,
    asked_of_search,
    asked_of_simulation,
    check_row,
    tuned_gains,
)
from wristctl.commands.procedure import Procedure, check_tendons, procedure_named
from wristctl.commands.progress import watched
from wristctl.commands.quantities import Quantity, documented
from wristctl.commands.results import Findings, StudyResult
from wristctl.commands.session import Session, Unattended
from wristctl.commands.sweep.answer import CONTROLLER, answer, fates, headline, metrics_of, quantities, rows_of
from wristctl.commands.units import performed
from wristctl.config.controller_row import BY_LOOP
from wristctl.config.loop import LOOPS
from wristctl.config.study import Study
from wristctl.errors import Argument, UserError
from wristctl.study_files.sweeps import SweepAxis, axes_of, points_of, study_at, unit_at
from wristctl.work.fan_out import Poisoned
from wristctl.work.worker import Golden, Unit

if TYPE_CHECKING:
    import numpy as np
    import pandas as pd


# Points of `simulate` in one unit.
_LANES = 2_000
_SECTIONS = {"simulate": {"seed", "wrist", "simulate"}}
_WHOLE = {"seed", "wrist", "families"}


def sweep_units(
    study: Study,
    command: str,
    axes: Sequence[SweepAxis],
    points: Sequence[Sequence[Any]],
    tuned: Mapping[str, Mapping[str, float]] | None = None,
) -> list[Unit]:
    """The points in order: many of `simulate` side by side, one of any other command.

    `tuned` has gains of a tune run by controller and name, for controllers that are taken in turn.
    """
    content = json.loads(study.model_dump_json(by_alias=True, include=_SECTIONS.get(command, _WHOLE | {command})))
    together, does = (_LANES, "simulated") if command == "simulate" else (1, "performed_at")
    keys = [(axis.key, axis.text) for axis in axes]
    units = []
    for first in range(0, len(points), together):
        block = [list(point) for point in points[first : first + together]]
        spec = {"study": content, "command": command, "keys": keys, "points": block, "tuned": tuned or {}}
        name = f"{command} at {', '.join(f'{k}={v}' for (k, _), v in zip(keys, block[0], strict=True))}"
        units.append(Unit(f"wristctl.commands.sweep.command:{does}", spec, name, len(block)))
    return units


def _studies(spec: Mapping[str, Any]) -> Iterator[Study]:
    study = Study.model_validate_json(json.dumps(spec["study"]))
    axes = [SweepAxis(key, (), False, text) for key, text in spec["keys"]]
    tuned = spec["tuned"]
    return (_at(study, axes, _plain(values), spec["command"], tuned) for values in spec["points"])


def _at(
    study: Study,
    axes: Sequence[SweepAxis],
    values: Sequence[Any],
    command: str,
    tuned: Mapping[str, Mapping[str, float]] | None,
    tell: bool = False,
) -> Study:
    """The study at a point, with gains that the controller there has. UserError where it has none that were tuned."""
    there = with_presets(study_at(study, axes, values), command, tell, _of_several(axes))
    row = there.simulate
    if command != "simulate" or row.gains != "tuned" or not _of_several(axes):
        return there
    check_row(row, tuned)
    gains = dict((tuned or {})[row.controller])
    return there.model_copy(update={"simulate": row.model_copy(update={"gains": gains})})


def _of_several(axes: Sequence[SweepAxis]) -> bool:
    """Whether one preset is given for controllers that are taken in turn."""
    keys = [axis.key for axis in axes]
    return "simulate.controller" in keys and not any(key.startswith("simulate.gains") for key in keys)


def _plain(values: Sequence[Any]) -> list[Any]:
    """JSON knows no tuples, and sections nothing else."""
    return [tuple(_plain(value)) if isinstance(value, list) else value for value in values]


def simulated(spec: Mapping[str, Any]) -> dict[str, np.ndarray]:
    """Closed loops at the points as lanes: metrics by name, which failed, and in words why a loop is no good.

    A row for each point and repetition.
    """
    import numpy as np

    from wristctl.simulation.swept_loops import SweptLoop, fates, run_swept, swept_loops

    places, every = list[tuple[int, int]](), list[SweptLoop]()

    def loops() -> Iterator[SweptLoop]:
        for point, study in enumerate(_studies(spec)):
            for repetition, loop in enumerate(swept_loops(study)):
                places.append((point, repetition))
                every.append(loop)
                yield loop

    outcome = run_swept(loops())
    point, repetition = np.array(places).T
    rows = {"point": point, "repetition": repetition, "failed": outcome.failed, "until": outcome.until}
    rows |= {"fate": np.array(fates(every, outcome))}
    return rows | {f"metric {name}": values for name, values in outcome.metrics.items()}


def performed_at(spec: Mapping[str, Any]) -> dict[str, np.ndarray]:
    """What a command found that is performed in memory at one point, and what is known of its columns, as JSON."""
    import numpy as np

    from wristctl.commands.perform import Prepared, perform

    (study,) = _studies(spec)
    procedure = procedure_named(spec["command"])
    result = perform(Prepared(procedure, study, Inputs()), None, watched(None), Unattended())
    columns, about = result.at_a_point()
    values = {f"metric {name}": np.array(column) for name, column in columns.items()}
    told = {f"about {name}": np.array([json.dumps(facts)]) for name, facts in about.items()}
    none = np.zeros(max(map(len, columns.values()), default=1), np.int64)
    return {"point": none, "repetition": none, **values, **told}


Found = TypeVar("Found", bound=StudyResult)
# Points that are made before anything is computed, so that a value that cannot be is known by then.
_CHECKED = 20_000
# Rows that `--all` prints; data/sweep.csv has the others.
_PRINTED = 200


@dataclass(frozen=True, repr=False, eq=False)
class Swept(StudyResult):
    """A command at every point of a sweep."""

    kind = "sweep"

    table: pd.DataFrame
    poisoned: list[Poisoned]
    first_screen: Answer

    @property
    def answer(self) -> Answer:
        """Where the main metric is least and most, and some of the points."""
        return self.first_screen

    def frame(self) -> pd.DataFrame:
        """A row for each point and repetition: what was set, and every metric."""
        return self.table

    @property
    def marks(self) -> list[str]:
        """Number of rollouts with each mark."""
        return [f"{mark}: {count} of {len(self.table)}" for mark, count in fates(self.table).items()]

    @property
    def fault(self) -> UserError | None:
        """UserError for points that were given up."""
        if not self.poisoned:
            return None
        first = self.poisoned[0]
        problem = f"{len(self.poisoned)} of the sweep's points failed: {first.unit.name}: {first.why}"
        return UserError(problem, self.place, "leave those values out, or mend them", exit_code=3)


def sweepable(procedure: Procedure[Found]) -> Procedure[Found]:
    """The procedure, which does what it does at every point where the study has a sweep."""

    def plan(study: Study, inputs: Inputs) -> str:
        from wristctl.simulation.closed_loop import check_steps

        if not study.sweep:
            return procedure.plan(study, inputs)
        base, axes = _base(study, procedure.kind, inputs), axes_of(study, procedure.kind)
        points = points_of(axes)
        for point in points[:_CHECKED]:
            check_tendons(study_at(base, axes, point), procedure)
        assert procedure.size is not None
        sizes = []
        with _said_once(adoption.log):
            for corner in _corners(axes):
                there = _at(base, axes, corner, procedure.kind, tuned_gains(inputs), tell=True)
                plan_text = procedure.plan(there, Inputs())
                sizes.append(procedure.size(there))
        steps, rollouts = (
            sum(column) / len(sizes) for column in zip(*((a.steps, a.rollouts) for a in sizes), strict=True)
        )
        try:
            check_steps(len(points) * steps, len(points) * rollouts)
        except UserError as error:
            raise error.at(Argument("sweep", metavar="KEY=VALUES")) from error
        return f"{len(points)} points of {', '.join(axis.key for axis in axes)}; at each: {plan_text}"

    @wraps(procedure.perform)
    def perform(session: Session) -> Found | Swept:
        return _swept(session, procedure.kind) if session.study.sweep else procedure.perform(session)

    swept: Any = replace(procedure, plan=plan, perform=cast(Any, perform), in_units=True)
    return cast(Procedure[Found], swept)


@contextmanager
def _said_once(log: logging.Logger) -> Iterator[None]:
    """Within the block a log says nothing twice: what holds at several points is said of the sweep."""
    said = set[str]()

    def is_new(record: logging.LogRecord) -> bool:
        known = record.getMessage() in said
        said.add(record.getMessage())
        return not known

    log.addFilter(is_new)
    try:
        yield
    finally:
        log.removeFilter(is_new)


def _base(study: Study, command: str, inputs: Inputs) -> Study:
    """The study without its sweep, and with what it takes from earlier runs written into it."""
    from wristctl.control.table import controller, gains_of

    if "network" in inputs:
        fix = "leave it out: inverse: closed-form follows tips without one"
        raise UserError("a sweep runs without a network", Argument("network"), fix)
    by_gain = any(".gains." in f".{key}" for key in study.sweep)
    swept, study, tuned = study, study.model_copy(update={"sweep": ()}), tuned_gains(inputs)
    if command in ("simulate", "tune"):
        study = identified(study, command, inputs)
    if command == "simulate":
        asked: dict[str, Any] = {"tuned": None, "from_identified": None}
        if by_gain or (study.simulate.gains == "tuned" and not _of_several(axes_of(swept, command))):
            law = controller(study.simulate.controller)
            values = gains_of(law, study.simulate.gains, tuned, study.simulate.loop)
            asked["gains"] = dict(zip(law.gains, values, strict=True))
        study = study.model_copy(update={"simulate": study.simulate.model_copy(update=asked)})
    if command == "compare" and tuned:
        rows = tuple(
            row.model_copy(update={"gains": dict(tuned[row.controller])}) if row.gains == "tuned" else row
            for row in study.compare.rows
        )
        study = study.model_copy(update={"compare": study.compare.model_copy(update={"rows": rows, "tuned": None})})
    return study


def _corners(axes: Sequence[SweepAxis]) -> list[tuple[Any, ...]]:
    """The first point, and each axis at its every value that may be unlike the others: names, and both ends."""
    first = tuple(axis.values[0] for axis in axes)
    corners = [first]
    for position, axis in enumerate(axes):
        names = [value for value in axis.values if isinstance(value, str)]
        numbers = [value for value in axis.values if not isinstance(value, str)]
        ends = [min(numbers), max(numbers)] if numbers else []
        corners += [(*first[:position], value, *first[position + 1 :]) for value in [*names[:100], *ends]]
    return corners


def _swept(session: Session, command: str) -> Swept:
    import pandas as pd

    from wristctl.commands.sweep.figures import over_setting

    study, findings = session.study, session.findings
    base, axes = _base(study, command, session.inputs), axes_of(study, command)
    points = points_of(axes)
    tuned = tuned_gains(session.inputs)
    units = sweep_units(base, command, axes, points, tuned)
    golden = None if session.executor == "serial" else _golden(base, command)
    with _said_once(loop_warnings.log):
        if command == "simulate":
            for corner in _corners(axes):
                at_corner = _at(base, axes, corner, command, tuned).simulate
                loop_warnings.warn_if_coarse([at_corner.loop])
                loop_warnings.warn_outside_conditions([at_corner], [at_corner.loop])
        outcome = performed(session, command, f"{command} at {len(points)} points", units, golden, "points")
    parts, about, first = list[pd.DataFrame](), dict[str, dict[str, Any]](), 0
    for unit, arrays in zip(units, outcome.arrays, strict=True):
        if arrays is not None:
            about |= {name[6:]: json.loads(str(array[0])) for name, array in arrays.items() if name[:6] == "about "}
            rows = {name.removeprefix("metric "): array for name, array in arrays.items() if name[:6] != "about "}
            parts.append(pd.DataFrame(rows | {"point": rows["point"] + first}))
        first += unit.size
    if not parts:
        raise UserError(
            "no point of the sweep could be computed",
            Argument("sweep", metavar="KEY=VALUES"),
            f"at the first: {outcome.poisoned[0].why}",
            exit_code=3,
        )
    table = pd.concat(parts, ignore_index=True)
    for number, axis in enumerate(axes):
        table.insert(number, axis.key, [points[index][number] for index in table["point"]])
    columns = quantities(table, {axis.key: unit_at(base, axis.path) for axis in axes}, about)
    findings.table("data/sweep.csv", table, *documented(columns.values()))
    keys = [columns[name] for name in (*(axis.key for axis in axes), CONTROLLER.name) if name in columns]
    chief = [columns[name] for name, facts in about.items() if facts.get("chief")]
    shown = headline(table, chief or metrics_of(columns, keys))
    _note(findings, table, shown)
    with session.drawing():
        for key in keys:
            others = [other for other in keys if other is not key]
            findings.figure(f"sweep-{key.name}", over_setting, table, key, others, shown)
    place, presets = str(findings.run.path) if findings.run else "", _presets(base, command, axes, points)
    screen = answer(command, table, keys, shown, place, presets)
    return Swept(study, findings, [rows_of(table.head(_PRINTED), keys, shown)], table, outcome.poisoned, screen)


def _presets(base: Study, command: str, axes: Sequence[SweepAxis], points: Sequence[Sequence[Any]]) -> list[str]:
    """Controllers with their gains by loop, of points unlike by names; none where gains were chosen."""
    if command != "simulate" or base.simulate.gains != BY_LOOP:
        return []
    unlike = {tuple(value for value in point if isinstance(value, str)): point for point in points}
    rows = [_at(base, axes, point, "simulate", None).simulate for point in [*unlike.values()][:_CHECKED]]
    return list(dict.fromkeys(f"{row.controller}/{row.gains}" for row in rows))


def _golden(study: Study, command: str) -> Golden:
    """Golden rollout of the loop of simulate or the built-in loop, by which workers show that they compute the same."""
    from wristctl.simulation.golden import GOLDEN, golden_spec
    from wristctl.simulation.planes import planes_of

    law, loop, asked = "feedforward", LOOPS["sampled"], asked_of_search
    if command == "simulate":
        law, loop, asked = study.simulate.controller, study.simulate.loop, asked_of_simulation
    elif command == "compare":
        asked = asked_of_comparison
    return Golden.here(GOLDEN, golden_spec([law], [loop], study.wrist, [planes_of(study.wrist, asked(study))]))


def _note(findings: Findings, table: pd.DataFrame, shown: Sequence[Quantity]) -> None:
    """Note the metrics that `runs ls` can filter by."""
    findings.metric("points", int(table["point"].nunique()), meaning="of the sweep")
    if "failed" in table:
        findings.metric(
            "failed", float(table["failed"].mean()), better="lower", n=len(table), meaning="share that left its range"
        )
    for metric in shown:
        values = table[metric.name].dropna()
        for end, value in (("least", values.min()), ("most", values.max())):
            findings.metric(f"{metric.name}_{end}", float(value), metric.unit, metric.better, len(values))
