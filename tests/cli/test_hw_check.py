"""What `wristctl hw check`, `flash` and `stop` ask of a board, and how they tell what it says."""

from __future__ import annotations

import io
import json
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from tests.cli.conftest import Call
from wristctl.board import transport
from wristctl.board.board_errors import PortUnusable
from wristctl.board.check import RoundTrips
from wristctl.board.exchange import Traffic
from wristctl.board.flashing import IMAGE
from wristctl.board.messages import Command, Counters, Hello, Reset, Result, State, Status
from wristctl.board.transport import BOOT_TIME, PortFound
from wristctl.cli.options import facts_of

HELLO = Hello(2, 0xAB, (1, 2, 3), 9, Reset.EXTERNAL | Reset.WARM, 4, 1000, 2000, 5)
COUNTERS = Counters(*range(11, 11 + len(Counters._fields)))


def _status() -> Status:
    plain: dict[str, Any] = dict.fromkeys(Status._fields, 0)
    return Status(**{**plain, "state": State.DISABLED, "position": (5, 6, 7, 8)})


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> list[tuple[Any, ...]]:
    """What was asked of a board that is plugged in at /dev/board, in its order."""
    found: list[tuple[Any, ...]] = []

    def opened(port: str | None, baud: int, exclusive: bool = True) -> Any:
        found.append(("open", port, baud, exclusive))
        return SimpleNamespace(name="/dev/board", close=lambda: found.append(("close",)), boot_time=BOOT_TIME)

    class Plugged:
        hello, traffic, bad_frames = HELLO, Traffic(sent=31, answers=29), 3

        def __init__(self, transport: Any) -> None:
            found.append(("board", transport.boot_time))

        def __enter__(self) -> Plugged:
            return self

        def __exit__(self, *_: object) -> None:
            found.append(("left",))

        def read(self) -> Status:
            return _status()

        def counters(self) -> Counters:
            return COUNTERS

        def stop_whatever_runs(self) -> Result:
            return Result(0)

    def timed(_board: Any, command: Command, count: int) -> RoundTrips:
        found.append(("timed", command, count))
        slower = 1 + (command is Command.STATUS)
        return RoundTrips(command.name, count, 1e-3 * slower, 2.5e-3 * slower, 0.04 * slower)

    monkeypatch.setattr("wristctl.board.transport.open_transport", opened)
    monkeypatch.setattr("wristctl.board.transport.SerialTransport", opened)
    monkeypatch.setattr("wristctl.board.transport.only_board", lambda: "/dev/only")
    monkeypatch.setattr("wristctl.board.driver.Board", Plugged)
    monkeypatch.setattr("wristctl.board.check.round_trips", timed)
    monkeypatch.setattr("wristctl.board.check.ports", lambda: [PortFound("/dev/board", "Mega", "", True, "16U2")])
    monkeypatch.setattr("wristctl.board.check.move_a_little", lambda _, axis: found.append(("moved", axis)))
    monkeypatch.setattr("wristctl.board.flashing.flash", lambda place, image, say: found.append((place, image)))
    return found


def test_check_shows_the_board_its_times_in_milliseconds_and_its_counts(call: Call, asked: list[Any]) -> None:
    code, out, err = call("hw", "check")
    assert (code, err) == (0, "")
    assert asked[0] == ("open", None, 250_000, True)
    assert asked[2:] == [("timed", Command.PING, 200), ("timed", Command.STATUS, 200), ("left",)]
    lines = [line.split() for line in out.splitlines()]
    assert [out.index(title) for title in ("Board", "Round trips", "On the wire")] == sorted(
        out.index(title) for title in ("Board", "Round trips", "On the wire")
    )
    for line in (
        ["USB", "adapter", "16U2,", "hands", "over", "every", "4.1", "ms"],
        ["port", "/dev/board"],
        ["firmware", "1.2.3"],
        ["dictionary", "000000ab"],
        ["state", "DISABLED"],
    ):
        assert line in lines
    assert ["PING", "200", "1", "2.5", "40"] in lines and ["STATUS", "200", "2", "5", "80"] in lines
    assert out.index("median [ms]") < out.index("p99 [ms]") < out.index("worst [ms]")
    counted = {"sent": 31, "answers": 29, "bad_frames_here": 3, **COUNTERS._asdict()}
    assert all([name, str(count)] in lines for name, count in counted.items())


def test_check_for_programs_is_in_seconds(call: Call, asked: list[Any]) -> None:
    code, out, _ = call("hw", "check", "--port", "/dev/x", "--baud", "9600", "--rounds", "1", "--json")
    told = json.loads(out)
    assert code == 0 and asked[0] == ("open", "/dev/x", 9600, True)
    assert told["round_trips_s"][1] == {
        "command": "STATUS", "rounds": 1, "median": 0.002, "p99": 0.005, "worst": 0.08,
    }  # fmt: skip
    assert told["adapter"] == {"name": "16U2", "every": 0.004096}
    assert told["position"] == [5, 6, 7, 8] and told["protocol"] == 2
    assert told["counters"] == {
        "sent": 31, "resent": 0, "answers": 29, "stale": 0, "bytes_read": 0, "bad_frames_here": 3,
        **COUNTERS._asdict(),
    }  # fmt: skip


