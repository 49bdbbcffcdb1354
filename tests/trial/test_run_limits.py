"""A run's files alone say what stopped it and how near each residual came to its limit."""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np
import pandas as pd
import pytest

from tests.trial.conftest import WRIST, Run, settings_of
from wristctl.plotting.residual_figure import residuals_over_time
from wristctl.trial.residuals import RESIDUALS, limits_of, load, plain
from wristctl.trial.run_limits import LEAST, MARGIN, SETTINGS, Logged, Nearness, nearness, stop_of

SETTINGS_OF_RUN = settings_of().within(WRIST)
WEIGHED_RUN = settings_of(load_cells={}).within(WRIST)
LIMITS = limits_of(SETTINGS_OF_RUN)
PERIOD = SETTINGS_OF_RUN.control_period


def logged(trial: int = 0, **sizes: Any) -> Logged:
    """A run whose residuals are 0 but for these."""
    values = pd.DataFrame({name: np.zeros(50) for name in RESIDUALS})
    for name, size in sizes.items():
        values[name] = size
    values.insert(0, "clock", 10.0 + PERIOD * np.arange(50))
    values.insert(0, "trial", trial)
    return Logged(values, LIMITS, SETTINGS_OF_RUN, WRIST)


def near(runs: list[Logged]) -> list[Nearness]:
    """Nearness of runs, each judged by its ticks."""
    return nearness(runs, [stop_of(run) for run in runs])


@pytest.mark.parametrize(
    ("kind", "size", "residual"), [("marker-turned", 5.0, "jump"), ("tendon-detached", 1.0, "across")]
)
@pytest.mark.slow
def test_the_files_of_a_stopped_trial_stop_at_the_very_tick(
    experiment: Run, tmp_path: Any, kind: str, size: float, residual: str
) -> None:
    fault = {"kind": kind, "size": size, "axis": 2, "at": 0.1}
    done = experiment(bench={"motors": {"slack": (0.0,) * 4}, "person": {"takes": 0.5}, "faults": (fault,)})
    assert done.error is not None and done.experiment.stop is not None
    file = tmp_path / "limits.json"
    file.write_text(json.dumps(plain(LIMITS), allow_nan=False))
    run = Logged(done.table("residuals"), load(file), SETTINGS_OF_RUN, WRIST)
    stop = stop_of(run)
    assert stop is not None and (stop.limit.name, stop.trial) == (residual, 0)
    assert stop.row == len(run.values) - 1, "no tick came after it, and none before stops"
    log = done.table("log")
    assert stop.clock - PERIOD == pytest.approx(log["clock"].iloc[-1], abs=1e-6)
    assert stop_of(run._replace(values=run.values.iloc[:-1])) is None
    picture = residuals_over_time(run, stop)
    marked = [panel for panel in picture.axes if "stopped here" in " ".join(panel.get_title(loc="left").split())]
    assert (
        len(picture.axes) == len(LIMITS) and len(marked) == 1 and marked[0].get_title(loc="left").startswith(residual)
    )
    drawn = marked[0].lines[0]
    unit = RESIDUALS[residual].shown.size
    assert drawn.get_ydata() == pytest.approx(run.values[residual].to_numpy() / unit, nan_ok=True)
    assert stop.limit.limit / unit in {float(np.ravel(line.get_ydata())[0]) for line in marked[0].lines}


def test_a_figure_of_the_last_seconds_has_those_alone() -> None:
    run = logged(load=np.linspace(0.0, 0.1, 50))
    for last, rows in ((None, 50), (9.5 * PERIOD, 10)):
        for panel in residuals_over_time(run, None, last).axes:
            clock = np.asarray(panel.lines[0].get_xdata(), float)
            assert clock == pytest.approx(run.values["clock"].to_numpy()[-rows:])


def test_of_several_runs_the_largest_is_named_with_its_run_trial_and_time() -> None:
    sizes = np.zeros(50)
    sizes[[10, 30]] = 0.4, -0.9
    lines = near([logged(load=0.2), logged(trial=3, load=sizes, apart=math.nan)])
    line = next(line for line in lines if line.limit.name == "load")
    assert (line.largest, line.run, line.trial) == (0.9, 1, 3) and line.clock == pytest.approx(10.0 + 30 * PERIOD)
    assert line.share == pytest.approx(0.9 / 1.6) and lines[0] == line, "nearest first"
    apart = next(line for line in lines if line.limit.name == "apart")
    assert apart.largest == 0.0 and apart.proposed is None and apart.setting == ""


@pytest.mark.parametrize("share", [0.1, 0.5, 0.9])
@pytest.mark.parametrize("name", [name for name in SETTINGS if name not in ("pull", "late", "age")])
def test_a_proposed_setting_makes_the_proposed_limit_and_has_its_margin(name: str, share: float) -> None:
    """Read back as a setting: 1.5 times the largest, half of the present one at least, to two digits."""
    limits = limits_of(WEIGHED_RUN)
    present = next(limit for limit in limits if limit.name == name)
    sizes = np.zeros(50)
    sizes[20] = share * present.limit
    seen: dict[str, Any] = {name: sizes}
    run = logged(**seen)._replace(limits=limits, settings=WEIGHED_RUN)
    line = next(line for line in near([run]) if line.limit.name == name)
    assert line.proposed == pytest.approx(max(MARGIN * share, LEAST) * present.limit, rel=0.05)
    key, _, value = line.setting.removeprefix("safety.").partition("=")
    changed = settings_of(load_cells={}, safety={key: float(value)})
    (made,) = (limit.limit for limit in limits_of(changed) if limit.name == name)
    assert made == pytest.approx(line.proposed)


def test_no_pull_is_proposed_beyond_what_the_wrist_bears() -> None:
    (line,) = (line for line in near([logged(pull=50.0)]) if line.limit.name == "pull")
    assert line.setting == "safety.tension=60" and line.proposed == 60.0
    (less,) = (line for line in near([logged(pull=22.0)]) if line.limit.name == "pull")
    assert less.setting == "safety.tension=33"


def test_where_the_motion_set_the_limit_of_tension_its_factor_is_proposed() -> None:
    """A limit of 18 N, twice what the trials need: 13 N are too near to it, and the same with 2.2 times."""
    run = logged(pull=13.0)
    limits = tuple(limit._replace(limit=18.0) if limit.name == "pull" else limit for limit in run.limits)
    (line,) = (line for line in near([run._replace(limits=limits)]) if line.limit.name == "pull")
    assert line.setting == "tension_factor=2.2" and line.proposed == pytest.approx(19.8)


def test_what_a_stopped_run_shows_proposes_nothing() -> None:
    stopped, sound = logged(load=1.7), logged(load=0.7)
    assert stop_of(stopped) is not None and stop_of(sound) is None
    (alone,) = (line for line in near([stopped]) if line.limit.name == "load")
    assert alone.largest == 1.7 and alone.proposed is None
    (both,) = (line for line in near([stopped, sound]) if line.limit.name == "load")
    assert both.largest == 1.7 and both.proposed == pytest.approx(MARGIN * 0.7, rel=0.05)
