"""Is a rig fit for trials? Checks of a robot of one's own against its facts, each with what was measured."""

import math
import signal
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

from wristctl.arrays import Array
from wristctl.commands.adoption import adopted
from wristctl.config.choices import RIGS
from wristctl.config.foreign import is_reference
from wristctl.config.hw_run import HwRunSettings, RigRow
from wristctl.config.study import Study
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.plugins.places import load
from wristctl.rig import Clock, Facts, Fault, Rig
from wristctl.trial.experiment import Experiment, log_of, spared
from wristctl.trial.guarded_rig import GuardedRig, RigStop
from wristctl.trial.log import TrialLog
from wristctl.trial.motion_limit import LEAST
from wristctl.trial.rig_belief import layout_of_rig
from wristctl.trial.rig_checks import RigTrier, said
from wristctl.trial.rig_settings import rig_of
from wristctl.trial.rig_stand import RigStand
from wristctl.trial.trials import Trial

# Bend of the trial that is tried [deg], its duration [s], and ticks after which it is interrupted.
_BEND_DEG, _HORIZON, _INTERRUPTED = 5.0, 1.5, 30


class RigCheck(NamedTuple):
    """Check of a rig: its subject, its outcome (None: not checked), and the measured values."""

    asked: str
    passed: bool | None
    found: str
    fix: str = ""
    """What would mend it, where that is known."""


class Certificate:
    """Checks of the rig that file.py:NAME names, with the settings of a study. `allowed` says what a trial may do.

    `confirm` has a person agree before a rig on the wall clock moves.
    """

    def __init__(self, name: str, study: Study, confirm: Callable[[], None] | None = None) -> None:
        self._name, self._study, self._confirm = name, study, confirm
        self.allowed: list[str] = []

    def checks(self) -> Iterator[RigCheck]:
        """Check after check; after one that fails none is tried that moves the rig.

        Raises UserError where the file cannot be loaded.
        """
        entry = RIGS.named(self._name)
        if is_reference(self._name):
            _, origin = load(self._name)
            for file, digest in origin.files.items():
                yield RigCheck("source", None, f"{file.relative_to(origin.root)} sha256 {digest}")
        else:
            yield RigCheck("source", None, "wristctl's own")
        try:
            made = rig_of(entry, self._name)
            changes = {"rig": self._name, "rows": (RigRow(controller="pid-ff", gains="hardware"),)}
            hw_run = self._study.hw_run.model_copy(update=changes)
            study = adopted(self._study.model_copy(update={"hw_run": hw_run}), "hw-run").study
            layout = layout_of_rig(study.hw_run, study.wrist)
            assert layout is not None
        except UserError as error:
            yield RigCheck("contract", False, said(error), str(error.fix))
            return
        facts = made.facts
        planes = f"{facts.planes} plane{'s' * (facts.planes == 2)}"
        yield RigCheck("contract", True, f"{len(facts.tendons)} tendons, {planes}, targets in {facts.unit}")
        guarded = GuardedRig(made, self._name)
        if self._confirm is not None and not guarded.virtual:
            self._confirm()
        trier = RigTrier(guarded, study.hw_run.within(study.wrist), study.wrist, layout)
        failed = ""
        for asked, check in trier.checks.items():
            try:
                if failed:
                    yield RigCheck(asked, None, f"not tried: {failed} fails")
                    continue
                yield RigCheck(asked, True, check())
            except UserError as error:
                failed = asked
                yield RigCheck(asked, False, said(error), str(error.fix))
        trouble = guarded.stop() or guarded.close()
        yield RigCheck("close", not trouble, trouble or "stopped and closed, without an error")
        for asked, experiment in (("silence", _silence), ("Ctrl-C", _interrupted), ("trial", _trial)):
            if failed or trouble:
                yield RigCheck(asked, None, f"not tried: {failed or 'close'} fails")
                continue
            try:
                again = GuardedRig(rig_of(entry, self._name), self._name)
                passed, found, fix = *experiment(again, study), ""
            except UserError as error:
                passed, found, fix = False, said(error), str(error.fix)
            failed = failed or asked * (passed is False)
            yield RigCheck(asked, passed, found, fix)
        if not failed and not trouble:
            self.allowed = _allowed(study.hw_run.within(study.wrist), study.wrist, facts)


def _silence(rig: GuardedRig, study: Study) -> tuple[bool | None, str]:
    """A rig that stops by itself where it hears nothing does so, and says it."""
    silence = rig.facts.silence
    if silence is None:
        return None, "facts.silence is None: it goes on where it hears nothing. Keep a hand at its power switch"
    try:
        stood = rig.connect()
        rig.send(stood)
        rig.wait_until(rig.now() + 0.5 * silence)
        rig.send(stood)
        rig.wait_until(rig.now() + 2.0 * silence)
        try:
            rig.send(stood)
        except RigStop as error:
            if isinstance(error.__cause__, Fault):
                return True, f"after {2.0 * silence:g} s of silence: {error.what}"
            raise
        return False, f"after {2.0 * silence:g} s without send() it follows targets, and facts.silence is {silence:g} s"
    finally:
        rig.stop()
        rig.close()


