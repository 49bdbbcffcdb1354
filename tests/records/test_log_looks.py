"""What no wrist does is refused at its line before anything is fitted; what is mended is told."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from tests.identification.inner_rigs import drawn_rig, recorded
from tests.identification.test_log_model import planar
from wristctl.arrays import Array
from wristctl.errors import UserError
from wristctl.records.log_converters import read_log
from wristctl.records.log_looks import looked_at
from wristctl.records.log_mending import parted
from wristctl.records.open_log import OpenLog

FIELD = Path(__file__).parents[1] / "data" / "field"
CLEAN = Path(__file__).parents[2] / "experiments" / "logs" / "clean.csv"
COUNTS = "time=ms [ms], bend_y=imu [deg], spool_1=enc1 [0.000719 mm], spool_2=enc2 [0.000719 mm]"


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("swapped.csv", "exchanged"),
        ("degrees_as_rad.csv", "in degrees"),
        ("ms_as_s.csv", "in ms"),
        ("still.csv", "without motion"),
    ],
)
def test_refused_before_a_fit(name: str, words: str) -> None:
    with pytest.raises(UserError) as refused:
        looked_at(read_log(FIELD / name))
    assert words in str(refused.value)


@pytest.mark.parametrize(
    ("name", "told"),
    [
        ("swapped.csv", "spool_1=spool_2 [mm], spool_2=spool_1 [mm]"),
        ("degrees_as_rad.csv", "bend_y=bend_y [deg]"),
        ("ms_as_s.csv", "time=time [ms]"),
    ],
)
def test_the_fix_can_be_pasted_and_gives_the_clean_numbers(name: str, told: str) -> None:
    with pytest.raises(UserError) as refused:
        looked_at(read_log(FIELD / name))
    assert f"--columns '{told}'" in refused.value.fix
    clean, log = read_log(CLEAN), looked_at(read_log(FIELD / name, told))
    for column, values in clean.columns.items():
        np.testing.assert_allclose(log.columns[column], values, rtol=1e-12, atol=1e-15)


def test_the_fix_keeps_what_was_named(tmp_path: Path) -> None:
    table = pd.read_csv(FIELD / "swapped.csv")
    table.columns = pd.Index(["t", "imu", "m1", "m2"])
    table.to_csv(tmp_path / "own.csv", index=False)
    names = "time=t [s], bend_y=imu [deg], spool_1=m1 [0.5 mm], spool_2=m2 [0.5 mm]"
    with pytest.raises(UserError) as refused:
        looked_at(read_log(tmp_path / "own.csv", names))
    fix = "time=t [s], bend_y=imu [deg], spool_1=m2 [0.5 mm], spool_2=m1 [0.5 mm]"
    assert f"--columns '{fix}'" in refused.value.fix


@pytest.mark.parametrize("tendon", [1, 2])
def test_millimetres_under_a_head_of_metres_are_refused_at_the_furthest_sample(tendon: int, tmp_path: Path) -> None:
    table = pd.read_csv(CLEAN)
    (head,) = (name for name in map(str, table) if name.startswith(f"spool_{tendon} [mm]"))
    changed = table.rename(columns={head: f"spool_{tendon} [m]"})
    changed.to_csv(tmp_path / "metres.csv", index=False)
    with pytest.raises(UserError, match="is it in mm") as refused:
        looked_at(read_log(tmp_path / "metres.csv"))
    furthest = int(table[head].abs().argmax()) + 2
    assert f"spool_{tendon}" in str(refused.value) and f"metres.csv:{furthest}" in str(refused.value)


def test_a_sound_log_stays_as_it_is() -> None:
    log = read_log(CLEAN)
    assert looked_at(log) is log


def test_repeated_rows_are_left_out_and_told() -> None:
    clean, log = read_log(CLEAN), looked_at(read_log(FIELD / "duplicate.csv"))
    for name, column in clean.columns.items():
        np.testing.assert_array_equal(log.columns[name], column)
    assert log.remarks[0].startswith("3 rows")


def test_a_clock_that_starts_again_parts_the_log() -> None:
    log = looked_at(read_log(FIELD / "clock_reset.csv"))
    trials = log.trials()
    assert len(trials) == 2
    assert all(np.all(np.diff(trial.columns["time"]) > 0.0) for trial in trials.values())
    assert ":502:" in log.remarks[0]


def test_counters_that_wrap_go_on_and_it_is_told() -> None:
    clean, log = read_log(CLEAN), looked_at(read_log(FIELD / "wrapped_counts.csv", COUNTS))
    for name in ("spool_1", "spool_2"):
        assert np.ptp(log.columns[name] - clean.columns[name]) < 3e-6  # a count is 0.7 um
    assert log.remarks[0].startswith("enc1 begins again after 2^16 counts at wrapped_counts.csv:27, 8 times")
    assert "enc1, enc2 are reeled in by 43.4 mm" in log.remarks[2]  # where these encoders began


@pytest.mark.parametrize("unit", ["m", "mm", "0.175 mm", "0.1 mm", "0.01 mm", "-0.0001 mm"])
def test_counts_of_a_wrong_length_are_refused_with_one_that_is_taken(unit: str) -> None:
    """The length that the tendon's way makes of the bend; the encoders were recorded with 0.000719 mm."""
    names = COUNTS.replace("0.000719 mm", unit)
    with pytest.raises(
        UserError, match=r"one count is about 0\.0007 mm if the tendon runs at wrist\.tendon_rad"
    ) as refused:
        looked_at(read_log(FIELD / "wrapped_counts.csv", names), tendon_offset=0.0141)
    sign = "-" if unit.startswith("-") else ""
    told = names.replace(unit + "]", f"{sign}0.0007 mm]")
    assert sorted(told.split(", ")) == sorted(refused.value.fix.split("'")[1].split(", "))
    if not sign:
        assert len(looked_at(read_log(FIELD / "wrapped_counts.csv", told), tendon_offset=0.0141)) == 1000


