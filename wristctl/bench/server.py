"""The emulated bench in real time: the board on a line, its pictures in a file, for any client."""

import json
import logging
import math
import os
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wristctl.bench.bench_wrist import BenchWrist, MotorMotion, Truth
from wristctl.bench.emulated_rig import Bystander, EmulatedRig
from wristctl.bench.faults import Faults
from wristctl.bench.motors import PERIOD
from wristctl.bench.usb_adapter import UsbAdapter, hand_over_of
from wristctl.board.emulator.chip import FREQUENCY
from wristctl.board.emulator.serve import Line, serve
from wristctl.config.bench import SerialLine
from wristctl.config.plant import Disturbances
from wristctl.errors import UserError
from wristctl.seeds import Entropy

log = logging.getLogger(__name__)


class FaultyLine:
    """Another line behind a USB adapter, with faults: port-lost, for good, and host-silent.

    `cycles` is the board's clock. What both sides say is passed on in its time, by `pass_on` and `receive`.
    """

    def __init__(self, line: Line, faults: Faults, cycles: Callable[[], int], settings: SerialLine) -> None:
        self.address = line.address
        self.there = False
        """Whether a client is there."""
        self.heard: float | None = None
        """When the board was last sent something [s on its clock]; None: never."""
        self._line, self._faults, self._cycles = line, faults, cycles
        self._lost = False
        self._usb = UsbAdapter(hand_over_of(settings))

    def wait(self, timeout: float) -> bool:
        """Wait until there may be bytes, at most `timeout` s; whether a client is there."""
        if not self._lost and self._faults.on("port-lost", self._clock()):
            self.close()
        if self._lost:
            time.sleep(timeout)  # the board still has its power: it is not to be reset
        else:
            self.there = self._line.wait(timeout)
        return self.there

    def receive(self) -> bytes:
        """Receive the clients' bytes that have arrived, as far as the board hears them."""
        received = b"" if self._lost else self._line.receive()
        if not self._faults.on("host-silent", self._clock()):
            self._usb.take_from_host(received, self._cycles())
        if arrived := self._usb.give_board(self._cycles()):
            self.heard = self._clock()
        return arrived

    def send(self, data: bytes) -> None:
        """Give bytes to every client, once their time has come."""
        self._usb.take_from_board(data, self._cycles())
        self.pass_on()

    def pass_on(self) -> None:
        """Hand over what is held, if it is time."""
        self._usb.take_from_board(b"", self._cycles())
        if (given := self._usb.give_host(self._cycles())) and not self._lost:
            self._line.send(given)

    def _clock(self) -> float:
        return self._cycles() / FREQUENCY

    def close(self) -> None:
        """Send the clients away."""
        if not self._lost:
            self._lost = True
            self._line.close()


SCHEMA = "wristctl.bench/1"
_LEAST_INTERVAL = 0.05


class BenchRecord:
    """A JSON file, written anew when motors have moved or been switched, at most 20 times a second.

    Times are of `time.monotonic`; lists are by axis, in two planes `theta` by plane.
    """

    def __init__(self, path: Path, wrist: BenchWrist, line: FaultyLine) -> None:
        self._path, self._wrist, self._line = path, wrist, line
        self._written, self._last = -math.inf, wrist.motion

    def look(self, start: float) -> None:
        """Write if there is something new; the board's clock was 0 at `start`."""
        if time.monotonic() - self._written >= _LEAST_INTERVAL and self._wrist.motion != self._last:
            self.write(start, ended=False)

    def write(self, start: float, ended: bool) -> None:
        """Write, in one piece."""
        self._last, self._written = self._wrist.motion, time.monotonic()
        newest = self._wrist.truth(self._wrist.time - PERIOD)
        record = {
            "schema": SCHEMA,
            "ended": ended,
            "time": self._written,
            "last_heard": _moved(self._line.heard, start),
            "last_step": [_moved(step_time, start) for step_time in self._last.last_step],
            "steps": self._last.steps,
            "energised": self._last.energised,
            "theta": newest.angle[-1].tolist(),
            "pull": newest.pull.sum(axis=0).tolist(),
        }
        part = self._path.with_name(f".{self._path.name}.part")
        part.write_text(json.dumps(record, indent=2) + "\n")
        os.replace(part, self._path)


def _moved(time: float | None, start: float) -> float | None:
    return None if time is None else start + time


# Seconds for which the bench goes on after its client has gone: long enough for the board to stop the motors.
_LINGER = 2.0
# Cycles that the wrist follows in one go.
_TOGETHER = FREQUENCY // 500


