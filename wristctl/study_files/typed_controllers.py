"""Controllers that are typed among study files: `wristctl compare pid-ff adrc/hardware my.py:LAW mywrist.yaml`."""

import ast
import logging
from collections.abc import Container, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from wristctl.config.choices import CONTROLLERS
from wristctl.config.controller_row import BY_LOOP, label_of
from wristctl.config.foreign import is_reference
from wristctl.errors import Call, Phrase, Setting, UserError, nearest, plain
from wristctl.plugins.places import placed
from wristctl.study_files.shipped import shipped_names, studies_beside, study_file
from wristctl.study_files.short_rows import forget, row_typed
from wristctl.study_files.strict_yaml import KeyPath

# Commands among whose study files controllers may be typed.
TAKE_CONTROLLERS = ("compare", "hw-run", "tune", "recommend", "study")
# Those of them that search the gains of every controller.
_SEARCHING = ("tune", "recommend", "study")
STUDIES = (".yaml", ".yml")
"""Ends of the names of study files."""
# Controllers of a study that a note names.
_NAMED = 5
log = logging.getLogger(__name__)


class Typed(NamedTuple):
    """Arguments of a command: controllers as NAME, NAME/GAINS or file.py:NAME, and study files, each in its order."""

    controllers: list[str]
    files: list[Path]


def parted(arguments: Sequence[str], command: str) -> Typed:
    """Controllers and study files among the arguments of a command that takes both; of another all are files.

    What ends in .yaml, or is the name of an experiment, is a study; a controller's name, NAME/GAINS or file.py:NAME is
    a controller. Raises UserError for what is both, with both spellings, and for what is neither, with the nearest.
    """
    if command not in TAKE_CONTROLLERS:
        return Typed([], [Path(argument) for argument in arguments])
    controllers = [argument for argument in arguments if _is_controller(argument)]
    return Typed(controllers, [Path(argument) for argument in arguments if argument not in controllers])


def names_controller(argument: str) -> bool:
    """Whether an argument has the form, or the name, of a controller: NAME, NAME/GAINS or file.py:NAME."""
    name = row_typed(argument)["controller"]
    return is_reference(name) or name in CONTROLLERS or name in CONTROLLERS.made


def _is_controller(argument: str) -> bool:
    if argument.endswith(STUDIES):
        return False
    named, study = names_controller(argument), study_file(Path(argument))
    if named and study is not None and not study.is_dir():
        raise UserError(f"'{argument}' is a controller and a study", str(study), _both(argument, study))
    if named or (study is not None and study.suffix != ".py"):
        return named
    if argument.endswith(".py"):
        raise UserError(f"{argument} should name its controller", argument, named_in(Path(argument)))
    raise UserError(f"'{argument}' is neither a controller nor a study file", "", _neither(argument))


def _both(argument: str, study: Path) -> Phrase:
    """The spelling of the study, and that of the controller."""
    as_study = f"{argument}.yaml" if study.suffix in STUDIES else f"./{argument}"
    row = row_typed(argument)
    if row["gains"] == BY_LOOP:
        return f"{as_study} for the study, {argument}/default or another preset for the controller"
    return (f"{as_study} for the study, ", Setting(f"controllers=[{argument}]", quoted=True), " for the controller")


def _neither(argument: str) -> Phrase:
    """What may have been meant, and where all names are."""
    _, stroke, gains = argument.partition("/")
    studies = studies_beside(Path(argument))
    names = [*CONTROLLERS.known(), *shipped_names(), *studies]
    names += [f"{name}/{gains}" for name in CONTROLLERS.known() if stroke]
    best = argument + ".yaml" if argument + ".yaml" in studies else nearest(argument, names)
    if own := _own_file(argument):
        best = named_in(own)
    every: Phrase = ("controllers: `", Call("list controllers"), "`; a study file ends in .yaml")
    return (f"did you mean '{best}'? ", every) if best else every


def _own_file(argument: str) -> Path | None:
    """The Python file in the folder of an argument that has its name: my_pd.py of my-pd; None without one."""
    beside = sorted(Path(argument).parent.glob("*.py"))
    return next((file for file in beside if plain(file.stem) == plain(Path(argument).name)), None)


def named_in(file: Path) -> str:
    """FILE:NAME of the first controller that a Python file makes, which is read and not run; else of NAME itself."""
    try:
        statements = ast.parse(file.read_bytes()).body
    except (OSError, SyntaxError, ValueError):
        statements = []
    for statement in statements:
        match statement:
            case ast.Assign(targets=[ast.Name(id=name)], value=ast.Call(func=ast.Name(id="Controller"))):
                return f"{file}:{name}"
    return f"{file}:NAME"


