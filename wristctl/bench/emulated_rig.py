"""Rig of the emulated bench, in virtual as in real time: board, wrist, camera and faults."""

import logging
import os
import re
import select
from collections.abc import Callable
from functools import cached_property, partial
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from wristctl.bench.bench_wrist import BenchWrist
from wristctl.bench.faults import CameraFaults, Faults
from wristctl.bench.load_cells import LoadCells
from wristctl.bench.shutter import Shutter
from wristctl.board.emulator.atmega2560 import Atmega2560
from wristctl.board.emulator.chip import NEVER
from wristctl.config.bench import BenchSettings, RenderedCamera
from wristctl.config.camera import Markers
from wristctl.config.plant import Disturbances
from wristctl.config.wrist import WristParameters
from wristctl.seeds import Entropy, stream
from wristctl.vision.scene import Scene
from wristctl.wrist.directions import DIRECTIONS

log = logging.getLogger(__name__)


def planes_seen(markers_2: Markers | None) -> tuple[Literal[0, 1] | None, ...]:
    """Planes that a bench's cameras look at: with a second camera's markers 0 and 1, else None, the one that bends."""
    return (None,) if markers_2 is None else (0, 1)


class Eye(Shutter):
    """A camera of the rig: when it takes which pictures, and what goes wrong with it."""

    def __init__(
        self, settings: RenderedCamera, faults: CameraFaults, wrist: BenchWrist, stream: Entropy,
        scene: Callable[[], Scene],
    ) -> None:  # fmt: skip
        super().__init__(settings, faults, wrist, stream)
        self.faults, self._scene = faults, scene

    @cached_property
    def scene(self) -> Scene:
        """Scene that draws its pictures; made when the first is wanted."""
        return self._scene()


class EmulatedRig:
    """A wrist that hangs on a chip's pins, before its cameras; all times are of the chip's clock [s].

    Only through load cells does the wrist act back on the board: beyond `weigh`, which is to be called in time, it may
    follow when somebody looks, and does the same however often that is. `seed` is the root of its random streams. With
    the markers of a second camera, `markers_2`, the wrist bends in two planes.
    """

    def __init__(
        self, settings: BenchSettings, wrist: WristParameters, seed: int, markers: Markers | None = None,
        chip: Atmega2560 | None = None, markers_2: Markers | None = None,
    ) -> None:  # fmt: skip
        self.settings = settings
        self.chip = chip or Atmega2560()
        self.faults = Faults(settings.faults)
        positive, plant = (markers or Markers()).positive, stream(seed, "bench plant")
        self.wrist = BenchWrist(settings, wrist, plant, self.faults, positive, 1 if markers_2 is None else 2)
        eyes = [(markers, settings.camera, "bench camera"), (markers_2, settings.camera_2, "bench camera 2")]
        self.eyes = tuple(
            Eye(
                camera, CameraFaults(self.faults, number), self.wrist, stream(seed, name),
                partial(Scene, camera.scene, wrist, seen, settings.plant.model, plane),
            )
            for number, (plane, (seen, camera, name)) in enumerate(zip(planes_seen(markers_2), eyes, strict=False), 1)
        )  # fmt: skip
        cells = settings.load_cells
        self.cells = (
            None if cells is None else LoadCells(cells, self.chip, self.faults, stream(seed, "bench load cells"))
        )

    def catch_up(self, edges: NDArray[np.void] | None = None) -> None:
        """Let the wrist follow the chip; `edges` where somebody has taken them from it already."""
        self.wrist.hear(self.chip.events() if edges is None else edges)
        self.wrist.follow(self.chip.cycles)

    def weigh(self) -> int:
        """Let load cells convert what is due by now; the cycle at which the next conversion ends, NEVER without any."""
        if self.cells is None:
            return NEVER
        if self.cells.next <= self.chip.cycles:
            self.catch_up()
            self.cells.convert(self.wrist)
        return self.cells.next

    def face(self, direction: str) -> None:
        """Turn the bench so that this direction's plane is the one that bends and is seen; in two planes nothing."""
        self.catch_up()
        self.wrist.face(direction)

    def disturb(self, disturbances: Disturbances, start: float) -> None:
        """Let these act, their times counted from `start`."""
        self.catch_up()
        self.wrist.disturb(disturbances, start)

    def begin(self, start: float, disturbances: Disturbances | None = None, noise: Entropy | None = None) -> None:
        """A trial's motion begins at `start`: disturbances, faults and frames of the stream `noise` count from it."""
        self.catch_up()
        self.wrist.begin(disturbances or Disturbances(), start)
        if noise is not None:
            for number, eye in enumerate(self.eyes):
                eye.begin(start, (*noise, number) if number else noise)
        self.faults.begin(start)


_BUTTON = "G", 0
_HANG = re.compile(r"hang (?P<axis>[0-3]) (?P<mass>\d+(\.\d*)?)")
_ACTS = f"press, release, hang AXIS KG, or one of {', '.join(DIRECTIONS)}"


class Bystander:
    """Does what comes as lines from a file descriptor; never waits for one."""

    def __init__(self, rig: EmulatedRig, typed: int) -> None:
        self._rig, self._typed = rig, typed
        self._line = b""
        self._there = True

    def look(self) -> None:
        """Do what has been typed since the last look."""
        while self._there and self._may_read() and select.select([self._typed], [], [], 0.0)[0]:
            read = os.read(self._typed, 256)
            self._there = bool(read)
            *lines, self._line = (self._line + read).split(b"\n")
            for line in lines:
                self.do(line.decode(errors="replace").strip())

    def do(self, act: str) -> None:
        """Press or release the button, hang a weight on a load cell, or turn the wrist to bend toward a direction."""
        cells, hung = self._rig.cells, _HANG.fullmatch(act)
        if act in ("press", "release"):
            self._rig.chip.drive(*_BUTTON, act == "press")  # an open contact stops
        elif act in DIRECTIONS:
            self._rig.face(act)
        elif cells is not None and hung is not None:
            cells.hanging[int(hung["axis"])] = float(hung["mass"])
        else:
            log.warning("nobody knows how to %r: %s", act, _ACTS)
            return
        log.info("done: %s", act)

    def _may_read(self) -> bool:
        """In the background a terminal is somebody else's: reading it would stop this process."""
        return not os.isatty(self._typed) or os.tcgetpgrp(self._typed) == os.getpgrp()
