"""Files and overrides become a study; what is wrong is named with place and cure."""

from __future__ import annotations

import json
import shlex
from collections.abc import Sequence
from pathlib import Path

import pytest
import yaml

from wristctl.config.loop import LOOPS, Loop, Reference
from wristctl.config.plant import Actuator, Plant, Sensor
from wristctl.config.study import Study
from wristctl.errors import UserError
from wristctl.study_files.load import load_study

ROOT = Path(__file__).parents[2]


def _file(folder: Path, text: str, name: str = "study.yaml") -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def test_later_files_win_leaf_by_leaf(tmp_path: Path) -> None:
    first = _file(tmp_path, "wrist: {length: 0.1, mass: 0.06}\ntrain: {hidden: [9, 9, 9]}", "a.yaml")
    second = _file(tmp_path, "wrist: {length: 0.12}\ntrain: {hidden: [5]}", "b.yaml")
    study = load_study([first, second])
    assert (study.wrist.length, study.wrist.mass, study.train.hidden) == (0.12, 0.06, (5,))


def test_overrides_win_over_files_and_are_typed(tmp_path: Path) -> None:
    study = load_study(
        [_file(tmp_path, "train: {epochs: 7}")],
        ["epochs=9", "train.hidden=[4, 4]", "wrist.length=9e-2", "data=latest:gen-data"],
        "train",
    )
    assert (study.train.epochs, study.train.hidden, study.wrist.length) == (9, (4, 4), 0.09)
    assert study.train.data == "latest:gen-data"


def test_an_override_is_relative_to_the_command_first() -> None:
    assert load_study([], ["horizon=2.0"], "tune").tune.horizon == 2.0
    assert load_study([], ["horizon=2.0"], "simulate").simulate.horizon == 2.0
    assert load_study([], ["seed=4"], "simulate").seed == 4


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("train:\n  epoch: 3\n", "unknown key 'epoch' - {file}:2: train.epoch - fix: did you mean 'epochs'?"),
        ("trian: {}\n", "unknown key 'trian' - {file}:1: trian - fix: did you mean 'train'?"),
        ("seed: 1\nlength: 0.1\n", "unknown key 'length' - {file}:2: length - fix: did you mean 'wrist.length'?"),
        ("plant_segments: 2\n", "unknown key 'plant_segments' - {file}:1: plant_segments - fix: one of analyse, "),
        ("wrist:\n  length:\n", "a value is missing - {file}:2: wrist.length"),
        ("wrist:\n  length: 0,095\n", "decimal comma - {file}:2: wrist.length - fix: with a point: 0.095"),
        ("wrist:\n  discs: 4,5\n", "decimal comma - {file}:2: wrist.discs"),
        ("gen_data: {}\n", "did you mean 'gen-data'?"),
        ("wrist:\n\n  mass: -0.1\n", "-0.1 should be greater than 0 - {file}:3: wrist.mass - fix: "),
        ("wrist: {mass: .nan}\n", "nan should be a finite number - {file}:1: wrist.mass"),
        ("wrist: {mass: .inf}\n", "inf should be a finite number"),
        ("wrist: {mass: heavy}\n", "'heavy' should be a valid number"),
        ("wrist: {mass: '0.1'}\n", "'0.1' should be a valid number"),
        ("wrist: {mass: true}\n", "should be a valid number"),
        ("gen-data: {samples: 1e3}\n", "1000.0 should be a valid integer"),
        (
            "wrist: {mass: 50g}\n",
            "'50g' is a number with a unit - {file}:1: wrist.mass - fix: give the number without its unit, in kg",
        ),
        (
            "train: {epochs: 30 %}\n",
            "is a number with a unit - {file}:1: train.epochs - fix: give the number without its unit",
        ),
        ("wrist: 3\n", "3 should have the form {{discs: ..., length: ..., mass: ..., ...}} - {file}:1: wrist"),
        ("wrist: [1, 2]\n", "[1, 2] should have the form {{discs: "),
        ("compare: {controllers: [3]}\n", "3 should have the form {{controller: ..., gains: ...}} - {file}:1"),
        ("compare: {loops: [3]}\n", "[3] should have the form {{NAME: ...}} - {file}:1"),
        ("wrist: {gravity: [a, 2]}\n", "'a' should be a valid number - {file}:1: wrist.gravity.0"),
        ("wrist: {pretension: 70}\n", "must exceed pretension"),
        ("train: {optimiser: adam_w}\n", "{file}:1: train.optimiser - fix: did you mean 'adamw'? All: "),
        ("compare:\n  controllers:\n  - {}\n  - contoller: pid\n", "{file}:4: compare.controllers.1.contoller"),
        ("compare:\n  controllers:\n  - gains:\n      P1: a\n", "'a' should be a valid number - {file}:4"),
        ("tune:\n  scenarios:\n  - reference: {kind: zigzag}\n", "{file}:3: tune.scenarios.0.reference.kind"),
        ("wrist: {tendons: 6}\n", "one of five, four, six, three; or a list, [{{angle_deg: ...}}, ...]"),
        ("wrist:\n  tendons:\n  - angle: 3\n", "{file}:3: wrist.tendons.0.angle - fix: did you mean 'angle_deg'?"),
        ("- 1\n", "a study file holds keys and values - {file}:1"),
        ("train: {epochs: 1}\ntrain: {}\n", "key 'train' is repeated - {file}:2"),
    ],
)
def test_errors_name_place_key_and_cure(tmp_path: Path, text: str, said: str) -> None:
    file = _file(tmp_path, text)
    with pytest.raises(UserError) as caught:
        load_study([file])
    assert said.format(file=file) in str(caught.value)
    assert "\n" not in str(caught.value)
    assert caught.value.exit_code == 2


