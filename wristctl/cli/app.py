"""`wristctl`: the table of commands, and the way every one of them ends."""

from __future__ import annotations

import gc
import signal
import sys
import traceback
from typing import NoReturn

import typer
from typer.main import get_command

from wristctl import __version__
from wristctl.cli.lazy_commands import lazy_group
from wristctl.config.errors import UserError
from wristctl.config.printable import printable
from wristctl.config.system_errors import error_of_the_system
from wristctl.interrupt import again, interrupts

_REPRODUCE, _HARDWARE, _OWN, _RESULTS = "Reproduce the paper", "Hardware", "Your own", "Results"

COMMANDS = {
    "init": ("wristctl.cli.init", _REPRODUCE, "Lay out the study files in a folder, for you to change."),
    "gen-data": (
        "wristctl.cli.gen_data",
        _REPRODUCE,
        "Sample tip positions and bending angles of the wrist's model.",
    ),
    "train": ("wristctl.cli.train", _REPRODUCE, "Train the network from tip position to bending angle."),
    "tune": ("wristctl.cli.tune", _REPRODUCE, "Search the gains of controllers."),
    "compare": ("wristctl.cli.compare", _REPRODUCE, "Compare controllers, the paper's numbers beside ours."),
    "study": ("wristctl.cli.study", _REPRODUCE, "Tune and judge all laws at equal budget: which is for which rig."),
    "simulate": ("wristctl.cli.simulate", _REPRODUCE, "Simulate one closed loop, with pictures."),
    "analyse": ("wristctl.cli.analyse", _REPRODUCE, "Find the margins of one loop, with pictures."),
    "hysteresis": (
        "wristctl.cli.hysteresis",
        _REPRODUCE,
        "Drive the wrist through hysteresis loops; fit a measured one.",
    ),
    "audit": ("wristctl.cli.audit", _REPRODUCE, "Judge the paper's claims one by one."),
    "hw-run": ("wristctl.cli.hw_run", _HARDWARE, "Perform the paper's experiment, on hardware or all emulated."),
    "identify": ("wristctl.cli.identify", _HARDWARE, "Find a real wrist's parameters from logged trials."),
    "hw": ("wristctl.cli.hw", _HARDWARE, "The motor board: find, check, flash, emulate, stop, move; calibrate."),
    "track": ("wristctl.cli.track", _HARDWARE, "Find the wrist's angle in a recorded video."),
    "export-model": ("wristctl.cli.export_model", _RESULTS, "Write the wrist of a run for MuJoCo or MATLAB."),
    "new": ("wristctl.cli.new", _OWN, "Write a controller, reference or optimiser of your own to begin from."),
    "check-law": ("wristctl.cli.check_law", _OWN, "Check a law of your own, and print its certificate."),
    "runs": ("wristctl.cli.runs", _RESULTS, "Find, compare, verify and repeat runs."),
}
"""Name -> module (its `app` is a typer.Typer, imported when called), panel and line in the help."""

_EXAMPLES = r"""
Examples:

wristctl gen-data experiments/quick.yaml

wristctl train experiments/quick.yaml --data latest:gen-data

wristctl tune experiments/quick.yaml --set 'controllers=\[smc,pid]'

wristctl compare experiments/quick.yaml --network latest:train --tuned latest:tune

wristctl runs show latest:compare
"""


app = typer.Typer(cls=lazy_group(COMMANDS), epilog=_EXAMPLES, context_settings={"help_option_names": ["-h", "--help"]})


@app.callback(invoke_without_command=True)
def _wristctl(
    context: typer.Context,
    version: bool = typer.Option(False, "--version", help="Show the version and exit."),
) -> None:
    """Experiments with tendon-driven soft prosthetic wrists. Each command writes one run directory."""
    if version:
        typer.echo(f"wristctl {__version__}")
    elif context.invoked_subcommand is None:
        typer.echo(context.get_help())


def main() -> NoReturn:
    """Run the command line; errors are one line on stderr and an exit code, no traceback unless --debug."""
    gc.set_threshold(100_000, 50, 100)  # imports make many objects and no cycles: looking for them costs 0.15 s
    sys.unraisablehook = again
    with interrupts() as seen:
        try:
            code = get_command(app)(prog_name="wristctl", standalone_mode=False) or 0
        except UserError as error:
            code = _failed(str(error), error, error.exit_code)
        except typer.TyperException as error:
            command = getattr(getattr(error, "ctx", None), "command_path", "wristctl")
            code = _failed(f"{error.format_message()} - fix: {command} --help", error, error.exit_code)
        except (KeyboardInterrupt, typer.Abort):
            code = 130
        except SystemExit:  # completion ends so
            raise
        except BaseException as error:
            notes = getattr(error, "__notes__", ["run again with --debug for the traceback"])
            if seen.asked:
                code = 130
            elif refused := error_of_the_system(error):
                code = _failed(str(refused), error, refused.exit_code)
            else:
                code = _failed(f"bug in wristctl: {type(error).__name__}: {error} - {notes[-1]}", error, 1)
        signal.setitimer(signal.ITIMER_REAL, 0.0)  # what has ended need not be interrupted again
        gc.freeze()  # else the interpreter looks for cycles once more before it ends: 0.3 s
        sys.exit(code)


def _failed(message: str, error: BaseException, code: int) -> int:
    if "--debug" in sys.argv:
        traceback.print_exception(error)
    print(f"error: {printable(' '.join(message.split()))}", file=sys.stderr)
    return code