class BenchServer:
    """Runs a rig against the wall clock. Exposures go to each camera's `films`, what the board did to `record`.

    Requests of a client come through `control` as a method's name and its arguments, and are answered; their times
    are of `time.monotonic`. When that client has gone the bench ends after a while; without `control` at `stop`.
    """

    def __init__(
        self, rig: EmulatedRig, line: Line, films: Sequence[Connection], record: Path | None = None,
        control: Connection | None = None, bystander: Bystander | None = None,
    ) -> None:  # fmt: skip
        self._rig, self._films, self._control, self._bystander = rig, films, control, bystander
        self._line = FaultyLine(line, rig.faults, lambda: rig.chip.cycles, rig.settings.line)
        self._record = None if record is None else BenchRecord(record, rig.wrist, self._line)
        self._start, self._until = time.monotonic(), math.inf
        self._taken, self._reset = [-1] * len(films), -math.inf
        self._energised = False
        self._edges: list[NDArray[np.void]] = []
        rig.chip.run(FREQUENCY // 100)
        rig.catch_up()  # so that what is to be compiled is, before real time begins
        try:
            self.cameras: list[str | None] = [film.recv() for film in films]
            """Address of each camera's stream."""
        except EOFError as error:
            fix = "give it more memory, or see with --debug"
            raise UserError("the rendered camera's process has died", fix=fix, exit_code=4) from error

    def run(self) -> None:
        """Serve until the end; then the line is closed."""
        try:
            serve(self._rig.chip, self._line, lambda: time.monotonic() < self._until, self._round)
        finally:
            self._line.close()
            for film in self._films:
                film.close()
            if self._record is not None:
                self._record.write(self._start, ended=True)

    def face(self, direction: str) -> None:
        """As `Bench.face`."""
        self._rig.wrist.face(direction)

    def disturb(self, disturbances: Disturbances, start: float) -> None:
        """As `Bench.disturb`."""
        self._rig.disturb(disturbances, start - self._start)

    def begin(self, start: float, disturbances: Disturbances | None, noise: Entropy | None = None) -> None:
        """As `Bench.begin`."""
        self._rig.begin(start - self._start, disturbances, noise)

    def truth(self, since: float) -> Truth:
        """As `Bench.truth`."""
        truth = self._rig.wrist.truth(since - self._start)
        return truth._replace(time=truth.time + self._start)

    def motion(self) -> MotorMotion:
        """As `Bench.motion`."""
        motion = self._rig.wrist.motion
        return motion._replace(
            last_step=tuple(tick if tick is None else tick + self._start for tick in motion.last_step)
        )

    def stop(self) -> None:
        """End soon."""
        self._until = -math.inf

    def _round(self, edges: NDArray[np.void], start: float) -> None:
        """Do the periodic work: `edges` are the chip's newest, its clock was 0 at `start`.

        The line is seen to at once, for a client waits for it; all else once in a while.
        """
        self._start = start
        self._line.pass_on()
        self._edges.append(edges)
        if self._rig.chip.cycles < self._rig.wrist.time * FREQUENCY + _TOGETHER:
            return
        self._rig.catch_up(np.concatenate(self._edges))
        self._edges.clear()
        self._rig.weigh()
        self._reset_board()
        self._take_frames()
        if self._control is not None:
            self._answer(self._control)
        if self._bystander is not None:
            self._bystander.look()
        if self._record is not None:
            self._record.look(start)
        self._tell()

    def _reset_board(self) -> None:
        due = self._rig.faults.next("board-reset", self._reset)
        if due <= self._rig.wrist.time:
            self._rig.chip.reset()
            self._reset = due

    def _take_frames(self) -> None:
        for camera, (eye, film) in enumerate(zip(self._rig.eyes, self._films, strict=True)):
            number = eye.newest(0.0)
            if number > self._taken[camera]:
                self._taken[camera] = number
                if self._line.there and eye.arrives(number):
                    with suppress(BrokenPipeError):  # a camera that has died gives no frames
                        film.send((eye.expose(number), self._start))

    def _answer(self, control: Connection) -> None:
        try:
            while self._until == math.inf and control.poll():
                name, *arguments = control.recv()
                request: Any = getattr(self, name)
                control.send(request(*arguments))
        except (EOFError, OSError):
            self._until = min(self._until, time.monotonic() + _LINGER)

    def _tell(self) -> None:
        energised = any(self._rig.wrist.motion.energised)
        if energised != self._energised:
            self._energised = energised
            theta = np.rad2deg(np.atleast_1d(self._rig.wrist.truth(self._rig.wrist.time - PERIOD).angle[-1]))
            log.info("drives %s, wrist at %s deg", "on" if energised else "off", ", ".join(f"{a:.1f}" for a in theta))
