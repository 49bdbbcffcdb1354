"""A law by its place: in every command, compiled by what it is made of, and refused in words where it is no law."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numba.core import event

import wristctl as face
from tests.doors.conftest import LAW, wristctl
from wristctl.commands.adoption import adopt, adopted, adoption, sources_in
from wristctl.config.study import Study
from wristctl.control.table import CONTROLLERS, controller
from wristctl.control.vetting import call_law
from wristctl.errors import UserError
from wristctl.interrupt import interrupts
from wristctl.lanes.compiled import frozen_values
from wristctl.records import list_runs
from wristctl.simulation.reference import motion
from wristctl.simulation.rollout import rollout
from wristctl.study_files.load import load_study

QUICK = "horizon: 0.3, loop: {plant_segments: 1}"


def named(folder: Path, name: str, command: str = "simulate", **laws: Any) -> Study:
    """A study that names a law of a folder."""
    data: dict[str, Any] = {
        "simulate": {"controller": f"{folder}/{name}", "gains": "default"},
        "controller-settings": laws,
    }
    return adopted(Study.model_validate(data), command).study


def answer(name: str, count: int = 3) -> np.ndarray:
    """Torques of a law with its default gains at a few states."""
    law = controller(name)
    states = np.random.default_rng(1).uniform(-0.3, 0.3, (count, 9 + 3 * law.preview))
    states[:, 5:8] = -2.0, 2.0, 1e-3
    gains = np.tile(law.values(law.presets["default"]), (count, 1))
    return call_law(law, states, gains)


@pytest.mark.slow
def test_a_worker_elsewhere_knows_the_same_law_and_refuses_another_text_of_it(stranger: Path) -> None:
    study = adopted(Study.model_validate({"study": {"laws": (f"{stranger}/strange.py:STRANGE",)}}), "study").study
    assert study.study.laws == ("strange",) and set(sources_in(study)) == {"strange/strange.py", "strange/helper.py"}
    told, known = json.loads(json.dumps(adoption(study, "study"))), answer("strange")
    del CONTROLLERS["strange"]
    adopt(told)
    assert np.array_equal(answer("strange"), known)
    (stranger / "helper.py").write_text((stranger / "helper.py").read_text().replace("k * e", "2.0 * k * e"))
    with pytest.raises(UserError, match=r"strange/helper\.py is another text here"):
        adopt(told)


@pytest.mark.slow
def test_a_law_by_its_place_is_simulated_tuned_and_compared_under_its_own_name(stranger: Path) -> None:
    (stranger / "inner").mkdir()
    (stranger / "inner" / "study.yaml").write_text(
        f"""
simulate: {{controller: ../strange.py:STRANGE, gains: default, {QUICK}}}
tune:
  controllers: [../strange.py:STRANGE]
  candidates: 2
  iterations: 1
  horizon: 0.2
  loops: {{fast: {{plant_segments: 1}}}}
  scenarios: [{{loop: fast, reference: {{kind: step, angle_deg: 20}}}}]
compare:
  horizon: 0.2
  loops: {{fast: {{plant_segments: 1}}}}
  references: [{{duration: 0.1}}]
  inverses: [none]
  controllers: [{{controller: ../strange.py:STRANGE, gains: tuned}}, {{controller: pid, gains: printed}}]
"""
    )
    study = face.load_study(stranger / "inner" / "study.yaml")
    results = stranger / "results"
    simulated = face.simulate(study, out=results)
    tuned = face.tune(study, out=results)
    compared = face.compare(study, tuned=tuned, out=results)
    assert simulated.trajectory.label == "strange/default" and set(tuned.gains) == {"strange"}
    assert [row.label for row in compared.rows] == ["strange/tuned", "pid/printed"]
    for done in (simulated, tuned, compared):
        assert done.run is not None
        for name in ("strange.py", "helper.py"):
            copy = done.run.path / "code" / "strange" / name
            assert copy.read_bytes() == (stranger / name).read_bytes()
        assert 'code/strange/strange.py:STRANGE"' in (done.run.path / "config.yaml").read_text()
        assert done.run.problems() == []


@pytest.mark.slow
def test_a_law_by_its_place_is_swept_beside_others_as_it_is_alone(stranger: Path) -> None:
    (stranger / "inner").mkdir()
    file = stranger / "inner" / "study.yaml"
    file.write_text(
        f"""
