"""A measured loop's file: columns in any order and unit that its header names, and what is wrong said with its line."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.identification.measured_loop import MeasuredLoop, loop_of
from wristctl.records.log_converters import read_log
from wristctl.records.log_looks import looked_at

WRIST = WristParameters()
TIME = np.linspace(0.0, 10.0, 201)
ANGLE = 15.0 - 15.0 * np.cos(0.4 * np.pi * TIME)
SPOOL = np.radians(ANGLE) * WRIST.tendon_offset * 1e3
COLUMNS = {
    "time [s]": TIME, "angle [deg]": ANGLE, "spool_plus [mm]": 0.1 + SPOOL, "spool_minus [mm]": 0.1 - SPOOL,
    "tension_plus [N]": 2.0 + 0.2 * ANGLE, "tension_minus [N]": 2.0 + 0.0 * ANGLE,
}  # fmt: skip


def text_of(columns: dict[str, np.ndarray]) -> str:
    rows = zip(*columns.values(), strict=True)
    return "\n".join([",".join(columns), *(",".join(map(repr, map(float, row))) for row in rows)]) + "\n"


def without(*names: str) -> dict[str, np.ndarray]:
    return {name: each for name, each in COLUMNS.items() if not name.startswith(names)}


def put(before: str, after: str, line: int, text: str = "") -> str:
    """The file with a cell of one line changed."""
    lines = (text or text_of(COLUMNS)).splitlines()
    assert before in lines[line - 1]
    lines[line - 1] = lines[line - 1].replace(before, after, 1)
    return "\n".join(lines)


def read(text: str, folder: Path) -> MeasuredLoop:
    file = folder / "loop.csv"
    file.write_text(text, encoding="utf-8")
    return loop_in(file)


def loop_in(file: Path) -> MeasuredLoop:
    offset = WRIST.tendon_offset
    return loop_of(looked_at(read_log(file, what="measured loop", tendon_offset=offset), tendon_offset=offset), WRIST)


def test_columns_may_stand_in_any_order_and_unit(tmp_path: Path) -> None:
    first = read(text_of(COLUMNS), tmp_path)
    other = {
        "tension_minus [N]": COLUMNS["tension_minus [N]"], "spool_minus [m]": 1e-3 * COLUMNS["spool_minus [mm]"],
        "angle [rad]": np.radians(ANGLE), " tension_plus[N] ": COLUMNS["tension_plus [N]"], "time [ms]": 1e3 * TIME,
        "spool_plus [um]": 1e3 * COLUMNS["spool_plus [mm]"],
    }  # fmt: skip
    again = read(f"\ufeff# by hand\n\n{text_of(other)}# end\n", tmp_path)
    for name in ("time", "angle", "spools", "tensions"):
        np.testing.assert_allclose(getattr(again, name), getattr(first, name), rtol=1e-12)
    assert first.spools is not None and first.tensions is not None and not first.winch
    np.testing.assert_allclose(first.spools[:, 0] * 1e3, COLUMNS["spool_plus [mm]"])
    np.testing.assert_allclose(first.angle, np.radians(ANGLE))
    assert first.drive is first.spools and first.name == "loop.csv"


def test_either_spools_or_tensions_will_do(tmp_path: Path) -> None:
    pulled, moved = read(text_of(without("spool")), tmp_path), read(text_of(without("tension")), tmp_path)
    assert pulled.winch and pulled.drive is pulled.tensions and moved.tensions is None and not moved.winch


def test_it_turns_where_what_drives_it_turns_whatever_trembles(tmp_path: Path) -> None:
    loop = read(text_of(COLUMNS), tmp_path)
    np.testing.assert_allclose(loop.time[loop.turns], [2.5, 5.0, 7.5], atol=1e-9)
    assert loop.rises
    trembling = COLUMNS | {"tension_plus [N]": 2.0 + 0.2 * ANGLE + 0.1 * (-1.0) ** np.arange(len(TIME))}
    late = {name: each[60:] for name, each in trembling.items() if "spool" not in name}
    other = read(text_of(late), tmp_path)
    assert not other.rises
    np.testing.assert_allclose(other.time[other.turns], [5.0, 7.5], atol=0.15)


def test_noise_in_pulls_that_drive_it_is_told_from_their_course(tmp_path: Path) -> None:
    still = read(text_of(without("spool")), tmp_path)
    noise = 0.03 * np.random.default_rng(0).standard_normal((2, len(TIME)))
    rough = {
        name: each + (noise[0] if "plus" in name else noise[1] if "minus" in name else 0.0)
        for name, each in without("spool").items()
    }
    assert still.tremble < 2e-3 and read(text_of(rough), tmp_path).tremble == pytest.approx(0.03, rel=0.2)
    assert read(text_of(COLUMNS), tmp_path).tremble == 0.0


IN_UM = {name.replace("[mm]", "[um]"): each for name, each in COLUMNS.items()}
STILL = {name: each if name == "time [s]" else 0.0 * each for name, each in COLUMNS.items()}
ONE_WAY = {name: each if name == "time [s]" else each[:51].repeat(4)[:201] for name, each in COLUMNS.items()}


@pytest.mark.parametrize(
    ("text", "what", "where", "fix"),
    [
        ("", "empty", "", "a header such as time [s],angle [deg]"),
        ("# nothing\n", "empty", "", "a header"),
        (put("angle [deg]", "angle", 1), "column 'angle' has no unit", ":1", "angle [deg] or [rad]"),
        (put("angle [deg]", "angle [grad]", 1), "angle is in 'grad'", ":1", "angle [deg] or [rad]"),
        (put("[mm]", "[N]", 1), "spool_plus is in 'N'", ":1", "spool_plus [m] or [mm] or [um]"),
        (put("[deg]", "[DEG]", 1), "angle is in 'DEG'", ":1", "[deg] or [rad]"),
        (put("angle", "angel", 1), "unknown column 'angel'", ":1", "did you mean 'angle'?"),
        (put("angle [deg]", "time [ms]", 1), "column time stands there twice", ":1", "leave one out"),
        (text_of(without("angle")), "no column bend_y (or angle", ":1", "a header such as"),
        (text_of(without("spool_minus")), "spool_plus without spool_minus", "", "both sides, or none"),
        (text_of(without("spool", "tension")), "neither spools nor tensions", "", "columns of both sides"),
        (put(",2.0", ",two", 2), "tension_plus is 'two'", ":2", "a number with a decimal point"),
        (put("0.0,", "nan,", 2), "time is missing", ":2", "a number"),
        (put(",2.0", "", 5), "5 cells under 6 columns", ":5", "one number for each column"),
        (text_of({name: each[:60] for name, each in COLUMNS.items()}), "60 samples, too few", "", "at least 100"),
        (put(str(TIME[7]), str(TIME[6]), 9), "time does not go on", ":9", "in the order of their times"),
        (text_of(COLUMNS | {"angle [deg]": 57.3 * ANGLE}), "angle reaches 1,719 deg", r":\d+", "[0.1 deg] is a tenth"),
        (text_of(COLUMNS | {"angle [deg]": 5.0 * ANGLE}), "it bends by 150 deg", "", "the angle's unit"),
        (text_of(COLUMNS | {"tension_minus [N]": 0.1 * TIME - 0.9}), "a tendon pushes", ":2", "the load cell's zero"),
        (text_of(COLUMNS | {"angle [deg]": -ANGLE}), "angle falls while tendon 1", ":1", "spool_1=spool_minus"),
        (text_of(IN_UM), "moves 0.0074 mm, and the bend takes 7.4 mm", ":1", "is it in mm?"),
        (text_of(STILL), "no spool moves", ":1", "bend the wrist to both sides"),
        (text_of(ONE_WAY), "never turns", "", "there and back"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_said_with_its_place_and_remedy(
    text: str, what: str, where: str, fix: str, tmp_path: Path
) -> None:
    with pytest.raises(UserError) as caught:
        read(text, tmp_path)
    assert what in caught.value.what and fix in caught.value.fix and caught.value.exit_code == 2
    assert re.fullmatch(rf".*loop\.csv{where}", caught.value.where), caught.value.where


def test_a_file_that_cannot_be_read_is_named(tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"cannot read the measured loop: No such file.*gone\.csv"):
        loop_in(tmp_path / "gone.csv")
    (tmp_path / "picture.png").write_bytes(bytes(range(256)))
    with pytest.raises(UserError, match=r"no text in UTF-8.*picture\.png"):
        loop_in(tmp_path / "picture.png")


def test_of_four_tendons_each_side_is_the_mean_of_its_pair(tmp_path: Path) -> None:
    """4 and 5 pull toward ulnar, where the angle is positive, 1 and 2 away from there."""
    two = read(text_of(COLUMNS), tmp_path)
    apart = 0.3 * np.sin(3.0 * TIME)
    four = without("spool", "tension")
    for quantity, unit in (("spool", "mm"), ("tension", "N")):
        plus, minus = (COLUMNS[f"{quantity}_{side} [{unit}]"] for side in ("plus", "minus"))
        each = {1: minus - apart, 2: minus + apart, 4: plus + apart, 5: plus - apart}
        four |= {f"{quantity}_{tendon} [{unit}]": values for tendon, values in each.items()}
    pairs = read(text_of(four), tmp_path)
    assert pairs.spools is not None and pairs.tensions is not None
    np.testing.assert_allclose(pairs.spools, np.asarray(two.spools), atol=1e-12)
    np.testing.assert_allclose(pairs.tensions, np.asarray(two.tensions), atol=1e-12)
    other = {name.replace("_5", "_3"): values for name, values in four.items()}
    with pytest.raises(UserError, match="spool of tendons 1, 2, 3, 4"):
        read(text_of(other), tmp_path)


def test_a_bend_is_read_in_the_plane_in_which_the_wrist_moves(tmp_path: Path) -> None:
    """In either; what it shows beside that is noise up to 5 deg from end to end."""
    across = 2.0 * np.cos(TIME) + 0.3
    for along, beside in (("bend_y", "bend_z"), ("bend_z", "bend_y")):
        columns = without("angle") | {f"{along} [deg]": ANGLE, f"{beside} [deg]": across}
        np.testing.assert_allclose(read(text_of(columns), tmp_path).angle, np.radians(ANGLE))
        np.testing.assert_allclose(
            read(text_of(columns | {f"{beside} [deg]": 1.24 * across}), tmp_path).angle, np.radians(ANGLE)
        )
        with pytest.raises(UserError, match=r"leaves its plane by 5\.04 deg"):
            read(text_of(columns | {f"{beside} [deg]": 1.26 * across}), tmp_path)


def test_a_log_without_times_is_taken_as_slow(tmp_path: Path) -> None:
    loop = read(text_of(without("time")), tmp_path)
    np.testing.assert_allclose(np.diff(loop.time), 0.1)
    assert len(loop.time) == len(TIME)


STRETCHED = {"spool_plus [mm]", "spool_minus [mm]"}


def scaled(names: set[str], factor: float) -> dict[str, np.ndarray]:
    return {name: factor * each if name in names else each for name, each in COLUMNS.items()}


def short(count: int) -> dict[str, np.ndarray]:
    """So many samples of a whole cycle."""
    return {name: np.interp(np.linspace(0.0, 5.0, count), TIME, each) for name, each in COLUMNS.items()}


def pushed(share: float) -> dict[str, np.ndarray]:
    """With a tension below nothing by a share of the largest, which is 8 N, in one sample."""
    dip = np.where(np.arange(len(TIME)) == 7, -8.0 * share, COLUMNS["tension_minus [N]"])
    return COLUMNS | {"tension_minus [N]": dip}


@pytest.mark.parametrize(
    ("fits", "beyond", "what"),
    [
        (short(100), short(99), "99 samples"),
        (scaled({"angle [deg]", *STRETCHED}, 3.33), scaled({"angle [deg]", *STRETCHED}, 3.34), "it bends by 100 deg"),
        (pushed(0.049), pushed(0.051), "a tendon pushes"),
        (scaled(STRETCHED, 2.97), scaled(STRETCHED, 3.03), "3 times as far"),
        (scaled(STRETCHED, 0.337), scaled(STRETCHED, 0.33), "0.33 times as far"),
    ],
)
def test_a_log_is_refused_only_where_it_can_be_no_loop_of_this_wrist(
    fits: dict[str, np.ndarray], beyond: dict[str, np.ndarray], what: str, tmp_path: Path
) -> None:
    """The wrist of the default settings, whose range is 50 deg."""
    read(text_of(fits), tmp_path)
    with pytest.raises(UserError, match=what):
        read(text_of(beyond), tmp_path)