class _Interrupting:
    """A rig whose operator presses Ctrl-C after some waits; it notes whether it was stopped."""

    def __init__(self, rig: Rig, after: int) -> None:
        self._rig, self._left, self.facts, self.stops = rig, after, rig.facts, 0
        self.clock: Clock = self
        self.virtual = bool(getattr(rig.clock, "virtual", False))
        self.connect, self.look, self.close = rig.connect, rig.look, rig.close

    def now(self) -> float:
        """As the rig's."""
        return self._rig.clock.now()

    def wait_until(self, moment: float) -> None:
        """As the rig's, until the interrupt."""
        self._rig.clock.wait_until(moment)

    def send(self, targets: Array) -> Any:
        """As the rig's."""
        self._left -= 1
        sent = self._rig.send(targets)
        if self._left == 0:
            signal.raise_signal(signal.SIGINT)
        return sent

    def stop(self) -> None:
        """As the rig's."""
        self.stops += 1
        self._rig.stop()


def _interrupted(rig: GuardedRig, study: Study) -> tuple[bool | None, str]:
    """Ctrl-C stops the rig, which then stands."""
    if signal.getsignal(signal.SIGINT) in (signal.SIG_IGN, None):
        return None, "Ctrl-C is ignored here"
    interrupting = _Interrupting(rig.rig, _INTERRUPTED)
    with _experiment(study) as (experiment, _):
        try:
            experiment.run(RigStand(GuardedRig(interrupting, rig.where)))
        except KeyboardInterrupt:
            stop = experiment.stop
            assert stop is not None
            if not stop.halt.verified:
                return False, f"after Ctrl-C: {stop.halt.how}"
            return True, f"{interrupting.stops} stop(), and the wrist stands after {1e3 * stop.halt.seconds:.0f} ms"
    return False, "Ctrl-C was swallowed: no bare except in the rig, which catches KeyboardInterrupt too"


@contextmanager
def _experiment(study: Study) -> Iterator[tuple[Experiment, TrialLog]]:
    """A short trial, and its log in a folder that is deleted in the end."""
    reference = study.hw_run.reference.model_copy(update={"angle_deg": _BEND_DEG})
    directions = study.hw_run.directions[:1]
    settings = study.hw_run.model_copy(update={"reference": reference, "horizon": _HORIZON, "directions": directions})
    with tempfile.TemporaryDirectory(prefix="wristctl-check-") as scratch:
        log = log_of(Path(scratch), settings, study.wrist)
        try:
            yield Experiment(settings, study.wrist, [Trial(0, directions[0], 0, 0.0, 0)], log), log
        finally:
            log.close()


def _trial(rig: GuardedRig, study: Study) -> tuple[bool, str]:
    """A trial of a small bend: homed, followed, and back."""
    with _experiment(study) as (experiment, log):
        experiment.run(RigStand(rig))
    late = max(experiment.timing.late)
    odd = f"; odd: {experiment.odd[0]}" if experiment.odd.get(0) else ""
    error = max(abs(value) for row in log.last for name, value in row.items() if name.startswith("error"))
    passed = math.degrees(error) < _BEND_DEG / 2.0
    return (
        passed,
        f"{_BEND_DEG:g} deg by pid-ff: error {math.degrees(error):.2g} deg at most in its last second, ticks "
        f"{1e3 * late:.2g} ms late at most{odd}",
    )


def _allowed(settings: HwRunSettings, wrist: WristParameters, facts: Facts) -> list[str]:
    """What a trial may do with this rig, in lines."""
    safety = settings.safety
    return [
        f"A trial may pull each tendon with {wrist.pretension:g} to {spared(wrist, settings).tension_limit:.3g} N; it "
        f"stops beyond {settings.tension_factor:g} times what its simulation needs, {LEAST:g} N at least.",
        f"It may bend the wrist to {safety.angle_deg:g} deg at {safety.rate:g} rad/s, and reel "
        f"{1e3 * safety.travel:.3g} mm from zero at {1e3 * facts.limits.rate:.3g} mm/s.",
        f"It ticks every {1e3 * settings.control_period:g} ms, and stops after {1e3 * safety.stale:g} ms without a "
        f"bend, at a tick {1e3 * safety.late:g} ms late, or with a wrist {safety.follow_deg:g} deg off its motors.",
    ]
