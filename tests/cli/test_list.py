"""`wristctl list` has a line for every entry of each table, by the name that can be typed."""

from __future__ import annotations

import json
import sys

import pytest

from wristctl.cli.app import main
from wristctl.commands.choice_tables import TABLES, first_sentence
from wristctl.config.choices import CONTROLLERS, METRICS, REFERENCES
from wristctl.control.shipped_gains import families, shipped_gains
from wristctl.study_files.typed_controllers import parted

NAMES = {"controllers": CONTROLLERS, "references": REFERENCES, "metrics": METRICS}


def _listed(what: str, *options: str, monkeypatch: pytest.MonkeyPatch, code: int = 0) -> None:
    monkeypatch.setattr(sys, "argv", ["wristctl", "list", what, *options])
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == code


@pytest.mark.parametrize("what", TABLES)
def test_each_list_has_a_line_for_every_entry(
    what: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    _listed(what, monkeypatch=monkeypatch)
    out = capsys.readouterr().out.splitlines()
    assert max(map(len, out)) <= 100
    _, rule, *every = out
    lines = [line for line in every if not line.startswith(" ")]
    _listed(what, "--json", monkeypatch=monkeypatch)
    shown = json.loads(capsys.readouterr().out)
    assert set(rule) == {"-", " "} and [line.split("  ")[0] for line in lines] == [row[0] for row in shown["rows"]]
    assert all(all(row[1:]) for row in shown["rows"]), "each says something"
    if what in NAMES:
        assert [row[0] for row in shown["rows"]] == list(NAMES[what])
    if what == "presets":
        names = [row[0] for row in shown["rows"]]
        assert parted(names, "compare").controllers == names
        shipped = [name for name in names if "/tuned:" in name]
        assert {name for name in names if name not in shipped} == {
            f"{name}/{preset}" for name in CONTROLLERS for preset in CONTROLLERS[name].presets
        }
        for name in shipped:
            controller, _, gains = name.partition("/")
            assert list(shipped_gains(controller, gains).gains) == list(CONTROLLERS[controller].gains)
        assert {name.partition(":")[2] for name in shipped} == set(families())


def test_a_sentence_ends_at_a_full_stop_outside_brackets() -> None:
    assert (
        first_sentence("Learns\nonline (Front. Robot. AI [no. 12]). More. And more.")
        == "Learns online (Front. Robot. AI [no. 12])"
    )
    assert first_sentence("Alone.") == "Alone"


def test_the_conditions_say_which_preset_a_name_alone_has(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    _listed("conditions", "--json", monkeypatch=monkeypatch)
    rows = {row[0]: row[2:] for row in json.loads(capsys.readouterr().out)["rows"]}
    assert rows["sampled"] == ["four-segments", "default"] and rows["motors + camera"] == ["camera", "hardware"]


def test_another_list_is_refused_with_the_nearest(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    _listed("contrlers", monkeypatch=monkeypatch, code=2)
    assert "did you mean 'controllers'?" in capsys.readouterr().err
