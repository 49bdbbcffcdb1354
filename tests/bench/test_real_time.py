"""The bench against the wall clock: in a thread here, and in a process that outlives its clients."""

from __future__ import annotations

import json
import math
import multiprocessing
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from tests.bench.conftest import TAUT
from tests.bench.record import is_released, last_step, read
from tests.board.patience import WATCHDOG, patient, wait_for
from wristctl.bench.emulated_rig import EmulatedRig
from wristctl.bench.faults import Faults
from wristctl.bench.frame_process import FrameMemory
from wristctl.bench.real_time_bench import RealTimeBench, films_of
from wristctl.bench.server import BenchServer, FaultyLine
from wristctl.board.board_errors import NoAnswer, PortLost, Restarted
from wristctl.board.driver import Board
from wristctl.board.emulator.chip import FREQUENCY
from wristctl.board.emulator.serve import PtyLine
from wristctl.board.messages import BAUD, Flag, Target
from wristctl.board.transport import SerialTransport
from wristctl.config.bench import BenchSettings, InjectedFault, RenderedCamera, SerialLine, WeakenedPlant
from wristctl.config.camera import Markers, SceneSettings
from wristctl.config.choices import PLANTS_IN_SPACE
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.processes import NO_HARDWARE
from wristctl.vision.camera import Frame
from wristctl.vision.detector import Detector

SMALL = SceneSettings(width=160, height=120)
STOPPED_WITHIN = WATCHDOG + 0.03
"""Seconds from the last that the board heard to its last step: watchdog and ramp."""
AT_ONCE = 0.1
"""Seconds of the board's time that a late server runs in one go."""


class Served(NamedTuple):
    """A bench in a thread of this process, and its client's side: what is asked of it, its own thread answers."""

    server: BenchServer
    bench: RealTimeBench
    record: Path


Serving = Callable[..., Served]


@pytest.fixture
def serving(tmp_path: Path) -> Iterator[Serving]:
    """Starts a bench's server in a thread."""
    running: list[tuple[Served, threading.Thread]] = []

    def start(*faults: InjectedFault, markers_2: Markers | None = None, model: str = "pcc") -> Served:
        camera = RenderedCamera(scene=SMALL if markers_2 is None else SceneSettings(), dropped=0.0)
        plant = WeakenedPlant(model=model)
        settings = BenchSettings(motors=TAUT, plant=plant, camera=camera, camera_2=camera, faults=faults)
        line, wrist = PtyLine(), WristParameters()
        cameras, films, pictures = films_of(settings, wrist, (None, markers_2), tmp_path)
        ours, theirs = multiprocessing.Pipe()
        rig = EmulatedRig(settings, wrist, 0, markers_2=markers_2)
        server = BenchServer(rig, line, films, tmp_path / "record", theirs)
        thread = threading.Thread(target=server.run, daemon=True)
        thread.start()
        bench = RealTimeBench(cameras, ours, line.address, pictures)
        running.append((Served(server, bench, tmp_path / "record"), thread))
        return running[-1][0]

    yield start
    for served, thread in running:
        served.server.stop()
        thread.join()
        served.bench.close()


def ready(bench: RealTimeBench) -> Board:
    board = patient(bench.transport)
    board.enable()
    board.home()
    return board


@pytest.mark.slow
def test_a_process_that_may_open_no_hardware_opens_the_emulated_bench(
    serving: Serving, monkeypatch: pytest.MonkeyPatch
) -> None:
    """So a run on it is repeated: only a port that could be a real board's is refused."""
    monkeypatch.setenv(NO_HARDWARE, "yes")
    _, bench, _ = serving()
    ready(bench)
    with pytest.raises(UserError, match="opens no board"):
        SerialTransport(bench.transport.name, BAUD)


