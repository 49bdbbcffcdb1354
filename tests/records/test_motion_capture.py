"""Exports in the makers' layouts give the bend of one rigid body against another, and the error asks which is which."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from wristctl.errors import UserError
from wristctl.records.log_converters import read_log

FIELD = Path(__file__).parents[1] / "data" / "field"
CLEAN = Path(__file__).parents[2] / "experiments" / "logs" / "clean.csv"
BENDS = np.radians([[0.0, 0.0], [10.0, 0.0], [15.0, -20.0], [-5.0, 30.0]])
LENGTH = 0.08


def poses(bends: np.ndarray, along: Sequence[int] = (0, 1, 2)) -> tuple[Rotation, Rotation, np.ndarray, np.ndarray]:
    """Orientations and places [m] of a base that stands askew and of a tip that has turned about itself too."""
    size = np.linalg.norm(bends, axis=1)
    away = np.divide(bends, size[:, None], out=np.zeros_like(bends), where=size[:, None] > 0.0)
    ours = np.stack([0.0 * size, -away[:, 1] * size, away[:, 0] * size], axis=1)  # about an axis across the wrist
    place = np.stack([np.cos(0.5 * size), *(np.sin(0.5 * size)[:, None] * away).T], axis=1) * LENGTH
    theirs, there = np.empty_like(ours), np.empty_like(place)
    theirs[:, along], there[:, along] = ours, place
    twist = np.zeros((len(bends), 3))
    twist[:, along[0]] = 0.2
    base = Rotation.from_rotvec(np.array([0.3, -0.2, 0.5]) + np.linspace(0.0, 0.2, len(bends))[:, None])
    at = np.array([0.4, 1.1, -0.3]) + np.linspace(0.0, 0.05, len(bends))[:, None]
    return base, base * Rotation.from_rotvec(theirs) * Rotation.from_rotvec(twist), at, at + base.apply(there)


def cells(*columns: np.ndarray) -> list[list[str]]:
    return [[f"{value:.9f}" for value in row] for row in np.column_stack(columns)]


def motive(folder: Path, names: Sequence[str], along: Sequence[int] = (0, 1, 2), lost: int = -1) -> Path:
    """A Motive export in metres: of each body quaternion, position and error, then one marker."""
    base, tip, at_base, at_tip = poses(BENDS, along)
    rows = cells(base.as_quat(), at_base, np.zeros(4), tip.as_quat(), at_tip, np.zeros(4), at_tip)
    if lost >= 0:
        rows[lost][8:] = [""] * 11
    kinds = [*["Rigid Body"] * 16, *["Rigid Body Marker"] * 3]
    owners = [*[names[0]] * 8, *[names[1]] * 8, *[f"{names[1]}:Marker1"] * 3]
    of_body = [*["Rotation"] * 4, *["Position"] * 3, "Mean Marker Error"]
    lines = [
        ["Format Version", "1.23", "Take Name", "Take 1", "Capture Frame Rate", "100.000000", "Rotation Type",
         "Quaternion", "Length Units", "Meters", "Coordinate Space", "Global"],
        [],
        ["", "Type", *kinds], ["", "Name", *owners], ["", "ID", *["3EF01"] * 19],
        ["", "", *of_body, *of_body, *["Position"] * 3],
        ["Frame", "Time (Seconds)", *["X", "Y", "Z", "W", "X", "Y", "Z", ""] * 2, "X", "Y", "Z"],
        *([str(k), f"{0.01 * k:.6f}", *row] for k, row in enumerate(rows)),
    ]  # fmt: skip
    file = folder / "take.csv"
    file.write_text("\r\n".join(",".join(line) for line in lines) + "\r\n", encoding="utf-8-sig")
    return file


def bends_of(file: Path, names: str = "") -> np.ndarray:
    bends = read_log(file, names).bends()
    assert bends is not None
    return bends


def test_one_rigid_body_is_the_tip_in_the_laboratorys_axes() -> None:
    clean, log = read_log(CLEAN), read_log(FIELD / "motive.csv", "motive")
    np.testing.assert_allclose(log.columns["bend_y"], clean.columns["bend_y"], atol=2e-6)  # six digits of a quaternion
    np.testing.assert_array_equal(log.columns["time"], clean.columns["time"])
    assert log.columns["tip_x"][0] == pytest.approx(0.08) and log.at(0).endswith("motive.csv:7")
    assert "rigid body tip against the laboratory's axes, the straight wrist along x" in log.remarks[0]


@pytest.mark.parametrize(("names", "told"), [(("Forearm", "Hand"), ""), (("A", "B"), "tip=B, base=A")])
def test_two_rigid_bodies_bend_against_each_other_where_they_are_told_apart(
    tmp_path: Path, names: tuple[str, str], told: str
) -> None:
    file = motive(tmp_path, names)
    log = read_log(file, told)
    np.testing.assert_allclose(bends_of(file, told), BENDS, atol=1e-7)
    assert log.columns["tip_x"][0] == pytest.approx(LENGTH)
    assert f"rigid body {names[1]} against rigid body {names[0]}" in log.remarks[0]


def test_bodies_whose_names_say_nothing_are_asked_for(tmp_path: Path) -> None:
    file = motive(tmp_path, ("A", "B"))
    with pytest.raises(UserError, match=r"2 rigid bodies, A, B: which .* - fix: --columns 'tip=A, base=B'"):
        read_log(file)
    with pytest.raises(UserError, match=r"no rigid body 'Hnd'"):
        read_log(file, "tip=Hnd")
    with pytest.raises(UserError, match=r"along=w is no axis"):
        read_log(file, "tip=B, base=A, along=w")
    with pytest.raises(UserError, match=r"are one axis"):
        read_log(file, "tip=B, base=A, along=x, toward=-x")


def test_a_wrist_along_another_axis_is_asked_for(tmp_path: Path) -> None:
    file = motive(tmp_path, ("base", "tip"), along=(1, 2, 0))
    with pytest.raises(
        UserError, match=r"tip stands 80 mm along y of base, .* --columns 'tip=tip, base=base, along=y'"
    ):
        read_log(file)
    np.testing.assert_allclose(bends_of(file, "along=y"), BENDS, atol=1e-7)
    np.testing.assert_allclose(bends_of(file, "along=y, toward=-z"), BENDS * [-1.0, -1.0], atol=1e-7)
    np.testing.assert_allclose(bends_of(file, "along=y, toward=x"), BENDS[:, ::-1] * [1.0, -1.0], atol=1e-7)


def test_a_body_that_was_lost_has_no_bend_and_it_is_said(tmp_path: Path) -> None:
    file = motive(tmp_path, ("base", "tip"), lost=2)
    assert np.isnan(bends_of(file)[2]).all() and np.isfinite(np.delete(bends_of(file), 2, 0)).all()
    assert any("in 1 of 4 rows" in remark for remark in read_log(file).remarks)


def vicon(
    folder: Path,
    kind: str,
    names: Sequence[str],
    head: Sequence[str],
    units: Sequence[str],
    rows: list[list[str]],
    mark: str = ",",
) -> Path:
    """A section of a Vicon export at 100 Hz: a name stands above the first column of what it is of."""
    above = ["", "", *(cell for name in names for cell in (name, *[""] * (len(head) - 1)))]
    lines = [[kind], ["100"], above, ["Frame", "Sub Frame", *list(head) * len(names)]]
    lines.append(["", "", *list(units) * len(names)])
    lines += [[str(k), "0", *row] for k, row in enumerate(rows, 1)]
    file = folder / "vicon.csv"
    file.write_text("\n".join(mark.join(line) for line in lines) + "\n", encoding="utf-8")
    return file


def test_objects_of_vicon_with_quaternions_and_segments_with_rotation_vectors(tmp_path: Path) -> None:
    base, tip, at_base, at_tip = poses(BENDS)
    rows = cells(base.as_quat(), 1e3 * at_base, tip.as_quat(), 1e3 * at_tip)
    names = ["Global Angle Base:Base", "Global Angle Hand:Hand"]
    head = ["RX", "RY", "RZ", "RW", "TX", "TY", "TZ"]
    file = vicon(tmp_path, "Objects", names, head, ["", "", "", "", "mm", "mm", "mm"], rows)
    np.testing.assert_allclose(bends_of(file), BENDS, atol=1e-7)
    np.testing.assert_allclose(read_log(file).columns["time"], [0.0, 0.01, 0.02, 0.03])
    turns = [np.degrees(turn.as_rotvec()) for turn in (base, tip)]
    rows = cells(turns[0], 1e3 * at_base, turns[1], 1e3 * at_tip)
    head.remove("RW")
    file = vicon(tmp_path, "Segments", ["Arm:Forearm", "Arm:Hand"], head, ["deg"] * 3 + ["mm"] * 3, rows, ";")
    np.testing.assert_allclose(bends_of(file, "vicon"), BENDS, atol=1e-7)
    assert any("rotation vectors" in remark for remark in read_log(file).remarks)


def test_segments_of_two_subjects_that_are_called_alike_are_told_apart(tmp_path: Path) -> None:
    base, tip, at_base, at_tip = poses(BENDS)
    rows = cells(base.as_quat(), 1e3 * at_base, tip.as_quat(), 1e3 * at_tip)
    head, units = ["RX", "RY", "RZ", "RW", "TX", "TY", "TZ"], ["", "", "", "", "mm", "mm", "mm"]
    file = vicon(tmp_path, "Segments", ["One:Root", "Two:Root"], head, units, rows)
    np.testing.assert_allclose(bends_of(file, "tip=Two:Root, base=Root"), BENDS, atol=1e-7)
    with pytest.raises(UserError, match="2 rigid bodies, Root, Two:Root"):
        read_log(file)


def test_of_a_body_in_two_sections_the_first_counts(tmp_path: Path) -> None:
    base, tip, at_base, at_tip = poses(BENDS)
    head, units = ["RX", "RY", "RZ", "RW", "TX", "TY", "TZ"], ["", "", "", "", "mm", "mm", "mm"]
    names, still = ["Base", "Hand"], np.tile([0.0, 0.0, 0.0, 1.0], (len(BENDS), 1))
    texts = []
    for kind, turns in (("Objects", (base.as_quat(), tip.as_quat())), ("Segments", (still, still))):
        rows = cells(turns[0], 1e3 * at_base, turns[1], 1e3 * at_tip)
        texts.append(vicon(tmp_path, kind, names, head, units, rows).read_text())
    file = tmp_path / "both.csv"
    file.write_text("\n".join(texts))
    np.testing.assert_allclose(bends_of(file), BENDS, atol=1e-7)


MARKERS = 0.03 * np.array([[0, 1, 0], [0, -1, 0.2], [0.3, 0, 1], [1, 0, -1]])


def markers() -> list[np.ndarray]:
    """Places [m] of four markers on the base and four on the tip, from a straight wrist along the laboratory's axes."""
    base, tip, at_base, at_tip = poses(BENDS)
    back = base[0].inv()
    untwisted = tip * tip[0].inv() * base[0]
    return [
        back.apply(at + turn.apply(marker)) for turn, at in ((base, at_base), (untwisted, at_tip)) for marker in MARKERS
    ]


