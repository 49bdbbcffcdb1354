"""An interruption comes when it may, once, and whoever else is asked swallows it in vain."""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import pytest

from wristctl.config.study import Study
from wristctl.interrupt import deferred, interrupts
from wristctl.records import start_run


@pytest.fixture
def another_thread() -> Iterator[None]:
    """One that any signal to the process may be given to, as a library's workers are."""
    done = threading.Event()
    thread = threading.Thread(target=done.wait)
    thread.start()
    yield
    done.set()
    thread.join()


@pytest.mark.usefixtures("another_thread")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_what_is_deferred_comes_at_the_end_whichever_thread_was_given_it(number: int) -> None:
    ended = False
    with pytest.raises(KeyboardInterrupt), interrupts(), deferred():
        os.kill(os.getpid(), number)
        until = time.monotonic() + 0.05
        while time.monotonic() < until:
            pass
        ended = True
    assert ended


def test_nothing_comes_where_nothing_came() -> None:
    before = signal.getsignal(signal.SIGINT)
    with interrupts() as seen, deferred():
        pass
    assert not seen.asked and signal.getsignal(signal.SIGINT) is before
    assert not signal.pthread_sigmask(signal.SIG_BLOCK, set())


def test_an_ignored_signal_stays_ignored() -> None:
    """As in a background job of a shell."""
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        with interrupts() as seen, deferred():
            signal.raise_signal(signal.SIGINT)
        assert not seen.asked
    finally:
        signal.signal(signal.SIGINT, before)


def test_no_run_begins_after_an_interruption_that_a_library_swallowed(tmp_path: Path) -> None:
    with pytest.raises(KeyboardInterrupt), interrupts():
        with suppress(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
        with start_run("simulate", Study(), out=tmp_path):
            pass
    assert not list(tmp_path.iterdir())


def test_a_later_command_of_the_same_process_begins_anew(tmp_path: Path) -> None:
    with suppress(KeyboardInterrupt), interrupts():
        signal.raise_signal(signal.SIGINT)
    with start_run("simulate", Study(), out=tmp_path) as run:
        pass
    assert run.path.is_dir()


def test_a_run_in_another_thread_goes_on_and_takes_nothing_from_the_main_one(tmp_path: Path) -> None:
    """Only the main thread is interrupted; what it was asked is its own."""
    made: list[Path] = []

    def another() -> None:
        with start_run("simulate", Study(), out=tmp_path) as run:
            made.append(run.path)

    with pytest.raises(KeyboardInterrupt), interrupts():
        with suppress(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
        thread = threading.Thread(target=another)
        thread.start()
        thread.join()
        with start_run("simulate", Study(), out=tmp_path):
            pass
    assert len(made) == 1 and [each for each in tmp_path.iterdir() if each.is_dir()] == made
