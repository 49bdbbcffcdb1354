"""The emulated bench in virtual time: board, wrist and camera in this process, the same in every run."""

import math
from collections.abc import Callable

import numpy as np

from wristctl.bench.bench_wrist import MotorMotion, Truth
from wristctl.bench.emulated_rig import EmulatedRig
from wristctl.bench.faults import Faults
from wristctl.bench.shutter import picture
from wristctl.bench.usb_adapter import HandOver, UsbAdapter, hand_over_of
from wristctl.board.board_errors import PortLost
from wristctl.board.emulator.atmega2560 import Atmega2560, VirtualTransport
from wristctl.board.emulator.chip import FREQUENCY, NEVER
from wristctl.config.bench import BenchSettings, FaultKind, SerialLine
from wristctl.config.camera import Markers
from wristctl.config.wrist import WristParameters
from wristctl.vision.camera import CameraError, Frame

_BUTTON = "G", 0


class BenchTransport(VirtualTransport):
    """The wire to an emulated chip in the same process, with the faults of cable, host and board.

    A lost port stays lost; the board runs on, also while the host can only `wait`. `weigh` gives the board's load cells
    what they have measured by now, and says when to be called again [cycles].
    """

    def __init__(
        self, chip: Atmega2560, faults: Faults, line: SerialLine | None = None, weigh: Callable[[], int] = lambda: NEVER
    ) -> None:
        super().__init__(chip)
        self._weigh = weigh
        self._hand_over = hand_over_of(line or SerialLine())
        self._usb = UsbAdapter(self._hand_over)
        self._faults, self._lost, self._reset = faults, False, -math.inf
        self._noise = np.random.default_rng(0)
        self._happened: set[tuple[FaultKind, float]] = set()
        self._pressed = False

    def write(self, data: bytes) -> None:
        """Give bytes to the adapter. Raises PortLost."""
        self._see_port()
        if not self._faults.on("host-silent", self.now()):
            self._usb.take_from_host(self._garbled(data), self.chip.cycles)

    def read(self, timeout: float) -> bytes:
        """Read the chip's bytes; runs it for up to `timeout` s until there are some. Raises PortLost."""
        self._see_port()
        self._stand_still("answers-held")
        end = self.chip.cycles + max(1, round(timeout * FREQUENCY))
        while not (data := self._usb.give_host(self.chip.cycles)) and self.chip.cycles < end:
            self._run(end)
            self._see_port()
        return self._garbled(data)

    def wait(self, seconds: float) -> None:
        """Run the chip for so long."""
        self._run_until(self.chip.cycles + round(seconds * FREQUENCY))
        self._stand_still("host-pause")

    def _run_until(self, end: int) -> None:
        while self.chip.cycles < end:
            self._run(end)

    def _run(self, end: int) -> None:
        """Run towards `end`, at most until the adapter has to be looked at, or to the next reset or press of the button
        that is due; and do that."""
        end = min(end, self._usb.next(self.chip.cycles), self._weigh())
        pressing = self._faults.next("estop-pressed", -math.inf) if not self._pressed else math.inf
        reset = self._faults.next("board-reset", self._reset)
        due = min(reset, max(pressing, self.now()))
        cycle = math.inf if math.isinf(due) else round(due * FREQUENCY)
        self.chip.run(max(0, int(min(end, cycle)) - self.chip.cycles))
        self._pass_on()
        if self.chip.cycles < cycle:
            return
        if pressing <= due:
            self.chip.drive(*_BUTTON, True)
            self._pressed = True
        else:
            self.chip.reset()
            self._reset = due

    def _pass_on(self) -> None:
        """Let the adapter take and give what it is time for."""
        now, usb = self.chip.cycles, self._usb
        every = round(1e-3 * self._sizes("usb-latency") * FREQUENCY)
        usb.hand_over = HandOver(every, 96) if every > self._hand_over.every else self._hand_over
        usb.late = round(1e-3 * self._sizes("answers-late") * FREQUENCY)
        usb.take_from_board(self.chip.read(), now)
        if arrived := usb.give_board(now):
            self.chip.write(arrived)

    def _see_port(self) -> None:
        self._lost = self._lost or self._faults.on("port-lost", self.now())
        if self._lost:
            raise PortLost(self.name, OSError("injected fault"))

    def _sizes(self, kind: FaultKind) -> float:
        return sum(fault.size for fault in self._faults.active((kind,), self.now()))

    def _stand_still(self, kind: FaultKind) -> None:
        for fault in self._faults.active((kind,), self.now()):
            if (kind, begun := self._faults.begun(fault)) not in self._happened:
                self._happened.add((kind, begun))
                self._run_until(self.chip.cycles + round(1e-3 * fault.size * FREQUENCY))

    def _garbled(self, data: bytes) -> bytes:
        if not data or not (probability := self._sizes("bytes-garbled")):
            return data
        hit = self._noise.random(len(data)) < probability
        flipped = hit.astype(np.uint8) << self._noise.integers(0, 8, len(data), np.uint8)
        return bytes(np.frombuffer(data, np.uint8) ^ flipped)


class VirtualCamera:
    """Sees what stands on a rig; frames arrive as the chip's clock goes on. `number` is which of its cameras it is."""

    def __init__(self, rig: EmulatedRig, number: int = 0) -> None:
        self.name = f"rendered {number + 1}" if number else "rendered"
        self._rig, self._eye, self._seen = rig, rig.eyes[number], -1

    def newest(self) -> Frame | None:
        """The newest frame that has arrived since the last call, None if none has. Raises CameraError."""
        self._rig.catch_up()
        if self._eye.faults.on("camera-lost", self._rig.wrist.time):
            raise CameraError("the camera gives no more pictures", self.name, "injected fault")
        eye = self._eye
        newest = eye.newest(eye.delay)
        unseen, self._seen = range(newest, self._seen, -1), max(newest, self._seen)
        for number in filter(eye.arrives, unseen):
            if eye.has_arrived(number):
                return picture(eye.expose(number), eye.scene)
            self._seen = number - 1  # it is still on its way
        return None

    def close(self) -> None:
        """Nothing to give back."""


class VirtualBench(EmulatedRig):
    """A wrist pulled by the step pulses of an emulated board, and a camera that sees it.

    Time passes while `transport` is waited on, and is of its clock. With the markers of a second camera, `markers_2`,
    the wrist bends in two planes, and each camera sees one.
    """

    def __init__(
        self, settings: BenchSettings, wrist: WristParameters, seed: int, markers: Markers | None = None,
        markers_2: Markers | None = None,
    ) -> None:  # fmt: skip
        super().__init__(settings, wrist, seed, markers, markers_2=markers_2)
        self.transport = BenchTransport(self.chip, self.faults, settings.line, self.weigh)
        self.cameras = tuple(VirtualCamera(self, number) for number in range(len(self.eyes)))

    def truth(self, since: float = 0.0) -> Truth:
        """True motion of the wrist after `since`, as far back as the last minute."""
        self.catch_up()
        return self.wrist.truth(since)

    def motion(self) -> MotorMotion:
        """Motion of the motors so far, as the board commanded it."""
        self.catch_up()
        return self.wrist.motion

    def close(self) -> None:
        """Nothing to give back: here so that every bench ends alike."""