@pytest.mark.parametrize(
    ("override", "said"),
    [
        ("epoch=3", "unknown key 'epoch' - --set epoch=3 - fix: did you mean 'epochs'?"),
        ("epochs=many", "'many' should be a valid integer - --set epochs=many: train.epochs"),
        ("wrist.lenght=1", "--set wrist.lenght=1: wrist.lenght - fix: did you mean 'length'?"),
        ("epochs", "an override is key=value"),
        ("hidden=[1,", "not valid YAML"),
        ("epochs=__import__('os').getpid()", "should be a valid integer"),
        (
            "hw-run.controllers.0.gain=x",
            "'controllers' is a list, and given as a whole: '0' is no key of it - --set hw-run.controllers.0.gain=x: "
            "hw-run.controllers - "
            "fix: hw-run.controllers=[{controller: ..., gains: ...}]; for 'gain' did you mean 'gains'?",
        ),
        ("compare.references=3", "3 should be a valid list - --set compare.references=3: compare.references"),
        ("epochs={a: 1}", "{'a': 1} should be a valid integer - --set epochs={a: 1}: train.epochs"),
        ("rows=[{name: a}, {name: b}, {name: a}]", "needs a name of its own"),
        ("rows=[{name: a}, {}]", "needs a name of its own"),
        ("train={rows: [{name: a}, {name: b}], search: true}", "give rows or search, not both"),
        ("wrist.gravity.0=1", "--set wrist.gravity.0=1: wrist.gravity - fix: wrist.gravity=[...]"),
    ],
)
def test_errors_in_overrides_name_the_override(override: str, said: str) -> None:
    section = override.partition(".")[0]
    with pytest.raises(UserError) as caught:
        load_study([], [override], section if section in ("hw-run", "compare") else "train")
    assert said in str(caught.value)


@pytest.mark.parametrize(
    ("override", "fix"),
    [
        ("simulate.controller=ct-dobb", "did you mean 'ct-dob'? All: adrc, clf-qp, computed-torque, ct-dob, "),
        ("simulate.controller=zzz", "one of adrc, clf-qp, computed-torque, "),
        ("wrist.tendons=6", "one of five, four, six, three"),
        ("simulate.loop.planes=3", "one of 1, 2"),
    ],
)
def test_of_names_the_one_that_was_meant_comes_first_and_each_once(override: str, fix: str) -> None:
    with pytest.raises(UserError) as caught:
        load_study([], [override])
    said, given = str(caught.value), override.partition("=")[2]
    assert caught.value.fix.startswith(fix) and said.startswith(
        f"{given if given.isdigit() else repr(given)} is not one of the choices - --set {override}: "
    )
    assert "computed-torque" not in fix or said.count("computed-torque") == 1


