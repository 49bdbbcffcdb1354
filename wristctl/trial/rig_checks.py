"""Checks of one connected rig against its facts, each with what was measured."""

import math
from collections.abc import Callable

import numpy as np

from wristctl.arrays import Array
from wristctl.config.hw_run import HwRunSettings
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.rig import Refused, Spread, most, value
from wristctl.trial.expected_moves import ExpectedMoves
from wristctl.trial.guarded_rig import GuardedRig, RigStop
from wristctl.trial.homing import Finder, rest_of
from wristctl.trial.rig_drive import RigTracking
from wristctl.trial.rig_motors import RigMotors
from wristctl.trial.rig_stand import PLANE, halt_rig
from wristctl.trial.rig_words import SLOW_CALL
from wristctl.wrist.tendon_layout import TendonLayout

# Seconds for which looks are watched, a response to a step, and between two polls of a rig.
_WATCHED, _RESPONSE, _POLL = 1.0, 0.5, 1e-3
# Steps whose responses are timed.
_STEPS = 6
# Share of a facts' rate of looks that must come, and multiple of its noise that may.
_SELDOM, _NOISY = 0.7, 2.0
# Share of the looks that are news of a sensor that is faster than anybody asks it.
_ALWAYS = 0.9
# Seconds by which looks may be dated wrongly, and by which a clock may err.
_DATED, _CLOCK = 3e-3, 0.05
# Share of a step's bend from which it has begun, and beyond which a stopped motor has gone on.
_BEGUN, _GONE_ON = 0.1, 0.6


class Unfit(UserError):
    """A check that fails, in words."""


def said(error: UserError) -> str:
    """An error as a check says it, with the line of the rig's code where it is known."""
    what, where = str(error.what).removeprefix("stopped: "), str(error.where)
    return f"{what} ({where})" if ".py:" in where and not isinstance(error, Unfit) else what


