"""A controller with its gains in short: NAME/GAINS anywhere, and one controller in place of a trial's list."""

from pathlib import Path
from typing import Any

import pytest

from wristctl.commands.adoption import with_presets
from wristctl.errors import UserError
from wristctl.study_files.error_messages import located
from wristctl.study_files.load import load_study, read_study


def rows_of(*overrides: str, files: tuple[Path, ...] = ()) -> list[tuple[str, Any]]:
    study = with_presets(load_study(files, overrides, "hw-run"), "hw-run")
    return [(row.controller, row.gains) for row in study.hw_run.rows]


@pytest.mark.parametrize(
    ("name", "controller", "gains"),
    [
        ("ct-dob/default", "ct-dob", "default"),
        ("ct-dob/tuned:camera", "ct-dob", "tuned:camera"),
        ("pid/Kp=10.5,Ki=2,Kd=0.1", "pid", {"Kp": 10.5, "Ki": 2.0, "Kd": 0.1}),
    ],
)
def test_a_controller_may_have_its_gains_with_it(tmp_path: Path, name: str, controller: str, gains: Any) -> None:
    chosen = load_study([], [f"controller={name}"], "simulate").simulate
    assert (chosen.controller, chosen.gains) == (controller, gains)
    assert rows_of(f"controller={name}") == [(controller, gains)]
    file = tmp_path / "study.yaml"
    file.write_text(f"compare:\n  controllers:\n  - {{controller: '{name}'}}\n")
    (row,) = load_study([file]).compare.rows
    assert (row.controller, row.gains) == (controller, gains)


def test_the_place_of_a_controller_is_no_name_with_gains(tmp_path: Path) -> None:
    (tmp_path / "laws").mkdir()
    law = tmp_path / "laws" / "mine.py"
    law.write_text("MINE = None\n")
    file = tmp_path / "study.yaml"
    for name, gains in (("laws/mine.py:MINE", "by-loop"), ("laws/mine.py:MINE/soft", "soft")):
        file.write_text(f"simulate: {{controller: '{name}'}}\n")
        chosen = load_study([file]).simulate
        assert (chosen.controller, chosen.gains) == (f"{law}:MINE", gains)
    with pytest.raises(UserError, match=r"laws/mine\.py should name its controller"):
        load_study([], ["simulate.controller=laws/mine.py"])


def test_gains_that_are_given_twice_at_once_are_refused_with_their_line(tmp_path: Path) -> None:
    file = tmp_path / "study.yaml"
    file.write_text("simulate:\n  gains: default\n  controller: ct-dob/hardware\n")
    with pytest.raises(UserError, match=r"ct-dob/hardware has its gains with it, .* - .*study\.yaml:3 - fix"):
        load_study([file])


@pytest.mark.parametrize("command", ["simulate", "hw-run", "analyse"])
@pytest.mark.parametrize("apart", ["gains=default", "gains.Kp=2.0"])
def test_gains_typed_with_a_controller_and_apart_from_it_are_refused_and_those_of_a_file_give_way(
    command: str, apart: str, tmp_path: Path
) -> None:
    for given in (["controller=pid/printed", apart], [apart, "controller=pid/printed"]):
        with pytest.raises(UserError, match="has its gains with it, and others are given too"):
            load_study([], given, command)
    with pytest.raises(UserError, match="has its gains with it, and others are given too"):
        read_study(command=command, keywords={"controller": "pid/printed", "gains": "default"})
    file = tmp_path / "study.yaml"
    file.write_text("simulate: {controller: pid/printed}\n")
    assert load_study([file], ["simulate.gains=default"]).simulate.gains == "default"
    assert load_study([], ["controller=pid/printed", "controller=pid/default"], "simulate").simulate.gains == "default"


def test_one_controller_takes_the_place_of_a_trials_list_with_its_gains_for_hardware(tmp_path: Path) -> None:
    assert rows_of() == [("smc-tracking", "hardware")]
    assert rows_of("controller=ct-dob") == [("ct-dob", "hardware")]
    assert rows_of("controller=pid") == [("pid", "printed")], "which has none for hardware"
    assert rows_of("hw-run.controllers=[{controller: ct-dob}]") == [("ct-dob", "hardware")]
    file = tmp_path / "study.yaml"
    file.write_text("hw-run:\n  controllers:\n  - {controller: pid-ff, gains: default}\n  - {controller: mrac}\n")
    assert rows_of("controller=ct-dob", files=(file,)) == [("ct-dob", "hardware")]
    assert rows_of("controller=ct-dob", "gains=default", files=(file,)) == [("ct-dob", "default")]
    assert rows_of("gains=tuned", files=(file,)) == [("pid-ff", "tuned"), ("mrac", "tuned")]
    assert rows_of("gains=default") == [("smc-tracking", "default")]
    file.write_text("hw-run: {controller: pid-ff/default}\n")
    assert rows_of(files=(file,)) == [("pid-ff", "default")]


def test_gains_by_loop_are_one_preset_where_all_loops_have_the_same() -> None:
    assert rows_of("hw-run.controllers=[pid-ff, pid, adrc/default]") == [
        ("pid-ff", "hardware"), ("pid", "printed"), ("adrc", "default")
    ]  # fmt: skip

    def gains(*settings: str) -> list[Any]:
        study = with_presets(load_study([], ["controllers=[pid-ff, pid]", *settings], "compare"), "compare")
        return [row.gains for row in study.compare.rows]

    assert gains() == ["by-loop", "printed"]
    assert gains("loops={one: {}}") == ["default", "printed"]
    assert gains("loops={one: {sensor: {level: camera}}, two: {actuator: {level: tendon}}}") == ["hardware", "printed"]
    worlds = load_study([Path("scenarios/camera")], ["controllers=[pid-ff]", "worlds.family=camera"], "compare")
    assert with_presets(worlds, "compare").compare.rows[0].gains == "hardware"
    alone = load_study([], ["controller=pid-ff", "gains=by-loop"], "simulate")
    assert with_presets(alone, "simulate").simulate.gains == "default"


def test_what_is_wrong_in_short_names_what_was_typed_and_the_row() -> None:
    for typed, said in (("controller=ctdob", "did you mean 'ct-dob'?"), ("gains=Kp=x", "NAME=NUMBER")):
        with pytest.raises(UserError) as caught:
            load_study([], [typed], "hw-run")
        assert f"--set {typed}: hw-run.controllers.0" in str(caught.value) and said in str(caught.value)
    study, origins = read_study([], ["controller=pid", "gains=Kp=1"], "hw-run")
    told = located(UserError("no", "hw-run.controllers.0.gains"), origins)
    assert told.where == "--set gains=Kp=1: hw-run.controllers.0.gains"
    assert study.hw_run.rows[0].gains == {"Kp": 1.0}


def test_values_of_gains_in_a_file_are_for_its_own_controller(tmp_path: Path) -> None:
    file = tmp_path / "study.yaml"
    file.write_text("simulate: {controller: ct-dob, gains: {w: 20, zeta: 1, wo: 10}}\n")
    for command in ("simulate", "analyse"):
        other = with_presets(load_study([file], ["controller=pid-ff"], command), command).simulate
        assert (other.controller, other.gains) == ("pid-ff", "default")
    same = load_study([file], ["controller=pid-ff", "gains={Kp: 1, Ki: 2, Kd: 3}"], "simulate").simulate
    assert same.gains == {"Kp": 1, "Ki": 2, "Kd": 3}