def test_the_first_proposal_for_counts_is_taken() -> None:
    with pytest.raises(
        UserError, match=r"the numbers the unit of enc1, enc2, imu; one count is about 0\.0007"
    ) as refused:
        read_log(FIELD / "wrapped_counts.csv")
    log = looked_at(read_log(FIELD / "wrapped_counts.csv", refused.value.fix.split("'")[1]), tendon_offset=0.0141)
    np.testing.assert_allclose(np.ptp(log.columns["spool_1"]), 0.0126, rtol=0.05)


@pytest.mark.parametrize(("bend", "spool"), [("deg", "mm"), ("deg", "m"), ("rad", "mm")])
def test_units_that_the_range_of_bend_and_spools_refutes_are_refused(bend: str, spool: str) -> None:
    names = f"time=t [s], bend_y=theta [{bend}], spool_1=l1 [{spool}], spool_2=l2 [{spool}]"
    with pytest.raises(UserError, match=r"l1 moves .* mm, and the bend takes .* mm") as refused:
        looked_at(read_log(FIELD / "log.mat", names), tendon_offset=0.0141)
    log = looked_at(read_log(FIELD / "log.mat", refused.value.fix.split("'")[1], others=True), tendon_offset=0.0141)
    assert np.abs(log.columns["spool_1"]).max() == pytest.approx(0.0066, rel=0.02)


def test_counts_without_a_bend_are_told_how_long_one_can_be(tmp_path: Path) -> None:
    table = pd.read_csv(FIELD / "wrapped_counts.csv").rename(columns={"enc1": "spool_1 [mm]"})
    table[["spool_1 [mm]"]].to_csv(tmp_path / "counts.csv", index=False)
    with pytest.raises(UserError, match=r"moves 17\.5 m .* the length that one count reels in: less than 0\.11 mm"):
        looked_at(read_log(tmp_path / "counts.csv"))


