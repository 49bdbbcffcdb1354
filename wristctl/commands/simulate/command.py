"""One closed loop, with pictures."""

from __future__ import annotations

import math
import shlex
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from wristctl.commands.identified_wrist import identified, wrist_identified
from wristctl.commands.inputs import FROM_IDENTIFIED, NETWORK, TUNED, Inputs
from wristctl.commands.inputs_of_loops import (
    asked_of_simulation,
    check_inverse,
    check_motion,
    check_row,
    check_tuned,
    network_for,
    planes_of_simulation,
    tuned_gains,
)
from wristctl.commands.kept_studies import asked_for, keep_study
from wristctl.commands.live_record import check_live, listened
from wristctl.commands.loop_warnings import OutOfReach, warn_if_outside, warn_of_loops, warn_outside_conditions
from wristctl.commands.procedure import Procedure
from wristctl.commands.session import Session
from wristctl.commands.simulate.results import Simulated, metrics_table, trajectory_table
from wristctl.commands.sweep.command import sweepable
from wristctl.config.choices import REFERENCES
from wristctl.config.loop import sample_period
from wristctl.config.study import Study
from wristctl.errors import under
from wristctl.wrist.directions import DIRECTIONS

if TYPE_CHECKING:
    from wristctl.simulation.closed_loop import Size
    from wristctl.simulation.repetitions import Repeated
    from wristctl.wrist.kinematics import Inverse


def plan(study: Study, inputs: Inputs) -> str:
    """Check the controller and its gains, and tell the rollouts and what of their world is not as believed."""
    from wristctl.commands.truth_table import truth_told
    from wristctl.simulation.closed_loop import check_size

    settings, known = study.simulate, identified(study, "simulate", inputs)
    planes = planes_of_simulation(known)
    with under("simulate"):
        check_row(settings, tuned_gains(inputs), inputs.runs().get("tuned"))
        check_tuned([settings], inputs)
        check_size(size(study), planes=planes)
        check_live(settings.reference, [settings.controller], known.wrist, sample_period(settings.loop.control_period))
        if not settings.reference.is_live:
            check_motion(known, planes)
        check_inverse(settings.reference, inputs)
    times, where = size(study).rollouts, " in two planes" * (planes == 2)
    truth = truth_told(known.wrist, {"simulate": settings.loop})
    return f"{'one rollout' if times == 1 else f'{times} rollouts'} of {settings.horizon:g} s{where}{truth}"


def size(study: Study) -> Size:
    """One rollout, or as many as there are repetitions of what is drawn, and as the controller learns from."""
    from wristctl.control.table import controller
    from wristctl.simulation.closed_loop import Size
    from wristctl.simulation.worlds import is_random

    chosen = study.simulate
    repetitions = chosen.repetitions if is_random(chosen.loop) else 1
    return Size([chosen.loop], chosen.horizon, repetitions * controller(chosen.controller).learning)


def simulate(session: Session) -> Simulated:
    """Simulate one closed loop and draw it."""
    from wristctl.commands.truth_table import truth_tables
    from wristctl.simulation.closed_loop import scenario_of
    from wristctl.simulation.closed_loop import simulate as run_simulation
    from wristctl.simulation.worlds import Draws

    asked, session = session.study, replace(session, study=listened(session))
    study, findings = identified(session.study, "simulate", session.inputs), session.findings
    settings, wrist, planes = study.simulate, study.wrist, planes_of_simulation(study)
    warn_outside_conditions([settings], [settings.loop])
    beyond = warn_of_loops(findings, study, settings, asked_of_simulation(study))
    network = network_for(session.inputs, wrist, [settings.loop], planes)
    with session.progress("simulating the loop"):
        repeated = run_simulation(study, network, tuned_gains(session.inputs))
    scenario = scenario_of(settings.reference, settings.direction)
    findings.note_streams(Draws(study.seed).names([settings.loop], [scenario]))
    course = repeated.first.trajectory
    warn_if_outside(course.outside)
    if planes == 2:
        findings.numerics(planes=2, substeps=int(repeated.metrics["substeps"].max()), drift=repeated.drift)
    trajectory_table(findings, course)
    findings.headline(*_HEADLINES[planes])
    gains = settings.gains if isinstance(settings.gains, str) else "given"
    label = course.label if planes == 1 else f"{settings.controller}/{gains} in two planes"
    title = ", ".join(part for part in (label, repeated.fate) if part)
    tables = [metrics_table(findings, title, repeated), *truth_tables(wrist, {"simulate": settings.loop})]
    with session.drawing():
        from wristctl.commands.simulate.figures import draw, draw_bends

        (draw if planes == 1 else draw_bends)(session, study, repeated)
    arrives = repeated.failed.any() or repeated.arrives
    short_of, advice = ("", []) if arrives else _short_of(session, study, repeated, network, beyond)
    words = wrist_identified(session.inputs)
    return Simulated(asked, findings, tables, repeated, short_of, advice, study, words)


# Metrics that head the run's page, by planes.
_HEADLINES = {
    1: ("rmse", "settling", "steady_state", "overshoot", "chattering", "peak_tension"),
    2: ("rmse", "rmse_ulnar", "rmse_flexion", "largest_error", "tip_rmse_mm", "peak_tension"),
}


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
    from wristctl.simulation.oscillation import at_rest

    chosen, course = study.simulate, repeated.first.trajectory
    if course.planes == 1:
        short = f"does not arrive: {why_not(course, study.wrist.tension_limit if chosen.loop.limits else math.inf)}"
    else:
        off = math.degrees(repeated.first.metrics["steady_state"])
        short = f"does not {'arrive' if at_rest(course) else 'follow'}: {off:.2g} deg off at the end"
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

    chosen, findings, name = study.simulate, session.findings, "here"
    own_plane = REFERENCES[chosen.reference.kind].planes == 2 or DIRECTIONS[chosen.direction].plane == "ulnar"
    if findings.run is None or not own_plane:
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
        (NETWORK, TUNED, FROM_IDENTIFIED),
        size=size,
        in_one_plane=lambda study: planes_of_simulation(study) == 1,
    )
)