def test_markers_of_vicon_make_rigid_bodies_from_the_first_row_on(tmp_path: Path) -> None:
    names = [f"{body}:M{k}" for body in ("Base", "Hand") for k in range(1, 5)]
    rows = cells(*(1e3 * place for place in markers()))
    rows[1][12:15] = ["", "", ""]  # a marker of the hand that was lost: three are left
    rows[3][12:18] = [""] * 6  # two of them
    file = vicon(tmp_path, "Trajectories", names, ["X", "Y", "Z"], ["mm"] * 3, rows)
    bends = bends_of(file, "along=x")
    np.testing.assert_allclose(bends[:3], BENDS[:3], atol=1e-7)
    assert np.isnan(bends[3]).all()
    told = read_log(file, "along=x").remarks
    assert any("count from line 6" in remark for remark in told)


def qualisys(folder: Path, about: Sequence[Sequence[str]], rows: list[list[str]]) -> Path:
    lines = [["NO_OF_FRAMES", "4"], ["NO_OF_CAMERAS", "8"], ["FREQUENCY", "50"], ["NO_OF_ANALOG", "0"],
             ["DESCRIPTION", "--"], ["TIME_STAMP", "2026-11-27, 22:21:31", "51.4"], *about, *rows]  # fmt: skip
    file = folder / "qtm.tsv"
    file.write_text("\n".join("\t".join(line) for line in lines) + "\n", encoding="utf-8")
    return file


