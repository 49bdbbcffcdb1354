"""Which combinations a comparison runs, in which order they come back, and on what each is run."""

from __future__ import annotations

import numpy as np
import pytest

import wristctl.comparison
from tests.values import changeable
from wristctl.comparison.combinations import ComparedRow, compare, count_rollouts, planned, refuse_tuned_scenarios
from wristctl.config.families import TuningWorlds, Worlds
from wristctl.config.study import Study
from wristctl.errors import UserError
from wristctl.simulation.closed_loop import simulate
from wristctl.study_files.load import load_study
from wristctl.wrist.kinematics import AnglePath, TipPath, exact_angle

PID, SOFTER = "{controller: pid, gains: {Kp: 30, Ki: 10, Kd: 0.5}}", "{controller: pid, gains: {Kp: 3, Ki: 1, Kd: 0.1}}"
SMC = "{controller: smc, gains: exchanged}"
DRAWN = "{plant: {stiffness_spread: 0.3}}"


def study(*settings: str) -> Study:
    return load_study([], ["horizon=0.2", *settings], "compare")


BOTH = (
    f"controllers=[{SOFTER}, {SMC}, {PID}]", "loops={four: {}, one: {plant_segments: 1}}",
    "inverses=[closed-form, none]", "references=[{kind: step, angle_deg: 10}, {duration: 0.1}]",
    "directions=[flexion, radial]",
)  # fmt: skip


@pytest.fixture(scope="module")
def both() -> list[ComparedRow]:
    return compare(study(*BOTH))


def test_rows_come_by_loop_reference_direction_row_and_inverse(both: list[ComparedRow]) -> None:
    references = [
        f"{name}, {side}" for name in ("step 10 deg", "minimum jerk 0.1 s 30 deg") for side in ("flexion", "radial")
    ]
    labels = ["pid/Kp=3 Ki=1 Kd=0.1", "smc/exchanged", "pid/Kp=30 Ki=10 Kd=0.5"]
    wanted = [
        (loop, reference, label, inverse)
        for loop in ("four", "one") for reference in references for label in labels
        for inverse in ("closed-form", "none")
    ]  # fmt: skip
    assert [(row.loop, row.reference, row.label, row.inverse) for row in both] == wanted
    assert [row.jumps for row in both] == [reference.startswith("step") for _, reference, _, _ in wanted]


def test_a_controller_by_its_name_alone_has_the_preset_of_each_loop() -> None:
    """`default` where all is exact, `hardware` behind a camera, motors or a lag; one that lacks one has the other."""
    loops = "loops={exact: {}, seen: {sensor: {level: camera}}, lagged: {actuator: {level: lagged}}}"
    names = "controllers=[pid-ff, pid-ff/default, pid-ff/hardware, smc, smc/printed, smc/hardware]"
    rows = compare(study(names, loops, "inverses=[closed-form]", "references=[{duration: 0.1}]"))
    rmse = {(row.loop, row.label): row.simulation.metrics["rmse"] for row in rows}
    for loop, name, preset in [
        ("exact", "pid-ff", "default"), ("seen", "pid-ff", "hardware"), ("lagged", "pid-ff", "hardware"),
        ("exact", "smc", "hardware"), ("seen", "smc", "hardware"),
    ]:  # fmt: skip
        other = {"default": "hardware", "hardware": "default", "printed": "hardware"}[preset]
        assert rmse[loop, name] == rmse[loop, f"{name}/{preset}"]
        assert rmse[loop, name] != rmse.get((loop, f"{name}/{other}"))


def test_each_row_is_the_closed_loop_of_its_own_settings(both: list[ComparedRow]) -> None:
    """The same as simulate gives of that controller, loop, reference and direction alone."""
    assert all(row.simulation.trajectory.label == row.label for row in both)
    for row in [row for row in both if row.inverse == "none" and row.controller == "smc"]:
        name, _, side = row.reference.partition(", ")
        reference = "{kind: step, angle_deg: 10}" if name.startswith("step") else "{duration: 0.1}"
        loop = "loop={plant_segments: 1}" if row.loop == "one" else "loop={}"
        alone = ["controller=smc", "gains=exchanged", loop, f"reference={reference}", f"direction={side}"]
        course = simulate(load_study([], ["horizon=0.2", *alone], "simulate")).first.trajectory
        np.testing.assert_allclose(row.simulation.trajectory.theta, course.theta, rtol=0, atol=1e-12)
        assert np.abs(course.theta).max() > 1e-3


def test_the_number_of_rollouts_counts_repetitions_only_where_something_is_drawn() -> None:
    assert count_rollouts(study(*BOTH).compare) == 3 * 2 * 2 * 2 * 2
    drawn = study(f"loops={{still: {{}}, drawn: {DRAWN}}}", "repetitions=7", f"controllers=[{PID}, {SMC}]",
                  "inverses=[none]", "references=[{}, {kind: step}, {duration: 2.0}]")  # fmt: skip
    assert count_rollouts(drawn.compare) == 2 * 3 * (1 + 7)