class RigTrier:
    """Checks of one connected rig, in the order in which they are made."""

    def __init__(self, rig: GuardedRig, settings: HwRunSettings, wrist: WristParameters, layout: TendonLayout) -> None:
        self._rig, self._facts, self._settings = rig, rig.facts, settings
        self._wrist, self._layout = wrist, layout
        self._noise = 0.0
        self._about: list[int] = []
        self._slack: Array = np.zeros(0)
        self._metres: Array = np.zeros(0)
        self.checks: dict[str, Callable[[], str]] = {
            "clock": self._clock,
            "connect": self._connect,
            "looks": self._looks,
            "noise": self._noisy,
            "sent": self._sent,
            "refuses": self._refuses,
            "sense": self._sense,
            "scale": self._scale,
            "delay": self._delay,
            "stop": self._stop,
        }

    def _clock(self) -> str:
        """It goes on by what is waited for, and does not wait for what has passed."""
        begin = self._rig.now()
        self._rig.wait_until(begin + _CLOCK)
        went = self._rig.now() - begin
        if not _CLOCK <= went + 1e-9 <= 3.0 * _CLOCK:
            raise Unfit(f"the clock goes on by {1e3 * went:.3g} ms where {1e3 * _CLOCK:g} ms are waited for")
        self._rig.wait_until(begin)
        back = self._rig.now() - begin - went
        if back > 0.5 * _CLOCK:
            raise Unfit(f"wait_until a moment that has passed takes {1e3 * back:.3g} ms")
        return f"{'virtual' if self._rig.virtual else 'wall'}, goes on by {1e3 * went:.3g} ms in {1e3 * _CLOCK:g} ms"

    def _connect(self) -> str:
        stood = self._rig.connect()
        self._motors, self._tracking = RigMotors(self._rig, self._settings, stood), RigTracking(self._rig)
        self._plane = PLANE if self._facts.planes == 1 else ""
        self._expected = ExpectedMoves(self._settings, self._wrist, self._plane, self._layout)
        silent = min(0.2, (self._facts.silence or math.inf) / 3.0)
        before = self._silent_looks(silent)[:, 1:]
        self._rig.send(stood)
        self._motors.wait(0.3)
        after = self._silent_looks(silent)[:, 1:]
        if np.isfinite(before).all() and np.isfinite(after).all():
            moved = _size(np.median(after, axis=0) - np.median(before, axis=0))
            if moved > math.radians(self._settings.homing.bend_deg):
                raise Unfit(f"the targets that connect() returns bend the wrist by {math.degrees(moved):.1f} deg")
        return f"stands at {', '.join(f'{target:.4g}' for target in stood)} {self._facts.unit}"

    def _news(self, seconds: float) -> Array:
        """Looks that are news, of so long [s]: their time [s] and bend (P,) [rad], (n, 1 + P). `_arrived` says when."""
        rows, newest, end = list[list[float]](), -math.inf, self._rig.now() + seconds
        self._arrived, self._polls, took = list[float](), 0, list[tuple[float, ...]]()
        while self._rig.now() < end:
            seen, now = self._rig.look(), self._rig.now()
            took.append(tuple(self._rig.took.values()))
            if seen.time > newest and np.isfinite(seen.bend).all():
                newest = seen.time
                rows.append([seen.time, *seen.bend.tolist()])
                self._arrived.append(now)
            self._motors.wait(min(5.0 * _POLL, max(_POLL, 0.25 / value(self._facts.sensor.rate))))
            self._polls += 1
        self._takes = dict(zip(self._rig.took, np.median(took, axis=0).tolist(), strict=True))
        return np.array(rows).reshape(len(rows), 1 + self._facts.planes)

    def _seen(self, seconds: float) -> Array:
        news = self._news(seconds)
        if not len(news):
            raise Unfit(f"no look of {seconds:g} s is news: the bend is nan, or its time stands still")
        bends: Array = np.median(news[:, 1:], axis=0)
        return bends

    def _looks(self) -> str:
        """News come as often as facts say, are no older, and are not of the future."""
        news, sensor = self._news(_WATCHED), self._facts.sensor
        if len(news) < 3:
            raise Unfit(f"{len(news)} looks in {_WATCHED:g} s are news: their bend is nan, or their time stands still")
        self._rest = news
        self._judge_calls()
        rate = (len(news) - 1) / (self._arrived[-1] - self._arrived[0])
        least = sensor.rate.low if isinstance(sensor.rate, Spread) else sensor.rate
        ages = np.array(self._arrived) - news[:, 0]
        if ages.min() < -1e-3:
            raise Unfit(f"a look is {-1e3 * ages.min():.3g} ms ahead of the clock")
        asked = _SELDOM / self._settings.control_period
        if rate < _SELDOM * least and (len(news) < _ALWAYS * self._polls or rate < asked):
            raise Unfit(f"{rate:.3g} looks/s are news, and facts.sensor.rate is {value(sensor.rate):g}")
        age, meant = float(np.median(ages)), sensor.delay
        off = 1.0 / value(sensor.rate) + 5e-3
        if not _low(meant) - off <= age <= most(meant) + off:
            raise Unfit(f"looks are {1e3 * age:.3g} ms old, and facts.sensor.delay is {1e3 * value(meant):g} ms")
        facts = f"{value(sensor.rate):g} and {1e3 * value(meant):g}"
        return f"{rate:.3g} news/s, {1e3 * age:.3g} ms old when they come (facts: {facts})"

    def _judge_calls(self) -> None:
        """Raises Unfit where look() and send() take longer than a tick; it names the slower first."""
        period = self._settings.control_period
        (slow, longer), (other, shorter) = sorted(self._takes.items(), key=lambda call: -call[1])
        if longer + shorter > period:
            beside = f" and {other} {1e3 * shorter:.3g} ms" if longer <= period else ""
            problem = f"{slow} takes {1e3 * longer:.3g} ms{beside}, and a tick of trials is {1e3 * period:g} ms"
            raise Unfit(problem, fix=SLOW_CALL)

    def _noisy(self) -> str:
        self._noise = float(self._rest[:, 1:].std(axis=0).max())
        facts, found = most(self._facts.sensor.noise_deg), math.degrees(self._noise)
        if found > _NOISY * facts + 5e-3:
            raise Unfit(f"a bend at rest scatters by {found:.2g} deg, and facts.sensor.noise_deg is {facts:g}")
        return f"{found:.2g} deg at rest (facts: {facts:g})"

    def _sent(self) -> str:
        """What send() returns is what was asked for, but for the resolution."""
        finest = max(value(self._facts.drive.resolution), 1e-6)
        asked = self._motors.targets_at(np.full(self._layout.directions.shape, -self._settings.homing.move))
        sent = self._rig.send(asked)
        off = float(np.abs(sent - asked).max()) * self._facts.metres_per_unit
        self._motors.left_at(asked)
        self._motors.reel(np.zeros(len(asked)))
        if off > 1.01 * finest:
            raise Unfit(
                f"send() returns {1e3 * off:.3g} mm off what was asked for; the resolution is {1e3 * finest:.3g} mm"
            )
        return f"within {1e6 * off:.3g} um of what was asked for"

    def _refuses(self) -> str:
        """Targets that are no number or beyond the limits are Refused, and nothing moves. None of them reels in."""
        stood, count = self._motors.targets, len(self._motors.targets)
        beyond = -1.5 * self._facts.limits.travel / self._facts.metres_per_unit
        wrong = {"nan": math.nan, "-inf": -math.inf, f"{beyond:.4g} {self._facts.unit}": beyond}
        before = self._seen(0.2)
        for words, target in wrong.items():
            targets = stood.copy()
            targets[count - 1] = target if not math.isfinite(target) else stood[count - 1] + target
            try:
                self._rig.send(targets)
            except RigStop as error:
                if not isinstance(error.__cause__, Refused):
                    raise Unfit(f"a target of {words} is no Refused, but: {said(error)}") from error
            else:
                self._rig.send(stood)
                raise Unfit(f"a target of {words} is not refused: raise Refused in send(), before anything moves")
        self._rig.send(stood)
        self._motors.wait(0.2)
        moved = _size(self._seen(0.2) - before)
        if moved > math.radians(self._settings.homing.bend_deg):
            raise Unfit(f"refused targets have bent the wrist by {math.degrees(moved):.1f} deg")
        return f"{', '.join(wrong)}: each Refused, and nothing moves"

    def _sense(self) -> str:
        self._finder = Finder(self._motors, self._tracking, self._settings, self._wrist, self._plane, self._expected)
        step, count = self._settings.actuator.step_length, len(self._layout.places)
        self._about = [self._finder.sense(tendon, (1, -1)) for tendon in range(count)]
        return "; ".join(
            f"target {tendon}: bends after {1e3 * step * about:.2f} mm" for tendon, about in enumerate(self._about, 1)
        )

    def _scale(self) -> str:
        step, expected = self._settings.actuator.step_length, self._expected
        self._finder.slacken()
        lines, _, taut = self._finder.lines(self._about)
        self._slack = step * np.array(taut)
        self._metres = step * np.array([line.per_radian for line in lines])
        meant = [step * expected.steps(axis=tendon) for tendon in range(len(lines))]
        toward = [expected.place(k) if math.isnan(found) else found for k, found in enumerate(self._finder.directions)]
        return "; ".join(
            f"target {tendon}: {1e3 * metres:.3g} mm/rad (model {1e3 * model:.3g}) toward "
            f"{math.degrees(angle) % 360.0:.0f} deg"
            for tendon, (metres, model, angle) in enumerate(zip(self._metres, meant, toward, strict=True), 1)
        )

    def _rests(self) -> Array:
        rest = rest_of(self._motors, self._tracking, self._expected, self._settings.homing)
        return np.array([rest.theta, rest.beside][: self._facts.planes])

    def _let_go(self) -> None:
        self._motors.reel(self._slack - 2.0 * self._settings.homing.pull)

    def _delay(self) -> str:
        """From send() until the bend changes, by the times of looks: what the drive's delay and lag explain.

        A wrist's own inertia delays what is seen of a step, and makes its bend begin as the square of time: so far back
        the first looks at it are extrapolated. The bend of one that hardly has any begins before that.
        """
        pull, drive, sensor = self._settings.homing.pull, self._facts.drive, self._facts.sensor
        times = np.array([self._step(number % len(self._slack), pull)[0] for number in range(_STEPS)])
        seen, dead = np.median(times, axis=0).tolist()
        off, winds = 1.0 / value(sensor.rate) + _DATED, pull / self._facts.limits.rate
        facts = f"{1e3 * value(drive.delay):g} and a lag of {1e3 * value(drive.lag):g}"
        acts = f"acts after {1e3 * max(0.0, dead):.0f} ms, and " if math.isfinite(dead) else ""
        told = f"a target {acts}shows after {1e3 * seen:.0f} ms"
        if seen < _low(drive.delay) - off or dead > most(drive.delay) + 2.0 * most(drive.lag) + winds + off:
            raise Unfit(f"{told}, and facts.drive says {facts} ms; or look() dates its bends wrongly")
        return f"{told} +-{1e3 * float(np.std(times[:, 0])):.1f} (facts: {facts})"

    def _step(self, tendon: int, pull: float, stop: bool = False) -> tuple[tuple[float, float], float]:
        """A step of a tendon beyond its taut point: after how many seconds it shows, and acts, and its bend's share.

        With `stop` the rig is stopped as soon as the step is sent.
        """
        position = self._slack - 2.0 * pull
        position[tendon] = self._slack[tendon]
        self._motors.reel(position)
        rest, toward = self._rests(), self._expected.toward(tendon)
        position[tendon] += pull
        sent_at = self._rig.now()
        self._rig.send(self._motors.targets_at(position))
        if stop:
            self._rig.stop()
            news = self._silent_looks(_RESPONSE)
        else:
            self._motors.left_at(self._motors.targets_at(position))
            news = self._news(_RESPONSE)
        along = (news[:, 1:] - rest) @ toward
        meant, last = pull / float(self._metres[tendon]), float(np.median(along[-5:]))
        if not stop:
            self._let_go()
            if last < 0.4 * meant:
                raise Unfit(
                    f"a step of target {tendon + 1} bends the wrist by {math.degrees(last):.2f} of "
                    f"{math.degrees(meant):.2f} deg"
                )
        since, least = news[:, 0] - sent_at, max(_BEGUN * meant, 4.0 * self._noise)
        clear = max(1.5 * least, min(4.0 * least, 0.8 * last))
        shown, further = (_passes(since, along, bend) for bend in (least, clear))
        return (shown, shown - (further - shown) / (math.sqrt(clear / least) - 1.0)), last / meant

    def _silent_looks(self, seconds: float) -> Array:
        """All looks of so long [s], as `_news` has them, while nothing is sent."""
        rows, end = list[list[float]](), self._rig.now() + seconds
        while self._rig.now() < end:
            seen = self._rig.look()
            rows.append([seen.time, *seen.bend.tolist()])
            self._rig.wait_until(self._rig.now() + 5.0 * _POLL)
        return np.array(rows)

    def _stop(self) -> str:
        """A step that is stopped at once goes no further, where the rig's delay leaves the time for it."""
        drive = self._facts.drive
        _, share = self._step(0, self._settings.homing.pull, stop=True)
        halted = halt_rig(self._rig, self._settings)
        if not halted.verified:
            raise Unfit(f"after stop() {halted.how}")
        if value(drive.delay) + value(drive.lag) > 4.0 * _POLL and share > _GONE_ON:
            raise Unfit(
                f"after stop() the motors have gone on: {100.0 * share:.0f} % of a step that was stopped at once"
            )
        done = f"{100.0 * max(0.0, share):.0f} % of a step that was stopped at once"
        return f"stands {1e3 * halted.seconds:.0f} ms after a second stop(); {done}"


def _passes(since: Array, along: Array, bend: float) -> float:
    """Seconds after which a bend goes beyond this one for good; nan where it never does."""
    past = np.flatnonzero((along > bend) & (since >= 0.0))
    if not len(past):
        return math.nan
    first = int(past[0])
    if first == 0 or along[first - 1] >= bend:
        return float(since[first])
    return float(np.interp(bend, along[first - 1 : first + 1], since[first - 1 : first + 1]))


def _low(quantity: float | Spread) -> float:
    return quantity.low if isinstance(quantity, Spread) else quantity


def _size(bend: Array) -> float:
    return math.hypot(*bend)
