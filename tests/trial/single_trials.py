"""One trial on an emulated rig on which something happens, and how it ended."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from tests.trial.conftest import WRIST
from tests.trial.fault_runs import Prepared, as_limited, over
from wristctl.bench.virtual_bench import VirtualBench
from wristctl.config.hw_run import HwRunSettings
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.trial.board_stand import BoardStand
from wristctl.trial.experiment import Experiment, log_of
from wristctl.trial.testbeds import EmulatedTestbed
from wristctl.trial.trials import trials_of
from wristctl.vision.view import View

# Seconds of a run that is refused before its trial that are looked at.
_LAST = 0.1
_UNPUSHED: dict[str, Any] = {"push": {"force": 0.0}, "bench": {"person": {"takes": 0.0}}}


class Ended(NamedTuple):
    """How a run has ended."""

    outcome: str
    odd: str
    after: float
    """From when it happened to the stop [s]; nan where there was none."""
    pull: float
    """Largest true pull since then [N]."""
    error: float
    """Largest true error in the trial [rad]."""
    fix: str = ""
    """What is advised where it was stopped."""
    limit: float = np.nan
    """Tension beyond which it would have been stopped [N]."""


def performed(
    changes: Mapping[str, Any], prepared: Prepared, wrist: WristParameters = WRIST, at: float = 0.0, seed: int = 0
) -> Ended:
    """One trial, which nobody pushes unless it is said, on a bench that is prepared.

    `at` is when something happens in it [s].
    """
    settings = as_limited(HwRunSettings.model_validate(over(_UNPUSHED, changes)), wrist)
    planes = settings.planes
    bench = VirtualBench(settings.bench, wrist, seed, settings.markers, settings.markers_2 if planes == 2 else None)
    prepared(bench)
    log = log_of(Path(tempfile.mkdtemp()), settings, wrist)
    done = Experiment(settings, wrist, trials_of(settings, np.random.default_rng(0)), log)
    refused = fix = ""
    try:
        done.run(BoardStand(EmulatedTestbed(bench, settings, [View()] * planes, None), seed=seed))
    except UserError as error:
        refused, fix = f"before it: {error.what}", str(error.fix)
    finally:
        log.close()
    stopped = bench.transport.now()
    started = bench.faults._starts["first trial"]
    begun = started if started < stopped else stopped - _LAST
    truth, followed = bench.truth(begun), next(iter(done.motions.values()))
    time = truth.time - begun
    moving = time < followed.horizon if done.stop is None or done.stop.time is None else time < done.stop.time
    wanted = np.stack([np.interp(time, followed.time, plane) for plane in followed.bend_ref.T], axis=1)
    bends = truth.theta.reshape(len(time), -1, planes).sum(axis=1)
    apart = np.hypot.reduce(bends - wanted, axis=1)
    return Ended(
        done.outcomes.get(0, refused), done.odd.get(0, ""), np.nan if done.stop is None else stopped - begun - at,
        float(truth.pull[time >= at].max(initial=0.0)), float(np.abs(apart[moving]).max(initial=0.0)), fix,
        settings.safety.tension,
    )  # fmt: skip