def test_other_jumps_of_a_counter_are_refused_at_their_line(tmp_path: Path) -> None:
    clean = read_log(CLEAN).columns
    counts = {f"enc{k}": np.round(clean[f"spool_{k}"] / 0.719e-6).astype(int) % 40000 for k in (1, 2)}
    table = pd.DataFrame({"ms": 1e3 * clean["time"], "imu": np.degrees(clean["bend_y"]), **counts})
    table.to_csv(tmp_path / "turn.csv", index=False)
    with pytest.raises(UserError, match=r"enc1 jumps 28\.\d mm .* - .*turn\.csv:\d+ - fix: a counter that wraps"):
        looked_at(read_log(tmp_path / "turn.csv", COUNTS))


def test_each_start_of_a_clock_counts_from_the_one_before() -> None:
    """The first recording begins at 0, those after it at 5 s."""
    time = np.concatenate([np.arange(0.0, 100.0, 0.5), np.arange(5.0, 20.0, 0.5), np.arange(5.0, 40.0, 0.5)])
    log = parted(OpenLog(Path("three.csv"), "log", {"time": time, "bend_y": np.sin(time)}))
    assert [len(trial) for trial in log.trials().values()] == [200, 30, 70] and list(log.trials()) == ["1", "2", "3"]


@pytest.mark.parametrize("signed", [True, False])
def test_clocks_and_counters_of_32_bits_wrap_too(signed: bool, tmp_path: Path) -> None:
    clean = read_log(CLEAN)
    clock = (2**32 - 2_000_000 + np.round(1e6 * clean.columns["time"]).astype(np.int64)) % 2**32
    counts = np.round(clean.columns["spool_1"] / 1e-7).astype(np.int64)
    counts = (counts + 2**31 + 2**31) % 2**32 if not signed else (counts + 2**31 + 2**31) % 2**32 - 2**31
    table = pd.DataFrame({"time [us]": clock, "spool_1 [0.1 um]": counts})
    table.to_csv(tmp_path / "counts.csv", index=False)
    log = looked_at(read_log(tmp_path / "counts.csv"))
    np.testing.assert_allclose(np.diff(log.columns["time"]), np.diff(clean.columns["time"]), atol=1e-9)
    assert np.ptp(log.columns["spool_1"] - clean.columns["spool_1"]) < 3e-7
    assert any("time begins again after 2^32" in remark for remark in log.remarks) and "trial" not in log.words


def changed(name: str, change: Callable[[Array], Array], rows: slice = slice(None)) -> OpenLog:
    """The clean log with something done to some rows of a column."""
    clean = read_log(CLEAN)
    column = clean.columns[name].copy()
    column[rows] = change(column[rows])
    return replace(clean, columns={**clean.columns, name: column})


def test_rows_that_come_late_are_put_in_their_place_and_recordings_in_one_are_refused() -> None:
    clean = read_log(CLEAN)
    order = np.arange(len(clean))
    order[[200, 201, 202]] = [202, 200, 201]
    late = replace(clean, columns={name: column[order] for name, column in clean.columns.items()})
    log = looked_at(late)
    np.testing.assert_array_equal(log.columns["bend_y"], clean.columns["bend_y"])
    assert log.remarks == ["1 rows that come late are put in the order of their times; the first is at clean.csv:203."]
    assert [log.at(row) for row in (199, 200, 201, 202)] == [clean.at(row) for row in (199, 201, 202, 200)]
    late = replace(clean, columns={name: np.roll(column, 300) for name, column in clean.columns.items()})
    again = looked_at(late)
    assert len(again.trials()) == 2  # from its first time on
    middle = replace(
        late,
        columns={
            **late.columns,
            "time": np.concatenate([np.linspace(5.0, 9.0, 300), late.columns["time"][300:] + 6.5]),
        },
    )
    with pytest.raises(UserError, match=r"time goes back by 2\.5 s - .*clean\.csv:302 - fix: two recordings in one"):
        looked_at(middle)


