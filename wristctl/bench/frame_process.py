"""Draws the pictures of a bench in real time, in a process of its own: the board's must not wait for a picture."""

import mmap
import multiprocessing
import signal
import threading
import time
from collections.abc import Callable
from functools import partial
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Literal

import cv2
import numpy as np

from wristctl.bench.shutter import Exposure, picture
from wristctl.config.bench import BenchSettings, RenderedCamera
from wristctl.config.camera import Markers
from wristctl.config.wrist import WristParameters
from wristctl.loop_priority import as_any_program
from wristctl.processes import safe_path
from wristctl.vision.camera import Frame, Image
from wristctl.vision.scene import Scene

_HEAD = np.dtype([*((name, np.int64) for name in ("writes", "number", "height", "width")), ("time", np.float64)])


class FrameMemory:
    """The frame in this file, as a camera. One process writes; the file's maker gives the size of the pictures.

    Times are of `time.monotonic`, which processes share.
    """

    def __init__(self, path: Path, size: tuple[int, int] | None = None) -> None:
        self.name = str(path)
        if size is not None:
            head = np.zeros(1, _HEAD)
            head["height"], head["width"] = size
            path.write_bytes(head.tobytes() + bytes(size[0] * size[1]))
        with path.open("r+b") as file:
            self._map = mmap.mmap(file.fileno(), 0)
        self._head = np.frombuffer(self._map, _HEAD, 1)
        shape = int(self._head["height"][0]), int(self._head["width"][0])
        self._image = np.frombuffer(self._map, np.uint8, offset=_HEAD.itemsize).reshape(shape)
        self._seen = 0

    def write(self, frame: Frame) -> None:
        """Put a frame in the place of the last."""
        self._head["writes"] += 1
        self._head["number"], self._head["time"] = frame.number, frame.time
        self._image[:] = frame.image
        self._head["writes"] += 1

    def newest(self) -> Frame | None:
        """The frame, if it is another one than at the last call. Never waits."""
        writes = int(self._head["writes"][0])
        if writes == self._seen or writes % 2:
            return None
        frame = Frame(self._image.copy(), float(self._head["time"][0]), int(self._head["number"][0]))
        if int(self._head["writes"][0]) != writes:
            return None
        self._seen = writes
        return frame

    def close(self) -> None:
        """Nothing to give back: the memory goes with its file."""


_QUALITY = 92
_BOUNDARY = b"--picture\r\nContent-Type: image/jpeg\r\nContent-Length: %d\r\n\r\n"


class MjpegStream:
    """Serves the newest picture to everybody who asks at `address`, and every newer one: newest wins."""

    def __init__(self) -> None:
        self._newer = threading.Condition()
        self._shown, self._picture = 0, b""
        stream = self

        class Viewer(BaseHTTPRequestHandler):
            disable_nagle_algorithm = True

            def do_GET(self) -> None:
                stream._send_to(self)

            def log_message(self, format: str, *arguments: object) -> None:
                """Nobody is to be told."""

        self._server = ThreadingHTTPServer(("127.0.0.1", 0), Viewer)
        self._server.daemon_threads = True
        self.address = f"http://127.0.0.1:{self._server.server_address[1]}/"
        threading.Thread(target=self._server.serve_forever, name="stream", daemon=True).start()

    @staticmethod
    def encoded(image: Image) -> bytes:
        """As JPEG."""
        return cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, _QUALITY])[1].tobytes()

    def show(self, encoded: bytes) -> None:
        """The next picture, as `encoded` gives it."""
        with self._newer:
            self._picture = encoded
            self._shown += 1
            self._newer.notify_all()

    def close(self) -> None:
        """Serve no more."""
        self._server.shutdown()
        self._server.server_close()

    def _send_to(self, viewer: BaseHTTPRequestHandler) -> None:
        viewer.send_response(200)
        viewer.send_header("Content-Type", "multipart/x-mixed-replace; boundary=picture")
        viewer.end_headers()
        sent = self._shown
        try:
            while True:
                with self._newer:
                    while self._shown == sent:
                        self._newer.wait()
                    sent, picture = self._shown, self._picture
                viewer.wfile.write(_BOUNDARY % len(picture) + picture + b"\r\n")
        except OSError:
            return


# Seconds that a viewer of the stream takes to read and decode a picture, a part of the camera's delay: 2.0 alone on two
# cores, and 3.2 ms (median) while a rig is checked on them.
_DECODED = 3e-3


def start_film(
    settings: BenchSettings, wrist: WristParameters, markers: Markers | None, pictures: Path, broadcast: bool = False,
    plane: Literal[0, 1] | None = None,
) -> tuple[BaseProcess, Connection]:  # fmt: skip
    """A process that puts pictures into the file `pictures`, and the way to it; `broadcast` also serves them by HTTP.

    Of a wrist that bends in two planes, `plane` 0 is the first camera's and 1 the second's.

    It says when it is ready, by the address that it serves or None, takes exposures with the time at which
    their clock was 0 (`time.monotonic`), and ends when the other side is closed.
    """
    camera = settings.camera_2 if plane == 1 else settings.camera
    FrameMemory(pictures, (camera.scene.height, camera.scene.width))
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe()
    paint = partial(Scene, camera.scene, wrist, markers, settings.plant.model, plane=plane)
    arguments = theirs, camera, paint, pictures, broadcast
    process = context.Process(target=_develop, args=arguments, daemon=True)
    with safe_path():
        process.start()
    theirs.close()
    return process, ours


def _develop(
    exposed: Connection, camera: RenderedCamera, paint: Callable[[], Scene], pictures: Path, broadcast: bool
) -> None:
    """Draw each exposure and show it when it arrives; late, leave pictures out. Ctrl-C is others' affair."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    as_any_program()  # a camera takes nothing of this computer
    cv2.setNumThreads(1)
    memory, painter = FrameMemory(pictures), paint()
    delay = camera.delay_frames / camera.frame_rate
    stream = MjpegStream() if broadcast else None
    try:
        exposed.send(stream and stream.address)
        while True:
            exposure, start = _next(exposed)
            arrival = start + exposure.time + delay + exposure.late
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
