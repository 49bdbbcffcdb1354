"""One closed loop, with pictures."""

from __future__ import annotations

import math
import shlex
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

from wristctl.commands.answer import Answer
from wristctl.commands.inputs import EarlierRun, Inputs
from wristctl.commands.inputs_of_loops import (
    check_inverses,
    check_reach,
    check_row,
    identified,
    inverses_of,
    network_for,
    tuned_gains,
    wrist_identified,
)
from wristctl.commands.kept_studies import asked_for, keep_study
from wristctl.commands.loop_warnings import (
    OutOfReach,
    asked_by,
    warn_if_coarse,
    warn_if_it_buckles,
    warn_if_outside,
    warn_of_one_plane,
    warn_out_of_reach,
    warn_outside_conditions,
)
from wristctl.commands.procedure import Procedure
from wristctl.commands.session import Session
from wristctl.commands.simulate.in_two_planes import (
    asked_for_by,
    check_two_planes,
    in_two_planes,
    simulate_in_two_planes,
)
from wristctl.commands.simulate.results import SimulatedLoop, metrics_table, trajectory_table
from wristctl.commands.sweep.command import sweepable
from wristctl.config.study import Study
from wristctl.errors import under

if TYPE_CHECKING:
    from wristctl.config.wrist import WristParameters
    from wristctl.simulation.closed_loop import Size
    from wristctl.simulation.repetitions import Repeated
    from wristctl.wrist.kinematics import Inverse


@dataclass(frozen=True, repr=False, eq=False)
class Simulated(SimulatedLoop):
    """One closed loop in one plane, as often as the study says, and whether the wrist ever left its range."""

    @property
    def answer(self) -> Answer:
        """The scenario and how it ends, in a few lines; why a loop does not arrive, and what may help."""
        from wristctl.commands.simulate.answer import answer

        return answer(self.simulated or self.study, self.repeated, self.short_of, self.advice, self.wrist)


def plan(study: Study, inputs: Inputs) -> str:
    """Check the controller and its gains."""
    from wristctl.simulation.closed_loop import check_size

    settings, known = study.simulate, identified(study, "simulate", inputs)
    two = in_two_planes(known)
    with under("simulate"):
        check_row(settings, tuned_gains(inputs), inputs.runs().get("tuned"))
        if two:
            check_two_planes(known)
        else:
            check_reach([settings.reference], known.wrist, "reference")
        check_inverses(inverses_of([settings.reference]), inputs)
        check_size(size(study), planes=2 if two else 1)
    return _in_words(study, " in two planes" * two, known.wrist)


def _in_words(study: Study, where: str, wrist: WristParameters) -> str:
    """The rollouts of a plan, and what of their world is not as believed."""
    from wristctl.commands.truth_table import truth_told

    times, settings = size(study).rollouts, study.simulate
    truth = truth_told(wrist, {"simulate": settings.loop})
    return f"{'one rollout' if times == 1 else f'{times} rollouts'} of {settings.horizon:g} s{where}{truth}"


def size(study: Study) -> Size:
    """One rollout, or as many as there are repetitions of what is drawn, and as the controller learns from."""
    from wristctl.control.table import controller
    from wristctl.simulation.closed_loop import Size
    from wristctl.simulation.worlds import is_random

    chosen = study.simulate
    repetitions = chosen.repetitions if is_random(chosen.loop) else 1
    return Size([chosen.loop], chosen.horizon, repetitions * controller(chosen.controller).learning)