def test_check_tells_what_a_try_of_the_wiring_came_to_and_units(call: Call, asked: list[Any]) -> None:
    code, out, _ = call("hw", "check", "--wiring", "2", "--yes")
    assert code == 0 and out.startswith("Wiring: the board has made 160 steps of axis 2") and ("moved", 2) in asked
    lines = [line.split() for line in out.splitlines()]
    for line in (["time", "0", "s"], ["watchdog_left", "0", "s"], ["max_rate", "1000", "steps/s"], ["lapses", "0"]):
        assert line in lines
    assert json.loads(call("hw", "check", "--wiring", "2", "--yes", "--json")[1])["wiring"]["axis"] == 2
    code, out, _ = call("hw", "check")
    assert code == 0 and "Wiring" not in out and "wiring" not in json.loads(call("hw", "check", "--json")[1])


@pytest.mark.parametrize("wrong", [("--rounds", "0"), ("--wiring", "4"), ("--wiring", "-1")])
def test_check_refuses_no_rounds_and_no_axis(call: Call, asked: list[Any], wrong: tuple[str, str]) -> None:
    assert call("hw", "check", *wrong)[0] == 2 and asked == []


@pytest.mark.parametrize(("typed", "code"), [("yes\n", 0), ("no\n", 3), ("\n", 3), ("y\n", 3)])
def test_an_axis_moves_after_a_typed_yes_asked_for_on_stderr(
    call: Call, asked: list[Any], monkeypatch: pytest.MonkeyPatch, typed: str, code: int
) -> None:
    monkeypatch.setattr(sys, "stdin", io.StringIO(typed))
    ended, out, err = call("hw", "check", "--wiring", "0", "--json")
    assert (
        ended == code and "Axis 0 will creep" in err and err.split("tendons.\n")[1].startswith("Type yes to move it:")
    )
    assert (("moved", 0) in asked) == (code == 0)
    assert json.loads(out)["schema"] == ("wristctl.error/1" if code else "wristctl.board/1")
    if out.strip():
        json.loads(out)
    else:
        assert "nothing was moved" in err


def test_stop_opens_a_free_port_alone_and_lets_it_go(call: Call, asked: list[Any]) -> None:
    code, out, _ = call("hw", "stop")
    assert code == 0 and out == "stopped (OK); the fault is latched until cleared\n"
    assert asked == [("open", None, 250_000, True), ("board", 2.0), ("close",)], "it may have been reset"


def test_beside_another_program_it_stops_at_once(call: Call, asked: list[Any], monkeypatch: pytest.MonkeyPatch) -> None:
    alone = transport.open_transport

    def opened(port: str | None, baud: int, exclusive: bool = True) -> Any:
        if exclusive:
            raise PortUnusable("/dev/board", OSError("could not exclusively lock"))
        return alone(port, baud, exclusive)

    monkeypatch.setattr(transport, "open_transport", opened)
    assert call("hw", "stop")[0] == 0
    assert asked == [("open", None, 250_000, False), ("board", 0.0), ("close",)]


def test_flash_writes_the_packaged_firmware_and_sees_that_it_answers(call: Call, asked: list[Any]) -> None:
    code, out, _ = call("hw", "flash")
    assert code == 0 and out == "firmware 1.2.3 written, verified and answering at /dev/only\n"
    assert asked == [("/dev/only", IMAGE), ("open", "/dev/only", 250_000, True), ("board", BOOT_TIME), ("left",)]
    told = json.loads(call("hw", "flash", "--port", "/dev/x", "--json")[1])
    assert (told["port"], told["firmware"]) == ("/dev/x", "1.2.3") and asked[4] == ("/dev/x", IMAGE)


def test_of_another_program_nothing_is_asked(call: Call, asked: list[Any]) -> None:
    assert call("hw", "flash", "--image", "own.hex")[:2] == (0, "")
    assert asked == [("/dev/only", Path("own.hex"))]


def test_facts_are_named() -> None:
    nameless = SimpleNamespace(name=None)
    told = facts_of({"dictionary": 255, "firmware": (1, 0, 2), "state": State.DISABLED, "flags": nameless, "axes": 4})
    assert told == {"dictionary": "000000ff", "firmware": "1.0.2", "state": "DISABLED", "flags": "none", "axes": 4}


@pytest.mark.parametrize(
    ("cause", "said"),
    [
        (Reset.EXTERNAL | Reset.WARM, ("reset line was pulled", "memory has survived")),
        (Reset.BROWN_OUT, ("the supply has sagged",)),
        (Reset.WARM, ("hidden by the boot loader", "memory has survived")),
        (Reset(0), ("hidden by the boot loader",)),
    ],
)
def test_why_the_board_has_started_is_said_in_words(cause: Reset, said: tuple[str, ...]) -> None:
    told = str(facts_of(HELLO._replace(reset_cause=cause)._asdict())["reset_cause"]).split("; ")
    assert len(told) == len(said) and all(part in whole for part, whole in zip(said, told, strict=True))
