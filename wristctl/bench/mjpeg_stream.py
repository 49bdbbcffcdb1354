"""The bench's pictures as Motion JPEG over HTTP on this computer: a camera that any program can open."""

from __future__ import annotations

import threading
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import cv2

from wristctl.vision.camera import Image

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
        seen = self._shown
        try:
            while True:
                with self._newer:
                    while self._shown == seen:
                        self._newer.wait()
                    seen, picture = self._shown, self._picture
                viewer.wfile.write(_BOUNDARY % len(picture) + picture + b"\r\n")
        except OSError:
            return
