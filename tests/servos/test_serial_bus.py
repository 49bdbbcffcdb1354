"""Servos behind a pseudo-terminal in real time: real bytes, the maker's own port, and the file of the page."""

from __future__ import annotations

import contextlib
import os
import pty
import re
import threading
import time
import tty
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.servos.bus_of import other, passed
from wristctl.commands.rig_certificate import Certificate
from wristctl.config.study import Study
from wristctl.errors import UserError
from wristctl.rig import Fault, Lost
from wristctl.servos import dynamixel, servo_bus, servo_watch
from wristctl.servos.dynamixel import DynamixelRig
from wristctl.servos.emulated import Emulated, ServoRehearsal
from wristctl.servos.emulated_servo import OVERLOAD
from wristctl.servos.pseudo_terminal import PseudoTerminal

PAGE = Path(__file__).parents[2] / "docs" / "servos.md"


def example() -> str:
    """The rig's file of the page."""
    (text,) = re.findall(r'```python\n("""My wrist.*?)```', PAGE.read_text(encoding="utf-8"), re.DOTALL)
    return str(text)


class _Blind(DynamixelRig):
    def bend(self) -> tuple[Any, float]:
        return np.zeros(2), self.clock.now()


@pytest.fixture(autouse=True)
def _patient(monkeypatch: pytest.MonkeyPatch) -> None:
    """What is asserted are bytes and motions: a busy computer may take its time."""
    monkeypatch.setattr(servo_bus, "_PATIENT", 2.0)
    monkeypatch.setattr(servo_bus, "_LEAST", 2.0)
    monkeypatch.setattr(dynamixel, "_SLOWEST", 2.0)
    monkeypatch.setattr(servo_watch, "_OLD", 9.0)


SLOW = other(silence=2.5)
"""Servos that bear a long silence."""


@contextlib.contextmanager
def bus() -> Iterator[tuple[PseudoTerminal, ServoRehearsal]]:
    servos = ServoRehearsal(SLOW, Emulated())
    with PseudoTerminal(servos) as terminal:
        yield terminal, servos


def test_servos_at_a_serial_port_are_found_set_up_and_moved() -> None:
    with bus() as (terminal, servos):
        rig = _Blind(SLOW, terminal.path)
        stood = rig.connect()
        while servos.servos[1].place < stood[1] + 19.0:
            passed(rig, 0.1, stood + np.array([0.0, 20.0, 0.0]), period=0.02)
        passed(rig, 0.3, stood + np.array([0.0, 20.0, 0.0]), period=0.02)
        with terminal.lock:
            assert servos.servos[1].place - stood[1] == pytest.approx(20.0, abs=1.0)
            servos.servos[0].shut_down(OVERLOAD)
        with pytest.raises(Fault, match="overload: servo 1"):
            passed(rig, 0.2, stood)
        rig.stop()
        rig.close()
        deadline = time.monotonic() + 10.0
        while any(servo.torque for servo in servos.servos) and time.monotonic() < deadline:
            time.sleep(0.01)
        assert not any(servo.torque for servo in servos.servos)


def test_a_port_that_another_program_has_open_is_refused() -> None:
    with bus() as (terminal, _):
        first, second = (_Blind(SLOW, terminal.path) for _ in range(2))
        first.connect()
        with pytest.raises(Lost, match="cannot be opened"):
            second.connect()
        first.close()
        second.connect()
        second.close()


def test_a_cable_that_comes_off_is_lost_and_the_servos_stop_by_themselves() -> None:
    with bus() as (terminal, servos):
        rig = _Blind(SLOW, terminal.path)
        stood = rig.connect()
        rig._port.patience = 0.1
        with terminal.lock:
            servos.receive = lambda data: []  # type: ignore[method-assign]
        with pytest.raises(Lost, match="no servo answers in time"):
            passed(rig, 9.0, stood)
        with pytest.raises(Lost, match=r"they stop 2\.5 s after the last packet"):
            rig.stop()
        deadline = time.monotonic() + 20.0
        while servos.servos[2].heard and time.monotonic() < deadline:
            time.sleep(0.05)
        assert not any(servo.heard for servo in servos.servos)
        rig.close()


