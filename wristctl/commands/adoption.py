"""Laws, references and optimisers from elsewhere in a study: loaded, tried, and known by their own names."""

import json
import logging
from collections.abc import Collection, Mapping
from typing import Any, NamedTuple, TypeVar

from pydantic import ValidationError

from wristctl.board.messages import AXES
from wristctl.commands.inputs_of_loops import judged_loops
from wristctl.config.choices import CONTROLLERS, OPTIMISERS, REFERENCES, RIGS, Choices
from wristctl.config.controller_row import BY_LOOP, Row
from wristctl.config.foreign import PLAIN, Foreign, is_reference
from wristctl.config.leaves import named_by, renamed_fields
from wristctl.config.loop import Loop
from wristctl.config.simulate import SimulateSettings
from wristctl.config.study import Study
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError, nearest, under
from wristctl.plugins.places import entry_point_names
from wristctl.study_files.error_messages import explained
from wristctl.study_files.resolved import names_read

log = logging.getLogger(__name__)

_Row = TypeVar("_Row", Row, SimulateSettings)


class Adopted(NamedTuple):
    """A study that calls what is from elsewhere by its own name, and where that is from."""

    study: Study
    foreign: tuple[Foreign, ...]


def adopted(study: Study, command: str) -> Adopted:
    """Load what the sections that a command reads name from elsewhere, and try each law on a few states.

    Raises UserError for what cannot be loaded or does not keep to what a law is, and for two things of one name.
    """
    read = names_read(command, study)
    names: dict[tuple[str, str], str] = {}
    settings = dict(study.controller_settings)
    owners: dict[tuple[str, str], str] = {}
    origins: list[Foreign] = []
    for table, name in named_by(study, read):
        loaded = _loaded(table, name)
        if loaded is None:
            continue
        entry, origin = loaded
        short_name = _entry(table, name, entry, origin, study)
        if owners.setdefault((table.what, short_name), origin.reference) != origin.reference:
            where = f"{owners[table.what, short_name]} and {origin.reference}"
            raise UserError(f"two {table.what}s are called '{short_name}'", where, "rename one of them")
        names[table.what, name] = short_name
        if table.what == CONTROLLERS.what and (declared := table[short_name].settings):
            section = short_name.removesuffix(PLAIN)
            settings[section] = {key: setting.default for key, setting in declared.items()} | settings.get(section, {})
        origins.append(origin)

    laws = [entry_name.removesuffix(PLAIN) for (kind, _), entry_name in names.items() if kind == CONTROLLERS.what]
    for name in study.controller_settings:
        if name not in laws and (meant := nearest(name, laws)):
            raise UserError(
                f"this study names no controller '{name}'", f"controller-settings.{name}", f"did you mean '{meant}'?"
            )

    def own_name(table: Choices[Any], name: str) -> str:
        return names.get((table.what, name), name)

    if "hw_run" in read:
        study = with_planes(with_rig(study))
    if "recommend" in read and study.recommend.rig is not None:
        from wristctl.commands.recommend.own_rig import with_facts

        study = with_facts(study)
    if not origins:
        return Adopted(study, ())
    called = renamed_fields(study, own_name, read)
    return Adopted(study.model_copy(update=called | {"controller_settings": settings}), tuple(origins))


def with_rig(study: Study) -> Study:
    """The study with the planes, tendons, motors, sensor and limits of its rig's facts, where nobody gave others.

    Raises UserError where the facts cannot be, or do not fit what was given.
    """
    name = study.hw_run.rig
    if name is None:
        if study.hw_run.actuator.level == "servo":
            raise UserError("the board leads its motors by rates", "hw-run.actuator.level", "level: tendon")
        return study
    from wristctl.trial.rig_settings import check_facts, settings_of, wrist_of

    facts = check_facts(getattr(RIGS[name], "facts", None), name)
    wrist = wrist_of(facts, study.wrist, name)
    return study.model_copy(update={"hw_run": settings_of(facts, study.hw_run, name), "wrist": wrist})


