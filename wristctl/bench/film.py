"""Draws the pictures of a bench in real time, in a process of its own: the board's must not wait for a picture."""

from __future__ import annotations

import multiprocessing
import signal
import time
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from pathlib import Path

import cv2

from wristctl.bench.exposure import Exposure, picture
from wristctl.bench.frame_memory import FrameMemory
from wristctl.bench.mjpeg_stream import MjpegStream
from wristctl.config.bench import BenchSettings
from wristctl.config.vision import Markers
from wristctl.config.wrist import WristParameters
from wristctl.loop_priority import as_any_program
from wristctl.work.serving import safe_path

_DECODED = 3e-3
"""Seconds that a viewer of the stream takes to read and decode a picture, a part of the camera's delay: 2.0 alone on
two cores, and 3.2 ms (median) while a rig is checked on them."""


def start_film(
    settings: BenchSettings, wrist: WristParameters, markers: Markers | None, pictures: Path, broadcast: bool = False
) -> tuple[BaseProcess, Connection]:
    """A process that puts pictures into the file `pictures`, and the way to it; `broadcast` also serves them by HTTP.

    It says when it is ready, by the address that it serves or None, takes exposures with the time at which
    their clock was 0 (`time.monotonic`), and ends when the other side is closed.
    """
    scene = settings.camera.scene
    FrameMemory(pictures, (scene.height, scene.width))
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe()
    given = theirs, settings, wrist, markers, pictures, broadcast
    process = context.Process(target=_develop, args=given, daemon=True)
    with safe_path():
        process.start()
    theirs.close()
    return process, ours


def _develop(
    exposed: Connection, settings: BenchSettings, wrist: WristParameters, markers: Markers | None, pictures: Path,
    broadcast: bool,
) -> None:  # fmt: skip
    """Draw each exposure and show it when it arrives; late, leave pictures out. Ctrl-C is others' affair."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    from wristctl.vision.scene import Scene

    as_any_program()  # a camera takes nothing of this computer
    cv2.setNumThreads(1)
    camera, memory = settings.camera, FrameMemory(pictures)
    painter = Scene(camera.scene, wrist, markers, settings.plant.model)
    delay = camera.delay_frames / camera.frame_rate
    stream = MjpegStream() if broadcast else None
    try:
        exposed.send(stream and stream.address)
        while True:
            exposure, start = _next(exposed)
            arrival = start + exposure.time + delay
            if time.monotonic() > arrival and exposed.poll():
                continue
            frame = picture(exposure, painter)
            encoded = stream.encoded(frame.image) if stream else b""
            if stream:
                time.sleep(max(0.0, arrival - _DECODED - time.monotonic()))
                stream.show(encoded)
            time.sleep(max(0.0, arrival - time.monotonic()))
            memory.write(frame._replace(time=start + frame.time))
    except (EOFError, OSError):
        return


def _next(exposed: Connection) -> tuple[Exposure, float]:
    taken: tuple[Exposure, float] = exposed.recv()
    return taken