def put_in(
    data: dict[str, Any], origins: dict[KeyPath, Phrase], controllers: Sequence[str], command: str, tune: bool
) -> None:
    """Put typed controllers in place of those of a command's section.

    With `tune` a comparison searches gains for those typed by name alone, with the budget of its section if it has one;
    without, of a search in the section only what typed `NAME/tuned` asks for stays. Raises UserError where a controller
    is typed twice, or with gains that the command would search, or with an option that says the same.
    """
    if not controllers:
        if tune:
            fix = "wristctl compare pid-ff adrc --tune"
            raise UserError("--tune is for controllers that are typed by name, and none is", "--tune", fix)
        return
    rows = {argument: row_typed(argument) for argument in controllers}
    if twice := [argument for argument in controllers if controllers.count(argument) > 1]:
        raise UserError(f"{twice[0]} is typed twice", twice[0], "each controller with its gains once")
    section = data.setdefault(command, {})
    if not isinstance(section, dict):  # which the validation says
        return
    if command in _SEARCHING:
        names = [argument for argument in controllers if rows[argument]["gains"] == BY_LOOP]
        fixed = [argument for argument in controllers if argument not in names]
        if fixed and (command != "study" or not names):
            name = rows[fixed[0]]["controller"]
            raise UserError(f"{command} searches the gains of a controller itself", fixed[0], f"the name alone: {name}")
        _replace(section, origins, (command, "controllers"), names, [placed(name, None) for name in names])
        if command == "study":
            presets = [placed(rows[argument], None) for argument in fixed]
            _replace(section, origins, (command, "presets"), fixed, presets)
            labels = {*(f"{name}/tuned" for name in names), *(label_of(**rows[argument]) for argument in fixed)}
            _keep_terms(section, origins, labels)
        return
    if command == "hw-run":
        _refuse_beside(origins, rows)
        section.pop("controller", None)
    chosen = {argument: _tuned(row) if tune else row for argument, row in rows.items()}
    _replace(section, origins, (command, "controllers"), controllers, [placed(row, None) for row in chosen.values()])
    if command == "compare":
        _settle_tuning(section, origins, chosen.values(), tune)


def _keep_terms(section: dict[str, Any], origins: dict[KeyPath, Phrase], labels: Container[str]) -> None:
    """Leave of a study's questions those that are of these rows alone."""
    terms = section.get("terms")
    if not isinstance(terms, dict):
        return
    for question in [
        name for name, pair in terms.items() if isinstance(pair, tuple) and not all(p in labels for p in pair)
    ]:
        del terms[question]
        forget(origins, ("study", "terms", question))


def _refuse_beside(origins: Mapping[KeyPath, Phrase], rows: Mapping[str, Mapping[str, str]]) -> None:
    """UserError where --controller stands beside typed controllers, or --gains beside gains that are typed."""
    given = [key for key in ("controller", "gains") if isinstance(origins.get(("hw-run", key)), Setting)]
    with_gains = [argument for argument, row in rows.items() if row["gains"] != BY_LOOP]
    for key in given:
        if key == "controller" or with_gains:
            typed = with_gains[0] if key == "gains" else next(iter(rows))
            raise UserError(f"{typed} is typed, and --{key} is given too", typed, f"leave out --{key}")


def _tuned(row: dict[str, str]) -> dict[str, str]:
    """The row with gains to search, where it is typed by name alone and its controller is known to have gains."""
    name = row["controller"]
    without = CONTROLLERS.belongs(name) and not CONTROLLERS[name].gains
    return row if row["gains"] != BY_LOOP or without else row | {"gains": "tuned"}


def _settle_tuning(
    section: dict[str, Any], origins: dict[KeyPath, Phrase], rows: Iterable[Mapping[str, str]], tune: bool
) -> None:
    """Let the search of a comparison be for the typed controllers with tuned gains alone."""
    place = ("compare", "tuning")
    names = [placed(row["controller"], None) for row in rows if row["gains"] == "tuned"]
    search = section.get("tuning")
    if not names or not (tune or isinstance(search, dict)):
        if told := [given for key, given in origins.items() if key[:2] == place and isinstance(given, Setting)]:
            fix = "give a controller by its name alone" if tune else "add --tune"
            raise UserError("no gains are searched here, of which this is a setting", told[0].text, fix)
        section.pop("tuning", None)
        forget(origins, place)
        return
    forget(origins, (*place, "controllers"))
    section["tuning"] = (search if isinstance(search, dict) else {}) | {"controllers": tuple(names)}
    origins.setdefault(place, "--tune")
    origins[*place, "controllers"] = "--tune" if tune else ", ".join(names)


def _labels(entries: Iterable[Any]) -> dict[str, str]:
    """Labels of rows, or of names alone, with those to show, in which own code has no folder."""
    labels = {}
    for entry in entries:
        row = entry if isinstance(entry, dict) else {"controller": entry, "gains": BY_LOOP}
        name, gains = str(row.get("controller", "")), row.get("gains", "default")
        gains = gains if isinstance(gains, str) else "given"
        labels[label_of(name, gains)] = label_of(Path(name).name, gains)
    return labels


def _replace(
    section: dict[str, Any],
    origins: dict[KeyPath, Phrase],
    place: KeyPath,
    arguments: Sequence[str],
    entries: Sequence[Any],
) -> None:
    """Put entries of a list in place of what a section had, each with the argument that it is from.

    A note names what of the section is left out.
    """
    listed, new = section.get(str(place[-1])), _labels(entries)
    old = _labels(listed) if isinstance(listed, tuple) else {}
    if left := [old[label] for label in old if label not in new]:
        more = f" and {len(left) - _NAMED} more" * (len(left) > _NAMED)
        log.warning("left out of the study: %s%s; what is typed takes the place", ", ".join(left[:_NAMED]), more)
    forget(origins, place)
    section[str(place[-1])] = tuple(entries)
    origins.setdefault(place[:1], " ".join(arguments))
    origins[place] = " ".join(arguments)
    origins.update({(*place, number): argument for number, argument in enumerate(arguments)})
