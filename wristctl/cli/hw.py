"""`wristctl hw`: the motor board, and what to calibrate."""

from __future__ import annotations

import json
import logging
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

import typer

from wristctl.cli.hw_calibrate import app as calibrations
from wristctl.cli.hw_watch import watch
from wristctl.cli.options import Debug, Json, Quiet
from wristctl.cli.progress import listening, progress
from wristctl.config.errors import UserError
from wristctl.report.tables import Table
from wristctl.studies.counting import no_event

log = logging.getLogger(__name__)

app = typer.Typer(
    help="The motor board: find, check, flash, emulate, stop; calibrate; watch trials.",
    no_args_is_help=True,
    add_completion=False,
)

app.add_typer(calibrations, name="calibrate")
app.command("watch")(watch)

Port = Annotated[
    str | None,
    typer.Option("--port", help="Serial port, socket://host:port, or emulated; without it the only board found."),
]
Baud = Annotated[int, typer.Option("--baud", help="Of the serial line.")]
Image = Annotated[Path | None, typer.Option("--image", help="Another program than the packaged firmware (Intel hex).")]

_BAUD = 250_000


@app.command("ports")
def ports(
    find: Annotated[bool, typer.Option("--find", help="Find the board's port by unplugging it.")] = False,
    as_json: Json = False,
    debug: Debug = False,
) -> None:
    """List the serial ports of this computer, those that may be a board first."""
    from wristctl.board.transport import ports as serial_ports

    found = serial_ports()
    if find:
        typer.prompt("Unplug the board, then press Enter", default="", show_default=False, err=True)
        left = {port.device for port in serial_ports()}
        found = [port for port in found if port.device not in left]
        if len(found) != 1:
            what = f"{len(found)} ports went away" if found else "no port went away"
            raise UserError(what, fix="plug the board in, start again, and unplug only the board", exit_code=4)
    if as_json:
        print(json.dumps({"schema": "wristctl.ports/1", "ports": [port._asdict() for port in found]}, indent=2))
    elif find:
        print(found[0].device)
    elif found:
        columns = ("port", "may be a board", "description", "serial number")
        print(Table("", columns, [(p.device, p.board_like, p.description, p.serial_number) for p in found]).text())
    else:
        print("no serial ports; wristctl hw emulate serves a board without hardware")


@app.command("check")
def check(
    port: Port = None,
    baud: Baud = _BAUD,
    rounds: Annotated[int, typer.Option("--rounds", min=1, help="Commands to time.")] = 200,
    wiring: Annotated[
        int | None, typer.Option("--wiring", metavar="AXIS", min=0, max=3, help="Move this axis a little, after a yes.")
    ] = None,
    as_json: Json = False,
    quiet: Quiet = False,
    debug: Debug = False,
) -> None:
    """Ask the board who it is and how it is, time its answers, and try one drive's wiring."""
    from wristctl.board.board import Board
    from wristctl.board.check import move_a_little, round_trips
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
                _ask_before_moving(wiring)
                move_a_little(board, wiring)
            times = [round_trips(board, command, rounds) for command in (Command.PING, Command.STATUS)]
            status, counters = board.read(), board.counters()
    facts = _plain({**board.hello._asdict(), **status._asdict()})
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


@app.command("flash")
def flash(
    port: Port = None, image: Image = None, as_json: Json = False, quiet: Quiet = False, debug: Debug = False
) -> None:
    """Write the firmware into the board, read it back, and see that it answers."""
    from wristctl.board.board import Board
    from wristctl.board.flashing import IMAGE
    from wristctl.board.flashing import flash as write
    from wristctl.board.transport import BOOT_TIME, SerialTransport, only_board

    with listening(quiet, False) as console:
        place = port or only_board()
        with progress(console, no_event, f"flashing the board at {place}", None, "", quiet):
            write(place, image or IMAGE, log.info)
        if image is not None:
            return
        transport = SerialTransport(place, _BAUD)
        transport.boot_time = BOOT_TIME
        with Board(transport) as board:
            assert board.hello is not None
            facts = _plain(board.hello._asdict())
    if as_json:
        print(json.dumps({"schema": "wristctl.flashed/1", "port": place, **facts}, indent=2))
    else:
        print(f"firmware {facts['firmware']} written, verified and answering at {place}")


