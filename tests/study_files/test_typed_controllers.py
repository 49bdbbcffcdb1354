"""What is typed among study files is a controller or a study by one rule, and what is both or neither is an error."""

from __future__ import annotations

import re
from pathlib import Path
from random import Random
from typing import Any

import pytest

from wristctl.config.choices import CONTROLLERS
from wristctl.errors import UserError
from wristctl.study_files.error_messages import check_sizes
from wristctl.study_files.load import read_study
from wristctl.study_files.shipped import shipped_names
from wristctl.study_files.typed_controllers import parted

LAW = "MINE = None\n"
STUDY = "compare: {horizon: 4}\n"


def settings_of(command: str, *typed: str, tune: bool = False, override: str = "") -> Any:
    """Section of a command as it is typed, as a file has it."""
    controllers, files = parted(typed, command)
    study, origins = read_study(files, [override] * bool(override), command, controllers=controllers, tune=tune)
    check_sizes(study, origins)
    return getattr(study, command.replace("-", "_"))


def rows_of(settings: Any) -> list[tuple[str, Any]]:
    return [(row.controller, row.gains) for row in settings.rows]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with a law, two studies, and studies called as controllers are."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "my.py").write_text(LAW)
    (tmp_path / "experiments").mkdir()
    for name in ("mywrist.yaml", "other.yml", "nc", "experiments/ilc.yaml"):
        (tmp_path / name).write_text(STUDY)
    (tmp_path / "mpc").mkdir()
    return tmp_path


def drawn(rng: Random) -> tuple[str, str]:
    """Something that is typed, and what it is: a controller, a study, both, misspelt, or nothing."""
    own = sorted(set(CONTROLLERS) - {"nc", "ilc"})
    name, preset = rng.choice(own), rng.choice(["default", "hardware", "printed", "tuned", "Kp=1,Kd=0.5"])
    wrong = name[:1] + name[2:] + rng.choice("xyz")
    kinds = {
        "controller": [name, f"{name}/{preset}", "my.py:MINE", f"my.py:MINE/{preset}", "mpc"],
        "study": ["mywrist.yaml", "other.yml", f"{name}.yaml", rng.choice(shipped_names()), "ilc.yaml", "./nc"],
        "both": ["nc", "ilc"],
        "neither": [wrong, f"{wrong}/{preset}", "my.py", "mywrist", "nothing-at-all"],
    }
    kind = rng.choice(list(kinds))
    return rng.choice(kinds[kind]), kind


@pytest.mark.parametrize(
    ("typed", "meant"),
    [
        ("CT-DOB", "ct-dob"),
        ("pid_ff/hardware", "pid-ff/hardware"),
        ("My_Wrist", "my-wrist.yaml"),
        ("my-pd", "my_pd.py:MY_PD"),
        ("broken", "broken.py:NAME"),
    ],
)
def test_capitals_underscores_and_files_of_ones_own_are_known_again(typed: str, meant: str, folder: Path) -> None:
    (folder / "my-wrist.yaml").write_text(STUDY)
    (folder / "my_pd.py").write_text("raise SystemExit\nOTHER = 1\nMY_PD = Controller(name='my-pd')\n")
    (folder / "broken.py").write_text("def (:")
    with pytest.raises(UserError, match=re.escape(f"did you mean '{meant}'?")):
        parted([typed], "compare")


@pytest.mark.parametrize("seed", range(30))
def test_a_drawn_argument_is_what_the_rule_says(seed: int, folder: Path) -> None:
    typed, kind = drawn(Random(seed))
    if kind in ("controller", "study"):
        controllers, files = parted(["pid-ff", typed, "mywrist.yaml"], "compare")
        assert controllers == ["pid-ff"] + [typed] * (kind == "controller")
        assert files == [Path(typed)] * (kind == "study") + [Path("mywrist.yaml")]
        return
    with pytest.raises(UserError) as caught:
        parted(["pid-ff", typed], "compare")
    if kind == "both":
        study = "./nc" if typed == "nc" else "ilc.yaml"
        assert f"{study} for the study, {typed}/default" in caught.value.fix
        return
    fix = {
        "my.py": "my.py:NAME",
        "mywrist": "did you mean 'mywrist.yaml'?",
        "nothing-at-all": "wristctl list controllers",
    }
    said = fix.get(typed, "did you mean '")
    assert said in caught.value.fix and typed in str(caught.value)


def test_both_spellings_that_the_error_names_are_taken(folder: Path) -> None:
    assert parted(["./nc", "ilc.yaml", "nc/default", "ilc/hardware"], "compare") == (
        ["nc/default", "ilc/hardware"],
        [Path("nc"), Path("ilc.yaml")],
    )
    (folder / "experiments" / "nc").mkdir()
    (folder / "experiments" / "nc" / "default.yaml").write_text(STUDY)
    with pytest.raises(UserError, match=r"nc/default\.yaml for the study, --set 'controllers=\[nc/default\]'"):
        parted(["nc/default"], "compare")
    assert rows_of(settings_of("compare", override="controllers=[nc/default]")) == [("nc", "default")]


