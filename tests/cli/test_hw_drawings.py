"""`hw drawings`: what is drawn is as large as the settings say, in millimetres of the SVG's own page."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest

from tests.cli.conftest import Call
from wristctl.arrays import Array

POINT = 25.4 / 72.0
PARTS = ("spool", "clamp", "disc", "flag", "markers")
SVG = "{http://www.w3.org/2000/svg}"


def drawn(folder: Path, name: str) -> dict[str, Array]:
    """Points (P, 2) [mm] of each named shape of a drawing; control points of arcs among them."""
    root = ET.parse(folder / f"{name}.svg").getroot()
    assert root.attrib["width"].endswith("pt"), "the page has a size of its own"
    shapes = {}
    for group in root.iter(f"{SVG}g"):
        if (path := group.find(f"{SVG}path")) is not None and "id" in group.attrib:
            numbers = re.findall(r"-?\d+\.?\d*(?:e-?\d+)?", path.attrib["d"])
            shapes[group.attrib["id"]] = POINT * np.array(numbers, float).reshape(-1, 2)
    return shapes


def size(points: Array) -> list[float]:
    width, height = np.ptp(points, axis=0)
    return [float(width), float(height)]


def test_parts_have_the_size_of_the_settings_and_a_bar_to_check_the_print(call: Call, tmp_path: Path) -> None:
    code, out, _ = call("hw", "drawings", "parts")
    folder = tmp_path / "parts"
    assert code == 0 and out.split() == [*(f"parts/{name}.svg" for name in PARTS), "parts/spool.stl"]
    for name in PARTS:
        page = ET.parse(folder / f"{name}.svg").getroot().attrib
        lengths = [POINT * float(page[side].removesuffix("pt")) for side in ("width", "height")]
        assert lengths == pytest.approx([210.0, 297.0], abs=0.01)
        assert size(drawn(folder, name)["ruler"])[0] == pytest.approx(100.0 if name == "markers" else 50.0, abs=1e-3)
    spool = drawn(folder, "spool")
    assert size(spool["front-bore"]) == pytest.approx([6.45, 6.45], abs=1e-3)
    section, enlarged = (np.concatenate([spool[f"section-{k}-{half}"] for half in ("upper", "lower")]) for k in (1, 4))
    assert size(section) == pytest.approx([15.5, 20.2], abs=1e-3) and size(enlarged) == pytest.approx(
        [4.0 * 15.5, 4.0 * 20.2], abs=1e-3
    )
    text = (folder / "spool.svg").read_text(encoding="utf-8")
    for value in ("15.5", "3.5", "core \u00d814.3", "flange \u00d820.2", "bore \u00d86.45", "r 7.5"):
        assert f"<!-- {value} -->" in text
    disc = drawn(folder, "disc")
    middle = np.mean([disc["disc"].min(axis=0), disc["disc"].max(axis=0)], axis=0)
    holes = [np.ptp(disc[f"tendon-{k}"], axis=0) / 2.0 + disc[f"tendon-{k}"].min(axis=0) - middle for k in range(4)]
    assert np.abs(holes) == pytest.approx(np.full((4, 2), 20.0 / np.sqrt(2.0)), abs=1e-3)
    flag = drawn(folder, "flag")
    assert size(flag["marker"]) == pytest.approx([20.0, 20.0], abs=1e-3)


@pytest.mark.slow
def test_another_rig_has_other_drawings_and_the_same_rig_the_same_bytes(call: Call, tmp_path: Path) -> None:
    other = (
        "--set",
        "actuator.pulley_radius=0.012",
        "--set",
        "markers.side=0.024",
        "--set",
        "wrist.tendon_radius=0.03",
    )
    assert call("hw", "drawings", "first")[0] == call("hw", "drawings", "again")[0] == 0
    assert call("hw", "drawings", "other", *other, "--tendon-mm", "0.5", "--shaft-mm", "5", "--paper", "letter")[0] == 0
    for file in (tmp_path / "first").iterdir():
        assert file.read_bytes() == (tmp_path / "again" / file.name).read_bytes()
        assert file.name == "clamp.svg" or file.read_bytes() != (tmp_path / "other" / file.name).read_bytes()
    spool, disc = drawn(tmp_path / "other", "spool"), drawn(tmp_path / "other", "disc")
    assert size(spool["front-bore"])[0] == pytest.approx(5.1, abs=1e-3)
    assert "<!-- core \u00d823.5 -->" in (tmp_path / "other" / "spool.svg").read_text(encoding="utf-8")
    assert np.ptp(disc["tendon-0"][:, 0]) == pytest.approx(1.0, abs=1e-3)
    between = abs(disc["tendon-0"].mean(axis=0) - disc["tendon-3"].mean(axis=0))
    assert np.hypot(*between) == pytest.approx(60.0, abs=0.05)
    assert size(drawn(tmp_path / "other", "flag")["marker"]) == pytest.approx([24.0, 24.0], abs=1e-3)


@pytest.mark.parametrize(
    ("arguments", "problem"),
    [
        (("--shaft-mm", "12"), "a shaft of 12 mm"),
        (("--set", "actuator.pulley_radius=0.06"), "a spool of 125 mm"),
        (("--set", "wrist.tendon_radius=0.06"), "a disc of 128 mm"),
        (("--set", "markers.side=0.08"), "a flag of 107 mm"),
    ],
)
def test_parts_that_cannot_be_are_refused_and_nothing_is_written(
    call: Call, tmp_path: Path, arguments: tuple[str, ...], problem: str
) -> None:
    code, out, err = call("hw", "drawings", "parts", *arguments)
    assert code == 2 and out == "" and problem in err and not (tmp_path / "parts").exists()


def test_a_folder_that_cannot_be_is_named(call: Call, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    code, _, err = call("hw", "drawings", "file/parts")
    assert code == 2 and "file/parts" in err


@pytest.mark.slow
def test_a_rig_in_two_planes_has_the_second_cameras_markers_too(call: Call, tmp_path: Path) -> None:
    code, out, _ = call("hw", "drawings", "parts", "--set", "planes=2")
    assert code == 0 and "parts/markers_2.svg" in out.split()
    pages = [(tmp_path / "parts" / f"{name}.svg").read_text(encoding="utf-8") for name in ("markers", "markers_2")]
    named = [set(re.findall(r"4x4_50, id (\d+)", page)) for page in pages]
    assert named == [{"0", "1"}, {"2", "3"}]