simulate: {{{QUICK}}}
sweep: ["simulate.controller=../strange.py:STRANGE,ct-dob", "simulate.reference.angle_deg=10,20"]
"""
    )
    for executor in ("serial", "processes"):
        swept = face.simulate(face.load_study(file), executor=executor, out=stranger / "results")
        assert swept.run is not None and swept.run.problems() == []
        assert (swept.run.path / "code" / "strange" / "helper.py").read_text() == (stranger / "helper.py").read_text()
        assert "controller=code/strange/strange.py:STRANGE,ct-dob" in (swept.run.path / "config.yaml").read_text()
        rows = swept.frame().set_index(["simulate.controller", "simulate.reference.angle_deg"])["rmse"]
        assert len(rows) == 4
        for name, place in (("strange", f"{stranger}/strange.py:STRANGE"), ("ct-dob", "ct-dob")):
            alone = face.load_study(file, f"simulate.controller={place}", "sweep=[]", "simulate.reference.angle_deg=10")
            assert rows[name, 10] == pytest.approx(face.simulate(alone).metrics["rmse"], rel=1e-12)


def test_of_code_a_sweep_takes_controllers_only(stranger: Path) -> None:
    """However its place is written: a name that is read as a place only later is refused."""
    for text in ("simulate.reference.kind=strange.py:STRANGE,step", 'simulate.controller="strange.p\\x79:STRANGE",pid'):
        study = face.load_study(None, f"sweep={json.dumps([text])}")
        with pytest.raises(UserError, match=r"of one's own code a sweep takes controllers only: strange\.py:STRANGE"):
            face.simulate(study)


@pytest.mark.slow
def test_an_edited_law_is_another_run_by_its_fingerprint_and_in_the_difference(stranger: Path) -> None:
    (stranger / "study.yaml").write_text(f"simulate: {{controller: strange.py:STRANGE, gains: default, {QUICK}}}")
    runs = []
    for factor in ("1.0", "2.0"):
        (stranger / "helper.py").write_text(
            f"from wristctl.lanes.compiled import compiled\n@compiled\ndef scaled(k, e):\n    return {factor} * k * e\n"
        )
        done = face.simulate(face.load_study(stranger / "study.yaml"), out=stranger / "results")
        assert done.run is not None
        runs.append(done.run)
    assert runs[0].manifest.fingerprint != runs[1].manifest.fingerprint
    assert runs[0].metrics["rmse"] != runs[1].metrics["rmse"]
    done_diff = wristctl(stranger, "runs", "diff", runs[0].id, runs[1].id)
    assert "code/strange/helper.py" in done_diff.stdout and "code/strange/strange.py" not in done_diff.stdout


def test_a_foreign_law_compiles_what_it_is_made_of_and_no_kernel_anew(stranger: Path) -> None:
    from wristctl.config.loop import Loop, Reference
    from wristctl.config.wrist import WristParameters

    wrist, loop, one = WristParameters(), Loop(plant_segments=1), np.zeros(1, np.int64)
    followed = motion(Reference(angle_deg=10.0), wrist, 0.1, 1e-3)

    def run(name: str) -> list[str]:
        law = controller(name)
        with event.install_recorder("numba:compile") as seen:
            rollout(law, np.array([law.values(next(iter(law.presets.values())))]), [followed], one, loop, wrist)
        begun = [each.data["dispatcher"].py_func.__name__ for _, each in seen.buffer if each.is_start]
        return [name for name in begun if name not in ("law", "scaled", "one_segment", "one_segment_terms", "bessel")]

    run("pid")
    assert run(f"{stranger}/strange.py:STRANGE") == []


@pytest.mark.parametrize("where", ["closure", "closure of a function", "global", "module", "file", "array"])
@pytest.mark.slow
def test_whatever_is_frozen_into_a_law_is_noticed_when_it_changes(tmp_path: Path, where: str) -> None:
    """numba alone would take the code that it kept: its key knows the function's own bytecode and closure only."""
    text = """
from pathlib import Path
import numpy as np
import own_numbers
from wristctl.control.law import Controller, Gain
from wristctl.lanes.compiled import compiled

def made(k):
    @compiled
    def inner(e):
        return {inner} * e
    def law(now, wrist, gains, memory):
        return -(k + inner(gains.k) + GLOBAL + own_numbers.VALUE + FROM_FILE + ARRAY[1]) * now.theta
    return law

GLOBAL = {globally}
FROM_FILE = float(Path(__file__).with_name("number.txt").read_text())
ARRAY = tuple(np.array([0.0, {array}]))
LAW = Controller("frozen", made({closed}), "a test", {{"k": Gain("", "", 0.1, 10.0)}}, {{"default": {{"k": 1.0}}}})
"""
    keys = {"closure": "closed", "closure of a function": "inner", "global": "globally", "array": "array"}
    found = []
    for value in ("1.0", "2.0"):
        numbers = dict.fromkeys(keys.values(), "1.0") | ({keys[where]: value} if where in keys else {})
        (tmp_path / "law.py").write_text(text.format(**numbers))
        (tmp_path / "own_numbers.py").write_text(f"VALUE = {value if where == 'module' else '1.0'}\n")
        (tmp_path / "number.txt").write_text(value if where == "file" else "1.0")
        from wristctl.plugins import places as foreign

        foreign._loaded.clear()  # as in another process: of what it reads, a law's own data are not watched
        law = CONTROLLERS[f"{tmp_path}/law.py:LAW"]
        found.append((answer(f"{tmp_path}/law.py:LAW"), frozen_values(law.law)[0]))
    np.testing.assert_allclose(found[1][0], found[0][0] * 7.0 / 6.0, rtol=1e-12)
    assert found[0][1] != found[1][1]


