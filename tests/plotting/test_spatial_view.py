"""The wrist in space on the page of a run in two planes: where the model has it, and how it is looked at."""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import wristctl
from tests.plotting.browser import Browser
from wristctl.arrays import Array
from wristctl.config.hw_run import HwRunSettings
from wristctl.config.study import Study
from wristctl.config.wrist import WristParameters
from wristctl.plotting import spatial_view as view_module
from wristctl.plotting.page import page
from wristctl.plotting.spatial_view import ANGLE, MOST, PLACE, PULL, cables, motion_in_space, rim, seen, spatial_view
from wristctl.plotting.style import TENDON_COLOURS
from wristctl.records import Run, start_run
from wristctl.simulation.spatial_references import bend_path
from wristctl.simulation.trajectory import Trajectory
from wristctl.trial import trial_results
from wristctl.wrist.plant import PLANTS_IN_SPACE
from wristctl.wrist.spatial.spatial_kinematics import spatial_frames, spatial_tips

PLANES = "simulate.loop.planes=2"
INNER = "wrist.tendons=[{angle_deg: 0}, {angle_deg: 120}, {angle_deg: 240}, {angle_deg: 60, radius: 0.012, ends_at: 3}]"


def course(tendons: int = 4, horizon: float = 1.5, length: float = 0.08, name: str = "circumduction") -> Trajectory:
    """Four segments that bend by 4, 3, 2 and 1 tenths of what is wanted, a little late."""
    path = bend_path(name, 25.0, 1.0, horizon)[:, 0].T
    time = 1e-3 * np.arange(float(len(path)))
    late = np.stack([np.interp(time - 0.02, time, plane) for plane in path.T], axis=1)
    bends = (late[:, None] * np.array([0.4, 0.3, 0.2, 0.1])[:, None]).reshape(len(path), 8)
    pulls = np.abs(20.0 * np.sin(time[:, None] + np.arange(tendons)))
    still = 0.0 * path
    tips = spatial_tips(bends, length), spatial_tips(path, 0.08)
    return Trajectory(
        "", time, late, bends, still, path, path, *tips, still, still, pulls, pulls, late, still, 1.0 + 0.0 * time
    )


def run_of(folder: Path, made: Trajectory, *settings: str) -> Run:
    study = wristctl.load_study(None, PLANES, *settings)
    with start_run("simulate", study, "", folder, page=lambda path, manifest, _: page(Run(path), manifest)) as live:
        live.table("data/bends.csv", made.columns())
    return Run(live.path)


def viewed(folder: Path, made: Trajectory, *settings: str) -> dict[str, Any]:
    found = spatial_view(run_of(folder, made, *settings))
    assert found is not None
    return found


def test_the_drawn_wrist_ends_where_the_tip_was_recorded(tmp_path: Path) -> None:
    made = course()
    found = viewed(tmp_path, made)
    ends = spatial_tips(ANGLE * np.array(found["bends"]), found["wrist"]["length"])
    np.testing.assert_allclose(ends, PLACE * np.array(found["tip"]), atol=3e-5)
    np.testing.assert_allclose(PLACE * np.array(found["tip"][-1]), made.tip[-1], atol=PLACE)
    np.testing.assert_allclose(PLACE * np.array(found["tip_desired"][-1]), made.tip_desired[-1], atol=PLACE)
    np.testing.assert_allclose(ANGLE * np.array(found["wanted"][-1]), made.bend_ref[-1], atol=ANGLE)
    np.testing.assert_allclose(PULL * np.array(found["pulls"][-1]), made.tension[-1], atol=PULL)
    assert found["duration"] == pytest.approx(1.5) and not found["left"]


@pytest.mark.slow
def test_pictures_are_those_of_their_times_and_a_long_run_has_no_more_of_them(tmp_path: Path) -> None:
    made = course()
    at = np.linspace(0.0, 1.5, len(viewed(tmp_path, made)["tip"]))
    expected = np.stack([np.interp(at, made.time, axis) for axis in made.tip.T], axis=1)
    np.testing.assert_allclose(PLACE * np.array(viewed(tmp_path / "b", made)["tip"]), expected, atol=PLACE)
    assert len(at) == 76
    assert len(viewed(tmp_path / "long", course(horizon=30.0))["bends"]) == MOST + 1


