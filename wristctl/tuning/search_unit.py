"""A search as a unit of work: from a specification that JSON can hold to arrays."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

import numpy as np

from wristctl.config.study import Study
from wristctl.control.table import controller
from wristctl.seeds import stream
from wristctl.tuning.objective import Judge
from wristctl.tuning.search import Finalist, Search, Tried, search, tuning_cases
from wristctl.work.unit import Unit


def search_unit(study: Study, law: str) -> Unit:
    """The search for gains of a law by the study's `tune` section, on worlds of the family that it names."""
    family, settings = study.tune.worlds.family, study.tune
    needed = study.model_copy(
        update={
            "families": {family: study.families[family]},
            "tune": settings.model_copy(update={"controllers": (law,)}),
        }
    )
    content = json.loads(needed.model_dump_json(by_alias=True, include={"seed", "wrist", "families", "tune"}))
    rollouts = settings.candidates * settings.iterations * settings.restarts * settings.worlds.draws
    rollouts += settings.finalists * settings.worlds.validation
    size = rollouts * len(study.families[family].references)
    spec = {"study": content, "law": law}
    return Unit("wristctl.tuning.search_unit:searched", spec, f"search for gains of {law} on {family}", size)


def searched(spec: Mapping[str, Any]) -> dict[str, np.ndarray]:
    """What `search_unit` asks for: all that was tried, and the finalists, best first."""
    study, law = Study.model_validate_json(json.dumps(spec["study"])), controller(spec["law"])
    cases, others = tuning_cases(study)
    judges = Judge(cases, study.wrist, study.tune.objective), Judge(others, study.wrist, study.tune.objective)
    found = search(study, law, lambda name: stream(study.seed, name), judges)
    return {
        "values": found.tried.values,
        "gains": found.tried.gains,
        "finalists": np.array([each.gains for each in found.finalists]),
        "origins": np.array([each.origin for each in found.finalists]),
        "judged": np.array([(each.objective, each.validated) for each in found.finalists]),
    }


def search_of(arrays: Mapping[str, np.ndarray], law: str, restarts: int) -> Search:
    """The search that gave these arrays."""
    tried = Tried(arrays["values"], arrays["gains"])
    finalists = tuple(
        Finalist(tuple(map(float, gains)), str(origin), float(objective), float(validated))
        for gains, origin, (objective, validated) in zip(
            arrays["finalists"], arrays["origins"], arrays["judged"], strict=True
        )
    )
    best = dict(zip(controller(law).gains, finalists[0].gains, strict=True))
    return Search(law, best, finalists[0].validated, tried.values.size, tried, restarts, finalists)
