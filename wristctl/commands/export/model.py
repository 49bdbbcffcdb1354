"""The wrist of a run as a model for another program."""

from collections.abc import Callable
from pathlib import Path

from wristctl.config.loop import DirectionName
from wristctl.config.wrist import WristParameters
from wristctl.errors import FILE, UserError
from wristctl.escape import printable
from wristctl.records import Run
from wristctl.records.files import write_text
from wristctl.records.lineage import input_run
from wristctl.wrist.directions import in_plane
from wristctl.wrist.hinge_chain import HingeChain, matlab, mjcf

Writer = Callable[[HingeChain, str], str]
# Programs, each with its file's usual name and what writes it.
FORMATS: dict[str, tuple[str, Writer]] = {"mujoco": ("wrist.xml", mjcf), "matlab": ("wrist_chain.m", matlab)}


def wrist_of(run: Run) -> tuple[WristParameters, str]:
    """The wrist that a run found, or else that its controller knew, and which it is, in words."""
    from wristctl.identification.unknowns import with_identified

    source = run if run.kind == "identify" else identified_in(run)
    if source is None:
        return run.config.wrist, f"the wrist of run {run.id}"
    text = source.file("data/identified.yaml").read_text(encoding="utf-8")
    return with_identified(run.config, "simulate", text).wrist, f"the wrist that run {source.id} identified"


def identified_in(run: Run) -> Run | None:
    """The run that identified the wrist of a run; None where the study's own was taken."""
    sources = [input_run(run, earlier) for earlier in run.manifest.inputs if earlier.role == "from_identified"]
    return sources[-1] if sources else None


def export_wrist(run: Run, program: str, file: Path | None, segments: int, direction: DirectionName) -> Path:
    """Write the chain of a run's wrist for a program; where it was written. Raises UserError for a file in the way."""
    usual, writer = FORMATS[program]
    path = file or Path(usual)
    if program == "matlab" and path.name != usual:
        raise UserError(
            f"MATLAB finds a function by its file's name, {usual}", str(path), f"--file {path.parent / usual}"
        )
    if path.exists():
        raise UserError("a file is in the way", str(path), "remove it, or name another with --file")
    wrist, words = wrist_of(run)
    about = printable(f"{words}, as {direction} bends it; result {run.result_hash[:12]}")  # a comment of one line
    write_text(path, writer(HingeChain.of(in_plane(wrist, direction), segments), about), FILE)
    return path