@pytest.mark.slow
def test_an_edit_is_noticed_within_a_process(stranger: Path) -> None:
    place = f"{stranger}/strange.py:STRANGE"
    before = answer(place)
    (stranger / "strange.py").write_text(LAW.replace("return load - scaled", "return load + scaled"))
    assert np.abs(answer(place) - before).max() > 0.1


@pytest.mark.slow
def test_each_law_imports_the_modules_that_stand_beside_it(tmp_path: Path) -> None:
    found = []
    for factor in ("1.0", "3.0"):
        folder = tmp_path / factor
        folder.mkdir()
        (folder / "strange.py").write_text(LAW)
        (folder / "helper.py").write_text(
            f"from wristctl.lanes.compiled import compiled\n@compiled\ndef scaled(k, e):\n    return {factor} * k * e\n"
        )
        found.append(answer(f"{folder}/strange.py:STRANGE"))
    assert np.abs(found[0] - found[1]).max() > 0.1
    np.testing.assert_array_equal(answer(f"{tmp_path}/1.0/strange.py:STRANGE"), found[0])


ONE = """from wristctl.control.law import Controller, Gain, ahead
from wristctl.lanes.lane import sqrt
import numpy as np
"""
BAD = {
    "branches": ("if now.theta > 0.0:\n        return now.theta\n    return -now.theta", "", "where(condition"),
    "has no such gain": ("return gains.kk * now.theta", "", "there is no 'kk' among k"),
    "calls numpy": ("return np.sin(now.theta)", "", "it calls sin"),
    "returns nothing": ("memory[0] = now.theta", "memory=1", "it returns no torque"),
    "allocates": ("a = np.zeros(3)\n    a[0] = 1.0\n    return a[0] * now.theta", "", "allocates memory, 1 times"),
    "changes its inputs": ("now[0] = 0.0 * now.rate\n    return now.rate", "", "changes what it sees"),
    "changes its gains": ("gains[0] = 0.0 * now.rate\n    return now.rate", "", "changes its gains"),
    "writes beyond its memory": ("memory[2] = now.theta\n    return now.rate", "memory=2", "writes more memory"),
    "reads beyond its memory": ("return now.theta + memory[1]", "memory=1", "reads more memory than the 1"),
    "looks beyond its preview": ("return ahead(now, 3)[0]", "preview=2", "further ahead than the 2 periods"),
    "returns nan": ("return sqrt(now.theta)", "", "returned nan at theta = -"),
    "raises": ("raise ZeroDivisionError('by zero')", "plain=True", "ZeroDivisionError: by zero"),
    "writes beyond, in Python": ("memory[1] = 1.0\n    return 0.0", "plain=True, memory=1", "IndexError"),
    "looks beyond, in Python": ("return now.ahead(3)[0]", "plain=True, preview=2", "a preview of fewer"),
    "returns infinity, in Python": ("return float('inf')", "plain=True", "returned inf"),
    "returns a word, in Python": ("return 'left'", "plain=True", "ValueError"),
}  # fmt: skip