@pytest.mark.parametrize("timed", [True, False])
def test_bodies_of_qualisys_have_their_matrix_column_after_column(tmp_path: Path, timed: bool) -> None:
    base, tip, at_base, at_tip = poses(BENDS)
    parts = []
    for turn, at in ((base, at_base), (tip, at_tip)):
        columns = turn.as_matrix().transpose(0, 2, 1).reshape(-1, 9)
        parts += [1e3 * at, np.zeros((4, 3)), np.full((4, 1), 0.1), columns]
    rows = cells(*parts)
    rows[2][22] = "-1.0"  # a residual below zero: lost
    head = [f"{name} X\tY\tZ\tRoll\tPitch\tYaw\tResidual\t" + "\t".join(f"Rot[{k}]" for k in range(9))
            for name in ("Base", "Hand")]  # fmt: skip
    if timed:
        head, rows = ["Frame", "Time", *head], [[str(k + 1), f"{0.02 * k:.5f}", *row] for k, row in enumerate(rows)]
    file = qualisys(tmp_path, [["DATA_INCLUDED", "6D"], ["BODY_NAMES", "Base", "Hand"], head], rows)
    log = read_log(file)
    np.testing.assert_allclose(log.columns["time"], [0.0, 0.02, 0.04, 0.06])
    bends = bends_of(file)
    np.testing.assert_allclose(np.delete(bends, 2, 0), np.delete(BENDS, 2, 0), atol=1e-7)
    assert np.isnan(bends[2]).all()