@pytest.mark.slow
@pytest.mark.parametrize("model", PLANTS_IN_SPACE)
def test_two_cameras_see_both_planes_of_a_wrist_in_real_time(serving: Serving, model: str) -> None:
    """Tendons 1 and 2 are let out and 4 and 5 reeled in: it bends toward ulnar, and the second camera sees no bend."""
    _, bench, record = serving(markers_2=Markers(base=2, tip=3), model=model)
    board = ready(bench)
    board.send(Target((-130, -130, 150, 150), (400,) * 4))
    board.wait_while(Flag.MOVING, timeout=60.0)
    board.ping()
    time.sleep(0.5)
    settled = time.monotonic()

    def newer(camera: FrameMemory) -> Frame | None:
        frame = camera.newest()
        return frame if frame is not None and frame.time > settled else None

    shown = [wait_for(partial(newer, camera)) for camera in bench.cameras]
    angle = bench.truth().angle[-1]
    board.close()
    assert angle.shape == (2,) and angle[0] > 0.1 and abs(angle[1]) < 0.01
    seen = []
    for plane, (frame, markers) in enumerate(zip(shown, (Markers(), Markers(base=2, tip=3)), strict=True)):
        found = Detector().everywhere(frame.image, fine=True)
        assert set(found) == {markers.base, markers.tip}, plane
        tip, base = (found[each][0][1] - found[each][0][0] for each in (markers.tip, markers.base))
        seen.append(math.atan2(base[0] * tip[1] - base[1] * tip[0], base @ tip))
    assert abs(seen[0]) == pytest.approx(angle[0], abs=0.02) and abs(seen[1]) < 0.02
    assert len(json.loads(record.read_text())["theta"]) == 2


@pytest.mark.slow
def test_steps_move_the_wrist_and_frames_come_late_with_their_time_of_capture(serving: Serving) -> None:
    _, bench, _ = serving()
    began = time.monotonic()
    board = ready(bench)
    frames: list[tuple[float, Frame]] = []
    while len(frames) < 10:
        board.turn((-100.0, -100.0, 100.0, 100.0))
        if (frame := bench.cameras[0].newest()) is not None:
            frames.append((time.monotonic(), frame))
    board.send(Target((-40, -40, 40, 40), (400,) * 4))
    board.wait_while(Flag.MOVING, timeout=60.0)
    motion, truth = bench.motion(), bench.truth(began)
    board.close()
    assert (np.diff([frame.number for _, frame in frames]) >= 1).all()
    assert all(now - frame.time >= 2 / 60 for now, frame in frames)
    assert len({frame.image.tobytes() for _, frame in frames}) == 10
    assert began <= truth.time[0] and truth.time[-1] <= time.monotonic()
    assert truth.theta[-1].sum() > 0.0
    assert motion.steps == (-40, -40, 40, 40)


@pytest.mark.slow
def test_a_lost_port_is_lost_to_the_client_and_the_board_stops_by_itself(serving: Serving) -> None:
    faults = (InjectedFault(kind="port-lost", at=0.2), InjectedFault(kind="marker-covered", at=0.1))
    _, bench, record = serving(*faults)
    board = ready(bench)
    bench.begin(time.monotonic())
    with pytest.raises(PortLost):
        while True:
            board.turn((0.0, 0.0, 50.0, 50.0))
    told = wait_for(lambda: is_released(r := read(record)) and r)
    assert 0.0 < last_step(told) - told["last_heard"] < STOPPED_WITHIN


@pytest.mark.slow
def test_a_board_that_restarts_is_found_out_and_its_drives_are_off(serving: Serving) -> None:
    server, bench, record = serving(InjectedFault(kind="board-reset", at=0.2))
    board = ready(bench)
    bench.begin(time.monotonic())
    due = server._rig.faults.next("board-reset", 0.0)
    with pytest.raises((Restarted, NoAnswer)):
        while True:
            board.turn((0.0, 0.0, 50.0, 50.0))
    wait_for(lambda: is_released(read(record)))
    # by the board's own clock: on a busy computer it loses time against the wall's
    assert max(at for at in server._rig.wrist.motion.last_step if at is not None) < due + AT_ONCE + 1e-3
    board.close()


class Wire:
    """A line on which a host always says one byte."""

    address = "wire"

    def __init__(self) -> None:
        self.closed = False

    def wait(self, timeout: float) -> bool:
        return True

    def receive(self) -> bytes:
        assert not self.closed
        return b"x"

    def send(self, data: bytes) -> None:
        assert not self.closed

    def close(self) -> None:
        self.closed = True


