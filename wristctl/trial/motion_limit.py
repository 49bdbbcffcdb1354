"""The largest tension of trials, by their own simulation: what a motion needs, and not what a wrist bears.

A held hand or a lost step is told by a tension far below what tendons bear, and within tenths of a second: a motor's
whole pull is then never reached.
"""

import math
from collections.abc import Mapping, Sequence

from wristctl.config.plant import Plant
from wristctl.config.study import Study
from wristctl.trial.rig_belief import layout_of_rig
from wristctl.trial.rig_settings import share_of_pair
from wristctl.trial.trial_results import twin
from wristctl.trial.trials import Trial
from wristctl.wrist.kinematics import Inverse

# A limit is no less [N]: tendons whose zero is 0.3 mm off pull so much more than simulated ones.
LEAST = 12.0


def peak_tension(
    study: Study, trials: Sequence[Trial], network: Inverse | None,
    tuned: Mapping[str, Mapping[str, float]] | None,
) -> float:  # fmt: skip
    """Largest tension [N] of a tendon over these trials, simulated on the believed wrist with and without its payload.

    Infinite where a simulation fails, and of a live reference: nothing then says what the motion needs.
    """
    settings, peaks = study.hw_run, list[float]()
    if settings.reference.is_live:
        return math.inf
    different = {(trial.direction, trial.push, trial.row): trial for trial in trials}
    for payload in dict.fromkeys((0.0, settings.payload)):  # an upright wrist needs less with one
        loop = settings.known_loop.model_copy(update={"plant": Plant(payload=payload)})
        for trial in different.values():
            done = twin(study, trial, network, tuned, loop)
            peaks.append(math.inf if done.failed else done.metrics["peak_tension"])
    share = share_of_pair(layout_of_rig(settings, study.wrist), settings.planes)
    return max(peaks) / share


def limited(study: Study, peak: float) -> Study:
    """The study with its rig's largest tension `hw-run.tension_factor` times this peak [N], where that is less."""
    settings = study.hw_run
    most = min(settings.within(study.wrist).safety.tension, max(LEAST, settings.tension_factor * peak))
    safety = settings.safety.model_copy(update={"tension": most})
    return study.model_copy(update={"hw_run": settings.model_copy(update={"safety": safety})})