@pytest.mark.parametrize("fault", BAD)
@pytest.mark.slow
def test_what_is_no_law_is_refused_in_words_with_its_place(tmp_path: Path, fault: str) -> None:
    body, more, told = BAD[fault]
    (tmp_path / "bad.py").write_text(
        f"{ONE}def law(now, wrist, gains, memory):\n    {body}\n"
        f'BAD = Controller("bad", law, "", {{"k": Gain("", "", 0.1, 10.0)}}, {{"default": {{"k": 1.0}}}}, {more})\n'
    )
    with pytest.raises(UserError) as refused:
        face.simulate(Study.model_validate({"simulate": {"controller": f"{tmp_path}/bad.py:BAD", "gains": "default"}}),
                      out=tmp_path / "results")  # fmt: skip
    error = refused.value
    assert told in error.what and error.exit_code == 2 and f"{tmp_path}/bad.py" in error.where and error.fix
    assert not (tmp_path / "results").exists()


FUNCTIONS: dict[str, Any] = {
    "cos(x)": np.cos, "math.exp(x)": np.exp, "np.sin(x)": np.sin, "np.arctan2(x, y)": np.arctan2,
    "math.sqrt(x * x)": np.abs, "min(x, y)": np.minimum, "np.floor(x)": np.floor,
    "math.pow(x * x, y)": lambda x, y: np.power(x * x, y),
}  # fmt: skip


@pytest.mark.parametrize("call", FUNCTIONS)
@pytest.mark.slow
def test_the_import_that_an_error_names_makes_the_law_compile(tmp_path: Path, call: str) -> None:
    text = """import math
from math import cos
import numpy as np
from wristctl.control.law import Controller
def law(now, wrist, gains, memory):
    x, y = now.theta, now.rate
    return CALL
L = Controller("calls", law, "", {}, {"default": {}})
"""
    (tmp_path / "calls.py").write_text(text.replace("CALL", call))
    with pytest.raises(UserError) as refused:
        controller(f"{tmp_path}/calls.py:L").compiled()
    line = str(refused.value.fix)
    name = line.rpartition(" ")[2]
    lanes_call = name + call[call.index("(") :]
    (tmp_path / "mended.py").write_text(text.replace("from math import cos", line).replace("CALL", lanes_call))
    states = np.random.default_rng(1).uniform(-0.3, 0.3, (3, 9))
    found = call_law(controller(f"{tmp_path}/mended.py:L"), states, np.zeros((3, 0)))
    x = states[:, :2] if "y" in call else states[:, :1]
    np.testing.assert_allclose(found, FUNCTIONS[call](*x.T), rtol=1e-14)


@pytest.mark.parametrize("plain", [False, True])
def test_what_goes_wrong_only_later_leaves_a_run_that_failed(tmp_path: Path, plain: bool) -> None:
    root = "(0.1 - memory[0]) ** 0.5 if memory[0] < 0.1 else float('nan')" if plain else "sqrt(0.1 - memory[0])"
    (tmp_path / "late.py").write_text(
        f"{ONE}def law(now, wrist, gains, memory):\n    memory[0] = memory[0] + now.period\n    return 0.0 * ({root})\n"
        f'LATE = Controller("late", law, "", {{}}, {{"default": {{}}}}, memory=1, plain={plain})\n'
    )
    (tmp_path / "study.yaml").write_text(f"simulate: {{controller: late.py:LATE, gains: default, {QUICK}}}")
    with pytest.raises(UserError, match="returned nan at") as refused:
        face.simulate(face.load_study(tmp_path / "study.yaml"), out=tmp_path / "results")
    assert refused.value.exit_code == 2
    (run,) = face.runs(out=tmp_path / "results").itertuples()
    assert run.state == "failed" and "returned nan" in str(run.note)