@app.command("emulate")
def emulate(
    tcp: Annotated[
        int | None, typer.Option("--tcp", help="Serve this TCP port (0: any), not a pseudo-terminal.")
    ] = None,
    image: Image = None,
    boot_loader: Annotated[
        Path | None, typer.Option("--boot-loader", help="Start this boot loader (Intel hex).")
    ] = None,
    wrist: Annotated[
        bool, typer.Option("--wrist", help="Hang a simulated wrist on it, before a rendered camera.")
    ] = False,
    quiet: Quiet = False,
    debug: Debug = False,
) -> None:
    """Serve the emulated board for any serial client, in real time; its port is the only line on stdout."""
    with listening(quiet, False) as console:
        with progress(console, no_event, "preparing the emulated board (compiled once per version)", None, "", quiet):
            from wristctl.board.emulator.atmega2560 import FIRMWARE, Atmega2560
            from wristctl.board.emulator.serve import PtyLine, TcpLine, serve

            chip = Atmega2560(image or FIRMWARE, boot_loader=boot_loader)
        line = PtyLine() if tcp is None else TcpLine(tcp)
        if wrist:
            _serve_with_wrist(chip, line, console, quiet)
            return
        log.info("serving; try: wristctl hw check --port %s", line.address)
        print(line.address, flush=True)
        try:
            serve(chip, line)
        finally:
            line.close()


def _serve_with_wrist(chip: Any, line: Any, console: Any, quiet: bool) -> None:
    from tempfile import TemporaryDirectory

    with TemporaryDirectory(prefix="wristctl-bench-") as folder:
        pictures = Path(folder) / "frame"
        with progress(console, no_event, "preparing the wrist (compiled once per version)", None, "", quiet):
            from wristctl.bench.film import start_film
            from wristctl.bench.rig import Rig
            from wristctl.bench.server import BenchServer
            from wristctl.config.bench import BenchSettings
            from wristctl.config.wrist import WristParameters

            settings, its = BenchSettings(), WristParameters()
            camera, film = start_film(settings.camera, its, None, pictures)
            server = BenchServer(Rig(settings, its, 0, chip=chip), line, film)
        log.info("serving, with a wrist of the default settings on axes 0 to 3; its camera's frames: %s", pictures)
        log.info("try: wristctl hw check --port %s --wiring 3", line.address)
        print(line.address, flush=True)
        try:
            server.run()
        finally:
            camera.join()


@app.command("stop")
def stop(port: Port = None, baud: Baud = _BAUD, debug: Debug = False) -> None:
    """Emergency stop: no further step, drives released. Works beside a running program."""
    from wristctl.board.board import Board
    from wristctl.board.transport import open_transport

    transport = open_transport(port, baud, exclusive=False)
    try:
        result = Board(transport).stop_whatever_runs()
    finally:
        transport.close()
    print(f"stopped ({result.name}); the fault is latched until cleared")


def _ask_before_moving(axis: int) -> None:
    typer.echo(f"Axis {axis} will creep a twentieth of a turn forward and back. Keep clear of the tendons.", err=True)
    if typer.prompt("Type yes to move it", default="no", show_default=False, err=True) != "yes":
        raise UserError("nothing was moved", fix="type yes, or leave out --wiring", exit_code=3)


def _plain(values: dict[str, Any]) -> dict[str, Any]:
    """Names for states, faults and flags; the dictionary in hex."""
    named = {key: value.name or "none" if hasattr(value, "name") else value for key, value in values.items()}
    return {**named, "dictionary": f"{values['dictionary']:08x}", "firmware": ".".join(map(str, values["firmware"]))}
