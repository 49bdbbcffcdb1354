"""What one run has measured of its rig: by where its trials come to rest, and by what homing found."""

from __future__ import annotations

import json
import math
from datetime import UTC, datetime
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest

from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.identification.rig_trend import Trend, reading_of
from wristctl.trial.homing import Zero
from wristctl.wrist.directions import ACTIVE, DIRECTIONS, TENDONS

BELIEVED = WristParameters(stiffness=0.6, flexion_ratio=1.5)
TIME = np.arange(0.0, 3.0, 0.01)
MOVES = 1.0
"""Until when the reference of a trial moves [s]."""


def trial(number: int, direction: str, stiffness: float, way: float, size: float = 0.4, load: float = 0.0) -> Any:
    """The log of a trial that rests bent from 1.3 s on: what the observer finds is (K_b - K) theta and the load."""
    plane, sign = DIRECTIONS[direction].plane, DIRECTIONS[direction].sign
    rests, bent = TIME > 1.3, np.minimum(TIME / MOVES, 1.0)
    theta = sign * size * np.where(rests, 1.0, 0.7 * bent)
    believed = 0.6 * (1.5 if plane == "flexion" else 1.0)
    along = 0 if plane == "ulnar" else 1
    columns = {
        "trial": number, "time": TIME, "theta": theta, "theta_ref": sign * size * bent,
        "rate_ref": np.where(TIME < MOVES, sign * size, 0.0), "load": (believed - stiffness) * theta + load,
    }  # fmt: skip
    columns |= {f"position_{tendon}": TENDONS[tendon][along] * way * theta for tendon in ACTIVE}
    return pd.DataFrame(columns)


def run(log: list[Any], path: Path, kind: str = "hw-run", **trials: Any) -> Any:
    """A run of as many trials that all went well, none with a push, but for what is said."""
    directions = [next(name for name, each in DIRECTIONS.items() if _goes(one, each)) for one in log]
    table = {"trial": range(len(log)), "direction": directions, "outcome": "ok", "push": 0.0} | trials
    frames = {"log": pd.concat(log), "trials": pd.DataFrame(table)}
    return SimpleNamespace(
        id="a run", kind=kind, path=path, data=frames.__getitem__, metrics={},
        has=lambda name: (path / name).exists(), json=lambda name: json.loads((path / name).read_text()),
        config=SimpleNamespace(wrist=BELIEVED),
        manifest=SimpleNamespace(inputs=[], timing=SimpleNamespace(started="2026-01-02T03:04:05+00:00")),
    )  # fmt: skip


def _goes(one: Any, direction: Any) -> bool:
    last = one.iloc[-1]
    pulls = {tendon for tendon in ACTIVE if last[f"position_{tendon}"] > 0.0}
    return pulls == set(direction.tendons)


STIFF = {"ulnar": 0.5, "radial": 0.5, "flexion": 0.8, "extension": 0.8}


def test_where_a_trial_rests_tells_the_springs_and_the_way_of_the_spools(tmp_path: Path) -> None:
    """Of each plane by itself, whatever is believed there; a load that never changes cancels between its sides."""
    log = [trial(k, name, STIFF[name], 900.0 + 100.0 * (k > 1), load=0.02) for k, name in enumerate(STIFF)]
    found = reading_of(run(log, tmp_path))
    assert found.values == pytest.approx(
        {"stiffness, ulnar": 0.5, "stiffness, flexion": 0.8, "steps per radian, ulnar": 900.0,
         "steps per radian, flexion": 1000.0}
    )  # fmt: skip
    assert (found.run, found.time) == ("a run", datetime(2026, 1, 2, 3, 4, 5, tzinfo=UTC).timestamp())


def test_a_direction_counts_once_however_often_it_was_tried(tmp_path: Path) -> None:
    log = [trial(0, "ulnar", 0.4, 900.0), trial(1, "radial", 0.6, 900.0), trial(2, "ulnar", 0.4, 900.0)]
    assert reading_of(run(log, tmp_path)).values["stiffness, ulnar"] == pytest.approx(0.5)


@pytest.mark.parametrize("why", [{"outcome": ["ok", "stopped"]}, {"push": [0.0, 2.0]}])
def test_a_trial_that_was_stopped_or_pushed_tells_nothing(why: dict[str, Any], tmp_path: Path) -> None:
    log = [trial(0, "ulnar", 0.4, 900.0), trial(1, "radial", 0.6, 900.0)]
    assert reading_of(run(log, tmp_path, **why)).values["stiffness, ulnar"] == pytest.approx(0.4)