def with_planes(study: Study) -> Study:
    """The study with as many planes of its rig as the trials' reference, or a board's tendons, need, if nobody gave it.

    The reference is loaded for it. Raises UserError where it bends in more planes than a rig was given, and where other
    settings do not fit them.
    """
    settings, name = study.hw_run, study.hw_run.reference.kind
    if loaded := _loaded(REFERENCES, name):
        _entry(REFERENCES, name, *loaded, study)
    planes = REFERENCES[name].planes
    if settings.rig is None and "planes" not in settings.model_fields_set and wound_in_both_planes(study.wrist):
        return bending_in(study, 2)
    if not settings.planes_are_open:
        if planes > settings.planes:
            problem = f"{name} bends in two planes, and the rig in one"
            raise UserError(problem, "hw-run.planes", "planes: 2")
        return study
    return bending_in(study, planes)


def wound_in_both_planes(wrist: WristParameters) -> bool:
    """Whether a board winds the wrist's tendons, and they are not those of two sides: it bends in both planes then."""
    if wrist.tendons == "four":
        return False
    from wristctl.wrist.tendon_layout import off_both_sides, wound_by

    try:
        return off_both_sides(wrist) is not None and wound_by(wrist, AXES) is not None
    except UserError:  # which is said where its tendons are looked at
        return False


def bending_in(study: Study, planes: int) -> Study:
    """The study with a rig of so many planes. UserError where other settings do not fit them."""
    try:
        return study.model_copy(update={"hw_run": study.hw_run.bending_in(planes)})
    except ValidationError as error:
        raise explained(error, {}).at("hw-run") from error


def with_presets(study: Study, command: str, tell: bool = True, for_several: bool = False) -> Study:
    """The study with a controller's own preset where nobody chose gains for it and it has none of the default's name.

    That is its preset `default`, or else its first, for the commands of one loop, for `compare` and for `hw-run`. With
    `tell` the log says which. A preset that was chosen `for_several` controllers in turn holds for those that have it.
    Gains by loop are the preset of all loops, where these have the same one; of a sweep each point has its own.
    """
    if study.sweep:
        return study
    if command in ("simulate", "analyse") and "simulate" in names_read(command, study):
        row = _with_preset(_by_loop(study.simulate, [study.simulate.loop], tell), tell, for_several)
        return study.model_copy(update={"simulate": row})
    if command not in ("compare", "hw-run"):
        return study
    name = command.replace("-", "_")
    section = getattr(study, name)
    loops: Collection[Loop] = ()  # none for the trials of a rig
    if command == "compare":
        with under(command):
            loops = judged_loops(study, study.compare).values()
    rows = tuple(_with_preset(_by_loop(row, loops, tell), tell) for row in section.rows)
    return study.model_copy(update={name: section.model_copy(update={"rows": rows})})


def _by_loop(row: _Row, loops: Collection[Loop], tell: bool) -> _Row:
    """The row with the preset that it has on all loops, or behind a rig where there are none, if gains are by loop."""
    if row.gains != BY_LOOP:
        return row
    from wristctl.control.table import controller, preset_for

    law = controller(row.controller)
    presets = {preset_for(law, loop.is_exact) for loop in loops} or {preset_for(law, exact=False)}
    if len(presets) > 1:
        return row
    (preset,) = presets
    if tell and preset not in ("default", "hardware"):
        log.info("%s has no preset 'default' or 'hardware': '%s' is taken", row.controller, preset)
    return row.model_copy(update={"gains": preset})


def _with_preset(row: _Row, tell: bool, for_several: bool = False) -> _Row:
    is_preset = isinstance(row.gains, str) and not row.gains.startswith("tuned")
    is_open = "gains" not in row.model_fields_set or (for_several and is_preset)
    if not is_open or row.controller not in CONTROLLERS:
        return row
    presets = getattr(CONTROLLERS[row.controller], "presets", {})
    if not presets or row.gains in presets:
        return row
    preset = "default" if "default" in presets else next(iter(presets))
    if tell:
        log.info("%s has no gains '%s': its own preset '%s' is taken", row.controller, row.gains, preset)
    return row.model_copy(update={"gains": preset})


