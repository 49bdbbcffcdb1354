"""`wristctl hw`: the motor board listed, flashed and stopped, and the commands beside."""

import logging
from typing import Annotated, Any

import typer

from wristctl.cli.hw_bench import emulate, watch
from wristctl.cli.hw_by_hand import clear, home, jog, limits, slacken, tension
from wristctl.cli.hw_check import check
from wristctl.cli.hw_sheets import app as calibrations
from wristctl.cli.hw_sheets import drawings
from wristctl.cli.hw_weigh import weigh
from wristctl.cli.json_output import print_json
from wristctl.cli.options import BAUD, Baud, Image, Json, Port, Quiet, facts_of, with_debug
from wristctl.cli.progress import listening, progress
from wristctl.commands.printed_table import Table
from wristctl.errors import UserError

log = logging.getLogger(__name__)


def ports(
    find: Annotated[bool, typer.Option("--find", help="Find the board's port by unplugging it.")] = False,
    as_json: Json = False,
) -> None:
    """List the serial ports of this computer, those that may be a board first."""
    from wristctl.board.transport import ports as serial_ports

    listed = serial_ports()
    if find:
        typer.prompt("Unplug the board, then press Enter", default="", show_default=False, err=True)
        left = {port.device for port in serial_ports()}
        listed = [port for port in listed if port.device not in left]
        if len(listed) != 1:
            problem = f"{len(listed)} ports went away" if listed else "no port went away"
            raise UserError(problem, fix="plug the board in, start again, and unplug only the board", exit_code=4)
    if as_json:
        print_json({"schema": "wristctl.ports/1", "ports": [port._asdict() for port in listed]})
    elif find:
        print(listed[0].device)
    elif listed:
        columns = ("port", "may be a board", "description", "serial number")
        print(Table("", columns, [(p.device, p.board_like, p.description, p.serial_number) for p in listed]).text())
    else:
        print("no serial ports; wristctl hw emulate serves a board without hardware")


def flash(port: Port = None, image: Image = None, as_json: Json = False, quiet: Quiet = False) -> None:
    """Write the firmware into the board, read it back, and see that it answers."""
    from wristctl.board.driver import Board
    from wristctl.board.flashing import IMAGE
    from wristctl.board.flashing import flash as write
    from wristctl.board.transport import BOOT_TIME, SerialTransport, only_board

    with listening(quiet, False) as console:
        place = port or only_board()
        with progress(console, f"flashing the board at {place}", quiet):
            write(place, image or IMAGE, log.info)
        facts: dict[str, Any] = {}
        if image is None:
            transport = SerialTransport(place, BAUD)
            transport.boot_time = BOOT_TIME
            with Board(transport) as board:
                assert board.hello is not None
                facts = facts_of(board.hello._asdict())
    if as_json:
        print_json({"schema": "wristctl.flashed/1", "port": place, **facts})
    elif image is None:
        print(f"firmware {facts['firmware']} written, verified and answering at {place}")


def stop(port: Port = None, baud: Baud = BAUD) -> None:
    """Emergency stop: no further step, drives released. Works beside a running program."""
    from wristctl.board.board_errors import PortUnusable
    from wristctl.board.driver import Board
    from wristctl.board.transport import open_transport

    try:
        transport = open_transport(port, baud)
    except PortUnusable:  # a program of ours has it: opening it a second time resets nothing, and every moment counts
        transport = open_transport(port, baud, exclusive=False)
        transport.boot_time = 0.0
    try:
        result = Board(transport).stop_whatever_runs()
    finally:
        transport.close()
    print(f"stopped ({result.name}); the fault is latched until cleared")


app = typer.Typer(
    help="The motor board: find, check, flash, emulate, stop; move by hand; calibrate; watch trials.",
    no_args_is_help=True,
    add_completion=False,
)

app.add_typer(calibrations, name="calibrate")
for command in (watch, ports, check, flash, emulate, stop, jog, home, limits, slacken, tension, clear, weigh, drawings):
    app.command(command.__name__)(with_debug(command))
