"""The bench's pictures over HTTP, as OpenCV and any other program read them."""

from __future__ import annotations

import threading
import time
import urllib.request

import numpy as np

from wristctl.bench.frame_process import MjpegStream
from wristctl.config.camera import Device
from wristctl.vision.camera import Frame
from wristctl.vision.device_camera import DeviceCamera


def flat(grey: int) -> bytes:
    return MjpegStream.encoded(np.full((48, 64), grey, np.uint8))


def test_a_device_camera_reads_the_stream_and_newest_wins() -> None:
    stream, done = MjpegStream(), threading.Event()

    def show() -> None:
        shown = 0
        while not done.wait(0.02):
            shown += 1
            stream.show(flat(min(250, shown)))

    showing = threading.Thread(target=show)
    showing.start()
    try:
        camera = DeviceCamera(stream.address, Device())
        frames: list[Frame] = []
        while len(frames) < 5:
            if (frame := camera.newest()) is not None:
                frames.append(frame)
            time.sleep(1e-3)
        camera.close()
    finally:
        done.set()
        showing.join()
        stream.close()
    greys = [float(frame.image.mean()) for frame in frames]
    assert frames[0].image.shape == (48, 64) and (np.diff(greys) > 0.0).all()
    assert all(abs(frame.time - time.monotonic()) < 60.0 for frame in frames)


def test_a_viewer_that_goes_away_ends_nobody_elses_pictures() -> None:
    stream = MjpegStream()
    try:
        first, second = (urllib.request.urlopen(stream.address, timeout=10.0) for _ in range(2))
        first.close()
        for grey in (10, 20, 30):
            time.sleep(0.05)
            stream.show(flat(grey))
        head = second.read(80)
        assert head.startswith(b"--picture\r\nContent-Type: image/jpeg\r\nContent-Length: ")
        second.close()
    finally:
        stream.close()
    assert stream.address.startswith("http://127.0.0.1:")