@pytest.mark.parametrize(
    ("text", "name", "told"),
    [
        ('X = Controller("x", law, "", {"k": Gain("", "", 1, 2)}, {"default": {}})', "X", "must give k by name"),
        ('X = Controller("a/b", law, "", {}, {})', "X", "no name for a controller"),
        ('X = Controller("pid", law, "", {}, {})', "X", "there is a controller 'pid' already"),
        ("X = 3", "X", "is a int, and no Controller"),
        ('RIGHT = Controller("x", law, "", {}, {})', "RIHGT", "did you mean 'RIGHT'?"),
        ("import nowhere_at_all", "X", "No module named 'nowhere_at_all'"),
        ("def broken(:", "X", "invalid syntax"),
        ("raise SystemExit(0)", "X", "SystemExit"),
    ],
)
def test_files_that_hold_no_law_are_refused_with_the_line(tmp_path: Path, text: str, name: str, told: str) -> None:
    (tmp_path / "x.py").write_text(f"{ONE}def law(now, wrist, gains, memory):\n    return -now.theta\n{text}\n")
    with pytest.raises(UserError) as refused:
        named(tmp_path, f"x.py:{name}")
    assert told in str(refused.value) and f"{tmp_path}/x.py" in refused.value.where


def test_a_place_that_is_none_is_refused_with_its_line_in_the_study(tmp_path: Path) -> None:
    study = tmp_path / "study.yaml"
    for given, told in (("gone.py:LAW", f"no file {tmp_path}/gone.py"), ("gone.py", "gone.py:NAME")):
        study.write_text(f"simulate:\n  controller: {given}\n")
        with pytest.raises(UserError) as refused:
            load_study([study])
        assert told in refused.value.what and f"{study}:2" in refused.value.where


@pytest.mark.slow
def test_two_laws_of_one_name_are_refused_with_both_places(stranger: Path) -> None:
    (stranger / "second.py").write_text(LAW)
    rows = tuple({"controller": f"{stranger}/{each}.py:STRANGE", "gains": "default"} for each in ("strange", "second"))
    with pytest.raises(UserError, match="two controllers are called 'strange'") as refused:
        adopted(Study.model_validate({"compare": {"rows": rows}}), "compare")
    assert "strange.py:STRANGE and" in refused.value.where and "second.py:STRANGE" in refused.value.where


def test_the_same_law_in_several_rows_is_one_law(stranger: Path) -> None:
    rows = tuple({"controller": f"{stranger}/strange.py:STRANGE", "gains": each} for each in ("default", "rig"))
    study, foreign = adopted(Study.model_validate({"compare": {"rows": rows}}), "compare")
    assert [row.label for row in study.compare.rows] == ["strange/default", "strange/rig"] and len(foreign) == 1


def test_laws_of_other_commands_sections_are_not_loaded(stranger: Path) -> None:
    (stranger / "strange.py").write_text("raise RuntimeError('loaded')")
    assert named(stranger, "strange.py:STRANGE", command="tune").tune.controllers == ("smc",)


DESIGN = """
from wristctl.config.section import Parameter
from wristctl.control.design import LawDesign
from wristctl.control.law import Controller

def make(settings):
    k = settings["spring"]
    def law(now, wrist, gains, memory):
        return -k * now.theta
    return Controller("springy", law, "", {}, {"default": {}})

SPRINGY = LawDesign("springy", {"spring": Parameter(2.0, "N m/rad", "how stiff")}, make)
"""


@pytest.mark.slow
def test_a_laws_own_section_has_units_decides_what_it_is_and_is_sealed_in_full(tmp_path: Path) -> None:
    (tmp_path / "springy.py").write_text(DESIGN)
    study = tmp_path / "study.yaml"
    found = []
    for laws in ("{}", "{springy: {spring: 3.0}}"):
        study.write_text(
            f"controller-settings: {laws}\nsimulate: {{controller: springy.py:SPRINGY, gains: default, {QUICK}}}"
        )
        own = adopted(load_study([study]), "simulate").study
        found.append(answer(own.simulate.controller))
        said = wristctl(tmp_path, "simulate", "study.yaml", "--dry-run").stdout
        assert f"    spring: {own.controller_settings['springy']['spring']}  # [N m/rad] how stiff" in said
    np.testing.assert_allclose(found[1], 1.5 * found[0], rtol=1e-14)
    for laws, told in (
        ("springy: {sprong: 3.0}", "did you mean 'spring'?"),
        ("sprngy: {}", "did you mean 'springy'?"),
    ):
        study.write_text(
            f"controller-settings: {{{laws}}}\nsimulate: {{controller: springy.py:SPRINGY, gains: default}}"
        )
        with pytest.raises(UserError) as refused:
            adopted(load_study([study]), "simulate")
        assert told in str(refused.value) and refused.value.where.startswith("controller-settings.")