def test_a_port_that_there_is_not_and_a_rate_that_there_is_not_are_named(tmp_path: Path) -> None:
    with pytest.raises(Lost, match="ttyNONE cannot be opened"):
        servo_bus.opened(str(tmp_path / "ttyNONE"), 1_000_000)
    with pytest.raises(UserError, match="12345 baud"):
        servo_bus.opened(str(tmp_path / "ttyNONE"), 12345)


class _Unit:
    """An inertial unit at a serial port, on the hand of emulated servos: along z, ulnar x, mounted anyhow."""

    def __init__(self, servos: ServoRehearsal, lock: threading.Lock) -> None:
        self._servos, self._lock, self._ended = servos, lock, threading.Event()
        self._end, self._host = pty.openpty()
        tty.setraw(self._host)
        self.path = os.ttyname(self._host)
        self._mounted = Rotation.from_rotvec([0.0, 0.0, 0.7])
        self._thread = threading.Thread(target=self._speak, daemon=True)
        self._thread.start()

    def _speak(self) -> None:
        while not self._ended.wait(0.01):
            with self._lock:
                ulnar, flexion = self._servos.wrist.bend
            x, y, z, w = (self._mounted * Rotation.from_rotvec([-flexion, ulnar, 0.0])).as_quat()
            os.write(self._end, f"{w:.6f},{x:.6f},{y:.6f},{z:.6f}\n".encode())

    def close(self) -> None:
        self._ended.set()
        self._thread.join()
        os.close(self._end)
        os.close(self._host)


def test_the_file_of_the_page_reads_its_inertial_unit_and_moves_its_servos() -> None:
    module: Any = ModuleType("my_servos")
    exec(compile(example(), "my_servos.py", "exec"), module.__dict__)
    module.SETTINGS = replace(module.SETTINGS, silence=2.5)
    servos = ServoRehearsal(module.SETTINGS, Emulated())
    with PseudoTerminal(servos) as terminal:
        unit = _Unit(servos, terminal.lock)
        module.PORT, module.IMU = terminal.path, unit.path
        rig = module.RIG()
        stood = rig.connect()
        while not np.isfinite(rig.look().bend).all():  # the straight wrist's zero is not found yet
            passed(rig, 0.02, stood)
        assert np.abs(rig.look().bend).max() < 1e-3
        for tendon, toward in ((0, 0.0), (2, 240.0)):
            targets = stood + 150.0 * np.eye(3)[tendon]
            bend = np.zeros(2)
            while np.linalg.norm(bend) < 0.02:
                passed(rig, 0.02, targets)
                bend, seen, *_ = rig.look()
            for _ in range(60):
                passed(rig, 0.02, targets)
                bend, seen, *_ = rig.look()
            with terminal.lock:
                true = servos.wrist.bend
            assert np.linalg.norm(true) > 0.02 and bend == pytest.approx(true, abs=3e-3)
            assert np.rad2deg(np.arctan2(bend[1], bend[0])) % 360.0 == pytest.approx(toward % 360.0, abs=12.0) or (
                toward == 0.0 and abs(np.arctan2(bend[1], bend[0])) < 0.2
            )
            assert rig.clock.now() > seen
            passed(rig, 0.5, stood)
        rig.close()
        unit.close()


@pytest.mark.slow
def test_the_file_of_the_page_rehearses_and_passes_every_check(tmp_path: Path) -> None:
    file = tmp_path / "my_servos.py"
    file.write_text(example(), encoding="utf-8")
    found = {check.asked: check for check in Certificate(f"{file}:RIG", Study()).checks()}
    assert not [check for check in found.values() if check.passed is False], found
    assert found["trial"].passed and found["silence"].passed and found["stop"].passed