@pytest.mark.parametrize(("tendons", "setting"), [(3, "wrist.tendons=three"), (5, "wrist.tendons=five"), (4, INNER)])
def test_tendons_run_at_their_places_through_the_discs_they_pass(tmp_path: Path, tendons: int, setting: str) -> None:
    made = course(tendons)
    found = viewed(tmp_path, made, setting)
    study = wristctl.load_study(None, setting)
    assert [len(row) for row in found["pulls"][:1]] == [tendons] == [len(found["tendons"])]
    assert [each["colour"] for each in found["tendons"]] == list(TENDON_COLOURS[:tendons])
    centres, frames = spatial_frames(made.segment_theta[-1], 0.08, np.linspace(0.0, 1.0, 5))
    for each, cable in zip(found["tendons"], cables(study.wrist), strict=True):
        assert (each["y"], each["z"], each["discs"]) == cable
        line = centres + frames @ np.array([0.0, each["y"], each["z"]])
        away, radius = line - centres, np.hypot(each["y"], each["z"])
        np.testing.assert_allclose(np.linalg.norm(away, axis=1), radius, atol=1e-15)
        np.testing.assert_allclose(np.einsum("kj,kj->k", away, frames[:, :, 0]), 0.0, atol=1e-15)
        assert radius < found["wrist"]["rim"]
    radii = sorted(round(float(np.hypot(each["y"], each["z"])), 12) for each in found["tendons"])
    assert radii[-1] == study.wrist.tendon_radius and (radii[0] == 0.0) == (setting == "wrist.tendons=five")
    inner = [each["discs"] for each in found["tendons"]]
    assert inner == ([5, 5, 5, 3] if setting == INNER else [5] * tendons)


def test_a_real_wrist_of_which_one_arc_is_seen_bends_by_its_share_in_every_segment(
    monkeypatch: pytest.MonkeyPatch
) -> None:  # fmt: skip
    whole = course()
    seen_as_one = dataclasses.replace(whole, segment_theta=whole.bend)
    monkeypatch.setattr(trial_results, "first_course", lambda run: seen_as_one)
    run: Any = SimpleNamespace(config=SimpleNamespace(hw_run=SimpleNamespace(planes=2)))
    bends = [f"bend_{k}_{plane}" for k in (1, 2, 3, 4) for plane in ("ulnar", "flexion")]
    table = view_module._performed(run, ["time", *bends, "tip_x"])
    assert table is not None
    np.testing.assert_allclose(np.stack([table[name] for name in bends], axis=1), np.tile(whole.bend / 4.0, 4))
    assert np.array_equal(table["time"], whole.time)
    assert np.array_equal(table["tip_x"], seen_as_one.columns()["tip_x"])


def test_tendons_have_the_numbers_of_the_runs_tables() -> None:
    """The motor board's four are the paper's, whose third runs through the centre."""
    board: Any = SimpleNamespace(kind="hw-run", config=SimpleNamespace(hw_run=HwRunSettings(), wrist=WristParameters()))
    servos: Any = SimpleNamespace(
        kind="hw-run",
        config=SimpleNamespace(hw_run=HwRunSettings(rig="servos"), wrist=WristParameters(tendons="three")),
    )
    assert tuple(view_module._numbers(board, 4)) == (1, 2, 4, 5)
    assert tuple(view_module._numbers(servos, 3)) == (1, 2, 3)
    assert tuple(view_module._numbers(SimpleNamespace(kind="simulate"), 6)) == (1, 2, 3, 4, 5, 6)  # type: ignore[arg-type]


def test_the_wrist_is_drawn_as_it_is_and_not_as_it_is_believed(tmp_path: Path) -> None:
    made = course(length=0.088)
    plant = "simulate.loop.plant={length: x1.1, tendon_radius: 0.03, hand_offset: 0.05}"
    found = viewed(tmp_path, made, plant)
    assert found["wrist"] == {"length": pytest.approx(0.088), "discs": 5, "rim": pytest.approx(0.0375), "hand": 0.05}
    ends = spatial_tips(ANGLE * np.array(found["bends"]), found["wrist"]["length"])
    np.testing.assert_allclose(ends, PLACE * np.array(found["tip"]), atol=3e-5)


def test_pictures_end_where_the_wrist_left_its_range(tmp_path: Path) -> None:
    made = course()
    for each in (made.theta, made.segment_theta, made.tip):
        each[800:] = np.nan
    found = viewed(tmp_path, made)
    assert found["left"] and found["duration"] == pytest.approx(0.799)
    np.testing.assert_allclose(PLACE * np.array(found["tip"][-1]), made.tip[799], atol=PLACE)


