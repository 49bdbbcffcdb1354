"""Events of a run as lines: events.jsonl for programs, console.log for people."""

import json
import logging
import math
import os
import threading
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from wristctl.records.manifest import CONSOLE, EVENTS


def now() -> str:
    """The time in UTC, ISO 8601 to the microsecond."""
    return datetime.now(UTC).isoformat(timespec="microseconds")


def jsonable(value: Any) -> Any:
    """`value` in JSON's terms: NumPy scalars and arrays become numbers and lists, NaN and infinities None."""
    if isinstance(value, dict):
        return {str(key): jsonable(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [jsonable(item) for item in value]
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if value is None or isinstance(value, str | int):
        return value
    return jsonable(value.tolist()) if hasattr(value, "tolist") else str(value)


class Journal(logging.Handler):
    """Appends to a run's events and console log; listens to wristctl's log messages while open.

    A line that the disk cannot take is lost: the run's outputs are what says that the disk is full.
    """

    def __init__(self, directory: Path) -> None:
        super().__init__()
        self._events = (directory / EVENTS).open("a", encoding="utf-8", newline="\n")
        self._console = (directory / CONSOLE).open("a", encoding="utf-8", newline="\n")
        self._writing = threading.RLock()
        logging.getLogger("wristctl").addHandler(self)

    def event(self, name: str, /, **fields: Any) -> None:
        """One line of events.jsonl, on its way to the disk when this returns."""
        line = json.dumps({"time": now(), "event": name, **jsonable(fields)}, allow_nan=False) + "\n"
        with self._writing, suppress(OSError, ValueError):  # ValueError: closed
            self._events.write(line)
            self._events.flush()

    def console(self, text: str) -> None:
        """Lines of console.log."""
        with self._writing, suppress(OSError, ValueError):  # ValueError: closed
            self._console.write(text.rstrip("\n") + "\n")
            self._console.flush()

    def emit(self, record: logging.LogRecord) -> None:
        """A message of the program: to the console log, and from warnings on to the events too."""
        message = record.getMessage()
        warning = record.levelno >= logging.WARNING
        self.console(f"{record.levelname.lower()}: {message}" if warning else message)
        if warning:
            self.event(record.levelname.lower(), message=message, logger=record.name)

    def close(self) -> None:
        """Stop listening and close the files, which are on the disk then."""
        logging.getLogger("wristctl").removeHandler(self)
        for file in (self._events, self._console):
            with suppress(OSError, ValueError):  # ValueError: closed
                os.fsync(file.fileno())
            with suppress(OSError):
                file.close()
        super().close()
