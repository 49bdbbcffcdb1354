"""Open logs: any order, unit and author's name of a column give the same numbers, and what is wrong has its place."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from wristctl.errors import UserError
from wristctl.records.log_columns import COLUMNS, mapped_names, units_of
from wristctl.records.log_converters import read_log
from wristctl.records.open_log import OpenLog, write_log

HEAD = "time [s],trial,spool_1 [mm],spool_2 [mm],tension_1 [N],bend_y [deg],mass [g],marker"
ROWS = ["0.0,a,1.0,-1.0,2.5,10.0,500,start", "0.1,a,2.0,-2.0,,20.0,500,", "0.0,b,3.0,-3.0,4.5,,500,end"]


def log_of(folder: Path, *lines: str, names: str = "", name: str = "log.csv") -> OpenLog:
    file = folder / name
    file.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return read_log(file, names)


def test_columns_are_in_si_units_and_an_empty_cell_is_no_number(tmp_path: Path) -> None:
    log = log_of(tmp_path, HEAD, *ROWS)
    np.testing.assert_allclose(log.columns["spool_2"], [-1e-3, -2e-3, -3e-3])
    np.testing.assert_allclose(log.columns["bend_y"], np.radians([10.0, 20.0, np.nan]))
    np.testing.assert_allclose(log.columns["mass"], 0.5)
    assert log.words["marker"].tolist() == ["start", "", "end"] and len(log) == 3
    assert list(log.tendons("spool")) == [1, 2]
    with pytest.raises(UserError, match=r"tension_1 is missing - .*log\.csv:3 - "):
        log.tendons("tension")


def test_trials_part_the_log_and_keep_their_lines(tmp_path: Path) -> None:
    first, second = log_of(tmp_path, "# by hand", HEAD, *ROWS).trials().values()
    np.testing.assert_allclose(first.columns["spool_1"], [1e-3, 2e-3])
    assert second.columns["tension_1"].tolist() == [4.5] and second.at(0).endswith("log.csv:5")
    alone = log_of(tmp_path, "time [s],angle [rad]", "0.0,0.1")
    assert alone.trials() == {"": alone}


def test_names_of_another_author_are_mapped_with_their_units(tmp_path: Path) -> None:
    names = "time=t [ms], spool_1=enc a [0.175 mm], spool_2=enc b [-2 mm], bend_y=imu, trial=name, tip_x=x [mm]"
    log = log_of(tmp_path, "name;t;enc a;noise;enc b;imu [deg];x", "up;100;10;7;5;90;3", names=names)
    expected = {"time": 0.1, "spool_1": 1.75e-3, "spool_2": -1e-2, "bend_y": 0.5 * np.pi, "tip_x": 3e-3}
    assert {name: pytest.approx(float(column[0])) for name, column in log.columns.items()} == expected
    assert log.words["trial"].tolist() == ["up"]


@pytest.mark.parametrize(
    ("names", "what", "fix"),
    [
        ("bend_y=imv [deg]", "no column 'imv', which is to be bend_y", "did you mean 'imu'?"),
        ("bent=imu [deg]", "bent is no column of an open log", "did you mean"),
        ("bend_y", "'bend_y' maps no column", "bend_y=imu [deg]"),
        ("qualysis", "unknown log format 'qualysis'", "did you mean 'qualisys'?"),
        ("humasof", "unknown log format 'humasof'", "did you mean 'humasoft'?"),
        ("bend_y=imu [N]", "imu is in 'N'", "imu [deg] or [rad]"),
        (
            "bend_y=imu",
            "column 'imu' has no unit",
            "imu [deg] or [rad]; or leave the file as it is: --columns 'time=t [s], bend_y=imu [deg]'",
        ),
        ("bend_y=imu [2 N]", "imu is in '2 N'", "a multiple such as [0.5 deg]"),
    ],
)
def test_a_mapping_that_cannot_be_meant_is_refused(names: str, what: str, fix: str, tmp_path: Path) -> None:
    with pytest.raises(UserError) as caught:
        log_of(tmp_path, "t [s],imu", "0,10", names=names)
    assert what in caught.value.what and fix in caught.value.fix


PROPOSALS = {
    "t_ms;Winkel_grad;Seil1_mm": "time=t_ms [ms], bend_y=Winkel_grad [deg], spool_1=Seil1_mm [mm]",
    "t [ms];Winkel [deg];Seil1 [mm]": "time=t [ms], bend_y=Winkel [deg], spool_1=Seil1 [mm]",
    "Zeit (s);Biegewinkel (Grad);Zugkraft 2 [N]": "time=Zeit (s) [s], bend_y=Biegewinkel (Grad) [deg], "
    "tension_2=Zugkraft 2 [N]",
    "temps_s;câble0_mm;câble1_mm": "time=temps_s [s], spool_1=câble0_mm [mm], spool_2=câble1_mm [mm]",
    "timeMs;thetaRef [rad];seil_rechts_mm;seil_links_mm": "time=timeMs [ms], spool_2=seil_rechts_mm [mm], "
    "spool_1=seil_links_mm [mm]",
    "motor1_deg;tip_x_mm;masse_kg": "spool_1=motor1_deg [0.1745 mm], tip_x=tip_x_mm [mm], mass=masse_kg [kg]",
    "ms;imu;enc1;enc2": "time=ms [ms], bend_y=imu [deg], spool_1=enc1 [mm], spool_2=enc2 [mm]",
}


@pytest.mark.parametrize("head", list(PROPOSALS))
def test_columns_of_ones_own_are_answered_with_a_text_that_one_can_paste(tmp_path: Path, head: str) -> None:
    row = ";".join(["0", "10", "20", "30"][: head.count(";") + 1])
    with pytest.raises(UserError) as caught:
        log_of(tmp_path, head, row)
    assert f"--columns '{PROPOSALS[head]}'" in caught.value.fix
    pasted = log_of(tmp_path, head, row, names=PROPOSALS[head])
    assert list(pasted.columns) == [entry.partition("=")[0] for entry in PROPOSALS[head].split(", ")]


def test_a_proposal_says_what_it_guesses_and_what_it_passes_over(tmp_path: Path) -> None:
    with pytest.raises(UserError) as caught:
        log_of(tmp_path, "t_s,Winkel,Temperatur", "0,0,2")
    assert "(guessed: the unit of Winkel) (it passes over Temperatur)" in caught.value.fix
    with pytest.raises(UserError, match=r"unknown column 'Temperatur'.* --columns 'NAME=Temperatur .UNIT.'"):
        log_of(tmp_path, "Temperatur", "2")


@pytest.mark.parametrize(("head", "turn", "bend"), [("imu", 1.0, "rad"), ("imu [rad]", 1.0, ""), ("imu", 57.3, "deg")])
@pytest.mark.parametrize(
    ("scale", "unit"), [(1.0, "m"), (1e3, "mm"), (-1e3, "mm"), (5e4, "0.02 mm"), (2e5, "0.005 mm")]
)
def test_units_that_nothing_says_are_guessed_by_the_range_of_the_numbers(
    head: str, turn: float, bend: str, scale: float, unit: str, tmp_path: Path
) -> None:
    theta = 0.5 * np.sin(np.linspace(0.0, 6.0, 60))
    rows = [f"{turn * angle},{scale * way},{-scale * way}" for angle, way in zip(theta, 0.0141 * theta, strict=True)]
    with pytest.raises(UserError, match="by the range of the numbers the unit of") as caught:
        log_of(tmp_path, f"{head},l1,l2", *rows)
    written = f"bend_y={'imu'} [{bend or 'rad'}], spool_1=l1 [{unit}], spool_2=l2 [{unit}]"
    assert f"--columns '{written}'" in caught.value.fix
    log = log_of(tmp_path, f"{head},l1,l2", *rows, names=written)
    np.testing.assert_allclose(np.ptp(log.columns["bend_y"]), np.ptp(theta), rtol=1e-3)
    np.testing.assert_allclose(np.ptp(log.columns["spool_1"]), 0.0141 * np.ptp(theta), rtol=0.05)


def test_units_in_a_line_may_be_spelt_in_any_way(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="Grad") as caught:
        log_of(tmp_path, "time;bend_y", "sec;Grad", "0;90")
    assert "--columns 'bend_y=bend_y [deg]'" in caught.value.fix
    assert log_of(tmp_path, "time;bend_y", "sec;°", "0;90").columns["bend_y"] == pytest.approx(0.5 * np.pi)


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        (("time [s],bent_y [deg]", "0,1"), r"unknown column 'bent_y' - .*log\.csv:1 - fix: did you mean 'bend_y'\?"),
        (("time [s],angle [deg],theta [rad]", "0,1,2"), r"theta stands there twice - .*:1 - fix: .* bend_y"),
        (("time [s],tension_1 [N]", "0,1", "1,two"), r"tension_1 is 'two' - .*:3 - "),
        (("time [s],tension_1 [N]", "0,1", "1,inf"), r"tension_1 is 'inf' - .*:3 - "),
        (("time [s],tension_0 [N]", "0,1"), r"unknown column 'tension_0'"),
        (("time [s],mass [kg]", "", "# c", "0,1,2"), r"3 cells under 2 columns - .*:4"),
    ],
)
def test_what_is_wrong_is_said_with_line_and_column(lines: tuple[str, ...], message: str, tmp_path: Path) -> None:
    with pytest.raises(UserError, match=message):
        log_of(tmp_path, *lines)


def test_bends_come_from_either_pair_of_columns(tmp_path: Path) -> None:
    by_parts = log_of(tmp_path, "bend_y [deg],bend_z [deg]", "3,4", "-3,4")
    by_size = log_of(tmp_path, "orientation [deg],inclination [deg]", "53.13010235415598,5", "126.86989764584402,5")
    one, other = by_size.bends(), by_parts.bends()
    assert one is not None and other is not None
    np.testing.assert_allclose(one, other, rtol=1e-12)
    alone = log_of(tmp_path, "bend_z [rad]", "0.2").bends()
    assert alone is not None and alone.tolist() == [[0.0, 0.2]]
    assert log_of(tmp_path, "time [s]", "0.2").bends() is None


NAMES = st.sampled_from([*(name for name in COLUMNS if name != "time"), "spool_1", "spool_12", "tension_3"])
VALUES = st.floats(-1e300, 1e300) | st.just(math.nan)


@given(names=st.lists(NAMES, min_size=1, max_size=5, unique=True), values=st.lists(VALUES, min_size=1, max_size=4))
@pytest.mark.slow
def test_what_is_written_reads_back_exactly(
    names: list[str], values: list[float], tmp_path_factory: pytest.TempPathFactory
) -> None:
    assume(not {"gravity_x", "gravity_y", "gravity_z"} <= set(names))  # read as bends, which numbers like these are not
    columns = {name: np.array(values) * (k + 1.0) for k, name in enumerate(names)}
    file = tmp_path_factory.getbasetemp() / "again.csv"
    write_log(OpenLog(file, "log", columns, {"trial": np.array([f"no {k}" for k in range(len(values))])}), file)
    again = read_log(file)
    for name, column in columns.items():
        np.testing.assert_array_equal(again.columns[name], column)
    assert again.words["trial"].tolist() == [f"no {k}" for k in range(len(values))]


def test_a_mapping_may_have_commas_in_its_units_only() -> None:
    assert mapped_names("time=t [s],bend_y=b [2 deg]") == {"t": ("time", "s"), "b": ("bend_y", "2 deg")}
    assert mapped_names("angle=b, mass=m [kg]") == {"b": ("bend_y", ""), "m": ("mass", "kg")}
    assert units_of("spool_7") is units_of("tip_x") and units_of("spool") is None


def test_parquet_files_are_read_or_say_what_is_missing(tmp_path: Path) -> None:
    file = tmp_path / "log.parquet"
    file.write_bytes(b"PAR1")
    with pytest.raises(UserError, match=r"parquet|cannot read"):
        read_log(file)
