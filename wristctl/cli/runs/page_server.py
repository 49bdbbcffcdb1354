"""HTTP server of a results folder for a browser on this machine: its page of runs, kept fresh, and files of runs."""

from __future__ import annotations

import shutil
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Lock
from typing import BinaryIO
from urllib.parse import unquote, urlsplit

from wristctl.plain_files import LARGEST_DATA, open_plain
from wristctl.plotting.index_page import index_page, mark_of
from wristctl.records.find import entries
from wristctl.version import __version__

LOOPBACK = "127.0.0.1"
# A file of a run may be another person's: it runs its scripts apart from all else, and asks for nothing.
_APART = (
    "sandbox allow-scripts allow-popups; default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; "
    "img-src data:; frame-ancestors 'none'"
)
_SHOWN = {".html": "text/html", ".png": "image/png", ".svg": "image/svg+xml", ".pdf": "application/pdf"}
_DATA = {".avi", ".mcap", ".mp4", ".npz", ".parquet", ".safetensors"}


class PageServer(ThreadingHTTPServer):
    """Serves one results folder on the loopback interface, for reading.

    Parameters
    ----------
    results
        Folder of run directories.
    port
        TCP port; 0 takes a free one.

    Raises OSError where the port is taken.
    """

    daemon_threads = True

    def __init__(self, results: Path, port: int) -> None:
        super().__init__((LOOPBACK, port), _Handler)
        self.results = results.resolve()
        self._page, self._mark, self._lock = b"", "", Lock()

    @property
    def url(self) -> str:
        """Address of the page."""
        return f"http://{LOOPBACK}:{self.server_port}/"

    @property
    def hosts(self) -> set[str]:
        """Host headers of a browser that was sent here by a person, and not by a name that leads here."""
        return {f"{name}:{self.server_port}" for name in (LOOPBACK, "localhost")}

    def page(self) -> tuple[str, bytes]:
        """Mark and content of the page of all runs as they are now."""
        with self._lock:
            listed = entries(self.results)
            mark = mark_of(listed)
            if mark != self._mark:
                self._page, self._mark = index_page(self.results, listed).encode(), mark
            return self._mark, self._page

    def file(self, path: str) -> BinaryIO | None:
        """Open a file of a run, by its path in an address; None for what is hidden, a link, elsewhere or not there."""
        parts = unquote(path, errors="replace").split("/")[1:]
        if len(parts) < 2 or any(part.startswith(".") or not part or {"\\", "\0"} & set(part) for part in parts):
            return None
        file = self.results.joinpath(*parts)
        if any(folder.is_symlink() for folder in (file, *file.parents[: len(parts) - 1])):
            return None
        try:
            return open_plain(file, LARGEST_DATA, links=False)
        except OSError:
            return None


class _Handler(BaseHTTPRequestHandler):
    """GET and HEAD; other methods are refused as not implemented."""

    server: PageServer
    server_version, sys_version = f"wristctl/{__version__}", ""
    timeout = 60

    def do_GET(self) -> None:
        """Answer with the page, or a file of a run."""
        path = urlsplit(self.path).path
        if self.headers.get("Host") not in self.server.hosts:
            self.send_error(HTTPStatus.MISDIRECTED_REQUEST)
        elif path == "/":
            self._send_page()
        elif file := self.server.file(path):
            with file:
                self._send_file(file, Path(path).suffix.lower())
        else:
            self.send_error(HTTPStatus.NOT_FOUND)

    do_HEAD = do_GET

    def _send_page(self) -> None:
        mark, page = self.server.page()
        if self.headers.get("If-None-Match") == f'"{mark}"':
            self._begin(HTTPStatus.NOT_MODIFIED, {"ETag": f'"{mark}"'})
            return
        self._begin(HTTPStatus.OK, {
            "Content-Type": "text/html; charset=utf-8", "Content-Length": str(len(page)), "ETag": f'"{mark}"',
            "Content-Security-Policy": "frame-ancestors 'none'",
        })  # fmt: skip
        if self.command == "GET":
            self.wfile.write(page)

    def _send_file(self, file: BinaryIO, suffix: str) -> None:
        kind = "application/octet-stream" if suffix in _DATA else _SHOWN.get(suffix, "text/plain")
        size = file.seek(0, 2)
        file.seek(0)
        self._begin(HTTPStatus.OK, {
            "Content-Type": kind + "; charset=utf-8" * kind.startswith("text/"),
            "Content-Length": str(size), "Content-Security-Policy": _APART,
        })  # fmt: skip
        if self.command == "GET":
            shutil.copyfileobj(file, self.wfile)

    def _begin(self, status: HTTPStatus, headers: dict[str, str]) -> None:
        self.send_response(status)
        fixed = {
            "Cache-Control": "no-cache", "X-Content-Type-Options": "nosniff", "Referrer-Policy": "no-referrer",
            "Cross-Origin-Resource-Policy": "same-origin",
        }  # fmt: skip
        for name, value in (headers | fixed).items():
            self.send_header(name, value)
        self.end_headers()

    def log_message(self, format: str, *arguments: object) -> None:
        """Say nothing: a terminal shows the address, and no request."""