def test_markers_of_qualisys_share_what_stands_before_their_numbers(tmp_path: Path) -> None:
    rows = cells(*(1e3 * place for place in markers()))
    names = [f"{body}_{k}" for body in ("forearm", "hand") for k in range(1, 5)]
    file = qualisys(tmp_path, [["DATA_INCLUDED", "3D"], ["MARKER_NAMES", *names]], rows)
    np.testing.assert_allclose(bends_of(file, "qualisys, along=x"), BENDS, atol=1e-7)


def test_an_export_without_rigid_bodies_says_what_to_export(tmp_path: Path) -> None:
    file = qualisys(tmp_path, [["DATA_INCLUDED", "3D"], ["MARKER_NAMES", "a", "b"]], [["1", "2", "3", "4", "5", "6"]])
    with pytest.raises(UserError, match="no rigid body in this export"):
        read_log(file)


@pytest.mark.parametrize(
    ("before", "after", "message"),
    [
        ("\n1,0,", "\n1,inf,", r"'inf' among the samples - .*vicon\.csv:6"),
        ("\n1,0,", '\n1,"0,', r"'0,.*among the samples - .*vicon\.csv:6"),
        ("TX,TY,TZ", "TX,TY", r"16 cells under 15 columns - .*vicon\.csv:6"),
        ("mm,mm,mm", "ft,ft,ft", r"TX is in 'ft'"),
        ("\n100\n", "\nsome\n", r"a frame rate of 'some' - .*vicon\.csv:2"),
    ],
)
def test_a_torn_export_is_refused_with_its_line(tmp_path: Path, before: str, after: str, message: str) -> None:
    base, tip, at_base, at_tip = poses(BENDS)
    rows = cells(base.as_quat(), 1e3 * at_base, tip.as_quat(), 1e3 * at_tip)
    head = ["RX", "RY", "RZ", "RW", "TX", "TY", "TZ"]
    file = vicon(tmp_path, "Objects", ["Base:Base", "Hand:Hand"], head, [""] * 4 + ["mm"] * 3, rows)
    text = file.read_text()
    assert before in text
    file.write_text(text.replace(before, after, 1))
    with pytest.raises(UserError, match=message):
        read_log(file)


def test_an_export_without_samples_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="no rigid body"):
        read_log(vicon(tmp_path, "Objects", ["a:a"], ["RX", "RY", "RZ", "RW"], [""] * 4, []))