def test_a_wrist_that_failed_at_once_has_no_pictures(tmp_path: Path) -> None:
    made = course()
    for each in (made.segment_theta, made.tip):
        each[1:] = np.nan
    assert spatial_view(run_of(tmp_path, made)) is None


def test_a_run_in_one_plane_has_nothing_of_it_on_its_page(tmp_path: Path) -> None:
    with start_run("simulate", Study(), "", tmp_path, page=lambda path, man, _: page(Run(path), man)) as live:
        live.table("data/trajectory.csv", dict.fromkeys(("time", "theta", "theta_desired"), np.array([0.0, 0.1])))
    text = Run(live.path).file("report.html").read_text()
    assert spatial_view(Run(live.path)) is None
    assert 'id="courses"' in text and not re.search(r'id="(motion|stage|keys|said)"', text)


@pytest.mark.slow
def test_a_page_of_eight_seconds_stays_small(tmp_path: Path) -> None:
    run = run_of(tmp_path, course(horizon=8.0))
    assert run.file("report.html").stat().st_size < 150_000


@pytest.mark.parametrize(
    ("setting", "pieces"),
    [
        ("wrist.tendons=three", [4, 4, 4]),
        ("wrist.tendons=four", [4, 4, 4, 4]),
        (INNER, [4, 4, 4, 2]),
        (INNER.replace("{angle_deg: 0}", "{angle_deg: 0, ends_at: 4}").replace(" 3}", " 2}"), [3, 4, 4, 1]),
    ],
)
def test_the_figure_shows_both_paths_of_the_tip_and_every_tendon_to_where_it_ends(
    setting: str, pieces: list[int]
) -> None:
    wrist = wristctl.load_study(None, setting).wrist
    made = course(len(pieces), name="figure-of-8")
    left, right = motion_in_space(made, wrist, "as believed").axes
    drawn: dict[Any, Any] = {line.get_label(): line.get_xydata() for line in right.get_lines()}
    np.testing.assert_allclose(drawn["tip reached"], 1e3 * made.tip[:, 1:], atol=1e-9)
    np.testing.assert_allclose(drawn["tip wanted"], 1e3 * made.tip_desired[:, 1:], atol=1e-9)
    lines: dict[Any, list[Any]] = {colour: [] for colour in TENDON_COLOURS[:4]}
    for line in left.get_lines():
        lines.get(line.get_color(), []).append(line.get_xydata())
    assert [len(each) for each in lines.values()] == [*pieces, *[0] * (4 - len(pieces))]
    bent = int(np.argmax(np.hypot(*made.bend.T)))
    centres, frames = spatial_frames(made.segment_theta[bent], wrist.length, np.linspace(0.0, 1.0, wrist.discs))
    for cable, parts in zip(cables(wrist), lines.values(), strict=False):
        holes = 1e3 * seen(centres + frames @ np.array([0.0, cable.y, cable.z]))[:, :2]
        ends = {tuple(np.round(end, 6)) for part in parts for end in part}
        assert ends == {tuple(np.round(hole, 6)) for hole in holes[: cable.discs]}
    assert len(left.patches) == wrist.discs and left.get_title(loc="left") == "as believed"
    assert rim(wrist) > wrist.tendon_radius


@pytest.mark.parametrize("planes", [(1.0, 0.2), (-1.0, 0.2), (0.2, 1.0), (0.2, -1.0)])
def test_the_figure_shows_the_wrist_where_it_is_bent_most_in_whichever_plane(planes: tuple[float, float]) -> None:
    """It bends and comes back, late in one plane and early in the other, which bends little."""
    still = course()
    time = still.time
    late, early = (25.0 * np.exp(-(((time - at) / 0.2) ** 2)) for at in (1.0, 0.4))
    most, little = np.radians(late), np.radians(early)
    bends = np.stack([most, little] if abs(planes[0]) == 1.0 else [little, most], axis=1) * np.array(planes)
    segments = np.tile(0.25 * bends, 4)
    made = dataclasses.replace(still, theta=bends, segment_theta=segments, tip=spatial_tips(segments, 0.08))
    left, right = motion_in_space(made, WristParameters()).axes
    assert right.get_title(loc="left") == "bent most at 1.00 s"
    (here,) = (line for line in right.get_lines() if line.get_marker() == "o")
    np.testing.assert_allclose(np.asarray(here.get_xydata(), float), 1e3 * made.tip[[1000], 1:])
    (dot,) = (line for line in left.get_lines() if line.get_marker() == "o")
    np.testing.assert_allclose(np.asarray(dot.get_xydata(), float), 1e3 * seen(made.tip[[1000]])[:, :2])


