"""Time that this process has spent on compiling, which says nothing of the pace of what is compiled."""

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager


class CompileTime:
    """Seconds in which at least one thread compiles, or waits for what another process compiles."""

    def __init__(self) -> None:
        self._lock, self._compiling, self._began, self._before = threading.Lock(), 0, 0.0, 0.0

    @contextmanager
    def counted(self) -> Iterator[None]:
        """A block that compiles."""
        with self._lock:
            if not self._compiling:
                self._began = time.monotonic()
            self._compiling += 1
        try:
            yield
        finally:
            with self._lock:
                self._compiling -= 1
                if not self._compiling:
                    self._before += time.monotonic() - self._began

    @property
    def seconds(self) -> float:
        """Seconds so far."""
        with self._lock:
            return self._before + (time.monotonic() - self._began if self._compiling else 0.0)

    @property
    def goes_on(self) -> bool:
        """Whether something is being compiled now."""
        return self._compiling > 0


COMPILE_TIME = CompileTime()