@pytest.mark.parametrize(
    ("command", "fix"),
    [
        ("simulate", "--controller pid-ff"),
        ("analyse", "--controller pid-ff"),
        ("tune", "--set 'controllers=[pid-ff, adrc]'"),
        ("recommend", "--set 'controllers=[pid-ff, adrc]'"),
        ("compare", "--set 'controllers=[{controller: pid-ff, gains: default}, {controller: adrc, gains: default}]'"),
        ("hw-run", "--controller pid-ff"),
        ("gen-data", ""),
    ],
)
def test_a_controller_in_place_of_a_study_file_is_told_how_it_is_given(
    command: str, fix: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(UserError, match=r"there is no study file .*/pid-ff") as caught:
        load_study([Path("pid-ff"), Path("adrc")], [], command)
    if not fix:
        assert caught.value.fix.startswith("one of accurate_network, ")
        return
    assert caught.value.fix == f"pid-ff is a controller: {fix}"
    word, text = shlex.split(fix)
    section = load_study([], [text if word == "--set" else f"controller={text}"], command)
    assert "pid-ff" in str(getattr(section, command.replace("-", "_").replace("analyse", "simulate")))


def test_gains_of_a_file_are_for_the_controller_of_that_file(tmp_path: Path) -> None:
    """An override that names another law has that one's own, unless it gives some too."""
    file = _file(tmp_path, "simulate: {controller: pid, gains: hardware}")

    def given(*overrides: str, files: Sequence[Path] = (file,)) -> bool:
        return "gains" in load_study(files, overrides, "simulate").simulate.model_fields_set

    assert given() and given("horizon=2.0") and not given("horizon=2.0", files=())
    assert not given("controller=smc") and not given("seed=3", "simulate.controller=smc", "horizon=2.0")
    assert given("controller=smc", "gains=printed") and given("gains=printed")
    other = _file(tmp_path, "simulate: {controller: smc}", "other.yaml")
    assert given(files=(file, other)), "a file says what it means"


@pytest.mark.parametrize("text", ["Kp=10,Ki=2,Kd=0.1", "Kp=10 Ki=2.0 Kd=1e-1", "Kp=10, Ki=2, Kd=0.1"])
def test_gains_by_name_are_read_from_a_text(text: str) -> None:
    study = load_study(
        overrides=["simulate.controller=pid", f'simulate.gains="{text}"', f"compare.rows=[{{gains: '{text}'}}]"]
    )
    assert study.simulate.gains == study.compare.rows[0].gains == {"Kp": 10.0, "Ki": 2.0, "Kd": 0.1}
    assert load_study(overrides=["simulate.gains=exchanged"]).simulate.gains == "exchanged"


@pytest.mark.parametrize(
    ("text", "wrong"), [("Kp=10,Ki=x", "Ki=x"), ("Kp=10,2", "'2'"), ("Kp=1,Kp=2", "twice"), ("=1", "no gain")]
)
def test_gains_by_name_that_cannot_be_read_are_refused(text: str, wrong: str) -> None:
    with pytest.raises(UserError, match=wrong) as caught:
        load_study(overrides=[f'simulate.gains="{text}"'])
    assert "simulate.gains" in caught.value.where and caught.value.fix


def test_an_error_names_the_file_that_set_the_value_last(tmp_path: Path) -> None:
    good = _file(tmp_path, "train: {epochs: 5, batch: 10}", "good.yaml")
    bad = _file(tmp_path, "train:\n  epochs: 0\n", "bad.yaml")
    with pytest.raises(UserError, match=r"bad\.yaml:2: train\.epochs"):
        load_study([good, bad])


def test_a_file_that_cannot_be_read_is_named(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="No such file"):
        load_study([tmp_path / "absent.yaml"])
    with pytest.raises(UserError, match="a folder, and no plain file") as caught:
        load_study([tmp_path])
    assert caught.value.fix == "it holds no study file"
    for name in ("f", "b", "d", "c", "e", "a"):
        _file(tmp_path, "seed: 1", f"{name}.yaml")
    with pytest.raises(UserError) as caught:
        load_study([tmp_path])
    assert caught.value.fix == "name a study file in it: a.yaml, b.yaml, c.yaml, d.yaml, e.yaml and 1 more"


@pytest.mark.parametrize("file", sorted((ROOT / "experiments").glob("*.yaml")), ids=lambda file: file.name)
def test_every_committed_experiment_is_valid(file: Path) -> None:
    assert load_study([file]) != load_study([])


def test_named_loops_are_all_there_are_and_a_built_in_one_keeps_what_is_not_given(tmp_path: Path) -> None:
    soft = "loops: {soft: {plant: {stiffness_scale: 0.8}}, exact: {substeps: 2}, sampled: {}}"
    file = _file(tmp_path, f"compare: {{{soft}}}")
    overrides = ["loops.soft.substeps=3", "loops.sampled.actuator.level=lagged"]
    loops = load_study([file], overrides, "compare").compare.loops
    assert list(loops) == ["soft", "exact", "sampled"]
    assert loops["soft"] == Loop(plant=Plant(stiffness_scale=0.8), substeps=3)
    assert loops["exact"] == LOOPS["exact"].model_copy(update={"substeps": 2})
    assert loops["sampled"] == LOOPS["sampled"].model_copy(update={"actuator": Actuator(level="lagged")})
    assert load_study([], ["loops.exact.limits=true"], "tune").tune.loops == {
        "exact": LOOPS["exact"].model_copy(update={"limits": True})
    }
    assert Loop() in load_study([]).compare.loops.values(), "where none are named the built-in one is among them"
    with pytest.raises(UserError, match="too few: at least 1"):
        load_study([], ["loops={}"], "compare")


def test_studies_that_call_the_closed_form_exact_still_read() -> None:
    """A loop has that name too, so what is written now is another."""
    study = load_study(
        [], ["compare.inverses=[network, exact]", "simulate.reference={tip: [0.07, 0.02], inverse: exact}"]
    )
    assert study.compare.inverses == ("network", "closed-form") and study.simulate.reference.inverse == "closed-form"
    with pytest.raises(UserError, match="closed-form"):
        load_study([], ["compare.inverses=[closed-from]"])


@pytest.mark.parametrize("name", ["../../evil", "a/b", ".hidden", "", "x" * 61, "a\n", "a\0b"])
def test_a_family_whose_name_is_none_for_a_file_is_refused_before_any_work(name: str) -> None:
    with pytest.raises(UserError, match="is no name for a family") as caught:
        load_study([], [f"families={json.dumps({name: {}})}"])
    assert caught.value.exit_code == 2 and "families" in caught.value.where
    assert list(load_study([], ['families={"my rig-2.5": {}}']).families) == ["my rig-2.5"]


def test_a_hands_mass_that_a_run_wrote_of_itself_is_not_given_unless_somebody_gives_it(tmp_path: Path) -> None:
    """A run writes every key: its default mass says nothing of a robot; an override and a part of it do."""
    whole = {"wrist": Study().wrist.model_dump(mode="json", exclude={"stiffness_axis_deg"})}
    (tmp_path / "config.yaml").write_text(yaml.safe_dump(whole))
    (tmp_path / "own.yaml").write_text("wrist: {hand_mass: 0.3}\n")
    for file, overrides, given in (
        ("config.yaml", [], False), ("config.yaml", ["wrist.hand_mass=0.3"], True), ("own.yaml", [], True),
    ):  # fmt: skip
        wrist = load_study([tmp_path / file], overrides).wrist
        assert ("hand_mass" in wrist.model_fields_set) == given and wrist.hand_mass == 0.3


def test_text_of_another_form_is_refused_with_the_form_in_words() -> None:
    with pytest.raises(UserError, match=r"'5005' has another form .*HOST:PORT") as caught:
        load_study([], ["simulate.reference={kind: live, listen: '5005'}"])
    assert "pattern" not in str(caught.value)


@pytest.mark.parametrize(
    ("command", "typed", "meant"),
    [
        ("simulate", "length=0.1", "wrist.length=0.1"),
        ("train", "stiffness=0.7", "wrist.stiffness=0.7"),
        ("simulate", "angle_deg=20", "simulate.reference.angle_deg=20"),
        ("hw-run", "plant.length=0.1", "hw-run.bench.plant.length=0.1"),
        ("simulate", "plant.length=0.1", "simulate.loop.plant.length=0.1"),
        (None, "tendon_radius=0.01", "wrist.tendon_radius=0.01"),
    ],
)
def test_a_key_that_stands_too_high_is_found_below(command: str | None, typed: str, meant: str) -> None:
    with pytest.raises(UserError, match="unknown key") as caught:
        load_study([], [typed], command)
    assert caught.value.fix == f"did you mean '{meant.partition('=')[0]}'?"
    assert load_study([], [meant], command) != load_study([], [], command)


def test_a_key_of_several_groups_is_none_of_them() -> None:
    """`simulate` has a level of motors and one of sensors, further down, and an objective's are no key of it."""
    for key in ("level=tendon", "chattering=1"):
        with pytest.raises(UserError, match=r"fix: one of analyse, .* controller, ") as caught:
            load_study([], [key], "simulate")
        assert "did you mean" not in caught.value.fix


def test_code_in_place_of_a_study_file_is_told_how_its_controller_is_given(tmp_path: Path) -> None:
    own = tmp_path / "pid_grav.py"
    own.write_text("PID_GRAV = Controller(name='pid-grav')\n")
    with pytest.raises(UserError, match="is no study file") as caught:
        load_study([own], [], "simulate")
    assert caught.value.fix == f"its controller: --controller {own}:PID_GRAV"
    caught.value.in_python = True
    assert caught.value.fix == f"its controller: simulate(controller='{own}:PID_GRAV')"
    with pytest.raises(UserError, match="holds keys and values"):
        load_study([own], [], "train")


def test_a_file_that_is_not_there_is_likened_by_its_own_name_and_not_by_its_end(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    for name in ("four.yaml", "mywrist.yaml"):
        Path(name).write_text("seed: 1\n")
    with pytest.raises(UserError) as unlike:
        load_study([Path("nosuch.yaml")])
    assert "four" not in unlike.value.fix and unlike.value.fix.startswith("one of ")
    for near in ("mywrst.yaml", "mywrist"):
        with pytest.raises(UserError) as alike:
            load_study([Path(near)])
        assert alike.value.fix == "did you mean 'mywrist.yaml'?"


def test_a_motion_may_be_given_by_its_name_alone(tmp_path: Path) -> None:
    """In a file, as an override and within a list, beside others in full; an unknown one is an unknown kind."""
    file = tmp_path / "study.yaml"
    listed = "[sine, {kind: step, angle_deg: 10}, ramp]"
    file.write_text(f"simulate: {{reference: circumduction}}\ncompare: {{controllers: pid-ff, references: {listed}}}\n")
    for study in (
        load_study([file]),
        load_study(
            [],
            ["simulate.reference=circumduction", "compare.controllers=pid-ff", f"compare.references={listed}"],
        ),
    ):
        assert study.simulate.reference == Reference(kind="circumduction")
        assert [each.kind for each in study.compare.references] == ["sine", "step", "ramp"]
        assert study.compare.references[1].angle_deg == 10.0
        assert [row.controller for row in study.compare.rows] == ["pid-ff"]
    file.write_text("simulate:\n  reference: circumducton\n")
    with pytest.raises(UserError, match=r"study\.yaml:2: simulate\.reference\.kind - fix: did you mean 'circ"):
        load_study([file])


def test_sensor_and_motors_may_be_given_by_their_level_alone(tmp_path: Path) -> None:
    file = tmp_path / "study.yaml"
    file.write_text("simulate: {loop: {sensor: camera, actuator: {level: tendon, friction: 0.2}}}\n")
    for study in (load_study([file]), load_study([file], ["simulate.loop.actuator=tendon"])):
        loop = study.simulate.loop
        assert (loop.sensor, loop.actuator) == (Sensor(level="camera"), Actuator(level="tendon", friction=0.2))
    with pytest.raises(UserError, match=r"loop\.sensor\.level - fix: did you mean 'camera'"):
        load_study([file], ["simulate.loop.sensor=camra"])


def test_tendons_may_be_given_by_their_directions_alone(tmp_path: Path) -> None:
    file = tmp_path / "study.yaml"
    file.write_text("wrist: {tendons: [0, 120.5, {angle_deg: 240, radius: 0.01}]}\n")
    places = load_study([file]).wrist.tendons
    assert isinstance(places, tuple) and [place.angle_deg for place in places] == [0.0, 120.5, 240.0]
    assert [place.radius for place in places] == [None, None, 0.01]
    for wrong in ("[0, true, 240]", "[0, x, 240]"):
        with pytest.raises(UserError, match=r"wrist\.tendons\.1"):
            load_study([], [f"wrist.tendons={wrong}"])