@pytest.mark.parametrize(
    ("name", "change", "rows", "told"),
    [
        ("time", lambda time: time + 0.52, slice(400, None), "clean.csv:402: 0.53 s without a row"),
        ("bend_y", lambda bend: 0.0 * bend + bend[0], slice(300, 420), "clean.csv:302 to 421: bend_y stands at"),
        ("spool_2", lambda spool: 0.0 * spool + spool[0], slice(300, 420), "clean.csv:302 to 421: spool_2 stands at"),
        ("bend_y", lambda bend: np.minimum(bend, 0.2), slice(None), "bend_y stops at 11.46 as a sensor at its end"),
        ("bend_y", lambda bend: np.roll(bend, 60), slice(None), "s behind the spools all along; are both of one clock"),
        ("bend_y", lambda bend: np.roll(bend, -60), slice(None), "clean.csv:1: bend_y is 0.59 s ahead of the spools"),
    ],
)  # fmt: skip
def test_what_a_fit_would_take_as_motion_is_told_with_its_line(
    name: str, change: Callable[[Array], Array], rows: slice, told: str
) -> None:
    faulty = changed(name, change, rows)
    log = looked_at(faulty)
    assert len(log.remarks) == 1 and told in log.remarks[0]
    np.testing.assert_array_equal(log.columns[name], faulty.columns[name])


def test_units_that_no_wrist_has_are_refused(tmp_path: Path) -> None:
    clean = read_log(CLEAN)
    newtons = {f"tension_{k}": 8000.0 + 1e6 * clean.columns[f"spool_{k}"] for k in (1, 2)}
    with pytest.raises(UserError, match=r"tension_1 reaches .* N by its header .* in mN, or a current in mA"):
        looked_at(replace(clean, columns={**clean.columns, **newtons}))
    seconds = pd.read_csv(CLEAN).rename(columns={"time [s]": "time [ms]"})
    seconds.to_csv(tmp_path / "s.csv", index=False)
    with pytest.raises(
        UserError, match=r"spool_1 moves at .* m/s - .*s\.csv:3 - fix: is time in s\? .* 'time=time \[s\]'"
    ):
        looked_at(read_log(tmp_path / "s.csv"))
    glitch = changed("bend_y", lambda bend: bend + 20.0, slice(5, 6))
    with pytest.raises(UserError, match=r"clean\.csv:7 - fix: the numbers, or their unit: \[0\.1 deg\] is a tenth"):
        looked_at(glitch)


def test_tendons_exchanged_in_one_trial_or_in_tensions_are_refused() -> None:
    clean = read_log(CLEAN)
    half = np.arange(len(clean)) >= 500
    one, two = (clean.columns[f"spool_{k}"] for k in (1, 2))
    columns = {**clean.columns, "spool_1": np.where(half, two, one), "spool_2": np.where(half, one, two)}
    words = {"trial": np.where(half, "second", "first")}
    with pytest.raises(UserError, match="reeled in in trial second"):
        looked_at(replace(clean, columns=columns, words=words))
    pulled = {"tension_1": 5.0 - 100.0 * one, "tension_2": 5.0 - 100.0 * two}
    only = {name: column for name, column in clean.columns.items() if not name.startswith("spool")}
    with pytest.raises(UserError, match=r"pulls more .* exchange tension_1 and tension_2"):
        looked_at(replace(clean, columns=only | pulled))