SEEK = "const s = document.getElementById('instant'); s.value = {}; s.dispatchEvent(new Event('input'));"
LOOK = "const v = document.getElementById('view'); v.selectedIndex = {}; v.dispatchEvent(new Event('change'));"
PICTURE = "return document.querySelector('#stage g').innerHTML"
SAID = "return document.getElementById('said').textContent"
PATHS = (
    "return [...document.querySelectorAll('#stage path')]"
    ".map(p => [p.getAttribute('stroke'), p.getAttribute('fill'), p.getAttribute('d')])"
)


def key(name: str) -> str:
    return f"document.getElementById('stage').dispatchEvent(new KeyboardEvent('keydown', {{key: '{name}'}}));"


def points(path: str) -> Array:
    return np.array(
        [[float(number) for number in pair.split()] for pair in path.strip("MZ").replace("M", "L").split("L")]
    )


@pytest.mark.parametrize("plant", ["pcc", "hinges"])
def test_the_browser_bends_the_wrist_as_the_model_does(browser: Browser, tmp_path: Path, plant: str) -> None:
    made, model = course(4), PLANTS_IN_SPACE[plant]
    made = dataclasses.replace(made, tip=model.tips(WristParameters(), made.segment_theta))
    run = run_of(tmp_path, made, INNER, f"simulate.loop.plant.model={plant}")
    browser.open(run.file("report.html"), 1280, False)
    browser.run(SEEK.format(1000))
    _, frames = model.frames(WristParameters(), made.segment_theta[-1], np.array([1.0]))
    x, y, z = frames[0, :, 0]
    bends = np.rad2deg(np.arctan2(np.hypot(y, z), x) * np.array([y, z]) / np.hypot(y, z))
    told = {name: float(number) for number, name in re.findall(r"([\d.]+)° toward (\w+)", browser.run(SAID))}
    signed = [told.get("ulnar", -told.get("radial", 0.0)), told.get("flexion", -told.get("extension", 0.0))]
    assert signed == pytest.approx(bends, abs=0.06)
    off = 1e3 * np.linalg.norm(made.tip[-1] - made.tip_desired[-1])
    assert f"{off:.1f} mm from where it is wanted" in browser.run(SAID)
    for view in range(4):
        browser.run(LOOK.format(view))
        paths = browser.run(PATHS)
        bone = [points(d) for stroke, fill, d in paths if stroke == "#000"]
        dot = points([d for _, fill, d in paths if fill == "#009E73"][-1])
        at = 0.5 * (dot.min(axis=0) + dot.max(axis=0))
        assert len(bone) == 4 and min(np.hypot(*(line[-1] - at)) for line in bone) < 0.05, (
            "the backbone ends at the tip"
        )
        pieces = [sum(stroke == colour for stroke, *_ in paths) for colour in TENDON_COLOURS[:4]]
        assert pieces == [4, 4, 4, 2], "one piece between two discs, and the last tendon ends at the third"
    keys = browser.run("return [...document.querySelectorAll('#keys li')].map(each => each.textContent)")
    assert f"tendon 4, to disc 3: {made.tension[-1, 3]:.1f} N" in keys
    assert browser.console() == []
    assert set(browser.requests()) == {next(tmp_path.glob("*/report.html")).as_uri()}


def test_it_is_turned_by_keys_and_by_dragging_and_moves_on_its_own_only_when_played(
    browser: Browser, tmp_path: Path
) -> None:
    browser.open(run_of(tmp_path, course()).file("report.html"), 1280, False)
    assert browser.run("return document.getElementById('animation').hidden") is False
    first = browser.run(PICTURE)
    seen = {first}
    for name in ("ArrowLeft", "ArrowUp", "ArrowRight", "ArrowDown"):
        seen.add(browser.run(key(name) + PICTURE))
    assert len(seen) == 4, "the last of four turns is back"
    browser.run(key("ArrowLeft"))
    assert browser.run(key("Home") + PICTURE) == first
    event = "new PointerEvent('pointer{}', {{pointerId: 1, isPrimary: true, clientX: {}, clientY: {}, bubbles: true}})"
    drag = [event.format("down", 200, 200), event.format("move", 240, 180), event.format("up", 240, 180)]
    quiet = "const s = document.getElementById('stage'); s.setPointerCapture = () => {};"  # of no real pointer
    dragged = browser.run(quiet + "".join(f"s.dispatchEvent({each});" for each in drag) + PICTURE)
    assert dragged != first
    chosen = browser.run("const v = document.getElementById('view'); return v.options[v.selectedIndex].text")
    assert chosen == "as it was turned"
    after = browser.run(f"document.getElementById('stage').dispatchEvent({event.format('move', 400, 400)});" + PICTURE)
    assert after == dragged, "let go"
    assert browser.run("document.getElementById('play').click(); return document.getElementById('play').textContent")
    for _ in range(1000):  # however slow the machine
        if browser.run(PICTURE) != dragged:
            break
    assert browser.run(PICTURE) != dragged
    unreachable = (
        "return [...document.querySelectorAll('#animation button, #animation input, #animation select, #stage')]"
    )
    assert browser.run(unreachable + ".filter(each => each.tabIndex < 0).length") == 0
    assert browser.console() == []


