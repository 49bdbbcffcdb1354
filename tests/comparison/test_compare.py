"""The comparison: order, verdicts, cost."""

from __future__ import annotations

import math
from typing import Any

import pytest

from wristctl.commands.compare.csv_data import frame, series
from wristctl.comparison.combinations import ComparedRow, compare, refuse_tuned_scenarios
from wristctl.comparison.paper import verdict
from wristctl.comparison.step_cost import step_time
from wristctl.config.compare import CompareSettings
from wristctl.config.loop import Reference
from wristctl.config.tune import TuneSettings
from wristctl.control.table import CONTROLLERS, controller, gains_of
from wristctl.errors import UserError
from wristctl.simulation.reference import reference_name
from wristctl.study_files.load import load_study

SETTINGS = (
    "loops={one: {plant_segments: 1}, four: {}}", "horizon=0.4", "inverses=[none, closed-form]",
    "references=[{kind: step, angle_deg: 10}, {duration: 0.3}]",
)  # fmt: skip
PID, SMC = "{controller: pid, gains: {Kp: 30, Ki: 10, Kd: 0.5}}", "{controller: smc, gains: exchanged}"


SOFT: dict[str, object] = {"plant": {"stiffness_scale": 0.8}}


def results(rows: str) -> list[ComparedRow]:
    return compare(load_study([], [*SETTINGS, f"controllers={rows}"], "compare"))


def test_rows_come_in_the_studys_order_and_do_not_depend_on_it() -> None:
    one, other = results(f"[{PID}, {SMC}]"), results(f"[{SMC}, {PID}]")
    assert [r.label for r in one[:3]] == ["pid/Kp=30 Ki=10 Kd=0.5"] * 2 + ["smc/exchanged"]
    assert [(r.loop, r.reference) for r in one][::4] == [
        (loop, name) for loop in ("one", "four") for name in ("step 10 deg", "minimum jerk 0.3 s 30 deg")
    ]

    def values(found: list[ComparedRow]) -> list[tuple[Any, ...]]:
        return sorted((r.loop, r.reference, r.inverse, r.label, tuple(r.simulation.metrics.values())) for r in found)

    assert repr(values(one)) == repr(values(other))


def test_exact_inverse_changes_nothing_on_an_inextensible_arc() -> None:
    found = results(f"[{PID}]")
    for direct, through_tip in zip(found[::2], found[1::2], strict=True):
        assert through_tip.simulation.metrics["rmse"] == pytest.approx(direct.simulation.metrics["rmse"], rel=1e-6)


def test_frame_and_series_hold_one_row_per_result() -> None:
    found = results(f"[{SMC}]")
    table, courses = frame(found, ()), series(found)
    assert len(table) == len(found) == 8 and courses["theta"].shape == (8, 80) == courses["theta_ref"].shape
    assert (table["reference"] == [r.reference for r in found]).all()


def test_verdict_needs_rmse_and_settling_near_the_papers() -> None:
    assert verdict("smc", 2.7e-4, 1.2, 1e-9) == "reproduced" == verdict("smc", 4.0e-4, 0.87, 0.0)
    assert verdict("smc", 4.2e-4, 1.2, 0.0) == "not reproduced" == verdict("smc", 2.7e-4, math.nan, 0.0)
    assert verdict("smc", 1e-5, 1.2, 0.0) == "not reproduced" == verdict("smc", 2.7e-4, 1.2, 5e-4)
    assert verdict("feedforward", 1.0, 1.0, 1.0) == ""


def test_references_are_named_by_kind_duration_and_target() -> None:
    assert reference_name(Reference(kind="step")) == "step 30 deg"
    assert reference_name(Reference(tip=(0.07, 0.02), inverse="closed-form")) == "minimum jerk 1 s tip 70, 20 mm"


@pytest.mark.slow
def test_step_time_is_measured_for_every_controller() -> None:
    study = load_study([])
    for name in CONTROLLERS:
        chosen = controller(name)
        time = step_time(chosen, gains_of(chosen, next(iter(chosen.presets))), study.wrist)
        assert 0.0 < time.median <= time.p99


def test_gains_are_not_judged_on_the_loop_and_the_reference_that_they_were_tuned_on() -> None:
    tuned = TuneSettings.model_validate(
        {"loops": {"soft": SOFT, "stiff": {}}, "scenarios": ({"loop": "soft", "reference": {"kind": "step"}},)}
    )

    def judged(loops: dict[str, dict[str, object]], reference: dict[str, object]) -> CompareSettings:
        return CompareSettings.model_validate({"loops": loops, "references": (reference,)})

    with pytest.raises(UserError, match="tuned on a scenario that they would be tested on: step 30 deg on loop other"):
        refuse_tuned_scenarios(judged({"fine": {}, "other": SOFT}, {"kind": "step"}), tuned)
    others: tuple[tuple[dict[str, dict[str, object]], dict[str, object]], ...] = (
        ({"soft": {}}, {"kind": "step"}),  # the same name for another loop
        ({"other": SOFT}, {"kind": "step", "angle_deg": 20.0}),
        ({"other": SOFT}, {"kind": "minimum-jerk"}),
    )
    for loops, reference in others:
        refuse_tuned_scenarios(judged(loops, reference), tuned)
