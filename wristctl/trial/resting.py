"""A slack wrist before any motor turns: does it rest where its weight lets it, and is it seen steadily enough?

Tendons that are but a little slack hold a wrist that wants to sag. So homing looks again when it has let them out.
"""

import math
from collections.abc import Sequence

import numpy as np

from wristctl.config.hw_run import RigSettings
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.trial.rig_words import words_of_board, words_of_rig
from wristctl.trial.safety import SafetyStop
from wristctl.vision.marker import Sighting
from wristctl.wrist.directions import in_plane
from wristctl.wrist.statics import equilibrium

# Degrees about a half or a quarter of a turn in which a marker was glued on so.
_TURNED_DEG = 30.0
# Share of what tendons were let out by from which on they hold a wrist that sags.
_HELD = 0.75
# Share of `homing.bend_deg` by which a reading may err: half of it says which tendon bends the wrist.
_STEADY = 0.4


def sag_of(wrist: WristParameters, plane: str) -> float:
    """Bend in a plane [rad] at which a wrist without taut tendons rests under its weight; infinite where it buckles."""
    free = in_plane(wrist, plane).model_copy(update={"pretension": 0.0})
    try:
        return float(equilibrium(free, 1, (0.0, 0.0)).sum())
    except UserError:
        return math.inf


def judge_weight(settings: RigSettings, wrist: WristParameters, planes: Sequence[str]) -> None:
    """Raises SafetyStop for a wrist that sags too far to be homed, by its weight and `wrist.gravity`."""
    for plane in planes:
        sag = sag_of(wrist, plane)
        if abs(sag) > math.radians(settings.homing.rest_deg):
            how = f"sags by {math.degrees(sag):.0f} deg" if math.isfinite(sag) else "buckles"
            problem = f"without taut tendons the wrist {how} under its weight, as wrist.gravity says, in {plane}"
            fix = f"set it up hanging or upright: homing wants it straight within {settings.homing.rest_deg:g} deg"
            raise SafetyStop(problem, "homing", fix)


def judge_rest(
    sightings: Sequence[Sighting], settings: RigSettings, wrist: WristParameters, planes: Sequence[str]
) -> None:
    """Raises SafetyStop by usable sightings of a slack wrist that nothing has moved, of a camera for each plane.

    No marker's angle has been taken off them.
    """
    judge_weight(settings, wrist, planes)
    for number, plane in enumerate(planes):
        own = [sighting for sighting in sightings if sighting.plane == number]
        if not own:
            continue
        whose = f" of camera {number + 1}" if len(planes) > 1 else ""
        angles = [sighting.theta for sighting in own]
        judge_turn(angles, whose)
        rest = float(np.median(angles))
        if abs(off := rest - sag_of(wrist, plane)) > math.radians(settings.homing.rest_deg):
            raise _off(f"the slack wrist{whose} rests at {math.degrees(rest):.0f} deg", off, settings)
        _judge_noise(own, whose, settings, wrist, len(planes) == 1)


def judge_turn(angles: Sequence[float], whose: str) -> None:
    """Raises SafetyStop where angles between the markers [rad] are those of one glued on upside down or sideways."""
    turned = math.degrees(float(np.median(np.abs(angles))))
    for turn, how in ((180.0, "upside down"), (90.0, "a quarter turn round")):
        if abs(turned - turn) < _TURNED_DEG:
            problem = f"the tip's marker{whose} sits {how}: it is turned by {turned:.0f} deg to the base's"
            raise SafetyStop(problem, "homing", "glue it on with its top toward the fingers, as the base's")


def judge_slack(bend: Sequence[float], settings: RigSettings, wrist: WristParameters, planes: Sequence[str]) -> None:
    """Raises SafetyStop where a wrist whose tendons were let out by twice `homing.pull` sags by this bend [rad].

    It counts from where the wrist stood before: in the plane, and across it or in the other one. One that sags until a
    tendon holds it, whose path is shorter by both, is refused too.
    """
    expected = [sag_of(wrist, plane) for plane in planes]
    off = np.nan_to_num(bend) - [*expected, 0.0][: len(bend)]
    let_out, sag = 2.0 * settings.homing.pull, float(np.hypot(*off))
    if wrist.tendon_offset * np.abs(off).sum() > _HELD * let_out or sag > math.radians(settings.homing.rest_deg):
        raise _off("with slack tendons the wrist sags", sag, settings)


def _off(problem: str, off: float, settings: RigSettings) -> SafetyStop:
    problem += f", {math.degrees(off):.1f} deg off where its weight should let it"
    likely = (
        "a tendon is taut, the frame is not as wrist.gravity says, something pushes at the hand, or the marker is "
        "glued on askew"
    )
    words = (words_of_rig if getattr(settings, "rig", None) is not None else words_of_board)((), ())
    fix = f"{words.taut}; set the frame plumb, free the hand of cables, see the marker; or say how it stands"
    return SafetyStop(f"{problem}; likely {likely}", "homing", f"{fix} (wrist.gravity)")


def _judge_noise(
    sightings: Sequence[Sighting], whose: str, settings: RigSettings, wrist: WristParameters, by_size: bool
) -> None:
    scale = 2.0 * settings.markers.distance / wrist.length
    seen = {"angle": [sighting.theta for sighting in sightings]}
    if by_size:
        seen["size"] = [scale * math.log(sighting.size) for sighting in sightings]
    for what, bends in seen.items():
        errs = _error(bends, settings)
        if len(bends) > 2 and errs > _STEADY * settings.homing.bend_deg:
            problem = (
                f"the markers{whose} are seen unsteadily: by the {what} of the tip's a reading errs by {errs:.2f} deg, "
                f"and homing tells tendons apart by {0.5 * settings.homing.bend_deg:g} deg"
            )
            raise SafetyStop(problem, "homing", "more light, a longer device.exposure, focus; or more homing.frames")


def judge_looks(sightings: Sequence[Sighting], settings: RigSettings, where: str) -> None:
    """Raises SafetyStop where looks of a rig at a wrist that rests scatter too much; `where` is the rig's place."""
    planes = range(settings.planes)
    errs = max(_error([look.theta for look in sightings if look.plane == plane], settings) for plane in planes)
    if errs > _STEADY * settings.homing.bend_deg:
        problem = f"the bend is seen unsteadily: a reading errs by {errs:.2f} deg"
        raise SafetyStop(problem, where, "a steadier sensor, more homing.frames, or a larger homing.bend_deg")


def _error(bends: Sequence[float], settings: RigSettings) -> float:
    """Standard deviation of a reading [deg] of bends that scatter so [rad]."""
    return math.degrees(float(np.std(bends))) / math.sqrt(settings.homing.frames)