def test_on_a_faulty_line_the_host_is_not_heard_for_a_while_and_a_lost_port_is_closed() -> None:
    clock, wire = [0.0], Wire()
    faults = Faults([InjectedFault(kind="host-silent", at=1.0, duration=0.5), InjectedFault(kind="port-lost", at=2.0)])
    faults.begin(10.0)
    line = FaultyLine(wire, faults, lambda: round(clock[0] * FREQUENCY), SerialLine())
    heard = {}
    for clock[0] in (9.0, 9.0015, 11.2, 11.21, 11.6, 11.61, 12.1, 13.0):
        assert line.wait(0.0)  # the board keeps its power
        line.send(b"y")
        heard[clock[0]] = (line.receive(), line.heard)
    assert heard == {
        9.0: (b"", None), 9.0015: (b"x", 9.0015), 11.2: (b"x", 11.2), 11.21: (b"", 11.2), 11.6: (b"", 11.2),
        11.61: (b"x", 11.61), 12.1: (b"x", 12.1), 13.0: (b"", 12.1),
    }  # fmt: skip
    assert wire.closed


def test_what_the_board_says_is_passed_on_when_its_adapter_hands_it_over() -> None:
    class Heard(Wire):
        heard: list[tuple[float, bytes]]

        def send(self, data: bytes) -> None:
            self.heard.append((clock[0], data))

    clock, wire = [0.0], Heard()
    wire.heard = []
    line = FaultyLine(wire, Faults(()), lambda: round(clock[0] * FREQUENCY), SerialLine(adapter="ftdi"))
    for clock[0], said in (
        (0.001, b"a"), (0.010, b"b"), (0.0171, b""), (0.0321, b""), (0.0325, b"c"), (0.047, b""),
        (0.0491, b""),
    ):  # fmt: skip
        if said:
            line.send(said)
        line.pass_on()
    assert wire.heard == [(0.0171, b"ab"), (0.0491, b"c")]


@pytest.fixture
def client(tmp_path: Path) -> Iterator[tuple[subprocess.Popen[str], Path]]:
    """A client in a process of its own, and the record of its bench."""
    script, record = Path(__file__).with_name("client.py"), tmp_path / "record"
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])}
    process = subprocess.Popen([sys.executable, script, record], stdout=subprocess.PIPE, text=True, env=environment)
    yield process, record
    process.kill()
    process.wait()
    assert process.stdout is not None
    process.stdout.close()


@pytest.mark.slow
def test_a_stopped_client_and_a_killed_one_leave_the_board_to_stop_the_motors(
    client: tuple[subprocess.Popen[str], Path],
) -> None:
    process, record = client
    assert process.stdout is not None and process.stdout.readline() == "turning\n"
    wait_for(lambda: last_step(read(record)) > 0.0)
    process.send_signal(signal.SIGSTOP)
    stopped = wait_for(lambda: is_released(r := read(record)) and r)
    assert 0.0 < last_step(stopped) - stopped["last_heard"] < STOPPED_WITHIN
    process.send_signal(signal.SIGCONT)
    assert process.stdout.readline() == "LINK\n"
    assert process.stdout.readline() == "turning\n"
    wait_for(lambda: last_step(read(record)) > last_step(stopped))
    process.kill()
    killed = wait_for(lambda: (r := read(record))["ended"] and r)
    assert is_released(killed)
    assert 0.0 < last_step(killed) - killed["last_heard"] < STOPPED_WITHIN


def test_a_frame_being_written_is_not_seen_and_none_is_seen_twice(tmp_path: Path) -> None:
    writer, reader = FrameMemory(tmp_path / "frame", (3, 4)), FrameMemory(tmp_path / "frame")
    assert reader.newest() is None
    image = np.arange(12, dtype=np.uint8).reshape(3, 4)
    writer.write(Frame(image, 1.5, 7))
    seen = reader.newest()
    assert seen is not None and (seen.image == image).all() and (seen.time, seen.number) == (1.5, 7)
    assert reader.newest() is None
    writer.write(Frame(image + 1, 1.6, 8))
    writer._head["writes"] += 1
    assert reader.newest() is None
    writer._head["writes"] += 1
    seen = reader.newest()
    assert seen is not None and seen.number == 8 and (seen.image == image + 1).all()
