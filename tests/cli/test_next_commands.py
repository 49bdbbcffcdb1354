"""The commands that commands advise, run as they are printed: they go on with the wrist, the loop and the gains."""

from __future__ import annotations

import re
import shlex
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from tests.cli.conftest import Call
from tests.identification.benches import LEVEL, UPRIGHT, write_run
from wristctl.config.simulate import SimulateSettings
from wristctl.config.wrist import WristParameters
from wristctl.records import Run, list_runs, open_run
from wristctl.wrist.kinematics import arc_tip

pytestmark = [pytest.mark.slow, pytest.mark.painted]

# A folder of runs with a name that a shell has to be told as one word.
OUT = ("--out", "my runs")
WRIST = ("--set", "wrist.length=0.09", "--set", "wrist.range_deg=45")
Did = Callable[..., tuple[str, Run]]
DOCS = Path(__file__).parents[2] / "docs"


def advised(text: str) -> list[list[str]]:
    """Commands that a text advises, as a shell parts them: on a line of their own, or between backticks.

    Those with a word for what a person is to choose, DIR or RUN, are examples.
    """
    found = [line for line in text.splitlines() if line.startswith("wristctl ")]
    found += re.findall(r"`(wristctl [^`]+)`", text)
    return [shlex.split(line)[1:] for line in found if not re.search(r"\b[A-Z]{3,}\b", line.partition("latest:")[0])]


@pytest.fixture
def did(call: Call) -> Did:
    """Runs `wristctl ...` well: what it printed, and the run that it left."""

    def do(*words: str) -> tuple[str, Run]:
        code, out, err = call(*words)
        assert code == 0, (words, err)
        places = [line for line in out.splitlines() if re.search(r"\d{8}T\d{6}Z-[\w-]+$", line) and " --" not in line]
        return out, open_run(places[-1]) if places else list_runs(Path("results"))[0]

    return do


def wrist_of(run: Run) -> WristParameters:
    return run.config.wrist


def small() -> WristParameters:
    return WristParameters(length=0.09, range_deg=45.0)