@pytest.mark.parametrize("quantum_deg", [0.0, 0.1, 0.5])
@pytest.mark.parametrize("held", [1, 4])
def test_drawn_sound_logs_stay_as_they_are(quantum_deg: float, held: int) -> None:
    for seed, sign in ((0, 1.0), (1, -1.0)):
        log = planar(seed, mass=0.2, tension=True, sign=sign, trials=2)
        bend = log.columns["bend_y"][np.arange(len(log)) // held * held]
        quantum = np.radians(quantum_deg)
        seen = quantum * np.round(bend / quantum) if quantum else bend
        sound = replace(log, columns={**log.columns, "bend_y": seen})
        assert looked_at(sound) is sound
        gaps = replace(log, columns={**log.columns, "bend_y": np.where(np.arange(len(log)) % 3, np.nan, bend)})
        assert looked_at(gaps) is gaps


@pytest.mark.slow
def test_a_wrist_with_slack_and_friction_is_sound() -> None:
    rng = np.random.default_rng(0)
    time = 0.02 * np.arange(400.0)
    bend, spools = recorded(drawn_rig(rng, True), lambda at: 6e-3 * np.sin(0.5 * np.pi * at), time, rng)
    columns = {"time": time, "bend_y": bend, "spool_1": spools[:, 0], "spool_2": spools[:, 1]}
    sound = OpenLog(Path("made.csv"), "log", columns)
    assert looked_at(sound) is sound


def told_of(log: OpenLog) -> str:
    """What the looks say of a log, or why they refuse it."""
    try:
        return " ".join(looked_at(log, tendon_offset=0.0141).remarks)
    except UserError as refused:
        return str(refused)


@pytest.mark.parametrize("tendon", [1, 2])
def test_one_spool_with_the_other_sign_is_refused_with_what_mends_it(tendon: int, tmp_path: Path) -> None:
    table = pd.read_csv(CLEAN)
    table[f"spool_{tendon} [mm]"] *= -1.0
    table.to_csv(tmp_path / "sign.csv", index=False)
    with pytest.raises(UserError, match=f"reel in together.*spool_{tendon} with the other sign") as refused:
        looked_at(read_log(tmp_path / "sign.csv"))
    log = looked_at(read_log(tmp_path / "sign.csv", refused.value.fix.split("'")[1]))
    np.testing.assert_allclose(log.columns[f"spool_{tendon}"], read_log(CLEAN).columns[f"spool_{tendon}"])


@pytest.mark.parametrize("size", [2048, 4096])
def test_a_counter_that_wraps_at_a_turn_is_refused_at_the_line_where_it_jumps(size: int) -> None:
    clean = read_log(CLEAN).columns["spool_1"]
    counts = np.round(clean / 2e-6).astype(int)
    wrapped = changed("spool_1", lambda spool: 2e-6 * ((counts - int(np.median(counts))) % size))
    first = int(np.flatnonzero(np.abs(np.diff(wrapped.columns["spool_1"])) > 1e-6 * size)[0]) + 3
    assert f"clean.csv:{first} - fix: a counter that wraps" in told_of(wrapped)


def test_steps_that_the_wrist_follows_are_no_jumps() -> None:
    clean = read_log(CLEAN)
    stepped = {name: column[np.arange(len(clean)) // 100 * 100] for name, column in clean.columns.items()}
    assert "jumps" not in told_of(replace(clean, columns={**stepped, "time": clean.columns["time"]}))


def test_a_step_of_one_tendon_that_the_wrist_follows_is_no_jump() -> None:
    clean = read_log(CLEAN)
    after = np.arange(len(clean)) >= 500
    moved = {"spool_1": 2e-3 * after, "bend_y": 0.5 * 2e-3 / 0.0141 * after}
    columns = {name: column + moved.get(name, 0.0) for name, column in clean.columns.items()}
    assert "jumps" not in told_of(replace(clean, columns=columns))
    assert "jumps" in told_of(replace(clean, columns={**columns, "bend_y": clean.columns["bend_y"]}))


@pytest.mark.parametrize("name", ["bend_y", "spool_2"])
def test_cells_that_stand_alone_are_told_with_their_lines(name: str) -> None:
    wrong = changed(name, lambda column: 3.0 * column + 0.005, slice(333, 334))
    told = told_of(wrong)
    assert f"clean.csv:335: a cell stands alone in {name}" in told


@pytest.mark.parametrize(
    ("names", "rows"),
    [(("bend_y",), 12), (("spool_1",), 12), (("spool_1", "spool_2"), 12), (("spool_1", "spool_2"), 80)],
)
def test_short_standstills_are_told_where_a_column_catches_up_in_one_step(names: tuple[str, ...], rows: int) -> None:
    clean = read_log(CLEAN)
    begin = int(np.argmax(np.abs(np.gradient(clean.columns["spool_1"]))[100:800])) + 100
    columns = dict(clean.columns)
    for name in names:
        columns[name] = columns[name].copy()
        columns[name][begin : begin + rows] = columns[name][begin]
    assert f"clean.csv:{begin + 2} to {begin + 1 + rows}: {names[0]} stands at" in told_of(
        replace(clean, columns=columns)
    )


@pytest.mark.parametrize("early", [0.05, 0.2])
def test_a_motion_that_comes_before_its_pull_is_told(early: float) -> None:
    time = read_log(CLEAN).columns["time"]
    assert "ahead of the spools" in told_of(changed("bend_y", lambda bend: np.interp(time + early, time, bend)))


def test_two_planes_that_are_late_are_told() -> None:
    time = 0.02 * np.arange(600.0)
    bends = [0.3 * np.sin(1.7 * time) * np.cos(0.4 * time), 0.25 * np.sin(2.3 * time + 1.0)]
    angles = np.radians([0.0, 120.0, 240.0])
    spools = {f"spool_{k + 1}": 0.02 * (np.cos(a) * bends[0] + np.sin(a) * bends[1]) for k, a in enumerate(angles)}
    for late, told in ((0.0, ""), (0.6, "0.6 s behind the spools")):
        seen = {
            name: np.interp(time - late, time, bend) for name, bend in zip(("bend_y", "bend_z"), bends, strict=True)
        }
        log = OpenLog(Path("made.csv"), "log", {"time": time, **seen, **spools})
        assert told in told_of(log) and bool(told) == bool(told_of(log))


def test_a_spool_of_another_unit_than_the_other_is_told() -> None:
    assert "spool_2 goes with the wrist, and moves 0.01" in told_of(changed("spool_2", lambda spool: 1e-3 * spool))


@pytest.mark.parametrize("size", [256, 1000])
def test_a_counter_that_wraps_every_few_rows_does_not_go_with_the_wrist(size: int) -> None:
    wrapped = changed("spool_1", lambda spool: 2e-6 * (np.round(spool / 2e-6) % size))
    assert "spool_1 does not go with the wrist as spool_2 does" in told_of(wrapped)


@pytest.mark.parametrize(("unit", "factor"), [("[rad]", 1.0), ("[deg]", np.pi / 180.0)])
def test_bends_under_the_other_unit_of_angles_are_asked_for(unit: str, factor: float, tmp_path: Path) -> None:
    table = pd.read_csv(CLEAN).rename(columns={"bend_y [deg]": f"bend_y {unit}"})
    table[f"bend_y {unit}"] *= 0.5 * factor
    table[["spool_1 [mm]", "spool_2 [mm]"]] *= 0.5
    table.to_csv(tmp_path / "angles.csv", index=False)
    with pytest.raises(UserError, match=r"in deg|in rad") as refused:
        looked_at(read_log(tmp_path / "angles.csv"), tendon_offset=0.0141)
    assert "--columns 'bend_y=bend_y" in refused.value.fix


@pytest.mark.parametrize("row", [20, 40, 900])
def test_a_clock_that_starts_again_near_an_end_parts_the_log_there(row: int) -> None:
    log = changed("time", lambda time: time - time[0], slice(row, None))
    trials = looked_at(log).trials()
    assert [len(trial) for trial in trials.values()] == [row, len(log) - row]


def test_trials_with_a_name_are_parted_where_their_clock_starts_again() -> None:
    log = changed("time", lambda time: time - time[0], slice(500, None))
    named = replace(log, words={"trial": np.full(len(log), "push")})
    assert list(looked_at(named).trials()) == ["push, 1", "push, 2"]


def test_whole_seconds_over_hours_are_asked_for_their_unit() -> None:
    assert "is it in ms" in told_of(changed("time", lambda time: np.round(1e3 * np.arange(len(time)))))


@pytest.mark.parametrize(("millimetres", "rows"), [(0.13, 1), (0.0, 40), (0.02, 1)])
def test_spools_that_scatter_are_told_and_staircases_are_not(millimetres: float, rows: int) -> None:
    rng = np.random.default_rng(0)
    held = np.arange(1000) // rows * rows
    told = told_of(changed("spool_1", lambda spool: spool[held] + 1e-3 * millimetres * rng.standard_normal(1000)))
    assert ("spool_1 scatter by 0.1" in told) == (millimetres > 0.1) and ("scatter" in told) == (millimetres > 0.1)