def test_a_rest_is_ten_ticks_or_more_away_from_straight_0_4_s_after_the_motion(tmp_path: Path) -> None:
    def told(one: Any) -> bool:
        return bool(reading_of(run([one], tmp_path)).values)

    whole = trial(0, "ulnar", 0.5, 900.0)
    settled = whole["time"] > MOVES - 0.01 + 0.4 + 1e-9
    first = int(np.flatnonzero(settled)[0])
    assert told(whole[: first + 10]) and not told(whole[: first + 9])
    for degrees, tells in ((5.1, True), (4.9, False)):
        assert told(trial(0, "ulnar", 0.5, 900.0, math.radians(degrees))) == tells


def test_what_homing_found_is_told_in_millimetres_and_degrees_by_tendon(tmp_path: Path) -> None:
    (tmp_path / "data").mkdir()
    zero = {
        "slack": [1e-4, 2e-4, 3e-4, 4e-4], "steps_per_radian": [900.0, 1000.0], "friction": [1e-4, 3e-4],
        "marker": math.radians(0.5),
    }  # fmt: skip
    for kind, name in (("hw-run", "zero.json"), ("calibrate-wrist", "wrist.json")):
        (tmp_path / "data" / name).write_text(json.dumps(zero))
        one = run([trial(0, "ulnar", 0.5, 900.0)], tmp_path, kind)
        one.metrics["greatest_apart"] = {"value": math.radians(1.5)}
        values = dict(reading_of(one).values)
        at_rest = {name: values.pop(name) for name in [*values] if name.endswith("ulnar")}
        assert bool(at_rest) == (kind == "hw-run") and values.pop("following error", 1.5) == pytest.approx(1.5)
        slack = {f"slack of tendon {tendon}": 0.1 * (k + 1) for k, tendon in enumerate(ACTIVE)}
        others = {"steps per radian at homing": 950.0, "friction at homing": 0.2, "marker's zero": 0.5}
        assert values == pytest.approx(slack | others)


def test_tendons_of_a_rig_that_takes_targets_are_numbered_in_their_order(tmp_path: Path) -> None:
    zero = Zero((1,) * 3, (900.0,) * 3, (0.01, 0.02), (1e-4, 2e-4, 3e-4), (0.0,) * 3, (0.0, 2.1, -2.1), (5.0, 6.0, 7.0))
    (tmp_path / "data").mkdir()
    (tmp_path / "data" / "zero.json").write_text(json.dumps(zero.plain()))
    one = run([trial(0, "ulnar", 0.5, 900.0)], tmp_path)
    names = {f"position_{tendon}": f"position_{number}" for number, tendon in enumerate(ACTIVE, 1)}
    one.data = {"log": one.data("log").rename(columns=names), "trials": one.data("trials")}.__getitem__
    values = reading_of(one).values
    assert not any(name.endswith("ulnar") for name in values)
    slack = {name: value for name, value in values.items() if name.startswith("slack")}
    assert slack == pytest.approx({"slack of tendon 1": 0.1, "slack of tendon 2": 0.2, "slack of tendon 3": 0.3})
    assert Zero.of_plain(json.loads(json.dumps(zero.plain()))) == zero


def test_what_was_identified_is_told_by_its_own_units(tmp_path: Path) -> None:
    one = run([trial(0, "ulnar", 0.5, 900.0)], tmp_path, "identify")
    one.metrics |= {"stiffness": {"value": 0.55}, "damping": {"value": None}, "rmse": {"value": 0.1}}
    assert reading_of(one).values == {"stiffness, identified": 0.55}
    with pytest.raises(UserError, match="a tune run measures no rig"):
        reading_of(run([trial(0, "ulnar", 0.5, 900.0)], tmp_path, "tune"))


def test_a_trend_changes_by_its_slope_over_all_runs_beside_the_size_of_its_mean() -> None:
    trend = Trend("x", "mm", np.array([0.0, 2.0, 4.0]), np.array([-1.0, -2.0, -3.0]), -0.5, -0.6, -0.4, True)
    assert trend.change == pytest.approx(-2.0) and trend.share == pytest.approx(-1.0)
    assert math.isnan(trend._replace(values=np.array([-1.0, 0.0, 1.0])).share)