def test_a_direction_is_named_only_where_there_are_several_and_wrists_lie_in_its_plane() -> None:
    tilted = "wrist.gravity_flexion=4.0"
    (one,) = planned(study("loops={one: {planes: 1}}", "references=[{kind: step}]", "inverses=[none]", tilted))
    assert [course.reference for course in one.courses] == ["step 30 deg"]
    ulnar, extension = planned(
        study(
            "loops={one: {planes: 1}}",
            "references=[{kind: step}]",
            "inverses=[none]",
            "directions=[ulnar, extension]",
            tilted,
        )
    )
    assert [each.courses[0].reference for each in (ulnar, extension)] == [
        "step 30 deg, ulnar",
        "step 30 deg, extension",
    ]
    assert [each.courses[0].scenario for each in (ulnar, extension)] == ["step 30 deg, ulnar", "step 30 deg, extension"]
    ends = [each.courses[0].motion.theta_ref[-1] for each in (ulnar, extension)]
    assert ends == [pytest.approx(np.radians(30.0)), pytest.approx(np.radians(-30.0))]
    assert ulnar.wrist.gravity[1] == 0.0 and extension.wrist.gravity[1] == 4.0


def test_a_loops_own_period_samples_its_references() -> None:
    fine, coarse = planned(study("loops={fine: {control_period: 0.002}, coarse: {control_period: 0.01}}",
                                 "inverses=[none]", "references=[{}]"))  # fmt: skip
    assert [each.name for each in (fine, coarse)] == ["fine", "coarse"]
    assert [np.diff(each.courses[0].motion.time[:2])[0] for each in (fine, coarse)] == pytest.approx([0.002, 0.01])


def test_repetitions_meet_another_plant_each_and_the_same_for_every_row() -> None:
    drawn = study(f"loops={{drawn: {DRAWN}}}", "repetitions=3", f"controllers=[{PID}, {SOFTER}]",
                  "inverses=[none, closed-form]", "references=[{duration: 0.1}]")  # fmt: skip
    found = compare(drawn)
    assert len(found) == 4 and all(len(set(row.repeated.metrics["rmse"])) == 3 for row in found)
    for direct, through_tip in zip(found[::2], found[1::2], strict=True):
        np.testing.assert_allclose(
            direct.repeated.metrics["rmse"], through_tip.repeated.metrics["rmse"], rtol=1e-6, err_msg="the same plants"
        )


def test_progress_goes_from_nothing_to_all_in_shares_of_the_whole() -> None:
    seen: list[float] = []
    compare(study("loops={one: {plant_segments: 1}, other: {}}", f"controllers=[{PID}, {SMC}]", "inverses=[none]"),
            progress=seen.append)  # fmt: skip
    assert seen == sorted(seen) and seen[-1] == pytest.approx(1.0) and 0.0 <= seen[0] <= 0.25
    assert {0.25, 0.5, 0.75, 1.0} <= {round(each, 9) for each in seen}, "two loops by two controllers"


def test_worlds_of_a_family_are_no_scenarios_that_could_be_judged_on() -> None:
    """Its scenarios are then not what was searched on, nor need their loops be there."""
    judged = study("loops={one: {}}", "references=[{kind: step, angle_deg: 20}]").compare
    searched = load_study(
        [], ["scenarios=[{loop: one, reference: {kind: step, angle_deg: 20}}]", "loops={one: {}}"], "tune"
    )
    with pytest.raises(UserError, match="tuned on a scenario"):
        refuse_tuned_scenarios(judged, searched.tune)
    on_worlds = searched.tune.model_copy(update={"worlds": TuningWorlds(family="soft"), "loops": {}})
    refuse_tuned_scenarios(judged, on_worlds)
    refuse_tuned_scenarios(judged.model_copy(update={"worlds": Worlds(family="soft")}), searched.tune)


def test_a_network_and_tuned_gains_are_asked_for_before_anything_runs() -> None:
    seen: list[float] = []
    with pytest.raises(UserError, match="network"):
        compare(study("inverses=[none, network]"), progress=seen.append)
    tuned = study("controllers=[{controller: pid, gains: tuned}]", "inverses=[none]",
                  "loops={one: {plant_segments: 1}}", "references=[{duration: 0.1}]")  # fmt: skip
    with pytest.raises(UserError, match="no tuned gains of pid"):
        compare(tuned, progress=seen.append)
    assert not seen
    found = compare(tuned, tuned={"pid": {"Kp": 30.0, "Ki": 10.0, "Kd": 0.5}})
    given = compare(study(f"controllers=[{PID}]", "inverses=[none]", "loops={one: {plant_segments: 1}}",
                          "references=[{duration: 0.1}]"))  # fmt: skip
    assert found[0].label == "pid/tuned" and found[0].simulation.metrics == given[0].simulation.metrics


def test_what_a_comparison_hands_out_cannot_be_changed() -> None:
    assert changeable(wristctl.comparison) == []


def test_a_network_changes_the_reference_of_its_inverse_and_not_what_is_wanted() -> None:
    def short(path: TipPath) -> AnglePath:
        theta = 0.9 * exact_angle(path.position)
        return AnglePath(theta, 0.0 * theta, 0.0 * theta, theta > 1.0)

    asked = study("loops={one: {}}", "inverses=[closed-form, network]", "references=[{duration: 0.1}]")
    ((exact, learned),) = [condition.courses for condition in planned(asked, short)]
    assert (exact.inverse, learned.inverse) == ("closed-form", "network")
    np.testing.assert_allclose(learned.motion.theta_ref, 0.9 * exact.motion.theta_ref, atol=1e-12)
    np.testing.assert_array_equal(learned.motion.theta_desired, exact.motion.theta_desired)