def with_places(study: Study, places: dict[str, str] | None = None) -> Study:
    """The study with what is from elsewhere by its place again, or by another (of the copy) where `places` has one."""

    def place(table: Choices[Any], name: str) -> str:
        origin = table.origin(name)
        reference = origin.reference if origin else name
        called = (places or {}).get(reference, reference)
        if (
            called != reference and table.what == REFERENCES.what
        ):  # by which its section is read, also while it is written
            table.lend(called, *table.loaded(reference))
        return called

    return study.model_copy(update=renamed_fields(study, place))


def sources_in(study: Study) -> dict[str, str]:
    """Hashes of the sources from elsewhere in an adopted study, by name and place."""
    sources: dict[str, str] = {}
    for table, name in named_by(study):
        if origin := table.origin(name):
            places = {f"{name}/{file.relative_to(origin.root)}": digest for file, digest in origin.files.items()}
            sources |= places
    return sources


def adoption(study: Study, command: str) -> dict[str, Any]:
    """Specification, as JSON has it, from which `adopt` loads the same laws in another process."""
    content = with_places(study).model_dump_json(by_alias=True, include=names_read(command, study))
    return {"study": json.loads(content), "command": command, "sources": sources_in(study)}


def adopt(spec: Mapping[str, Any]) -> None:
    """Load what a study names from elsewhere, in a process that has not. UserError where it is another text there."""
    study = Study.model_validate_json(json.dumps(spec["study"]))
    sources = sources_in(adopted(study, spec["command"]).study)
    changed = [name for name, digest in spec["sources"].items() if sources.get(name) != digest]
    if changed:
        raise UserError(f"{', '.join(changed)} is another text here than where the study began", "study")


def _loaded(table: Choices[Any], name: str) -> tuple[Any, Foreign] | None:
    """Object and origin of a name from elsewhere; None of a name that belongs to the table."""
    if not table.group:
        return None
    lent = table.origin(name)
    if is_reference(name) or (lent is None and not table.belongs(name)):
        return table.loaded(name)
    if lent is not None:
        return table.loaded(lent.reference)
    if name in entry_point_names(table.group):
        reason = f"'{name}' is a {table.what} of wristctl, and an installed package has one of that name too"
        raise UserError(reason, table.group, "uninstall that package, or let its author rename it")
    return None


def _entry(table: Choices[Any], name: str, entry: Any, origin: Foreign, study: Study) -> str:
    """The name of what was loaded, under which the table knows it now; UserError where it is no such thing."""
    if table.what == CONTROLLERS.what:
        from wristctl.control.vetting import law_of, vet

        entry = law_of(entry, origin.reference, study.controller_settings)
        entry_name = str(entry.name)
    elif table.what == OPTIMISERS.what:
        from wristctl.tuning.optimisers import Optimiser

        if not (isinstance(entry, type) and issubclass(entry, Optimiser)):
            raise UserError(f"{origin.attribute} is no Optimiser", str(origin.file), "derive it from Optimiser")
        entry_name = str(entry.name)
    else:
        from wristctl.simulation.reference import ReferenceKind
        from wristctl.trial.rig_settings import check_facts

        if table.what == RIGS.what:
            check_facts(getattr(entry, "facts", None), origin.reference)
        elif not isinstance(entry, ReferenceKind):
            raise UserError(f"{origin.attribute} is no ReferenceKind", str(origin.file), "make it a ReferenceKind")
        if not is_reference(name):
            table.lend(name, entry, origin)
        return name  # rigs and references have no name but their place, by which their sections are read
    if table.belongs(entry_name) or (entry_name in entry_point_names(table.group) and is_reference(name)):
        reason = f"there is a {table.what} '{entry_name}' already"
        raise UserError(reason, origin.reference, f'rename this one: name="my-{entry_name}"')
    if table.what == CONTROLLERS.what:
        vet(entry, origin.reference)
    table.lend(entry_name, entry, origin)
    return entry_name
