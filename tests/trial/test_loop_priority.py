"""What priority changes, it changes back; what is not allowed is said, and no reason to stop."""

from __future__ import annotations

import gc
import os
import resource
import sys
import threading
from typing import Any

import pytest

from wristctl.trial import loop_priority
from wristctl.trial.loop_priority import PRIORITY, prioritised

ORDINARY = (os.SCHED_OTHER, 0)


def scheduled() -> tuple[int, int]:
    return os.sched_getscheduler(0), os.sched_getparam(0).sched_priority


def may_come_first() -> bool:
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(1))
    except OSError:
        return False
    os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
    return True


@pytest.fixture
def unlocked(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Memory is not really locked: the tests' would not fit."""
    called: list[str] = []

    class Library:
        def mlockall(self, flags: int) -> int:
            called.append(f"lock {flags}")
            return 0

        def munlockall(self) -> int:
            called.append("unlock")
            return 0

    monkeypatch.setattr(loop_priority, "_libc", Library)
    monkeypatch.setattr(os, "geteuid", lambda: 0)
    return called


@pytest.mark.skipif(not may_come_first(), reason="needs the right to real-time scheduling")
def test_the_loop_and_its_threads_come_first_until_the_end(unlocked: list[str]) -> None:
    before, found = scheduled(), []
    with pytest.raises(ValueError, match="ends it"), prioritised(True) as said:
        thread = threading.Thread(target=lambda: found.append(scheduled()))
        thread.start()
        thread.join()
        assert scheduled() == found[0] == (os.SCHED_FIFO, PRIORITY)
        assert not gc.isenabled() and gc.get_freeze_count() > 0 and sys.getswitchinterval() < 1e-3
        assert said == f"priority: garbage collection off, SCHED_FIFO {PRIORITY}, locked memory"
        raise ValueError("what ends it")
    assert scheduled() == before and gc.isenabled() and gc.get_freeze_count() == 0
    assert sys.getswitchinterval() == pytest.approx(5e-3) and unlocked == ["lock 3", "unlock"]


def test_what_is_not_allowed_is_said_with_where_to_read_on(monkeypatch: pytest.MonkeyPatch) -> None:
    def refused(*_: Any) -> None:
        raise PermissionError(1, "Operation not permitted")

    monkeypatch.setattr(os, "sched_setscheduler", refused)
    monkeypatch.setattr(os, "geteuid", lambda: 1000)
    monkeypatch.setattr(resource, "getrlimit", lambda _: (65536, 65536))
    with prioritised(True) as said:
        assert not gc.isenabled()
    assert "not allowed: SCHED_FIFO 20, locked memory" in said and "docs/hardware/real-time.md" in said


def test_without_the_wish_nothing_changes() -> None:
    before = scheduled()
    with prioritised(False) as said:
        assert scheduled() == before and gc.isenabled() and said == ""
