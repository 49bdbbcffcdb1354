"""A headless Chromium, driven over the WebDriver protocol with nothing but the standard library."""

from __future__ import annotations

import base64
import json
import os
import shutil
import socket
import subprocess
import time
import urllib.error
import urllib.request
from pathlib import Path
from typing import Any

CHROMIUM, DRIVER = shutil.which("chromium"), shutil.which("chromedriver")


class Browser:
    """One page at a time; `close` ends the browser."""

    def __init__(self, profile: Path) -> None:
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            port = free.getsockname()[1]
        self._driver = subprocess.Popen(
            [str(DRIVER), f"--port={port}"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
        self._url = f"http://127.0.0.1:{port}/session"
        arguments = [f"--user-data-dir={profile}", "--headless=new", "--no-sandbox", "--disable-gpu"]
        arguments += ["--hide-scrollbars", "--no-first-run"]
        arguments += ["--disable-background-networking", "--disable-component-update"]
        wanted = {
            "goog:chromeOptions": {"binary": CHROMIUM, "args": arguments},
            "goog:loggingPrefs": {"browser": "ALL", "performance": "ALL"},
        }
        deadline = time.monotonic() + 30
        while True:
            try:
                self._url += "/" + self._post("", {"capabilities": {"alwaysMatch": wanted}})["sessionId"]
                return
            except urllib.error.URLError:
                if time.monotonic() > deadline:
                    raise
                time.sleep(0.1)

    def open(self, file: Path, width: int, dark: bool) -> None:
        """Show a file at a width, in the light or dark scheme; what the page before it said and asked is forgotten."""
        self.visit(file.as_uri(), width, dark)

    def visit(self, address: str, width: int, dark: bool) -> None:
        """Show the page at an address, as `open` does a file."""
        self._post("/url", {"url": "about:blank"})
        self.console()
        self.requests()
        size = {"width": width, "height": 800, "deviceScaleFactor": 1, "mobile": width < 600}
        self._devtools("Emulation.setDeviceMetricsOverride", size)
        scheme = {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}
        self._devtools("Emulation.setEmulatedMedia", {"features": [scheme]})
        self._post("/url", {"url": address})

    def run(self, script: str) -> Any:
        """What the body of a function returns in the page."""
        return self._post("/execute/sync", {"script": script, "args": []})

    def console(self) -> list[str]:
        """Messages and errors of the page so far."""
        return [entry["message"] for entry in self._log()]

    def errors(self) -> list[str]:
        """Warnings and errors of the page so far, without what it says by the way."""
        return [entry["message"] for entry in self._log() if entry["level"] in ("WARNING", "SEVERE")]

    def requests(self) -> list[str]:
        """Addresses that the page asked for so far, but for data within it."""
        log = self._post("/se/log", {"type": "performance"})
        events = [json.loads(entry["message"])["message"] for entry in log]
        sent = [event["params"] for event in events if event["method"] == "Network.requestWillBeSent"]
        return [each["request"]["url"] for each in sent if not each["request"]["url"].startswith("data:")]

    def processor_time(self) -> float:
        """Processor time [s] that the browser's processes have taken, however busy the machine."""
        parents, taken = dict[int, int](), dict[int, int]()
        for file in Path("/proc").glob("[0-9]*/stat"):
            try:
                fields = file.read_text().rpartition(")")[2].split()
            except OSError:  # it has ended
                continue
            parents[int(file.parent.name)], taken[int(file.parent.name)] = int(fields[1]), sum(map(int, fields[11:13]))
        own = {self._driver.pid}
        while further := {process for process, parent in parents.items() if parent in own} - own:
            own |= further
        return sum(taken[process] for process in own) / os.sysconf("SC_CLK_TCK")

    def screenshot(self, file: Path) -> None:
        """A picture of the whole page."""
        whole = self._devtools("Page.captureScreenshot", {"captureBeyondViewport": True})
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_bytes(base64.b64decode(whole["data"]))

    def close(self) -> None:
        """End the browser and its driver."""
        try:
            urllib.request.urlopen(urllib.request.Request(self._url, method="DELETE"), timeout=10).close()
        finally:
            self._driver.terminate()
            self._driver.wait(10)

    def _log(self) -> list[dict[str, Any]]:
        entries: list[dict[str, Any]] = self._post("/se/log", {"type": "browser"})
        return entries

    def _devtools(self, command: str, parameters: dict[str, Any]) -> Any:
        return self._post("/goog/cdp/execute", {"cmd": command, "params": parameters})

    def _post(self, path: str, body: dict[str, Any]) -> Any:
        headers = {"Content-Type": "application/json"}
        request = urllib.request.Request(self._url + path, json.dumps(body).encode(), headers)
        with urllib.request.urlopen(request, timeout=60) as answer:
            return json.load(answer)["value"]