def test_samples_are_trained_on_and_their_network_is_used_on_their_wrist(
    did: Did, call: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    out, drawn = did("gen-data", "--samples", "300", *WRIST, *OUT)
    (train,) = advised(out)
    assert train[0] == "train"
    out, trained = did(*train, "--epochs", "40", "--set", "hidden=[16]", "--set", "activation=tanh")
    assert [one.run for one in trained.manifest.inputs] == [drawn.id] and wrist_of(trained) == small()
    (simulate,) = advised(out)
    _, moved = did(*simulate)
    assert wrist_of(moved) == small() and moved.config.simulate.reference.inverse == "network"
    assert [one.run for one in moved.manifest.inputs] == [trained.id]
    (shown,) = re.findall(r"metrics: (wristctl .*)$", call("runs", "show", drawn.id, *OUT)[1], re.MULTILINE)
    assert "exact_inverse_rmse_deg" in call(*shlex.split(shown)[1:])[1]
    (again,) = [words for words in advised(drawn.file("README.md").read_text()) if words[:2] == ["runs", "replay"]]
    monkeypatch.chdir(drawn.path.parent)
    assert "identical" in call(*again)[1]


def test_a_network_of_several_segments_is_used_on_a_wrist_of_as_many(did: Did) -> None:
    """Without data of its own it was trained on what it drew."""
    out, trained = did(
        "train", "--epochs", "5", "--set", "hidden=[8]", "--set", "gen-data.segments=3", "--set", "gen-data.samples=60"
    )
    (simulate,) = advised(out)
    _, moved = did(*simulate)
    assert moved.config.simulate.loop.plant_segments == 3 and [one.run for one in moved.manifest.inputs] == [trained.id]


@pytest.mark.parametrize(("rows", "parted"), [(60, True), (12, False)])
def test_one_recording_is_parted_by_samples_and_too_few_are_not_advised_to_be_trained_on(
    did: Did, tmp_path: Path, rows: int, parted: bool
) -> None:
    theta = np.random.default_rng(0).uniform(-0.6, 0.6, rows)
    table = np.column_stack([1e3 * arc_tip(theta, 0.09), np.degrees(theta)]).tolist()
    lines = ["tip_x [mm],tip_y [mm],angle [deg]", *(",".join(map(repr, row)) for row in table)]
    (tmp_path / "mine.csv").write_text("\n".join(lines) + "\n")
    out, _ = did("gen-data", "--source", "csv", "--set", "files=[mine.csv]", *WRIST)
    assert bool(advised(out)) == parted
    for train in advised(out):
        _, trained = did(*train, "--epochs", "3", "--set", "hidden=[8]")
        assert trained.config.train.split == "sample" and wrist_of(trained) == small()


def chosen(run: Run) -> SimulateSettings:
    """What was simulated, without the horizon."""
    return run.config.simulate


SEARCH = ("--candidates", "4", "--iterations", "2", "--set", "finalists=4", "--set", "repetitions=2")


def test_gains_are_tried_on_the_loop_that_they_were_tuned_for(did: Did, call: Call) -> None:
    scenario = "scenarios=[{loop: rig, reference: {angle_deg: 15, duration: 1.2}}]"
    motors = "actuator: {level: tendon, friction: 0.2}, sensor: {level: camera}"
    rig = f"loops={{other: {{}}, rig: {{control_period: 1.0e-2, {motors}}}}}"
    out, tuned = did("tune", *WRIST, *SEARCH, "--set", "controllers=[ct-dob]", "--set", scenario, "--set", rig, *OUT)
    simulate, trial = advised(out)
    assert "on the loop rig, for which they were tuned" in " ".join(out.split())
    gains = {name: tuned.metrics[f"ct-dob_{name}"]["value"] for name in ("w", "zeta", "wo")}
    _, moved = did(*simulate)
    once = chosen(moved)
    assert once.loop == tuned.config.tune.loops["rig"] and wrist_of(moved) == wrist_of(tuned) == small()
    assert (once.controller, once.gains) == ("ct-dob", gains)
    assert once.reference == tuned.config.tune.scenarios[0].reference and once.horizon == tuned.config.tune.horizon
    assert trial[0] == "hw-run"
    out, performed = did(*trial, "--set", "directions=[ulnar]")
    rows, settings = performed.config.hw_run.rows, performed.config.hw_run
    assert [(row.controller, row.gains) for row in rows] == [("ct-dob", gains)] and wrist_of(performed) == small()
    assert (settings.actuator, settings.sensor) == (once.loop.actuator, once.loop.sensor)
    (limits,) = [words for words in advised(performed.file("README.md").read_text()) if words[:2] == ["hw", "limits"]]
    assert call(*limits)[0] == 0


def test_gains_tuned_on_worlds_for_an_identified_wrist_are_tried_on_the_worlds_loop_and_that_wrist(
    did: Did, tmp_path: Path
) -> None:
    """A loop that no rig has, and a controller of one's own with a setting; the identification is a stand-in."""
    (tmp_path / "family.yaml").write_text(
        "families:\n  mine:\n    loop: {plant_segments: 2, plant: {payload: 0.1}}\n"
        "    draw: {reference.angle_deg: 10..20}\n    references: [{duration: 0.5}]\n    horizon: 1.0\n"
        "controller-settings: {own: {share: 0.5}}\n"
    )
    (tmp_path / "own.py").write_text(OWN)
    poses = [write_run(tmp_path / "results", 0, pose, sides=("ulnar", "extension")) for pose in (UPRIGHT, LEVEL)]
    _, found = did("identify", *(run.id for run in poses), "--set", "fix.friction=0.1")
    worlds = ("--set", "worlds.family=mine", "--set", "worlds.draws=2", "--set", "worlds.validation=2")
    out, tuned = did(
        "tune", "family.yaml", *SEARCH, *worlds, "--set", "controllers=[own.py:OWN]", "--from-identified", found.id
    )
    (simulate,) = advised(out)
    (tmp_path / "own.py").unlink()
    _, moved = did(*simulate)
    once = chosen(moved)
    assert once.loop.plant == tuned.config.families["mine"].loop.plant and once.loop.plant_segments == 2
    assert wrist_of(moved).stiffness == found.metrics["stiffness"]["value"]
    assert 10.0 < once.reference.end_deg < 20.0 and once.horizon == 1.0
    assert "code/own/own.py" in once.controller and moved.config.controller_settings == {"own": {"share": 0.5}}


OWN = """
from wristctl.config.section import Parameter
from wristctl.control.design import LawDesign
from wristctl.control.law import Controller, Gain
from wristctl.control.model import inverse_dynamics

GAINS = {"k": Gain("N m/rad", "spring", 0.1, 40.0), "d": Gain("N m s/rad", "damper", 1e-2, 1.0)}

def make(settings):
    share = settings["share"]

    def law(now, wrist, gains, memory):
        forward = inverse_dynamics(wrist, now.theta_ref, now.rate_ref, now.acceleration_ref)
        return share * forward - gains.k * (now.theta - now.theta_ref) - gains.d * (now.rate - now.rate_ref)

    return Controller("own", law, "", GAINS, {"soft": {"k": 10.0, "d": 0.2}})

OWN = LawDesign("own", {"share": Parameter(1.0, "", "of the torque that the model asks for")}, make)
"""


def test_where_no_preset_arrives_the_search_is_on_the_loop_and_the_motion_that_were_simulated(did: Did) -> None:
    loop = "loop={plant_segments: 1, control_period: 2.0e-3, disturbances: {load: 0.1}}"
    motion = ("--reference", "step", "--set", "reference.angle_deg=12", "--set", "direction=radial")
    out, moved = did(
        "simulate",
        "--controller",
        "pid-ff",
        *WRIST,
        "--set",
        loop,
        *motion,
        "--set",
        "horizon=0.02",
        "--seed",
        "4",
        *OUT,
    )
    (tune,) = advised(out)
    _, tuned = did(*tune)
    settings = tuned.config.tune
    assert settings.controllers == ("pid-ff",) and wrist_of(tuned) == small() and tuned.config.seed == 4
    assert list(settings.loops.values()) == [moved.config.simulate.loop] and settings.horizon == 0.02
    (scenario,) = settings.scenarios
    assert (scenario.reference.kind, scenario.reference.end_deg) == ("step", -12.0)
    out, _ = did("simulate", "--controller", "feedforward", "--set", "loop.plant.stiffness=x2", "--set", "horizon=2.5")
    assert "does not arrive" in out and not advised(out), "what has no gains is not searched"


RECOMMEND = (
    "recommend", *WRIST, "--set", "controllers=[pid-ff]", "--set", "horizon=2.5", "--set", "draws=2",
    "--set", "validation=2", "--set", "tests=8", "--set", "candidates=4", "--set", "iterations=1",
    "--set", "rehearsed=0", "--set", "frequencies=[0.5]", "--set", "payloads=[0.2]",
)  # fmt: skip
TRIAL = ("--set", "hw-run.directions=[ulnar]", "--set", "hw-run.push.force=0", "--set", "hw-run.horizon=1.5")


@pytest.mark.parametrize("on_a_rig", [True, False])
def test_what_is_recommended_is_tried_on_its_rig_or_simulated_on_its_loop(did: Did, on_a_rig: bool) -> None:
    ideal = ("--set", "loop={actuator: {level: ideal}, sensor: {level: ideal}}")
    drawn = ("--set", "draw={plant.stiffness: x0.8..1.2}")
    out, made = did(*RECOMMEND, *TRIAL, *drawn, *(() if on_a_rig else ideal), *OUT)
    (following,) = advised(out)
    _, done = did(*following)
    rig, settings = made.config.recommend.loop, done.config.hw_run if on_a_rig else chosen(done).loop
    assert done.kind == ("hw-run" if on_a_rig else "simulate") and wrist_of(done) == small()
    assert (settings.actuator, settings.sensor) == (rig.actuator, rig.sensor)
    if on_a_rig:
        assert done.config.hw_run.directions == ("ulnar",) and done.config.hw_run.horizon == 1.5
    files = sorted((made.path / "data" / "controllers").iterdir())
    assert len(files) >= 2
    for file in files:
        assert wrist_of(did("simulate", str(file))[1]) == small()


IN_TWO_PLANES = {
    "simulate": ("--set", "wrist.tendons=six"),
    "hw-run": ("--set", "references=[{kind: dart-thrower, turn: 2}]"),
}


@pytest.mark.parametrize("command", IN_TWO_PLANES)
def test_what_is_recommended_in_two_planes_is_simulated_or_tried_in_two(did: Did, command: str) -> None:
    drawn = ("--set", "draw={plant.stiffness: x0.8..1.2, disturbances.load: -0.2..0.2, plant_segments: [1]}")
    trial = TRIAL if command == "hw-run" else ()
    out, _ = did(*RECOMMEND, *IN_TWO_PLANES[command], *trial, *drawn, "--set", "loop.plant_segments=1", *OUT)
    assert "All loops bend in two planes: " in out and "to any side on the simulated rigs" in " ".join(out.split())
    assert ("compare and hw-run" in " ".join(out.split())) == (command == "hw-run")
    (following,) = advised(out)
    _, done = did(*following)
    assert done.kind == command
    if command == "hw-run":
        assert done.config.hw_run.planes == 2 and done.has("data/log.csv")
        assert {"bend_ulnar", "bend_flexion"} <= set(done.data("log"))
    else:
        assert {"bend_ulnar", "bend_flexion", "pull_3"} <= set(
            done.data("bends")
        ) and done.config.simulate.loop.planes == 2


def test_an_identified_wrist_is_simulated_and_compared_on_with_its_geometry(did: Did, tmp_path: Path) -> None:
    poses = [
        write_run(tmp_path / "my runs", 0, pose.model_copy(update={"length": 0.085}), sides=("ulnar", "extension"))
        for pose in (UPRIGHT, LEVEL)
    ]
    out, found = did("identify", *(run.id for run in poses), "--set", "fix.friction=0.1", *OUT)
    _, simulate, compare = advised(out)
    _, moved = did(*simulate)
    first = poses[0].config.wrist
    assert wrist_of(moved) == first and [one.run for one in moved.manifest.inputs] == [found.id]
    out, compared = did(
        *compare, "--set", "worlds.draws=8", "--set", "controllers=[{controller: pid-ff, gains: hardware}]"
    )
    names = ("stiffness", "damping", "tendon_radius", "flexion_ratio")
    told = {name: found.metrics[name]["value"] for name in names if name in found.metrics}
    assert wrist_of(compared).model_dump() == {**first.model_dump(), **told}
    for words in advised(out):
        did(*words)


def test_what_new_and_init_write_is_followed_by_commands_that_run(did: Did, call: Call) -> None:
    for kind in ("controller", "reference", "optimiser"):
        code, out, err = call("new", kind, f"my-{kind}")
        assert code == 0, err
        lines = re.findall(r"^  (wristctl .*)$", out, re.MULTILINE)
        assert lines
        for line in lines:
            words = shlex.split(line)[1:]
            code, out, err = call(*words, *(["--iterations", "2"] if words[0] == "tune" else []))
            assert code == 0, (line, out, err)
    code, out, err = call("init", ".")
    assert code == 0, err
    lines = re.findall(r"^  (wristctl .*)$", out, re.MULTILINE)
    assert [shlex.split(line)[1] for line in lines] == ["simulate", "compare", "tune"]
    did(*shlex.split(lines[0])[1:])


@pytest.mark.parametrize(
    "words",
    [
        ("compare", "--set", "inverses=[none]", "--set", "controllers=[{controller: pid-ff, gains: hardware}]"),
        ("analyse", "--controller", "pid-ff", "--set", "reference.angle_deg=10"),
        (
            "analyse",
            "--of",
            "hysteresis",
            "--set",
            "hysteresis.ranges_deg=[[0, 10]]",
            "--set",
            "hysteresis.frequencies=[2.0]",
            "--set",
            "hysteresis.sheaths=[0.0]",
            "--set",
            "hysteresis.angles_deg=[5]",
        ),
        ("simulate", "--controller", "ct-dob", "--reference", "circle"),
        ("simulate", "--sweep", "wrist.length=0.07,0.08"),
    ],
)
def test_what_else_is_advised_in_answers_and_readmes_runs(
    did: Did, words: tuple[str, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A README says how to do its run anew, from the folder above."""
    out, run = did(*words)
    page = run.file("README.md").read_text()
    followed = [*advised(out), *advised(page)]
    assert ["runs", "replay", run.id] in followed and "from the folder above" in page
    for following in followed:
        with monkeypatch.context() as during:
            if "--config" in following:
                during.chdir(run.path.parent)
            did(*following)


PRESETS = ", ".join(f"{{controller: {name}, gains: hardware}}" for name in ("ct-dob", "pid-ff", "mrac"))
FEW = ("--set", "references=[{kind: circle, angle_deg: 15}]", "--set", "inverses=[none]")


def test_a_file_of_three_tendons_goes_through_every_command_and_what_each_advises(did: Did, call: Call) -> None:
    """One wrist from YAML to exports, with small budgets."""
    Path("robot.yaml").write_text("wrist: {tendons: three, length: 0.095, stiffness: 1.1}\n")
    robot = "robot.yaml"
    wrist = WristParameters(tendons="three", length=0.095, stiffness=1.1)

    def walked(*words: str) -> tuple[str, Run, list[list[str]]]:
        """What a command said in one line, its run of this wrist, and the commands that it advises."""
        out, run = did(*words)
        assert wrist_of(run) == wrist
        return " ".join(out.split()), run, advised(out)

    said, moved, _ = walked("simulate", robot)
    assert "in two planes (3 tendons" in said and moved.metrics["rmse_flexion"]["value"] < 1e-6
    # At 30 deg one tendon alone pulls toward ulnar: the springs' torque over its radius, less what gravity takes.
    springs = wrist.stiffness * np.radians(30.0) / wrist.tendon_radius
    assert 0.6 * springs < moved.metrics["peak_tension"]["value"] < springs + wrist.pretension
    said, _, _ = walked("compare", robot, *FEW, "--set", f"controllers=[{PRESETS}]")
    assert "All loops bend in two planes: " in said and all(f" {law} " in said for law in ("ct-dob", "pid-ff", "mrac"))
    scenario = "scenarios=[{loop: rig, reference: {angle_deg: 15, duration: 1.2}}]"
    rig = "loops={other: {}, rig: {control_period: 1.0e-2, actuator: {level: tendon}, sensor: {level: camera}}}"
    tuning = ("--set", scenario, "--set", rig)
    said, _, following = walked("tune", robot, *SEARCH, "--set", "controllers=[pid-ff]", *tuning)
    assert "All loops bend in two planes" in said and [words[0] for words in following] == ["simulate", "hw-run"]
    for words in following:
        assert wrist_of(did(*words, *(TRIAL if words[0] == "hw-run" else ()))[1]) == wrist
    small_draws = ("--set", "draw={plant.stiffness: x0.8..1.2, plant_segments: [1]}", "--set", "loop.plant_segments=1")
    said, _, following = walked("recommend", robot, *RECOMMEND[1 + len(WRIST) :], *small_draws)
    assert "The tendons hold" in said and "to any side" in said and [words[0] for words in following] == ["hw-run"]
    for words in following:
        assert wrist_of(did(*words, *TRIAL)[1]) == wrist
    said, _, _ = walked("analyse", robot, "--controller", "ct-dob", "--set", "angles_deg=[0, 15]")
    assert "ct-dob/default in two planes toward ulnar is stable at 0 and 15 deg" in said
    said, drawn, (train,) = walked("gen-data", robot, "--samples", "300")
    said, trained, (simulate,) = walked(*train, "--epochs", "40", "--set", "hidden=[8]", "--preset", "recommended")
    assert [one.run for one in trained.manifest.inputs] == [drawn.id] and "over both planes" in said
    _, behind, _ = walked(*simulate)
    assert behind.config.simulate.reference.inverse == "network" and behind.metrics["rmse_flexion"]["value"] > 1e-6
    loops = ("ranges_deg=[[0,10]]", "frequencies=[2.0]", "sheaths=[0.0]", "angles_deg=[5]")
    loops_set = [word for each in loops for word in ("--set", f"hysteresis.{each}")]
    said, _, _ = walked("analyse", robot, "--of", "hysteresis", *loops_set)
    assert "In two planes (these tendons bend the wrist in both), bent toward ulnar" in said
    motors = ("--set", "loop.actuator.level=tendon", "--set", "loop.plant_segments=1")
    said, recorded, _ = walked("simulate", robot, "--reference", "circumduction", "--controller", "ct-dob", *motors)
    assert call("runs", "export", recorded.id, "--file", "log.csv")[0] == 0
    assert "spool_3 [m]" in Path("log.csv").read_text().partition("\n")[0]
    springs = ("--set", "wrist.stiffness=0.8", "--set", "wrist.hand_mass=0.3")
    belief = ("--config", robot, *springs, "--set", "model=wrist", "--set", "segments=1")
    out, found = did("identify", "log.csv", *belief)
    assert found.metrics["stiffness"]["value"] == pytest.approx(1.1, rel=0.01)
    recommend, simulate = advised(out)
    assert recommend[0] == "recommend" and found.id in recommend[-1]
    told = f"on the wrist identified in {found.id} in two planes (3 tendons"
    assert told in " ".join(did(*simulate)[0].split())
    for program, file in (("mujoco", "wrist.xml"), ("matlab", "wrist_chain.m")):
        assert call("export-model", recorded.id, "--to", program)[0] == 0
        assert len(Path(file).read_text().splitlines()) > 20
    assert Path("wrist.xml").read_text().count("<spatial ") == 3
    said, _, _ = walked("simulate", robot, "--sweep", "wrist.tension_limit=6,60")
    assert "highest 22.8 deg at wrist.tension_limit = 6 N; 1 of 2 rollouts: does not arrive" in said


def test_the_page_of_a_robot_with_three_tendons_names_commands_that_run(did: Did, call: Call) -> None:
    """Each as it stands on the page, as far as its plan; the budgets are a reader's."""
    page = (DOCS / "your-own-wrist.md").read_text().partition("## A robot with three tendons")[2]
    file, commands = re.findall(r"```(?:yaml)?\n(.*?)```", page, re.DOTALL)
    Path("robot.yaml").write_text(file)
    lines = [shlex.split(line, comments=True)[1:] for line in commands.splitlines()]
    assert [words[0] for words in lines] == ["simulate", "compare", "recommend", "hw-run", "simulate", "compare"]
    for words in lines:
        if not any("RUN" in word for word in words[1:3]):
            code, out, err = call(*words, "--dry-run")
            assert code == 0 and "would write a run of" in out, (words, out, err)