@pytest.mark.slow
def test_a_runs_configuration_holds_every_setting_of_its_laws(tmp_path: Path) -> None:
    (tmp_path / "springy.py").write_text(DESIGN)
    (tmp_path / "study.yaml").write_text(f"simulate: {{controller: springy.py:SPRINGY, gains: default, {QUICK}}}")
    done = face.simulate(face.load_study(tmp_path / "study.yaml"), out=tmp_path / "results")
    assert done.run is not None
    text = (done.run.path / "config.yaml").read_text()
    assert re.search(r"^controller-settings:.*\n  springy:\n    spring: 2.0", text, re.MULTILINE)


ENDINGS = ("SystemExit", "GeneratorExit", "KeyboardInterrupt", "type('Odd', (BaseException,), {})")


@pytest.mark.parametrize("raised", ENDINGS)
def test_a_file_that_will_not_be_imported_is_named_whatever_it_raises(stranger: Path, raised: str) -> None:
    (stranger / "strange.py").write_text(f"raise {raised}\n{LAW}")
    with pytest.raises(UserError, match=r"strange\.py cannot be loaded") as caught, interrupts():
        named(stranger, "strange.py:STRANGE")
    assert caught.value.where == f"{stranger}/strange.py:1"


@pytest.mark.parametrize("where", ["__init__", "propose", "learn"])
def test_what_an_optimiser_from_elsewhere_raises_is_said_of_it(tmp_path: Path, where: str) -> None:
    text = (Path(face.__file__).parent / "cli/templates/optimiser.py.txt").read_text()
    text = text.replace("@name@", "mine").replace("@OBJECT@", "Mine").replace("@Title@", "Mine")
    parts = {"__init__": "(self, *given)", "propose": "(self)", "learn": "(self, values)"}
    ends = f"    def {where}{parts[where]}:\n        raise SystemExit(0)\n"
    (tmp_path / "mine.py").write_text(f"{text}\n\nclass Ends(Mine):\n    name = 'ends'\n\n{ends}")
    (tmp_path / "study.yaml").write_text(
        "tune: {controllers: [pid], optimiser: mine.py:Ends, candidates: 2, iterations: 2, horizon: 0.1, finalists: 1, "
        "loops: {fast: {plant_segments: 1}}, scenarios: [{loop: fast, reference: {kind: step, angle_deg: 20}}]}"
    )
    with pytest.raises(UserError, match="the optimiser ends failed: SystemExit: 0") as caught:
        face.tune(face.load_study(tmp_path / "study.yaml"), out=tmp_path / "results")
    assert caught.value.where.startswith(f"{tmp_path}/mine.py:")
    states = [(run.state, run.manifest.exit_code) for run in list_runs(tmp_path / "results")]
    assert states == ([] if where == "__init__" else [("failed", 2)]), "one that cannot be made is known before"


@pytest.mark.slow
def test_a_law_that_ends_the_program_ends_its_run_as_failed_with_its_name(stranger: Path) -> None:
    law = "def law(now, wrist, gains, memory):\n    exit() if abs(now.theta) < 1e-9 else None\n    return 0.0\n"
    more = "ENDS = Controller('ends', law, 'a stranger', GAINS, PRESETS, plain=True)\n"
    (stranger / "strange.py").write_text(f"{LAW}\n{law}\n{more}")
    given = ("--controller", "strange.py:ENDS", "--gains", "default", "--set", "horizon=0.1")
    done = wristctl(stranger, "simulate", *given)
    assert done.returncode == 2 and "ends(py) failed: SystemExit" in done.stderr and "Traceback" not in done.stderr
    assert f"{stranger}/strange.py:" in done.stderr
    (run,) = list_runs(stranger / "results")
    assert run.state == "failed" and run.manifest.error is not None and run.manifest.error.what.startswith("ends(py)")