def test_rows_are_as_typed_in_their_order_before_those_of_files(folder: Path) -> None:
    compared = settings_of("compare", "pid-ff", "mywrist.yaml", "adrc/hardware", "my.py:MINE", "pid/Kp=1,Ki=2,Kd=0")
    law = f"{folder / 'my.py'}:MINE"
    gains = {"Kp": 1.0, "Ki": 2.0, "Kd": 0.0}
    assert rows_of(compared) == [("pid-ff", "by-loop"), ("adrc", "hardware"), (law, "by-loop"), ("pid", gains)]
    assert [row.label for row in compared.rows[:2]] == ["pid-ff", "adrc/hardware"] and compared.horizon == 4.0
    trial = settings_of("hw-run", "pid-ff", "mywrist.yaml", "adrc/default")
    assert rows_of(trial) == [("pid-ff", "by-loop"), ("adrc", "default")]
    assert settings_of("tune", "pid-ff", "my.py:MINE").controllers == ("pid-ff", law)
    assert settings_of("recommend", "pid-ff", "mrac").controllers == ("pid-ff", "mrac")
    study = settings_of("study", "fair_study", "pid-ff", "pd-ff", "adrc/hardware")
    assert study.laws == ("pid-ff", "pd-ff") and [row.label for row in study.presets] == ["adrc/hardware"]
    assert study.terms and {row for pair in study.terms.values() for row in pair} == {"pid-ff/tuned", "pd-ff/tuned"}


def test_controllers_of_a_file_that_are_left_out_are_told_in_one_note(
    folder: Path, caplog: pytest.LogCaptureFixture
) -> None:
    listed = "[pid-ff/hardware, my.py:MINE, {controller: pid, gains: {Kp: 1, Ki: 2, Kd: 0}}]"
    (folder / "mywrist.yaml").write_text(f"compare: {{controllers: {listed}}}\ntune: {{controllers: [smc, pid]}}\n")
    settings_of("compare", "mywrist.yaml", "ct-dob", "pid-ff/hardware")
    (note,) = caplog.messages
    assert "my.py:MINE" in note and "pid/given" in note and "pid-ff" not in note and str(folder) not in note
    caplog.clear()
    settings_of("tune", "mywrist.yaml", "pid", "pid-ff")
    assert ["smc" in note and "pid" not in note for note in caplog.messages] == [True]
    caplog.clear()
    settings_of("compare", "mywrist.yaml")
    settings_of("compare", "other.yml", "pid-ff")
    settings_of("tune", "mywrist.yaml", "pid", "smc")
    assert not caplog.messages


def test_a_list_in_a_file_is_typed_the_same_way(folder: Path) -> None:
    (folder / "mywrist.yaml").write_text("compare: {controllers: [pid-ff, adrc/hardware, my.py:MINE]}\n")
    assert rows_of(settings_of("compare", "mywrist.yaml")) == rows_of(
        settings_of("compare", "pid-ff", "adrc/hardware", "my.py:MINE")
    )


def test_typed_controllers_are_tuned_only_where_that_is_asked_for(folder: Path) -> None:
    assert settings_of("compare", "controllers").tuning is not None
    assert settings_of("compare", "pid-ff", "smc", "controllers").tuning is None
    named = settings_of("compare", "pid-ff", "smc/tuned", "controllers")
    assert named.tuning.controllers == ("smc",) and named.tuning.iterations == 15
    tuned = settings_of("compare", "pid-ff", "smc/printed", "feedforward", tune=True)
    assert rows_of(tuned) == [("pid-ff", "tuned"), ("smc", "printed"), ("feedforward", "by-loop")]
    assert tuned.tuning.controllers == ("pid-ff",)
    assert settings_of("compare", "pid-ff", "controllers", tune=True).tuning.iterations == 15
    assert settings_of("compare", "pid-ff", tune=True, override="tuning.candidates=8").tuning.candidates == 8
    with pytest.raises(UserError, match="give a controller by its name alone"):
        settings_of("compare", "pid-ff/hardware", tune=True, override="tuning.candidates=8")


@pytest.mark.parametrize(
    ("command", "typed", "override", "said"),
    [
        ("compare", ("pid-ff", "pid-ff"), "", "pid-ff is typed twice"),
        ("compare", ("pid-ff", "nosuch.py:LAW"), "", r"no file .*nosuch\.py - nosuch\.py:LAW: compare\.controllers\.1"),
        ("tune", ("pid-ff", "adrc/hardware"), "", "tune searches the gains .* the name alone: adrc"),
        ("study", ("adrc/hardware",), "", "study searches the gains"),
        ("hw-run", ("pid-ff",), "controller=adrc", "leave out --controller"),
        ("hw-run", ("pid-ff/hardware",), "gains=default", "leave out --gains"),
        ("compare", ("pid-ff", "adrc"), "tuning.candidates=8", "tuning.candidates=8 - fix: add --tune"),
        ("compare", ("pid-ff", "adrc"), "compare.tuning.iterations=2", "add --tune"),
    ],
)
def test_what_cannot_be_typed_is_refused_by_the_word(
    command: str, typed: tuple[str, ...], override: str, said: str, folder: Path
) -> None:
    with pytest.raises(UserError, match=said):
        settings_of(command, *typed, override=override)
    if not override:
        with pytest.raises(UserError, match="--tune is for controllers that are typed"):
            settings_of("compare", "mywrist.yaml", tune=True)
