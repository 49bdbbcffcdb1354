"""Trials one after the other, whatever performs them: what is known of each, and the stop that ends them early."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np

from wristctl.config.hw_run import HwRunSettings
from wristctl.config.wrist import WristParameters
from wristctl.control.table import controller, gains_of
from wristctl.errors import UserError, fix_of
from wristctl.interrupt import undisturbed
from wristctl.simulation.motion import Motion
from wristctl.simulation.spool_timing import remembered_commands
from wristctl.trial.control_loop import ControlLoop, course_of
from wristctl.trial.live_datagrams import LiveReference
from wristctl.trial.log import TrialLog
from wristctl.trial.motions import back, motion_of
from wristctl.trial.motors_ready import Halt
from wristctl.trial.rig_belief import RigBelief, names_of_planes
from wristctl.trial.safety import SafetyStop
from wristctl.trial.spools import spools_of
from wristctl.trial.steering import HostFaults, Steering
from wristctl.trial.tick_timing import TickTiming
from wristctl.trial.trials import Trial, motions_of
from wristctl.trial.watch import Watch
from wristctl.vision.camera_pose import CameraPose
from wristctl.wrist.kinematics import Inverse
from wristctl.wrist.tendon_layout import TendonLayout


class Stop:
    """Why, when (on the time of the trial, where one went on) and how an experiment was stopped before its end."""

    def __init__(self, error: BaseException, trial: int | None, time: float | None, halted: Halt) -> None:
        self.reason = f"{type(error).__name__}: {error}"
        if isinstance(error, UserError):
            self.reason = error.what
        elif isinstance(error, KeyboardInterrupt):
            self.reason = "interrupted by the operator"
        self.trial, self.time, self.halt = trial, time, halted

    def plain(self) -> dict[str, Any]:
        """For JSON."""
        status = self.halt.status
        board: dict[str, Any] = {"state": None, "faults": None, "position": None, "rate": None}
        if status is not None:
            faults = status.faults.name or "none"
            board |= {"state": status.state.name, "faults": faults, "position": status.position, "rate": status.rate}
        return {
            "reason": self.reason,
            "trial": self.trial,
            "time": self.time,
            "motors_stand": self.halt.verified,
            "how": self.halt.how,
            "seconds": self.halt.seconds,
            **board,
        }


class TrialSeries:
    """Trials; `outcomes` holds how each trial that began has ended, `odd` what was odd in it, `most` the largest of
    each residual in any, `poses` the camera's by plane (None: calibrated), `stop` why they ended early.

    `settings` and `wrist` are as trials have them, `asked` is the wrist that motions are worked out for. Raises
    UserError for what is wrong with controllers, gains or motions.
    """

    def __init__(
        self, settings: HwRunSettings, wrist: WristParameters, asked: WristParameters, trials: Sequence[Trial],
        kept: TrialLog, timing: TickTiming, network: Inverse | None, tuned: Mapping[str, Mapping[str, float]] | None,
        live: LiveReference | None,
    ) -> None:  # fmt: skip
        self._settings, self._wrist, self._asked, self._trials, self._log = settings, wrist, asked, trials, kept
        self._live = live
        chosen = [(controller(row.controller), row.gains) for row in settings.rows]
        self._laws = [(law, gains_of(law, gains, tuned)) for law, gains in chosen]
        self._back = controller("feedforward")
        self.motions: dict[str, Motion] = {
            name: motion_of(settings, asked, name, network) for name in motions_of(settings)
        }
        self.timing = timing
        self.outcomes: dict[int, str] = {}
        self.stop: Stop | None = None
        self.most, self.odd = dict[str, float](), dict[int, str]()
        self.poses: dict[str, CameraPose | None] = {}
        self._under_way: tuple[int, float] | None = None  # number and start of the trial that goes on
        self._in_doubt: int | None = None  # the trial that has ended, until its tendons have been looked at

    def replay(self, settings: HwRunSettings) -> None:
        """Judge the trials by motions of these settings: those of a live reference are known afterwards."""
        self.motions = {name: motion_of(settings, self._asked, name) for name in motions_of(settings)}

    @contextmanager
    def _stopping(self, stopped: Callable[[BaseException], None]) -> Iterator[None]:
        """Whatever ends the block early, `stopped` is called with its cause before it is raised."""
        try:
            yield
        except BaseException as error:
            cause = cause_of(error)
            with undisturbed():
                stopped(cause)
            if cause is not error:
                raise cause from error
            raise

    def _to_rest(self, bend: Any, duration: float, rest: float) -> Motion:
        """The way from a bend [rad] to zero, and rest there."""
        return back(bend, duration, rest, self._settings.control_period, self._settings.planes)

    def _come_back(self, loop: ControlLoop, trial: Trial) -> None:
        """The way back to zero after a trial that has ended; it is in doubt until its tendons have been looked at."""
        self._in_doubt = trial.number
        loop.follow(self._to_rest(self._final(trial), self._settings.back, 0.0), self._back, ())

    def _warm_up(self, facing: WristParameters, plane: str, layout: TendonLayout | None = None) -> None:
        """Have all compiled or loaded before the first motor is on: from then on a rig wants to be fed.

        `facing` is the wrist as a loop in this plane knows it, or in both; `layout` as `Watch` has it.
        """
        settings, period = self._settings, self._settings.control_period
        belief = RigBelief(facing, settings.actuator, names_of_planes(settings.planes, plane), layout)
        spools, course = spools_of(settings.actuator), course_of(self._to_rest(0.0, settings.rest, 0.0))
        taut, _ = belief.taut(course[0, :, 0])
        still, reeled = np.zeros(len(taut)), belief.at_places(taut)
        spools.target(still, taut)
        spools.rate(still, still, still, period)
        spools.behind(still, still, still, period)
        rates = np.zeros((len(taut), remembered_commands(spools.timing.delay, period)))
        spools.foreseen(still, rates, period)
        spools.reckoned(still, rates, 0.0, period)
        Watch(settings, facing, plane, self.timing, layout=layout).predict(reeled)
        steering = Steering(belief, settings.sensor, period)
        for law, gains in [*self._laws, (self._back, ())]:
            steering.use(law, gains)
            steering.respond(course)
            steering.predict(reeled)
        steering.see(0, 0.0, 0.0)

    def _begun(self, trial: Trial, start: float) -> None:
        self._under_way, self.outcomes[trial.number] = (trial.number, start), "begun"

    def _follow(self, loop: ControlLoop, trial: Trial, faults: HostFaults | None = None) -> None:
        """Have a loop follow the motion of a trial, and keep its residuals however it ends."""
        law, gains = self._laws[trial.row]
        try:
            followed = self.motions[trial.direction]
            loop.follow(followed, law, gains, trial.number, faults, trial.push != 0.0, self._live)
        finally:
            self.most = {name: max(size, self.most.get(name, 0.0)) for name, size in loop.watch.most.items()}
            self.odd[trial.number] = loop.watch.words()

    def _final(self, trial: Trial) -> Any:
        """Where the motion of a trial ends, or a live reference has led [rad]."""
        return self.motions[trial.direction].final if self._live is None else self._live.bend

    def _note_stop(self, error: BaseException, decided: float, halted: Halt) -> Stop:
        """Note why and how the trials were stopped, decided on at this time [s]."""
        trial, start = self._under_way or (None, None)
        stop = self.stop = Stop(error, trial, None if start is None else decided - start, halted)
        if self._in_doubt is not None and isinstance(error, SafetyStop):
            self.outcomes[self._in_doubt] = f"after it: {stop.reason.removeprefix('stopped: ')}"
        self._log.disk.give_up_reserve()
        return stop


# Share of the motors' pull that a law may ask for: they turn meanwhile, and the wrist may be pushed.
_ASKED = 0.8


def spared(wrist: WristParameters, settings: HwRunSettings) -> WristParameters:
    """The wrist with tensions that its motors can hold. Raises UserError where these are not above pretension."""
    limit = min(wrist.tension_limit, _ASKED * settings.safety.motor_pull)
    if limit <= wrist.pretension:
        problem = f"motors of {settings.safety.motor_pull:g} N cannot hold a pretension of {wrist.pretension:g} N"
        raise UserError(problem, "safety.motor_pull", "more current (documentation: The rig), or less wrist.pretension")
    return wrist.model_copy(update={"tension_limit": limit})


def cause_of(error: BaseException) -> BaseException:
    """The safety stop behind a disk that takes no more rows; any other error as it is."""
    if isinstance(error, OSError):
        return SafetyStop(f"the log cannot be written: {error.strerror}", str(error.filename or "data"), fix_of(error))
    return error
