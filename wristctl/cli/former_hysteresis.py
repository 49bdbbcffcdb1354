"""`wristctl hysteresis`, the former name of a mode of `analyse` and of one of `identify`."""

import shlex
import sys
from collections.abc import Sequence
from pathlib import Path

import typer
from typer.main import get_command

from wristctl.config.former_names import KEYS, MEASURED, WITH_MEASURED, key_today
from wristctl.study_files.keys import field_at, keys_of
from wristctl.study_files.load import read_study

hysteresis_app = typer.Typer(add_completion=False)
_FILE, _SET = ("--config", "-c"), "--set"
_VALUED = ("--measured", "--drive", "--shape", "--columns", "--seed", "--out", "--label", _SET, *_FILE)


def words_today(typed: Sequence[str]) -> list[str]:
    """The words of today, behind `wristctl`, for those that were typed behind `wristctl hysteresis`.

    Raises UserError for a study file that cannot be read.
    """
    files, settings, others, log = list[str](), list[str](), list[str](), ""
    words = iter(typed)
    for word in words:
        name, equals, value = word.partition("=")
        if name not in _VALUED:
            (others if word.startswith("-") else files).append(word)
            continue
        value = value if equals else next(words, "")
        if name in _FILE:
            files.append(value)
        elif name in ("--measured", "--drive", "--shape", "--columns", _SET):
            settings.append(value if name == _SET else f"{name[2:]}={value}")
        else:
            others += [name, value]
    own = {*keys_of(field_at(MEASURED[:1])[0]), *(path[1] for path in KEYS if path[0] == MEASURED[0])}
    paths = [(tuple(text.partition("=")[0].split(".")), text.partition("=")[2]) for text in settings]
    paths = [((MEASURED[0], *path) if path[0] in own else path, value) for path, value in paths]
    log = next((value for path, value in reversed(paths) if path == MEASURED), "")
    measured = log or read_study([Path(file) for file in files], note=False)[0].identify.model == "hysteresis"
    begin = ["identify", *[log] * bool(log), "--model", "hysteresis"] if measured else ["analyse", "--of", "hysteresis"]
    begin += [word for file in files for word in ("--config", file)]
    for path, value in paths:
        if path != MEASURED:
            today = key_today(path, KEYS | WITH_MEASURED if measured else KEYS)
            begin += [_SET, f"{'.'.join(map(str, today))}={value}"]
    return [*begin, *others]


@hysteresis_app.command(
    add_help_option=False, context_settings={"ignore_unknown_options": True, "allow_extra_args": True}
)
def hysteresis(context: typer.Context) -> None:
    """Do what was meant by its name of today, and say that."""
    from wristctl.cli.app import app

    words = words_today(context.args)
    typer.echo(f"`wristctl hysteresis` is now `{shlex.join(['wristctl', *words])}`", err=True)
    sys.argv[1:] = words
    raise typer.Exit(get_command(app)(words, prog_name="wristctl", standalone_mode=False) or 0)
