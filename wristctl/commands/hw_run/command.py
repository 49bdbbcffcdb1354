"""The paper's experiment on the whole chain, from marker to motor."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from wristctl.commands.adoption import with_planes, wound_in_both_planes
from wristctl.commands.calibrate.wrist import calibration_in
from wristctl.commands.hw_run.results import Performed, performed
from wristctl.commands.identified_wrist import identified
from wristctl.commands.inputs import FROM_IDENTIFIED, EarlierRun, Inputs
from wristctl.commands.inputs_of_loops import (
    check_inverse,
    check_reach,
    check_row,
    check_tuned,
    network_for,
    tuned_gains,
)
from wristctl.commands.live_record import check_live, with_record
from wristctl.commands.loop_warnings import (
    outside_conditions,
    warn_of_earlier_families,
    warn_of_first_repetitions,
    warn_outside_conditions,
)
from wristctl.commands.procedure import Procedure
from wristctl.commands.rig_description import describe_rig
from wristctl.commands.session import Session
from wristctl.config.study import Study
from wristctl.errors import UserError, under

if TYPE_CHECKING:
    from wristctl.config.hw_run import HwRunSettings
    from wristctl.config.wrist import WristParameters
    from wristctl.control.table import Gains
    from wristctl.wrist.kinematics import Inverse

# Time between two samples of a motion by which it is checked before a run [s].
_CHECKED = 0.01


def plan(study: Study, inputs: Inputs) -> str:
    """Check controllers and gains and say what would be done; opens nothing."""
    settings, tuned = study.hw_run, tuned_gains(inputs)
    for number, row in enumerate(settings.rows):
        with under(f"hw-run.controllers.{number}"):
            check_row(row, tuned)
    check_tuned(settings.rows, inputs)
    found = identified(study, "hw-run", inputs)
    known = found.wrist
    with under("hw-run"):
        check_live(settings.reference, [row.controller for row in settings.rows], known, settings.control_period)
        if settings.planes == 1 and not settings.reference.is_live:
            from wristctl.trial.rig_belief import layout_of_rig
            from wristctl.trial.rig_settings import as_modelled

            modelled = as_modelled(known, layout_of_rig(settings, known), settings.planes)
            check_reach([settings.reference], modelled, "reference")
        elif settings.planes == 2:
            check_bends_of_trials(settings, known)
        check_inverse(settings.reference, inputs)
    pushes = settings.without_push + (settings.push.force != 0.0)
    motions = len(set(settings.directions))
    if settings.planes == 2:
        from wristctl.trial.trials import motions_of

        motions = len(motions_of(settings))
    count = len(settings.rows) * motions * settings.repetitions * pushes
    trial_seconds = settings.horizon + settings.back + settings.rest
    rig = "\n".join([describe_rig(settings), *_keeps_its_camera(found.hw_run)])
    return f"{rig}\n{count} trials, about {count * trial_seconds:.0f} s of motion after homing"


def _keeps_its_camera(believed: HwRunSettings) -> list[str]:
    """What to say of an emulated rig whose camera has other frames than that which was identified."""
    if believed.from_identified is None or believed.port is not None or believed.rig is not None:
        return []
    rate, own = believed.sensor.frame_rate, believed.bench.camera.frame_rate
    if math.isclose(rate, own, rel_tol=0.01):
        return []
    cameras = ["bench.camera"] + ["bench.camera_2"] * (believed.planes == 2)
    settings = " ".join(f"--set {camera}.frame_rate={rate:.4g}" for camera in cameras)
    return [
        f"the emulated rig is not the identified one: its camera has {own:.4g} frames a second, and controllers "
        f"believe in the {rate:.4g} that were identified; {settings} gives it those"
    ]


def check_bends_of_trials(settings: HwRunSettings, wrist: WristParameters) -> None:
    """UserError for motions or controllers of trials in two planes that cannot be."""
    from wristctl.control.table import controller
    from wristctl.simulation.rollout import check_two_planes
    from wristctl.simulation.worlds import World
    from wristctl.trial.motions import motion_of
    from wristctl.trial.rig_belief import layout_of_rig
    from wristctl.trial.trials import motions_of

    if layout_of_rig(settings, wrist) is not None and settings.rig is None:
        for key in ("load_cells", "calibration"):
            if getattr(settings, key):
                problem = f"{key}: a board's go with the tendons 1, 2, 4 and 5, and this wrist has others"
                raise UserError(problem, key, "leave it out: the wrist is homed anew")
    check_two_planes([World(settings.loop, wrist)])
    through = settings.reference.inverse == "network"
    for name in () if through else motions_of(settings):
        motion_of(settings.model_copy(update={"control_period": _CHECKED}), wrist, name)
    for row in settings.rows:
        controller(row.controller)


def hw_run(session: Session) -> Performed:
    """Perform trials, emulated or on hardware: in four directions or both planes at once, with and without a push."""
    session.operator.tell(describe_rig(session.study.hw_run))
    warn_of_first_repetitions(session.study.hw_run.rows)
    from wristctl.commands.hw_run.trials import perform_trials
    from wristctl.trial.motions import has_path

    study, bench = session.study, session.study.wrist
    identified_session = replace(session, study=identified(study, "hw-run", session.inputs))
    believed = identified_session.study.hw_run
    for kept in _keeps_its_camera(believed):
        session.operator.tell(kept)
    planes = 2 if believed.planes == 2 and has_path(believed) else 1  # of a network: two of a path
    network = network_for(session.inputs, identified_session.study.wrist, [believed.loop], planes)
    tuned = tuned_gains(session.inputs)
    if believed.port is None and believed.rig is None:
        warn_outside_conditions(believed.rows, [believed.loop])
    else:
        warn_of_earlier_families(believed.rows)
        if swinging := outside_conditions(believed.rows, [believed.loop]):
            session.operator.dare("; ".join(swinging), "hw-run.controllers", "other gains")
    limited_session, peak = _limited(identified_session, network, tuned)
    trials = perform_trials(limited_session, bench, network, tuned)
    identified_session = with_record(identified_session)
    most = limited_session.study.hw_run.safety.tension
    done = performed(identified_session, trials, network, tuned)
    return replace(done, study=study, tension_limit=most, expected_peak=peak)


def _limited(session: Session, network: Inverse | None, tuned: Gains | None) -> tuple[Session, float]:
    """The session with tension limited to what the trials need, and that [N], as the person is told."""
    import numpy as np

    from wristctl.trial.motion_limit import asked_at_most, borne, held_pull, limited, peak_tension, reeled_unseen
    from wristctl.trial.trials import trials_of

    study = session.study
    trials = trials_of(study.hw_run, np.random.default_rng(0))
    with session.progress("simulating what the trials need"):
        peak = peak_tension(study, trials, network, tuned)
    changed = limited(study, peak)
    most, factor = changed.hw_run.safety.tension, study.hw_run.tension_factor
    if math.isfinite(peak):
        carried = f" with {study.hw_run.payload:g} kg in the hand" if study.hw_run.payload else ""
        session.operator.tell(
            f"tension limit: {most:.3g} N, beyond which the motors stop; expected peak: {peak:.2g} N, which the trials "
            f"need in simulation{carried} (hw-run.tension_factor: {factor:g}, hw-run.payload)"
        )
    elif study.hw_run.reference.is_live:
        session.operator.tell(
            f"tension limit: {most:.3g} N, beyond which the motors stop (hw-run.safety.tension); expected peak: none, "
            "as no simulation says what a live reference needs"
        )
        return replace(session, study=changed), peak
    asked, motors = asked_at_most(study.hw_run, study.wrist), study.hw_run.safety.motor_pull
    if math.isfinite(peak) and peak > asked:
        share = 100.0 * peak / asked
        _dare(
            session,
            f"expected peak: in simulation the trials need {peak:.2g} N, and of motors that pull {motors:.3g} N no "
            f"more than {asked:.2g} N is asked: the wrist stays behind, or motors slip",
            f"a smaller motion, or drives at {share:.0f} % of their current (safety.motor_pull)",
        )
    reeled = reeled_unseen(changed.hw_run, study.wrist, network)
    pull, most = held_pull(changed.hw_run, reeled), borne(study.hw_run)
    beyond = f", beyond the {most:.0f} N that tendons are to bear (safety.tension)" if pull > most else ""
    said = (
        f"a wrist that is held, or a motor that fails, may pull a tendon with about {pull:.0f} N{beyond} before the "
        f"motors stop: spools reel in {1e3 * reeled:.1f} mm more until that is seen and they stand"
    )
    if beyond:
        share = 100.0 * most / motors
        fix = f"a slower motion, or drives at {share:.0f} % of their current (safety.motor_pull={most:.0f})"
        _dare(session, said, fix)
    else:
        session.operator.tell(said)
    return replace(session, study=changed), peak


def _dare(session: Session, danger: str, fix: str) -> None:
    """Tell what motors may do; of real ones only an operator that forces it goes on."""
    if session.study.hw_run.port is None:
        session.operator.tell(danger)
    else:
        session.operator.dare(danger, "hw-run.safety.motor_pull", fix)


def _with_planes(study: Study) -> Study:
    """The study of a board with as many planes as its trials need, by which a calibration is chosen.

    What a board cannot wind, or not so, is refused later, with what takes its tendons.
    """
    wound = study.wrist.tendons in ("four", "five") or wound_in_both_planes(study.wrist)
    if study.hw_run.rig is not None or not wound:
        return study
    try:
        return with_planes(study)
    except UserError:
        return study


def _in_one_plane(study: Study) -> bool:
    """Whether a board's trials bend the wrist in one plane: its tendons may ask for both where nobody gave planes."""
    settings = study.hw_run
    return (
        settings.rig is None
        and settings.planes == 1
        and ("planes" in settings.model_fields_set or not wound_in_both_planes(study.wrist))
    )


HW_RUN: Procedure[Performed] = Procedure(
    "hw-run",
    plan,
    hw_run,
    (
        EarlierRun("calibration", "calibrate-wrist", True, content=lambda section: calibration_in(section.planes)),
        EarlierRun("optics", kind="calibrate-camera", optional=True),
        EarlierRun("optics_2", kind="calibrate-camera", optional=True),
        FROM_IDENTIFIED,
        EarlierRun("tuned", kind="tune", optional=True),
        EarlierRun("network", kind="train", optional=True),
    ),
    completed=_with_planes,
    in_one_plane=_in_one_plane,
)
