"""Points of a sweep as units of work."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from wristctl.config.study import Study
from wristctl.config.sweeps import SweepAxis, study_at

if TYPE_CHECKING:
    import numpy as np

    from wristctl.work.unit import Unit

_LANES = 2_000
"""Points of `simulate` in one unit."""
_SECTIONS = {"simulate": {"seed", "wrist", "simulate"}}
_WHOLE = {"seed", "wrist", "families"}


def sweep_units(study: Study, command: str, axes: Sequence[SweepAxis], points: Sequence[Sequence[Any]]) -> list[Unit]:
    """The points in order: many of `simulate` side by side, one of any other command."""
    from wristctl.work.unit import Unit

    content = json.loads(study.model_dump_json(by_alias=True, include=_SECTIONS.get(command, _WHOLE | {command})))
    together, does = (_LANES, "simulated") if command == "simulate" else (1, "performed_at")
    keys = [(each.key, each.text) for each in axes]
    units = []
    for first in range(0, len(points), together):
        own = [list(each) for each in points[first : first + together]]
        spec = {"study": content, "command": command, "keys": keys, "points": own}
        name = f"{command} at {', '.join(f'{k}={v}' for (k, _), v in zip(keys, own[0], strict=True))}"
        units.append(Unit(f"wristctl.studies.sweep_unit:{does}", spec, name, len(own)))
    return units


def _studies(spec: Mapping[str, Any]) -> Iterator[Study]:
    study = Study.model_validate_json(json.dumps(spec["study"]))
    axes = [SweepAxis(key, (), False, text) for key, text in spec["keys"]]
    return (study_at(study, axes, _plain(values)) for values in spec["points"])


def _plain(values: Sequence[Any]) -> list[Any]:
    """JSON knows no tuples, and sections nothing else."""
    return [tuple(_plain(each)) if isinstance(each, list) else each for each in values]


def simulated(spec: Mapping[str, Any]) -> dict[str, np.ndarray]:
    """Closed loops at the points as lanes: metrics by name, which failed, and in words why a loop is no good.

    A row for each point and repetition.
    """
    import numpy as np

    from wristctl.simulation.swept_loops import SweptLoop, fates, run_swept, swept_loops

    places, every = list[tuple[int, int]](), list[SweptLoop]()

    def loops() -> Iterator[SweptLoop]:
        for point, study in enumerate(_studies(spec)):
            for repetition, each in enumerate(swept_loops(study)):
                places.append((point, repetition))
                every.append(each)
                yield each

    found = run_swept(loops())
    point, repetition = np.array(places).T
    rows = {"point": point, "repetition": repetition, "failed": found.failed, "until": found.until}
    rows |= {"fate": np.array(fates(every, found))}
    return rows | {f"metric {name}": values for name, values in found.metrics.items()}


def performed_at(spec: Mapping[str, Any]) -> dict[str, np.ndarray]:
    """All metrics of a command that is performed in memory at one point, with their units."""
    import numpy as np

    from wristctl.studies.counting import watched
    from wristctl.studies.inputs import Inputs
    from wristctl.studies.perform import Prepared, perform
    from wristctl.studies.unattended import Unattended
    from wristctl.work.unit import function_at

    (study,) = _studies(spec)
    procedure: Any = function_at(_PROCEDURES[spec["command"]])
    found: Any = perform(Prepared(procedure, study, Inputs()), None, watched(None), Unattended())
    known = found.findings.metrics
    values = {f"metric {name}": np.array([value]) for name, value in found.metrics.items()}
    units = {f"unit {name}": np.array([each["unit"]]) for name, each in known.items()}
    return {"point": np.zeros(1, np.int64), "repetition": np.zeros(1, np.int64), **values, **units}


_PROCEDURES: Mapping[str, str] = {"tune": "wristctl.studies.tune:TUNE", "compare": "wristctl.studies.compare:COMPARE"}
