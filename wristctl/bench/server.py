"""The emulated bench in real time: the board on a line, its pictures in a file, for any client."""

from __future__ import annotations

import logging
import math
import time
from contextlib import suppress
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wristctl.bench.bench_record import BenchRecord
from wristctl.bench.bench_wrist import MotorMotion, Truth
from wristctl.bench.bystander import Bystander
from wristctl.bench.line import FaultyLine
from wristctl.bench.motors import PERIOD
from wristctl.bench.rig import Rig
from wristctl.board.emulator.chip import FREQUENCY
from wristctl.board.emulator.serve import Line, serve
from wristctl.config.errors import UserError
from wristctl.config.plant import Disturbances
from wristctl.seeds import Entropy

log = logging.getLogger(__name__)

_LINGER = 2.0
"""Seconds for which the bench goes on after its client has gone: long enough for the board to stop the motors."""
_TOGETHER = FREQUENCY // 500
"""Cycles that the wrist follows in one go."""


class BenchServer:
    """Runs a rig against the wall clock. Exposures go to `film`, what the board did to the file `record`.

    Requests of a client come through `control` as a method's name and its arguments, and are answered; their times
    are of `time.monotonic`. When that client has gone the bench ends after a while; without `control` at `stop`.
    """

    def __init__(
        self, rig: Rig, line: Line, film: Connection, record: Path | None = None, control: Connection | None = None,
        bystander: Bystander | None = None,
    ) -> None:  # fmt: skip
        self._rig, self._film, self._control, self._bystander = rig, film, control, bystander
        self._line = FaultyLine(line, rig.faults, lambda: rig.chip.cycles / FREQUENCY, rig.settings.line.latency_timer)
        self._record = None if record is None else BenchRecord(record, rig.wrist, self._line)
        self._start, self._until = time.monotonic(), math.inf
        self._taken, self._reset = -1, -math.inf
        self._energised = False
        self._edges: list[NDArray[np.void]] = []
        rig.chip.run(FREQUENCY // 100)
        rig.catch_up()  # so that what is to be compiled is, before real time begins
        self.camera: str | None = None
        """Where its pictures can be had as a stream."""
        try:
            self.camera = film.recv()
        except EOFError as error:
            fix = "give it more memory, or see with --debug"
            raise UserError("the rendered camera's process has died", fix=fix, exit_code=4) from error

    def run(self) -> None:
        """Serve until the end; then the line is closed."""
        try:
            serve(self._rig.chip, self._line, lambda: time.monotonic() < self._until, self._round)
        finally:
            self._line.close()
            self._film.close()
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
        return motion._replace(last_step=tuple(at if at is None else at + self._start for at in motion.last_step))

    def stop(self) -> None:
        """End soon."""
        self._until = -math.inf

    def _round(self, edges: NDArray[np.void], start: float) -> None:
        """What is due again and again: `edges` are the chip's newest, its clock was 0 at `start`.

        The line is seen to at once, for a client waits for it; all else once in a while.
        """
        self._start = start
        self._line.pass_on()
        self._edges.append(edges)
        if self._rig.chip.cycles < self._rig.wrist.time * FREQUENCY + _TOGETHER:
            return
        self._rig.catch_up(np.concatenate(self._edges))
        self._edges.clear()
        self._reset_board()
        self._take_frame()
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

    def _take_frame(self) -> None:
        shutter = self._rig.shutter
        number = shutter.newest(0.0)
        if number > self._taken:
            self._taken = number
            if self._line.there and shutter.arrives(number):
                with suppress(BrokenPipeError):  # a camera that has died gives no frames
                    self._film.send((shutter.expose(number), self._start))

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
            theta = self._rig.wrist.truth(self._rig.wrist.time - PERIOD).angle[-1]
            log.info("drives %s, wrist at %.1f deg", "on" if energised else "off", np.rad2deg(theta))
