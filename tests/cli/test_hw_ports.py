"""`wristctl hw ports` lists the serial ports, or finds the one that goes away."""

from __future__ import annotations

import io
import json
import sys

import pytest

from tests.cli.conftest import Call
from wristctl.board.transport import PortFound

MEGA, OTHER, THIRD = (
    PortFound("/dev/a", "Mega", "77", True),
    PortFound("/dev/b", "modem", "", False),
    PortFound("/dev/c", "mouse", "5", False),
)


def _seen(monkeypatch: pytest.MonkeyPatch, *looks: list[PortFound]) -> None:
    """These are plugged in at the first look, then at the second."""
    following = iter(looks)
    monkeypatch.setattr("wristctl.board.transport.ports", lambda: next(following))
    monkeypatch.setattr(sys, "stdin", io.StringIO("\n"))


def test_ports_are_listed_with_what_is_known_of_them(call: Call, monkeypatch: pytest.MonkeyPatch) -> None:
    _seen(monkeypatch, [MEGA, OTHER], [MEGA], [])
    code, out, err = call("hw", "ports")
    assert (code, err) == (0, "")
    assert [line.split() for line in out.splitlines()[2:]] == [
        ["/dev/a", "yes", "Mega", "77"],
        ["/dev/b", "no", "modem"],
    ]
    assert json.loads(call("hw", "ports", "--json")[1]) == {"schema": "wristctl.ports/1", "ports": [MEGA._asdict()]}
    assert "wristctl hw emulate" in call("hw", "ports")[1]


def test_the_port_that_goes_away_is_the_boards(call: Call, monkeypatch: pytest.MonkeyPatch) -> None:
    _seen(monkeypatch, [OTHER, MEGA], [OTHER])
    code, out, err = call("hw", "ports", "--find")
    assert (code, out.strip()) == (0, "/dev/a"), "the port alone on stdout"
    assert err == "Unplug the board, then press Enter:"


@pytest.mark.parametrize(
    ("left", "said"), [([MEGA, OTHER, THIRD], "no port went away"), ([THIRD], "2 ports went away"), ([], "3 ports")]
)
def test_none_or_several_that_went_away_are_no_answer(
    call: Call, monkeypatch: pytest.MonkeyPatch, left: list[PortFound], said: str
) -> None:
    _seen(monkeypatch, [MEGA, OTHER, THIRD], left)
    code, out, err = call("hw", "ports", "--find")
    assert (code, out.strip()) == (4, "") and said in err
