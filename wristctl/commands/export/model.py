"""The wrist of a run as a model for another program."""

from pathlib import Path
from typing import Literal, NamedTuple

from wristctl.commands.export.urdf import urdf
from wristctl.config.loop import DirectionName
from wristctl.config.study import Study
from wristctl.errors import FILE, Argument, UserError
from wristctl.escape import printable
from wristctl.records import Run
from wristctl.records.files import write_text
from wristctl.records.lineage import input_run
from wristctl.simulation.planes import Asked, planes_of
from wristctl.wrist.directions import in_plane
from wristctl.wrist.hinge_chain import HingeChain, Spools, matlab, mjcf
from wristctl.wrist.tendon_layout import off_both_sides

# Programs, each with its file's usual name.
FORMATS = {"mujoco": "wrist.xml", "matlab": "wrist_chain.m", "urdf": "wrist.urdf"}


class Exported(NamedTuple):
    """Chain of a run's wrist that another program is to move."""

    segments: int = 4
    planes: int | None = None
    """None: as many as the run's loop, or its tendons, bend in."""
    direction: DirectionName | None = None
    """Whose bending plane, in one plane; None: ulnar."""
    motors: Literal["tensions", "spools"] = "tensions"


def study_of(run: Run) -> tuple[Study, str]:
    """The study of a run with the wrist and motors that it found, or else that its controller knew, and which wrist it
    is, in words."""
    from wristctl.commands.identified_wrist import found_in, with_found

    sources = [input_run(run, earlier) for earlier in run.manifest.inputs if earlier.role == "from_identified"]
    source = run if run.kind == "identify" else sources[-1] if sources else None
    if source is None:
        return run.config, f"the wrist of run {run.id}"
    return with_found(run.config, "simulate", found_in(source)), f"the wrist that run {source.id} identified"


def export_wrist(run: Run, program: str, file: Path | None, asked: Exported) -> Path:
    """Write the chain of a run's wrist for a program; where it was written. Raises UserError for a file in the way."""
    usual = FORMATS[program]
    path = file or Path(usual)
    if program == "matlab" and path.name != usual:
        raise UserError(
            f"MATLAB finds a function by its file's name, {usual}", str(path), f"--file {path.parent / usual}"
        )
    if program == "matlab" and asked.motors == "spools":
        raise UserError("the function for MATLAB takes tensions", Argument("motors", "spools"), "leave --motors out")
    if program == "urdf" and asked.motors == "spools":
        raise UserError("a URDF has no motors", Argument("motors", "spools"), "leave --motors out, or --to mujoco")
    if path.exists():
        raise UserError("a file is in the way", str(path), "remove it, or name another with --file")
    if program == "urdf" and asked.planes is None and asked.direction is None:
        asked = asked._replace(planes=2)  # a viewer shows a motion in one plane as well
    study, words = study_of(run)
    wrist, loop, planes = study.wrist, study.simulate.loop, _planes(run, study, asked)
    way = "in two planes" if planes == 2 else f"as {asked.direction or 'ulnar'} bends it"
    about = printable(f"{words}, {way}; result {run.result_hash[:12]}")  # a comment of one line
    seen = wrist if planes == 2 else in_plane(wrist, asked.direction or "ulnar")
    chain = HingeChain.of(seen, asked.segments, planes, loop.plant.model)
    spools = Spools.of(loop.actuator, wrist) if asked.motors == "spools" else None
    if program == "mujoco":
        text = mjcf(chain, about, spools)
    else:
        text = matlab(chain, about) if program == "matlab" else urdf(chain, wrist.range_deg, about)
    write_text(path, text, FILE)
    return path


def viewed_chain(run: Run) -> HingeChain:
    """The chain in two planes that `export-model --to urdf` writes of a run."""
    study, _ = study_of(run)
    return HingeChain.of(study.wrist, Exported().segments, 2, study.simulate.loop.plant.model)


def _planes(run: Run, study: Study, asked: Exported) -> int:
    """Planes of the chain. Raises UserError where a wrist's tendons are on no two sides of the one plane asked for."""
    one = asked.planes == 1 or (asked.planes is None and asked.direction is not None)
    if asked.planes == 2 and asked.direction is not None:
        raise UserError(
            "a direction is of one plane", Argument("direction", asked.direction), "--planes 1, or no --direction"
        )
    aside = off_both_sides(study.wrist) is not None
    if one and aside:
        key = Argument("planes", "1") if asked.planes == 1 else Argument("direction", asked.direction)
        raise UserError("these tendons bend the wrist in two planes", key, "leave it out: both planes are written")
    if asked.planes or one:
        return asked.planes or 1
    simulated = study.simulate
    loops = [Asked(simulated.loop, simulated.reference, simulated.direction)] if run.kind == "simulate" else []
    return 2 if aside else planes_of(study.wrist, loops)
