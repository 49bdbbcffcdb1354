"""The largest tension of trials, by their own simulation: what a motion needs, and not what a wrist bears.

A held hand or a lost step is told by a tension far below what tendons bear, and within tenths of a second: a motor's
whole pull is then never reached, but in a motion so quick that its spools reel in much until a camera has shown it.
"""

import math
from collections.abc import Mapping, Sequence

import numpy as np

from wristctl.config.hw_run import HwRunSettings
from wristctl.config.plant import Plant
from wristctl.config.study import Study
from wristctl.config.wrist import WristParameters
from wristctl.trial.motions import motion_of
from wristctl.trial.rig_belief import RigBelief, layout_of_rig, names_of_planes
from wristctl.trial.rig_settings import as_modelled, share_of_pair
from wristctl.trial.trial_results import twin
from wristctl.trial.trials import Trial, motions_of
from wristctl.wrist.directions import DIRECTIONS, in_plane
from wristctl.wrist.kinematics import Inverse

# A limit is no less [N]: tendons whose zero is 0.3 mm off pull so much more than simulated ones.
LEAST = 12.0
# Share of the motors' pull that a controller may ask for: they turn meanwhile, and the wrist may be pushed.
_ASKED = 0.8


def peak_tension(
    study: Study, trials: Sequence[Trial], network: Inverse | None,
    tuned: Mapping[str, Mapping[str, float]] | None,
) -> float:  # fmt: skip
    """Largest tension [N] of a tendon over these trials, simulated on the believed wrist with and without its payload.

    Infinite where a simulation fails, and of a live reference: nothing then says what the motion needs.
    """
    settings, peaks = study.hw_run, list[float]()
    if settings.reference.is_live:
        return math.inf
    different = {(trial.direction, trial.push, trial.row): trial for trial in trials}
    for payload in dict.fromkeys((0.0, settings.payload)):  # an upright wrist needs less with one
        loop = settings.known_loop.model_copy(update={"plant": Plant(payload=payload)})
        for trial in different.values():
            done = twin(study, trial, network, tuned, loop)
            peaks.append(math.inf if done.failed else done.metrics["peak_tension"])
    share = share_of_pair(layout_of_rig(settings, study.wrist), settings.planes)
    return max(peaks) / share


def limited(study: Study, peak: float) -> Study:
    """The study with its rig's largest tension `hw-run.tension_factor` times this peak [N], where that is less."""
    settings = study.hw_run
    most = min(settings.within(study.wrist).safety.tension, max(LEAST, settings.tension_factor * peak))
    safety = settings.safety.model_copy(update={"tension": most})
    return study.model_copy(update={"hw_run": settings.model_copy(update={"safety": safety})})


def asked_at_most(settings: HwRunSettings, wrist: WristParameters) -> float:
    """Largest tension of a tendon [N] that a controller may ask for: a share of a motor's pull, and what a wrist bears.

    A motion that needs more leaves the wrist behind, or motors slip.
    """
    return min(wrist.tension_limit, _ASKED * settings.safety.motor_pull)


def unseen_time(settings: HwRunSettings) -> float:
    """Seconds from a moment until the motors stop by what it shows: the next picture, its age, a tick, a command."""
    sensor, motors = settings.sensor, settings.actuator
    return (1.0 + sensor.delay_frames) / sensor.frame_rate + settings.control_period + motors.command_delay


def reeled_unseen(settings: HwRunSettings, wrist: WristParameters, network: Inverse | None = None) -> float:
    """Furthest that a spool of these trials reels in until the motors stop by what is seen before [m].

    By v t of a motion of speed v in `unseen_time` t, and v^2/(2 a) while the board ramps down by a.
    """
    layout, motors, furthest = layout_of_rig(settings, wrist), settings.actuator, 0.0
    modelled = as_modelled(wrist, layout, settings.planes)
    ticks = max(1, math.ceil(unseen_time(settings) / settings.control_period))
    for name in motions_of(settings):
        plane = DIRECTIONS[name].plane if settings.planes == 1 else ""
        facing = in_plane(modelled, plane) if plane else modelled
        belief = RigBelief(facing, motors, names_of_planes(settings.planes, plane), layout)
        reeled = np.array([belief.taut(bend)[0] for bend in motion_of(settings, modelled, name, network).bend_ref])
        fastest = float(np.diff(reeled, axis=0).max(initial=0.0)) / settings.control_period
        braked = fastest**2 / (2.0 * motors.ramp * motors.step_length)
        gone = [float((reeled[ahead:] - reeled[:-ahead]).max(initial=0.0)) for ahead in range(1, ticks + 1)]
        furthest = max(furthest, braked + max(gone))
    return furthest


def held_pull(settings: HwRunSettings, reeled: float) -> float:
    """Largest pull of a tendon whose wrist is held, or whose motor fails [N]: the motor's, or the limit of tension and
    what its spool still reels in [m]."""
    return min(settings.safety.motor_pull, settings.safety.tension + settings.actuator.tendon_stiffness * reeled)


def borne(settings: HwRunSettings) -> float:
    """What tendons are to bear [N]: `safety.tension`, and no less than its default.

    A smaller one is where motors are to stop, which they overrun by a little in any motion.
    """
    return max(settings.safety.tension, HwRunSettings().safety.tension)
