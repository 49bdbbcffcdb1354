"""A tuned controller for a firmware of one's own: C99 and NumPy, with test vectors of a simulated loop."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from wristctl.config.choices import CONTROLLERS
from wristctl.config.plant import TrueActuator, TrueSensor
from wristctl.config.simulate import SimulateSettings
from wristctl.config.study import Study
from wristctl.errors import FILE, UserError, meant, writing
from wristctl.escape import printable
from wristctl.records import Run, require
from wristctl.records.files import write_text
from wristctl.records.find import a_run
from wristctl.records.lineage import input_run
from wristctl.study_files.load import load_study
from wristctl.study_files.shipped import study_file
from wristctl.study_files.short_rows import row_typed
from wristctl.study_files.typed_controllers import STUDIES, names_controller
from wristctl.version import __version__

if TYPE_CHECKING:
    from wristctl.control.law import Controller

# Most ticks of the test vectors, and how far an exported law may be from its loop.
_MOST_TICKS, MOST_DIFFERENCE = 1000, 1e-9
_RECOMMENDED, _KEPT = "data/recommended.yaml", "data/controllers"

# Meaning of constants, by how their names begin or end.
_MEANINGS = {
    "PERIOD": "control period [s]", "LEAD": "1 where spools move at the speed of the reference, else 0",
    "LEAST_PULL_": "least pull of a place [N]", "GREATEST_PULL_": "greatest pull of a place [N]",
    "TENDONS_AT_": "tendons at a place", "STIFFNESS_": "of all tendons of a place [N/m]",
    "TENDON_Y": "place of a tendon toward ulnar [m]", "TENDON_Z": "place of a tendon toward flexion [m]",
    "TENDON_ALONG": "share of the wrist that a tendon runs along",
    "MOTOR_LAG": "time constant of the motors [s]", "MOTOR_STIFFNESS": "stiffness of one tendon [N/m]",
    "MOTOR_STEP": "length of a microstep [m]", "MOTOR_SPEED": "largest speed of a spool [m/s]",
    "MOTOR_ACCELERATION": "largest acceleration of a spool by its host [m/s^2]",
    "BOARD_LAG": "time constant of the motors that their host reckons with [s]",
    "BOARD_STEP": "resolution of targets that it reckons with [m]",
    "BOARD_SPEED": "largest speed of a spool that it reckons with [m/s]",
    "_RAMP": "change of a spool's rate by its board [m/s^2]", "_DELAY": "from a tick until its rate takes effect [s]",
    "_UPDATE": "between two changes of a rate by the board [s]",
    "_HAND_MASS": "mass of the hand [kg]", "_MASS": "moving mass of the wrist [kg]",
    "_HAND_OFFSET": "hand's centre of mass beyond the last disc [m]", "_LENGTH": "length of the wrist [m]",
    "_TENDON_OFFSET": "distance of the tendons from the middle line [m]", "_SPANS": "gaps between discs",
    "_GRAVITY_X": "gravity along the straight wrist [m/s^2]", "_GRAVITY_Y": "gravity across it [m/s^2]",
    "_GRAVITY_Z": "gravity across it, toward flexion [m/s^2]",
    "_STIFFNESS": "bending stiffness [N m/rad]", "_DAMPING": "bending damping [N m s/rad]",
    "SPACE_STIFFNESS": "bending stiffness, a symmetric matrix [N m/rad]",
    "SPACE_DAMPING": "bending damping, a symmetric matrix [N m s/rad]",
    "_FORCE_X": "force on the tip along the straight wrist [N]", "_FORCE_Y": "force on the tip toward ulnar [N]",
    "_FORCE_Z": "force on the tip toward flexion [N]",
}  # fmt: skip


def export_law(words: Sequence[str], overrides: Sequence[str], folder: Path | None, out: Path) -> list[Path]:
    """Write the files of a controller; the paths, the header first.

    `words` are a controller (NAME, NAME/GAINS or file.py:NAME) with study files, or a run in the folder `out`, with a
    controller where the run has several. Raises UserError for a law that has no such form, and for a file in the way.
    """
    from wristctl.commands.export.law_in_c import c_files
    from wristctl.commands.export.law_in_numpy import largest_difference, numpy_module
    from wristctl.commands.export.law_programs import programs_of
    from wristctl.commands.export.law_readme import readme
    from wristctl.commands.export.law_vectors import loop_of, vectors_of
    from wristctl.control.table import controller, gains_of

    study, source = _chosen(words, overrides, out)
    chosen = study.simulate
    law = controller(chosen.controller)
    gains = gains_of(law, chosen.gains, None, chosen.loop)
    named = ", ".join(f"{name} = {value:.6g}" for name, value in zip(law.gains, gains, strict=True))
    about = printable(f"{law.name}{f' with {named}' * bool(named)}, {source}; written by wristctl {__version__}.")
    batch = loop_of(_as_believed(study), law, np.array([gains]), _MOST_TICKS)
    programs = programs_of(law, batch)
    vectors, module = vectors_of(programs, batch), numpy_module(programs, about)
    if not (difference := largest_difference(module, vectors)) <= MOST_DIFFERENCE:
        problem = f"what would be written of {law.name} differs from the loop by {difference:.2g}"
        reason = "torques far beyond the tendons' reach, whose rounding decides"
        raise UserError(f"{problem}: {reason}", "gains", "other gains, or a loop in which they hold the wrist")
    texts = c_files(programs, about) | {
        f"{programs.name}.py": module,
        "vectors.csv": vectors.text,
        "README.md": readme(programs, vectors, about, _meanings(law, programs.constants)),
    }
    place = folder or Path(programs.name)
    paths = [place / name for name in texts]
    for path in paths:
        if path.exists():
            raise UserError("a file is in the way", str(path), "remove it, or name another folder with --folder")
    with writing(place, FILE):
        place.mkdir(parents=True, exist_ok=True)
    for path, text in zip(paths, texts.values(), strict=True):
        write_text(path, text, FILE)
    return paths


def _chosen(words: Sequence[str], overrides: Sequence[str], out: Path) -> tuple[Study, str]:
    """The study whose `simulate` section has loop, controller and gains, and where they are from, in words."""
    files = [Path(word) for word in words if _is_study(word)]
    others = [word for word in words if not _is_study(word)]
    refs = [word for word in others if not names_controller(word)]
    runs = [ref for ref in refs if ref.startswith("latest:") or Path(ref).is_dir() or any(out.glob(f"{ref}*"))]
    if refs and not runs:
        listings = "`wristctl list controllers` and `wristctl runs ls` show what there is"
        fix = f"{meant(refs[0], CONTROLLERS.known())}; {listings}"
        raise UserError(f"'{refs[0]}' is no controller, no study file and no run in {out}", refs[0], fix)
    controllers = [word for word in others if word not in runs]
    if len(controllers) > 1 or len(runs) > 1 or (runs and files):
        raise UserError(
            "one controller is exported at a time", " ".join(words), "a controller with study files, or a run"
        )
    if runs:
        return _of_run(require(runs[0], None, out), controllers[0] if controllers else None, overrides)
    typed = [f"{key}={value}" for word in controllers for key, value in row_typed(word).items()]
    study = load_study(files, [*(f"simulate.{each}" for each in typed), *overrides], "simulate")
    return study, f"of {', '.join(map(str, files))}" if files else "of the default wrist"


def _is_study(word: str) -> bool:
    study = study_file(Path(word))
    return word.endswith(STUDIES) or (not names_controller(word) and study is not None and study.is_file())


def _of_run(run: Run, controller: str | None, overrides: Sequence[str]) -> tuple[Study, str]:
    about = f"of run {run.id}"
    if overrides:
        raise UserError("a run is exported as it was", f"--set {overrides[0]}", "leave it out, or name study files")
    if run.kind == "simulate" or (run.kind == "analyse" and run.config.analyse.of == "loop"):
        return _with_what_it_had(run, run.config), about
    if run.kind == "hw-run":
        return _of_trials(run, controller), about
    kept = {file.stem: file for file in sorted((run.path / _KEPT).glob("*.yaml"))}
    recommended = run.path / _RECOMMENDED
    if controller is None and recommended.is_file():
        return load_study([recommended]), about
    if controller is None and len(kept) == 1:
        return load_study(list(kept.values())), about
    if not kept:
        raise UserError(
            f"{a_run(run.kind)} has no tuned controller", str(run.path), "a run of tune, recommend or hw-run"
        )
    names = f"one of {', '.join(kept)}: `wristctl export-law {run.id} {next(iter(kept))}`"
    if controller is None:
        raise UserError(f"run {run.id} has {len(kept)} controllers", str(run.path / _KEPT), names)
    if controller not in kept:
        raise UserError(f"run {run.id} has no {controller}", str(run.path / _KEPT), names)
    return load_study([kept[controller]]), about


def _with_what_it_had(run: Run, study: Study) -> Study:
    """The study of a run with the wrist and the gains of the runs that it took them from."""
    from wristctl.commands.identified_wrist import found_in, with_found
    from wristctl.control.table import controller, read_gains

    for earlier in run.manifest.inputs:
        if earlier.role == "from_identified":
            study = with_found(study, run.kind, found_in(input_run(run, earlier)))
    chosen = study.simulate
    if chosen.gains == "tuned":
        (source,) = (input_run(run, earlier) for earlier in run.manifest.inputs if earlier.role == "tuned")
        gains = read_gains(source.file("data/gains.json"))[controller(chosen.controller).name]
        study = study.model_copy(update={"simulate": chosen.model_copy(update={"gains": dict(gains)})})
    return study


def _of_trials(run: Run, controller: str | None) -> Study:
    study = _with_what_it_had(run, run.config)
    settings = study.hw_run
    rows = [row for row in settings.rows if controller in (None, row.controller, row.label)]
    if len(rows) != 1:
        names = ", ".join(row.label for row in settings.rows)
        raise UserError(f"run {run.id} tried {names}", str(run.path), f"name one after {run.id}")
    simulated = SimulateSettings(
        controller=rows[0].controller, gains=rows[0].gains, loop=settings.known_loop, reference=settings.reference,
        horizon=settings.horizon,
    )  # fmt: skip
    return study.model_copy(update={"simulate": simulated})


def _as_believed(study: Study) -> Study:
    """The study with motors and camera as its controller believes them: of what is true beside, a firmware knows
    nothing. It bends in the planes that it had."""
    from wristctl.simulation.planes import Asked, planes_of
    from wristctl.simulation.reference import by_angles

    chosen = study.simulate
    planes = planes_of(study.wrist, [Asked(chosen.loop, chosen.reference, chosen.direction)])
    plant = chosen.loop.plant.model_copy(update={"actuator": TrueActuator(), "sensor": TrueSensor()})
    loop = chosen.loop.model_copy(update={"plant": plant, "planes": planes})
    update = {"loop": loop, "reference": by_angles(chosen.reference)}
    return study.model_copy(update={"simulate": chosen.model_copy(update=update)})


def _meanings(law: Controller, constants: Mapping[str, float]) -> dict[str, str]:
    from wristctl.commands.export.law_programs import identifier

    gains = {
        f"GAIN_{identifier(name)}": f"{gain.meaning}{f' [{gain.unit}]' * bool(gain.unit)}"
        for name, gain in law.gains.items()
    }
    return {
        name: gains.get(name)
        or next((words for part, words in _MEANINGS.items() if name.startswith(part) or name.endswith(part)), "")
        for name in constants
    }
