"""`wristctl`: the program, and the way every command ends."""

import gc
import os
import signal
import sys
import traceback
from collections.abc import Mapping
from importlib import import_module
from typing import Any, NoReturn

import typer
from typer.core import TyperCommand, TyperGroup, TyperOption
from typer.main import get_command

from wristctl.cli.commands import COMMANDS, PAPER, Entry
from wristctl.cli.json_output import Interrupted, print_error
from wristctl.cli.matplotlib_defaults import use_defaults
from wristctl.cli.options import everything
from wristctl.errors import UserError, error_of_the_system
from wristctl.escape import printable
from wristctl.interrupt import again, interrupts
from wristctl.version import __version__


def typer_of(entry: Entry) -> typer.Typer:
    """The command of an entry, imported now."""
    module, _, name = entry.place.partition(":")
    target = getattr(import_module(module), name)
    if isinstance(target, typer.Typer):
        return target
    from wristctl.cli.command import study_command

    return study_command(target, entry)


class _OnCall(TyperCommand):
    """A command known by its line in the help; its module is imported when it is called."""

    def __init__(self, name: str, entry: Entry) -> None:
        super().__init__(name, help=entry.line, rich_help_panel=entry.panel, hidden=entry.hidden)
        self.entry = entry

    def make_context(self, info_name: str | None, args: list[str], parent: Any = None, **extra: Any) -> Any:
        real = get_command(typer_of(self.entry))
        real.name = self.name
        return real.make_context(info_name, args, parent=parent, **extra)


def lazy_group(commands: Mapping[str, Entry]) -> type[TyperGroup]:
    """A group of these commands, for `typer.Typer(cls=...)`."""

    class Commands(TyperGroup):
        def __init__(self, **attributes: Any) -> None:
            super().__init__(**attributes)
            for name, entry in commands.items():
                self.add_command(_OnCall(name, entry))

        def format_help(self, ctx: Any, formatter: Any) -> None:
            """The commands; with --all the group's options too."""
            for option in self.get_params(ctx):
                if isinstance(option, TyperOption):
                    option.hidden = not everything()
            super().format_help(ctx, formatter)

    return Commands


_EXAMPLES = """Examples:
wristctl init my-wrist
wristctl simulate --controller smc --gains exchanged
wristctl compare pid-ff adrc ct-dob"""


def lazy_app(commands: Mapping[str, Entry], help_: str) -> typer.Typer:
    """A command that holds these ones, each imported when it is called."""
    holder = typer.Typer(cls=lazy_group(commands), help=help_, no_args_is_help=True, add_completion=False)
    holder.callback()(lambda: None)
    return holder


paper = lazy_app(PAPER, "Check the paper's claims one by one.")
app = typer.Typer(cls=lazy_group(COMMANDS), epilog=_EXAMPLES, context_settings={"help_option_names": ["-h", "--help"]})


@app.callback(invoke_without_command=True)
def _wristctl(
    context: typer.Context,
    version: bool = typer.Option(False, "--version", help="Show the version and exit."),
    all_: bool = typer.Option(False, "--all", help="Beside --help: show these options too."),
) -> None:
    """Experiments with tendon-driven soft prosthetic wrists. Each command writes one run directory."""
    if version:
        typer.echo(f"wristctl {__version__}")
    elif context.invoked_subcommand is None:
        typer.echo(context.get_help())


def main() -> NoReturn:
    """Run the command line; errors are one line on stderr and an exit code, no traceback unless --debug.

    With --json an error is an object on stdout too.
    """
    gc.set_threshold(100_000, 50, 100)  # imports make many objects and no cycles: looking for them costs 0.15 s
    sys.unraisablehook = again
    use_defaults()
    with interrupts() as interrupt:
        try:
            code = get_command(app)(prog_name="wristctl", standalone_mode=False) or 0
            code = _interrupted() if code == 130 else code  # as which typer gives Ctrl-C
            sys.stdout.flush()
        except BrokenPipeError:
            code = _unread()
        except Interrupted as error:
            code = _interrupted(error)
        except UserError as error:
            code = _failed(error, error)
        except typer.TyperException as error:
            command = getattr(getattr(error, "ctx", None), "command_path", "wristctl")
            what = error.format_message().replace("Value error, ", "")  # pydantic's, in typer's own words
            told = UserError(what, command, f"{command} --help", error.exit_code)
            code = _failed(error, told, f"{told.what} - fix: {told.fix}")
        except (KeyboardInterrupt, typer.Abort):
            code = _interrupted()
        except SystemExit as ended:  # completion ends so, and typer where it meets a closed pipe
            if not isinstance(ended.__context__, BrokenPipeError):
                raise
            code = _unread()
        except BaseException as error:
            notes = getattr(error, "__notes__", ["run again with --debug for the traceback"])
            if interrupt.asked:
                code = _interrupted()
            elif refused := error_of_the_system(error):
                code = _failed(error, refused)
            else:
                frames = traceback.extract_tb(error.__traceback__)[-1:]
                where = "".join(f"{frame.filename}:{frame.lineno}" for frame in frames)
                bug = UserError(f"bug in wristctl: {type(error).__name__}: {error}", where, notes[-1], 1)
                code = _failed(error, bug, f"{bug.what} - {bug.fix}")
        signal.setitimer(signal.ITIMER_REAL, 0.0)  # what has ended need not be interrupted again
        gc.freeze()  # else the interpreter looks for cycles once more before it ends: 0.3 s
        sys.exit(code)


def _unread() -> int:
    """Exit code where whoever read the output has left; what is still in its buffer goes nowhere."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    return 128 + signal.SIGPIPE


def _failed(error: BaseException, told: UserError, line: str = "") -> int:
    """Print what a person, or with --json a program, is told of an error; the exit code."""
    if "--debug" in sys.argv:
        traceback.print_exception(error)
    print(f"error: {printable(' '.join((line or str(told)).split()))}", file=sys.stderr)
    print_error(told)
    return told.exit_code


def _interrupted(error: Interrupted | None = None) -> int:
    print_error(error or Interrupted())
    return 130