@pytest.mark.parametrize("width", [390, 1280], ids=["phone", "desktop"])
@pytest.mark.slow
def test_the_view_fits_the_page(browser: Browser, tmp_path: Path, width: int) -> None:
    browser.open(run_of(tmp_path, course()).file("report.html"), width, True)
    assert browser.run("return document.documentElement.scrollWidth") <= width
    stage, letters = browser.run(
        "const t = document.querySelector('#stage text').getBoundingClientRect();"
        "return [document.getElementById('stage').clientWidth, t.height]"
    )
    assert stage > 0.4 * width and 10.0 < letters < 24.0


@pytest.mark.parametrize(("gravity", "up"), [("[9.81, 0]", True), ("[-9.81, 0]", False)])
def test_gravity_is_shown_as_it_pulls_on_the_page_and_in_the_figure(
    browser: Browser, tmp_path: Path, gravity: str, up: bool
) -> None:
    run = run_of(tmp_path, course(), f"wrist.gravity={gravity}")
    browser.open(run.file("report.html"), 1280, False)
    arrow = "return document.querySelector(`#stage path[stroke-width='1.2']`).getAttribute('d')"
    begin, end = points(browser.run(arrow).split("M")[1])
    assert (end[1] < begin[1]) == up and begin[0] == pytest.approx(end[0])
    pulled = motion_in_space(course(), run.config.wrist).axes[0].texts
    drawn = next(text for text in pulled if text.arrow_patch is not None)  # type: ignore[attr-defined]
    assert (drawn.xy[1] > drawn.xyann[1]) == up  # type: ignore[attr-defined]
    still = run.config.wrist.model_copy(update={"gravity": (0.0, 0.0)})
    assert "gravity" not in [text.get_text() for text in motion_in_space(course(), still).axes[0].texts]


def test_the_figures_view_turns_space_and_neither_stretches_nor_mirrors_it() -> None:
    """From above and from the side: the straight wrist stands upright, and its far end is the nearer one."""
    right, up, away = seen(np.eye(3)).T
    np.testing.assert_allclose(np.array([right, up, away]) @ np.array([right, up, away]).T, np.eye(3), atol=1e-12)
    np.testing.assert_allclose(np.cross(right, up), -away, atol=1e-12)
    assert right[0] == 0.0 and up[0] > 0.5 and -1.0 < away[0] < 0.0
    ulnar, flexion = seen(np.eye(3)[1:])
    assert abs(ulnar[0]) > 0.5 and abs(flexion[0]) > 0.5, "neither plane is seen edge on"


@pytest.mark.painted
@pytest.mark.parametrize("planes", [(1.0, 0.0), (0.0, 1.0), (0.0, 0.0)], ids=["ulnar", "flexion", "at rest"])
def test_a_straight_move_is_drawn_with_one_scale_for_both_planes(planes: tuple[float, float]) -> None:
    from wristctl.records.formats import pictures

    round_move = course()
    bends, wanted = round_move.segment_theta * np.tile(planes, 4), round_move.bend_ref * planes
    flat = dataclasses.replace(
        round_move, theta=round_move.bend * planes, theta_ref=wanted, segment_theta=bends,
        tip=spatial_tips(bends, 0.08), tip_desired=spatial_tips(wanted, 0.08),
    )  # fmt: skip
    drawn = motion_in_space(flat, WristParameters())
    assert pictures(drawn, "space")[".png"].startswith(b"\x89PNG")
    path = drawn.axes[1]
    scale = np.diff(path.transData.transform([[0.0, 0.0], [1.0, 1.0]]), axis=0)[0]
    assert scale[0] == pytest.approx(scale[1]), "a millimetre is as long in one plane as in the other"
