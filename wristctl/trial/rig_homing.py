"""Zero of a rig that takes targets, as the board's is found, and the checks after each trial."""

import math
from dataclasses import replace

import numpy as np

from wristctl.config.hw_run import HwRunSettings
from wristctl.config.wrist import WristParameters
from wristctl.trial.expected_moves import ExpectedMoves
from wristctl.trial.homing import Zero, find_zero, rest_of, slacken
from wristctl.trial.resting import judge_weight
from wristctl.trial.rig_belief import names_of_planes
from wristctl.trial.rig_drive import RigTracking
from wristctl.trial.rig_motors import RigMotors
from wristctl.trial.safety import SafetyStop
from wristctl.trial.spools import spools_of
from wristctl.trial.supervised_wait import Patience
from wristctl.trial.zero_checks import check_cocontraction, check_tendons
from wristctl.wrist.tendon_layout import TendonLayout

# The plane of a rig that bends in one.
PLANE = "ulnar"
# Share of `homing.bend_deg` by which a reading may err.
_STEADY = 0.4


class RigHoming:
    """Homing of a connected rig with slack tendons. Raises SafetyStop and RigStop."""

    def __init__(
        self, motors: RigMotors, tracking: RigTracking, settings: HwRunSettings, wrist: WristParameters,
        layout: TendonLayout, where: str,
    ) -> None:  # fmt: skip
        self._motors, self._tracking, self._settings, self._where = motors, tracking, settings, where
        self._wrist, self._layout = wrist, layout
        self._plane = PLANE if settings.planes == 1 else ""
        self.expected = ExpectedMoves(settings, wrist, self._plane, layout)
        self._zero: Zero | None = None
        judge_weight(settings, wrist, names_of_planes(settings.planes, PLANE))

    def find(self) -> Zero:
        """Zero of the rig, at which its tendons stand then; bends are of the straight wrist from here on."""
        self._judge_noise()
        zero = find_zero(self._motors, self._tracking, self._settings, self._wrist, self._plane, layout=self._layout)
        placed = tuple(self.expected.place(axis) for axis in range(len(zero.slack)))
        self._tracking.zero = zero.markers
        self._zero = replace(zero, directions=zero.directions or placed, targets=tuple(self._motors.targets.tolist()))
        return self._zero

    def _judge_noise(self) -> None:
        homing, planes = self._settings.homing, range(self._settings.planes)
        seen = Patience(self._motors).sightings(self._tracking, 4 * homing.frames)
        errs = max(float(np.std([look.theta for look in seen if look.plane == plane])) for plane in planes)
        if math.degrees(errs) / math.sqrt(homing.frames) > _STEADY * homing.bend_deg:
            errs /= math.sqrt(homing.frames)
            problem = f"the bend is seen unsteadily: a reading errs by {math.degrees(errs):.2f} deg"
            raise SafetyStop(problem, self._where, "a steadier sensor, more homing.frames, or a larger homing.bend_deg")

    def check(self) -> None:
        """See that a homed wrist that is let go rests straight, that no tendons pull against each other, and that each
        bends it; leaves it slack."""
        assert self._zero is not None
        settings, expected, spools = self._settings, self.expected, spools_of(self._settings.actuator)
        slacken(self._motors, spools, settings.homing, self._zero.signs)
        rest = rest_of(self._motors, self._tracking, expected, settings.homing)
        off, step = math.hypot(rest.theta, np.nan_to_num(rest.beside)), settings.actuator.step_length
        rigid = min(expected.steps(math.inf, axis=axis) for axis in range(len(expected.motors))) * step
        if off > settings.homing.pull / rigid:
            problem = f"the slack wrist rests {math.degrees(off):.1f} deg off where it was straight"
            fix = "a tendon is shorter than it was, caught or slipped, or the bend's zero has moved: home again"
            raise SafetyStop(problem, self._where, fix)
        common = self._motors, self._tracking, settings, self._wrist
        check_cocontraction(*common, self._plane, self._zero, self._layout)
        check_tendons(*common, self._zero, self._layout)
