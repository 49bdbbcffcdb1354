"""`wristctl hw check`."""

from __future__ import annotations

import json
from dataclasses import asdict
from typing import Annotated

import typer

from wristctl.cli.hw_options import BAUD, Baud, Port, facts_of
from wristctl.cli.options import Debug, Json, Quiet
from wristctl.cli.progress import listening, progress
from wristctl.config.errors import UserError
from wristctl.report.printed_table import Table
from wristctl.studies.counting import no_event


def check(
    port: Port = None,
    baud: Baud = BAUD,
    rounds: Annotated[int, typer.Option("--rounds", min=1, help="Commands to time.")] = 200,
    wiring: Annotated[
        int | None, typer.Option("--wiring", metavar="AXIS", min=0, max=3, help="Move this axis a little, after a yes.")
    ] = None,
    rig: Annotated[
        bool, typer.Option("--rig", help="Camera and computer too: can the loop of hw-run run here?")
    ] = False,
    camera: Annotated[str | None, typer.Option("--camera", help="With --rig: number, path or address.")] = None,
    axis: Annotated[int, typer.Option("--axis", min=0, max=3, help="With --rig: axis that is to be moved.")] = 2,
    override: Annotated[
        list[str] | None, typer.Option("--set", metavar="KEY=VALUE", help="With --rig: a setting of hw-run.")
    ] = None,
    yes: Annotated[bool, typer.Option("--yes", help="Ask nobody before a motor moves.")] = False,
    as_json: Json = False,
    quiet: Quiet = False,
    debug: Debug = False,
) -> None:
    """Ask the board who it is and how it is, time its answers, and try one drive's wiring; --rig: the whole rig."""
    if rig:
        from wristctl.cli.hw_check_rig import check_rig

        return check_rig(port, baud, camera, override or [], axis, yes, as_json, quiet)
    from wristctl.board.check import move_a_little, round_trips
    from wristctl.board.driver import Board
    from wristctl.board.messages import Command
    from wristctl.board.transport import EMULATED, open_transport

    with listening(quiet, False) as console:
        if port == EMULATED:
            with progress(console, no_event, "preparing the emulated board", None, "", quiet):
                transport = open_transport(port, baud)
        else:
            transport = open_transport(port, baud)
        with Board(transport) as board:
            assert board.hello is not None
            if wiring is not None:
                if not yes:
                    _ask_before_moving(wiring)
                move_a_little(board, wiring)
            times = [round_trips(board, command, rounds) for command in (Command.PING, Command.STATUS)]
            status, counters = board.read(), board.counters()
    facts = facts_of({**board.hello._asdict(), **status._asdict()})
    counted = {**asdict(board.traffic), "bad_frames_here": board.bad_frames, **counters._asdict()}
    if as_json:
        timed = [each._asdict() for each in times]
        shown = {
            "schema": "wristctl.board/1",
            "port": transport.name,
            **facts,
            "round_trips_s": timed,
            "counters": counted,
        }
        print(json.dumps(shown, indent=2))
        return
    columns = ("command", "times", "median [ms]", "p99 [ms]", "worst [ms]")
    rows = [(each.command, each.rounds, *(1e3 * value for value in each[2:])) for each in times]
    for table in (
        Table("Board", ("port", transport.name), [(name, str(value)) for name, value in facts.items()]),
        Table("Round trips", columns, rows),
        Table("On the wire", ("what", "count"), list(counted.items())),
    ):
        print(table.text(), end="\n\n")


def _ask_before_moving(axis: int) -> None:
    typer.echo(f"Axis {axis} will creep a twentieth of a turn forward and back. Keep clear of the tendons.", err=True)
    if typer.prompt("Type yes to move it", default="no", show_default=False, err=True) != "yes":
        raise UserError("nothing was moved", fix="type yes, or leave out --wiring", exit_code=3)
