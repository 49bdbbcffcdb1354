"""Open logs as recordings: whose tendons they are, even steps, what serves for what, and what they tell."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from unittest.mock import patch

import numpy as np
import pytest

from wristctl.commands.identify.logs import settings_told, told_answer
from wristctl.config.wrist import TendonPlace, WristParameters
from wristctl.errors import UserError
from wristctl.identification.arc_fit import fit_arcs
from wristctl.identification.driven_log import MOTIONS, motions_for
from wristctl.identification.log_model import (
    everything_fitted,
    rate_of_logs,
    readings_of_log,
    recordings_of_logs,
    robot_of_logs,
)
from wristctl.identification.model_choice import tried_models
from wristctl.records.open_log import OpenLog
from wristctl.wrist.compiled_model import terms
from wristctl.wrist.segments import segments

WRIST = WristParameters()
OFFSET = WRIST.tendon_offset


def planar(
    seed: int = 0, mass: float | None = None, tension: bool = False, sign: float = 1.0, trials: int = 1
) -> OpenLog:
    """A wrist in one plane on an antagonist pair of 8 over its stiffness, 40 ms late, its stiffness 0.5 N m/rad."""
    rng = np.random.default_rng(seed)
    parts = []
    for trial in range(trials):
        time = np.arange(0.0, 6.0, 0.02)
        wanted = 0.4 * np.sin((1.3 + 0.4 * trial) * time) * np.minimum(1.0, time)
        late = 0.4 * np.sin((1.3 + 0.4 * trial) * (time - 0.04)) * np.clip(time - 0.04, 0.0, 1.0)
        tight = 6e-4  # both tendons stay taut
        stiff = 8.0 / (1.0 + 2.0 * 8.0)
        bend = 2.0 * stiff * late * (1.0 if mass is None else (1.0 + 16.0) / (1.0 - 0.4 * mass + 16.0))
        here = 2.0 * stiff * wanted
        pulls = 0.5 * 8.0 / OFFSET * np.stack([wanted - here + tight / OFFSET, here - wanted + tight / OFFSET])
        columns = {"time": time, "spool_1": OFFSET * sign * wanted + tight, "spool_2": -OFFSET * sign * wanted + tight,
                   "bend_y": sign * bend + 1e-4 * rng.normal(size=len(time))}  # fmt: skip
        if tension:
            columns |= {f"tension_{k + 1}": pulls[k if sign > 0 else 1 - k] for k in (0, 1)}
        if mass is not None:
            columns["mass"] = np.full(len(time), mass)
        parts.append(columns)
    whole = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    words = {"trial": np.repeat([f"t{k}" for k in range(trials)], len(parts[0]["time"]))}
    return OpenLog(Path("made.csv"), "log", whole, words)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_late_planar_wrist_tells_its_delay_and_with_tensions_its_stiffness(sign: float) -> None:
    log = planar(tension=True, sign=sign)
    robot = robot_of_logs([log], WRIST, 0.01)
    fit = fit_arcs(robot, (), everything_fitted(recordings_of_logs([log], robot)))
    told = fit.told
    assert told["delay"].known and told["delay"].low - 2e-3 < 0.04 < told["delay"].high + 2e-3
    assert told["force"].known and fit.values["force"] == pytest.approx(0.5, rel=0.1)
    assert math.degrees(fit.rms()) < 0.1


def test_without_tensions_or_masses_nothing_in_newton_metres_is_looked_for() -> None:
    robot = robot_of_logs([planar()], WRIST, 0.01)
    assert set(robot.unknowns(())) == {"gain", "tendon", "delay", "damping", "inertia"}
    log = planar(mass=0.2, trials=2)
    log.columns["mass"][300:] = 0.6
    assert "softening" in robot_of_logs([log], WRIST, 0.01).unknowns(())


def test_of_many_trials_whole_ones_are_predicted_and_of_few_parts() -> None:
    robot = robot_of_logs([planar()], WRIST, 0.01)
    few, many = (recordings_of_logs([planar(trials=n)], robot) for n in (2, 4))
    assert [bool(one.fitted.all()) for one in many] == [True, False, False, True]
    assert [bool(one.asked.all()) for one in many] == [False, True, True, False]
    for one in few:
        assert 0.4 < one.fitted.mean() < 0.6 and (one.fitted ^ one.asked).all()
    blocks = [set(one.block.tolist()) for one in few]
    assert not blocks[0] & blocks[1] and len(blocks[1]) >= 8


@pytest.mark.parametrize("parts", [2, 4])
def test_a_motion_that_comes_back_after_some_parts_is_fitted_and_predicted_at_every_phase(parts: int) -> None:
    robot = robot_of_logs([planar()], WRIST, 0.01)
    (one,) = recordings_of_logs([planar()], robot)
    for phase in range(parts):
        there = one.block % parts == phase
        assert one.fitted[there].any() and one.asked[there].any()


@pytest.mark.parametrize("length", [6.0, 1.2])
def test_a_trial_that_begins_in_motion_is_fitted_once_nobody_needs_to_know_how_it_began(length: float) -> None:
    """Half a second later, or after a quarter of a short trial; one that begins at rest is fitted from its begin."""
    resting = planar()
    robot = robot_of_logs([resting], WRIST, 0.01)
    (whole,) = recordings_of_logs([resting], robot)
    assert (whole.fitted | whole.asked).all()
    kept = (resting.columns["time"] >= 0.7) & (resting.columns["time"] < 0.7 + length)
    cut = replace(resting, columns={name: column[kept] for name, column in resting.columns.items()}, words={})
    (begun,) = recordings_of_logs([cut], robot)
    used = begun.fitted | begun.asked
    first = begun.time[used][0] - begun.time[0]
    assert first == pytest.approx(min(0.5, 0.25 * (begun.time[-1] - begun.time[0])), abs=0.021)
    assert not used[: int(used.argmax())].any() and used[int(used.argmax()) :].all()
    (all_of_it,) = everything_fitted([begun])
    assert (all_of_it.fitted == used).all() and not all_of_it.asked.any()


def cut_in_motion(damping: float, whole: bool) -> OpenLog:
    """A damped wrist that friction holds back, by its own model; whole, or as two trials, the second cut in motion."""
    time = np.arange(0.0, 10.0, 0.0125)
    robot = robot_of_logs([planar()], WRIST, 0.01)
    way = 6e-3 * np.sin(4.1 * time) * np.cos(2.3 * time) * np.minimum(1.0, time**2)
    spools = np.stack([6e-4 + way, 6e-4 - way], axis=1)
    pause = np.diff(time, prepend=math.nan)
    values = {"gain": 1.0, "tendon": 12.0, "damping": damping, "inertia": 4e-3, "friction": 0.2, "presliding": 2e-5}
    arcs = robot.arcs({name: np.array([value]) for name, value in values.items()}, 0.0, 1)
    bend = arcs.rest(spools[None], pause)[0, :, 0]
    noise = math.radians(0.015) * np.random.default_rng(3).standard_normal(len(time))
    columns = {"time": time, "spool_1": spools[:, 0], "spool_2": spools[:, 1], "bend_y": bend + noise}
    words = {} if whole else {"trial": np.where(time < 4.4, "a", "b")}
    return OpenLog(Path("made.csv"), "log", columns, words)


@pytest.mark.slow
@pytest.mark.parametrize("damping", [0.15, 0.35])
def test_a_log_tells_the_same_damping_and_friction_whole_or_as_two_trials(damping: float) -> None:
    for log in (cut_in_motion(damping, True), cut_in_motion(damping, False)):
        robot = robot_of_logs([log], WRIST, 0.01)
        fit = fit_arcs(robot, ("tendon friction",), everything_fitted(recordings_of_logs([log], robot)))
        assert fit.told["damping"].low < damping < fit.told["damping"].high
        assert fit.values["presliding"] == pytest.approx(2e-5, rel=0.5)
        assert math.degrees(fit.rms()) == pytest.approx(0.015, rel=0.1)


def test_tendons_are_those_of_the_square_wrist_of_the_study_or_evenly_around() -> None:
    log = planar()
    square = OpenLog(
        log.file, "log", {**log.columns, "spool_4": log.columns["spool_1"], "spool_5": log.columns["spool_2"]}
    )
    four = robot_of_logs([square], WRIST, 0.01)
    toward_y = np.cos(four.angles)
    assert toward_y[2:] == pytest.approx([math.sqrt(0.5)] * 2) and toward_y[:2] == pytest.approx([-math.sqrt(0.5)] * 2)
    assert four.radius == WRIST.tendon_radius
    three = OpenLog(log.file, "log", {**log.columns, "spool_3": log.columns["spool_1"]})
    around = robot_of_logs([three], WRIST.model_copy(update={"tendons": "three"}), 0.01)
    assert np.degrees(around.angles) == pytest.approx([0.0, 120.0, 240.0])


def four_in_a_plane(plus: tuple[int, ...], bend: str = "bend_y") -> OpenLog:
    """The planar wrist with four tendons, of which `plus` make the bend grow."""
    log = planar()
    spools = {f"spool_{k}": log.columns["spool_1" if k in plus else "spool_2"] for k in range(1, 5)}
    return OpenLog(log.file, "log", {"time": log.columns["time"], bend: log.columns["bend_y"], **spools})


@pytest.mark.parametrize("plus", [(1, 2), (3, 4), (1, 3), (2, 4), (1, 4)])
@pytest.mark.parametrize(("bend", "toward"), [("bend_y", 0.0), ("bend_z", 90.0)])
def test_of_two_tendons_a_side_in_one_plane_the_motion_says_the_sides(
    plus: tuple[int, ...], bend: str, toward: float
) -> None:
    robot = robot_of_logs([four_in_a_plane(plus, bend)], WRIST, 0.01)
    directions = [toward if k in plus else toward + 180.0 for k in range(1, 5)]
    assert np.degrees(robot.angles) == pytest.approx(directions)
    assert robot.radius == OFFSET and "turn" not in robot.base
    log = four_in_a_plane(plus, bend)
    log.columns["time"][:] *= 2.0  # samples and motion stretch together
    unseen = np.arange(len(log)) % 3 > 0
    log.columns[bend][unseen] = math.nan
    assert robot_of_logs([log], WRIST, 0.01).angles == robot.angles


def test_a_spool_of_the_wrong_sense_is_refused_and_other_logs_keep_the_places_of_the_wrist() -> None:
    for plus in ((1, 2, 3), (4,), (1, 2, 3, 4)):
        with pytest.raises(UserError, match="not two on either side") as caught:
            robot_of_logs([four_in_a_plane(plus)], WRIST, 0.01)
        assert "senses" in str(caught.value.fix) and "wrist.tendons" in str(caught.value.fix)
    square = [math.atan2(y, x) for x, y in ((-1, -1), (-1, 1), (1, -1), (1, 1))]
    both = four_in_a_plane((1, 2))
    both = replace(both, columns={**both.columns, "bend_z": 0.5 * both.columns["bend_y"]})
    assert robot_of_logs([both], WRIST, 0.01).angles == pytest.approx(square)
    held = four_in_a_plane((1, 2))
    held.columns["spool_3"][:] = 1e-3
    assert robot_of_logs([held], WRIST, 0.01).angles == pytest.approx(square)
    places = tuple(TendonPlace(angle_deg=angle, radius=0.03) for angle in (0.0, 90.0, 180.0, 270.0))
    given = robot_of_logs([four_in_a_plane((1, 2))], WRIST.model_copy(update={"tendons": places}), 0.01)
    assert np.degrees(given.angles) == pytest.approx([0.0, 90.0, 180.0, 270.0]) and given.radius == 0.03
    uneven = (*places[:3], TendonPlace(angle_deg=270.0, radius=0.02))
    with pytest.raises(UserError, match="several circles"):
        robot_of_logs([both], WRIST.model_copy(update={"tendons": uneven}), 0.01)
    for more in ({"multiplicity": 2}, {"ends_at": 3}):
        unlike = (*places[:3], places[3].model_copy(update=more))
        with pytest.raises(UserError, match=r"ends before the tip .* model: wrist"):
            robot_of_logs([both], WRIST.model_copy(update={"tendons": unlike}), 0.01)
    pair = tuple(TendonPlace(angle_deg=angle, radius=0.03, multiplicity=2) for angle in (0.0, 180.0))
    assert robot_of_logs([four_in_a_plane((1, 2))], WRIST.model_copy(update={"tendons": pair}), 0.01).radius == 0.03


def test_masses_and_tensions_count_in_whichever_of_several_logs_they_are() -> None:
    light, heavy = planar(mass=0.1), planar(mass=0.4)
    assert "softening" in robot_of_logs([light, heavy], WRIST, 0.01).base
    assert "softening" not in robot_of_logs([light, planar(mass=0.1)], WRIST, 0.01).base
    assert "force" in robot_of_logs([planar(), planar(tension=True)], WRIST, 0.01).base
    with pytest.raises(UserError, match="no mass"):
        robot_of_logs([light, planar()], WRIST, 0.01)
    unweighed = planar(mass=0.1, trials=2)
    unweighed.columns["mass"][300:] = math.nan
    with pytest.raises(UserError, match="no mass"):
        robot_of_logs([unweighed], WRIST, 0.01)
    log = planar()
    timeless = replace(log, columns={name: column for name, column in log.columns.items() if name != "time"})
    robot = robot_of_logs([log, timeless], WRIST, 0.01)
    assert not robot.timed and "delay" not in robot.base
    spools = {name: log.columns[name] for name in ("time", "spool_1", "spool_2")}
    tips = replace(log, columns={**spools, "tip_x": log.columns["bend_y"], "tip_y": log.columns["bend_y"]})
    with pytest.raises(UserError, match="the tip, in"):
        robot_of_logs([log, tips], WRIST, 0.01)


@pytest.mark.parametrize(
    ("masses", "tension", "asks_for_tensions", "asks_for_masses"),
    [((None,), False, True, True), ((0.1, 0.4), False, True, False), ((0.1,), True, False, False)],
)
def test_masses_are_asked_for_only_where_the_logs_have_not_several_and_no_tensions(
    masses: tuple[float | None, ...], tension: bool, asks_for_tensions: bool, asks_for_masses: bool
) -> None:
    logs = [planar(mass=mass, tension=tension) for mass in masses]
    robot = robot_of_logs(logs, WRIST, 0.01)
    model = next(iter(tried_models(robot, [recordings_of_logs(logs, robot)], False)))
    said = " ".join(told_answer(model.fits[0], [model], model).lines())
    assert ("tension_1 [N]" in said) == asks_for_tensions
    assert ("several masses" in " ".join(said.split())) == asks_for_masses


def test_a_delay_at_its_lower_bound_is_told_as_that() -> None:
    """A rig that dates its bends too early shows no other."""
    logs = [planar()]
    robot = robot_of_logs(logs, WRIST, 0.01)
    model = next(iter(tried_models(robot, [recordings_of_logs(logs, robot)], False)))
    fit = model.fits[0]
    for value, high, bound in ((2e-6, 0.036, True), (0.003, 0.008, False), (2e-6, math.inf, False)):
        delay = fit.told["delay"]._replace(value=value, low=0.0, high=high)
        with patch.dict(vars(fit), told={**fit.told, "delay": delay}):
            said = " ".join(" ".join(told_answer(fit, [model], model).lines()).split())
        assert ("at its lower bound" in said and "dated too early" in said) == bound


def test_what_a_log_does_not_tell_is_named_with_the_motions_that_would() -> None:
    logs = [planar()]
    robot = robot_of_logs(logs, WRIST, 0.01)
    model = next(iter(tried_models(robot, [recordings_of_logs(logs, robot)], False)))
    fit = model.fits[0]
    known = {name: one._replace(low=0.9, high=1.1) for name, one in fit.told.items()}
    one_less = known | {"damping": known["damping"]._replace(low=-math.inf, high=math.inf)}
    for told, named in ((one_less, True), (known, False)):
        with patch.dict(vars(fit), told=told):
            said = " ".join(" ".join(told_answer(fit, [model], model).lines()).split())
        assert ("To tell damping, record: quick steps" in said) == named
    assert motions_for(["gain", "tendon", "nothing that a motion tells"]) == [MOTIONS["gain"]], "each motion once"


def test_settings_that_a_log_does_not_tell_are_named_as_given_or_not() -> None:
    said = settings_told(WristParameters.model_validate({"length": 0.1}))
    assert "wrist.length = 0.1 m (given)" in said and "tendon_radius = 0.02 m (by default)" in said


def test_spools_and_motion_may_have_times_of_their_own() -> None:
    log = planar()
    odd = np.arange(len(log)) % 2 == 1
    gaps = {
        name: np.where(odd, math.nan, column) if name.startswith("spool") else column
        for name, column in log.columns.items()
    }
    gaps["bend_y"] = np.where(odd, gaps["bend_y"], math.nan)
    apart = OpenLog(log.file, "log", gaps)
    robot = robot_of_logs([apart], WRIST, 0.01)
    (whole,), (with_gaps,) = (
        recordings_of_logs([OpenLog(log.file, "log", dict(log.columns))], robot),
        recordings_of_logs([apart], robot),
    )
    at = np.interp(with_gaps.time, whole.time, whole.measured[:, 0])
    assert with_gaps.measured[:, 0] == pytest.approx(at, abs=5e-3)


def test_bends_of_two_planes_may_have_rows_of_their_own() -> None:
    log = planar()
    both = {**log.columns, "bend_z": 0.5 * log.columns["bend_y"]}
    row = np.arange(len(log)) % 2
    apart = {**both, "bend_y": np.where(row, both["bend_y"], math.nan),
             "bend_z": np.where(row, math.nan, both["bend_z"])}  # fmt: skip
    robot = robot_of_logs([OpenLog(log.file, "log", both)], WRIST, 0.01)
    (whole,), (parted,) = (recordings_of_logs([OpenLog(log.file, "log", some)], robot) for some in (both, apart))
    assert parted.time[0] == pytest.approx(0.02) and parted.time[-1] == pytest.approx(5.96)
    for plane in (0, 1):
        at = np.interp(parted.time, whole.time, whole.measured[:, plane])
        assert parted.measured[:, plane] == pytest.approx(at, abs=2e-3)
    assert rate_of_logs([OpenLog(log.file, "log", apart)]) == pytest.approx(25.0)
    assert readings_of_log(OpenLog(log.file, "log", apart)) == len(log)


@pytest.mark.parametrize(("every", "instants"), [(1, 300), (2, 150)])
def test_even_readings_are_fitted_as_they_are(every: int, instants: int) -> None:
    log = planar()
    seen = np.arange(len(log)) % every == 0
    some = OpenLog(log.file, "log", {**log.columns, "bend_y": np.where(seen, log.columns["bend_y"], math.nan)})
    (recording,) = recordings_of_logs([some], robot_of_logs([some], WRIST, 0.01))
    assert len(recording.time) == instants
    assert recording.measured[:, 0] == pytest.approx(log.columns["bend_y"][seen], abs=1e-12)


@pytest.mark.parametrize(
    ("name", "value", "narrow", "wide"),
    [("gain", 1.0, 0.2, 0.9), ("tendon", 16.0, 3.9, 10.0), ("tendon", 2.0, 0.4, 3.0), ("damping", 0.2, 0.09, 0.12),
     ("damping", 0.0, 0.02, 0.06), ("delay", 0.0, 0.04, 0.06), ("friction", 0.0, 0.09, 0.2)],
)  # fmt: skip
def test_a_wide_interval_is_not_identified(name: str, value: float, narrow: float, wide: float) -> None:
    robot = robot_of_logs([planar()], WRIST, 0.01)
    assert robot.is_told(name, value, narrow) and not robot.is_told(name, value, wide)
    assert robot_of_logs([planar()], WRIST, 0.01, widest=5.0).is_told(name, value, wide)


def test_logs_without_spools_or_motion_are_refused() -> None:
    log = planar()
    bare = {name: log.columns[name] for name in ("time", "bend_y")}
    with pytest.raises(UserError, match="no motors: neither spools"):
        robot_of_logs([OpenLog(log.file, "log", bare)], WRIST, 0.01)
    alone = OpenLog(log.file, "log", bare | {"spool_2": log.columns["spool_2"]})
    with pytest.raises(UserError, match="spool_2 is its only spool"):
        robot_of_logs([alone], WRIST, 0.01)
    with pytest.raises(UserError, match=r"its tendons are spool_2, and those of .* spool_1, spool_2"):
        robot_of_logs([log, alone], WRIST, 0.01)
    still = {name: log.columns[name] for name in ("time", "spool_1", "spool_2")}
    with pytest.raises(UserError, match="neither a bend nor the tip"):
        robot_of_logs([OpenLog(log.file, "log", still)], WRIST, 0.01)


@pytest.mark.parametrize(("changed", "within"), [({}, 0.01), ({"hand_mass": 0.0}, 0.25), ({"mass": 1e-6}, 1e-3)])
def test_a_logs_arc_begins_with_the_inertia_that_the_wrist_has_straight(
    changed: dict[str, float], within: float
) -> None:
    """Its mass is spread along the arc; the model's is at the chords' middles, a quarter more."""
    wrist = WRIST.model_copy(update=changed)
    begun = robot_of_logs([planar()], wrist, 0.01).begin["inertia"] * wrist.stiffness
    assert begun == pytest.approx(terms(segments(wrist, 1), [0.0], [0.0]).mass[0, 0], rel=within)


def test_a_share_of_the_motion_is_missed_where_something_else_moves_and_noise_is_no_part_of_it() -> None:
    log, rng = planar(), np.random.default_rng(1)
    bend, time = log.columns["bend_y"], log.columns["time"]
    size = float(np.std(bend))
    shares = []
    for more in (0.0 * time, 0.3 * math.sqrt(2.0) * size * np.sin(5.1 * time), 0.3 * size * rng.normal(size=len(time))):
        changed = replace(log, columns={**log.columns, "bend_y": bend + more})
        robot = robot_of_logs([changed], WRIST, 0.01)
        fit = fit_arcs(robot, (), recordings_of_logs([changed], robot))
        shares.append(fit.missed())
        assert any(told.known for told in fit.told.values())
        assert not any(told.known for told in replace(fit, predicts=False).told.values())
    assert shares[0] < 0.02 and shares[1] == pytest.approx(0.3, abs=0.06) and shares[2] < 0.1