def simulate(session: Session) -> SimulatedLoop:
    """Simulate one closed loop and draw it, in one plane, or in two where reference or tendons bend in two."""
    if in_two_planes(identified(session.study, "simulate", session.inputs)):
        return simulate_in_two_planes(session)
    from wristctl.commands.simulate.figures import consistency, sliding
    from wristctl.commands.truth_table import truth_heading, truth_tables
    from wristctl.control.table import controller, gains_of
    from wristctl.plotting.loop_figures import angles, error_sizes, errors, one_motion, tensions
    from wristctl.plotting.wrist_drawing import stroboscope
    from wristctl.simulation.closed_loop import scenario_of
    from wristctl.simulation.closed_loop import simulate as run_simulation
    from wristctl.simulation.metrics import METRICS
    from wristctl.simulation.worlds import Draws

    study, findings = identified(session.study, "simulate", session.inputs), session.findings
    settings, wrist = study.simulate, study.wrist
    warn_if_it_buckles(findings, wrist, [settings.loop])
    warn_if_coarse([settings.loop])
    warn_of_one_plane(wrist, asked_for_by(study))
    warn_outside_conditions([settings], [settings.loop])
    beyond = warn_out_of_reach(findings, wrist, asked_by(study, settings))
    network = network_for(session.inputs, wrist, [settings.loop])
    with session.progress("compiling and simulating the loop"):
        repeated = run_simulation(study, network, tuned_gains(session.inputs))
    findings.headline("rmse", "settling", "steady_state", "overshoot", "chattering", "peak_tension")
    scenario = scenario_of(settings.reference, settings.direction)
    findings.note_streams(Draws(study.seed).names([settings.loop], [scenario]))
    course, failed = repeated.first.trajectory, bool(repeated.failed.any())
    warn_if_outside(course.outside)
    trajectory_table(findings, "trajectory", course)
    title = ", ".join(part for part in (course.label, repeated.fate) if part)
    tables = [metrics_table(findings, title, METRICS, repeated), *truth_tables(wrist, {"simulate": settings.loop})]
    with session.drawing():
        world = truth_heading(wrist, settings.loop)
        caption = "Bending angle, error and tensions over time; what changes faster is a band about its mean"
        findings.figure("course", one_motion, course, heading=world, caption=caption)
        if len(repeated.failed) > 1:
            findings.figure("error-repetitions", error_sizes, [repeated])
        later = partial(findings.figure, later=True)
        later("angle", angles, [course], heading=world)
        later("error", errors, [course], heading=world)
        findings.figure("tensions", tensions, course, later=not repeated.marks)
        if course.load is not None:
            later("observer", consistency, course, heading=world)
        law = controller(settings.controller)
        if law.surface is not None and not failed:
            gains = dict(zip(law.gains, gains_of(law, settings.gains, tuned_gains(session.inputs)), strict=True))
            caption = "How the motion comes to the controller's sliding surface: phase plane, and sigma over time"
            later("sliding", sliding, course, law.surface, gains, caption=caption)
        later("motion", stroboscope, course, wrist, plant=settings.loop.plant.model)
    short_of, advice = ("", []) if failed or repeated.arrives else _short_of(session, study, repeated, network, beyond)
    words = wrist_identified(session.inputs)
    return Simulated(session.study, findings, tables, repeated, short_of, advice, study, words)


def _short_of(
    session: Session, study: Study, repeated: Repeated, network: Inverse | None, beyond: Sequence[OutOfReach]
) -> tuple[str, list[str]]:
    """Why the loop does not arrive, and what may help.

    Beyond what tendons hold that is other tendons or another motion; else those of its law's presets that arrive: they
    are tried on the very same loop.
    """
    from wristctl.control.table import controller
    from wristctl.simulation.arrival import why_not
    from wristctl.simulation.closed_loop import simulate as run_simulation

    chosen = study.simulate
    limit = study.wrist.tension_limit if chosen.loop.limits else math.inf
    short = f"does not arrive: {why_not(repeated.first.trajectory, limit)}"
    if beyond:
        return f"{short}; {beyond[0].what}", [f"No gains can help: {beyond[0].fix}."]
    arriving = []
    with session.progress("trying the controller's other gains"):
        for preset in controller(chosen.controller).presets:
            trial = chosen.model_copy(update={"gains": preset, "repetitions": 1})
            if preset != chosen.gains and run_simulation(study.model_copy(update={"simulate": trial}), network).arrives:
                arriving.append(preset)
    if arriving:
        return short, [f"On the same loop these gains arrive: --gains {' or --gains '.join(arriving)}."]
    if not controller(chosen.controller).gains:
        return short, [f"{chosen.controller} has no gains to search: a controller with feedback may arrive."]
    none = f"No preset of {chosen.controller} arrives here"
    search = _search(session, study)
    return short, [f"{none}. Search its gains:", search] if search else [f"{none}: `tune` may find gains that do."]


# Study file of a run with a search for the gains of its controller, on its loop and motion.
_SEARCH = "data/tune.yaml"


def _search(session: Session, study: Study) -> str:
    """The command that searches gains on the loop and the motion that were simulated, with its file in the run.

    Empty without a run, and in the other plane than `tune` has.
    """
    from wristctl.simulation.reference import toward
    from wristctl.wrist.directions import DIRECTIONS

    chosen, findings, name = study.simulate, session.findings, "here"
    if findings.run is None or DIRECTIONS[chosen.direction].plane != "ulnar":
        return ""
    settings = {
        "controllers": [chosen.controller],
        "loops": {name: chosen.loop.model_dump(mode="json")},
        "scenarios": [{"loop": name, "reference": asked_for(toward(chosen.reference, chosen.direction))}],
        "horizon": chosen.horizon,
    }
    content = {"seed": study.seed, "wrist": study.wrist.model_dump(mode="json"), "tune": settings}
    keep_study(findings, _SEARCH, f"Search for gains of {chosen.controller}: wristctl tune THIS", content)
    network = session.inputs.runs().get("network")
    through = ["--network", str(network.path)] if network and chosen.reference.inverse == "network" else []
    return f"$ {shlex.join(['wristctl', 'tune', f'{findings.run.path}/{_SEARCH}', *through])}"


SIMULATE = sweepable(
    Procedure(
        "simulate",
        plan,
        simulate,
        (
            EarlierRun("network", kind="train", optional=True),
            EarlierRun("tuned", kind="tune", optional=True),
            EarlierRun("from_identified", kind="identify", optional=True),
        ),
        size=size,
        in_one_plane=lambda study: not in_two_planes(study),
    )
)
