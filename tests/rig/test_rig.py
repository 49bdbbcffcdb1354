"""The real path, serial port and camera device, against the emulated rig in real time: `make test-rig`, alone.

On a computer that cannot keep the period they end as skipped, with the lateness that was measured, never as passed.
"""

from __future__ import annotations

import json
import os
import re
import select
import shlex
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from wristctl.config.hw_run import HwRunSettings
from wristctl.config.wrist import WristParameters
from wristctl.loop_priority import PRIORITY

ROOT = Path(__file__).parents[2]
BOOT_LOADER = Path("/usr/share/arduino/hardware/arduino/avr/bootloaders/stk500v2/stk500boot_v2_mega2560.hex")
TENDONS_OFF = ("--set", "bench.motors.slack=[0.02, 0.02, 0.02, 0.02]")
_SLOWER = " --set sensor.frame_rate=15 --set safety.stale=0.35"
"""What the page has two cameras of 15 pictures/s need, so that two cores do."""
PERIOD, MAY_BE_LATE, AT_WORST = 10e-3, 5e-3, 50e-3
BOARD_MAY_BE_LATE = 1e-3

pytestmark = pytest.mark.skipif(not os.environ.get("WRISTCTL_RIG"), reason="runs alone: make test-rig")


class Lateness:
    """How late this computer wakes somebody who sleeps for 10 ms at a time on each of its processors, before a loop
    of ours where it gives any priority, for as long as the block lasts: another guest of the machine may take one."""

    def __enter__(self) -> Lateness:
        self._late: list[float] = []
        self._done = threading.Event()
        self._threads = [threading.Thread(target=self._sleep, args=(each,)) for each in os.sched_getaffinity(0)]
        for thread in self._threads:
            thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._done.set()
        for thread in self._threads:
            thread.join()

    @property
    def excuse(self) -> str:
        """What a test may have failed by that is not ours; empty where the period was kept."""
        late, worst = np.quantile(self._late, [0.99, 1.0]) if self._late else (0.0, 0.0)
        if late > MAY_BE_LATE or worst > AT_WORST:
            return f"one time in a hundred this computer wakes {1e3 * late:.1f} ms late, at worst {1e3 * worst:.0f} ms"
        return ""

    def _sleep(self, processor: int) -> None:
        os.sched_setaffinity(0, {processor})  # 0: the calling thread
        with suppress(OSError):
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(PRIORITY + 1))
        while not self._done.is_set():
            due = time.monotonic() + PERIOD
            time.sleep(PERIOD)
            self._late.append(time.monotonic() - due)


@contextmanager
def in_time(served: Bridge) -> Iterator[None]:
    """What fails in the block is only held against us where computer and emulated board kept their times."""
    with Lateness() as lateness:
        failed: BaseException | None = None
        try:
            yield
        except (AssertionError, subprocess.TimeoutExpired) as error:
            failed = error
    if failed is None:
        return
    served.close()
    if excuse := lateness.excuse or served.excuse:
        pytest.skip(f"{excuse}, which is too much for ticks of {1e3 * PERIOD:g} ms: {failed}")
    raise failed


class Bridge:
    """`wristctl hw emulate --wrist` in a process of its own; `type` is what is typed there."""

    def __init__(self, *options: str) -> None:
        self._process = wristctl("hw", "emulate", "--wrist", *options)
        assert self._process.stdout is not None
        cameras = 2 if "planes=2" in options else 1
        self.port, *self.cameras = (self._process.stdout.readline().strip() for _ in range(1 + cameras))
        assert self.port.startswith("/dev/"), self._process.stderr
        assert all(each.startswith("http://127.0.0.1:") for each in self.cameras)

    def type(self, act: str) -> None:
        assert self._process.stdin is not None
        self._process.stdin.write(act + "\n")
        self._process.stdin.flush()

    def at_its(self, command: str) -> str:
        """A command of the page with the port and the cameras that are here."""
        command = command.replace("/dev/ttyACM0", self.port).replace("--camera 0", f"--camera {self.camera}")
        return command.replace("camera_2=2", f"camera_2={self.cameras[-1]}")

    @property
    def camera(self) -> str:
        return self.cameras[0]

    @property
    def alive(self) -> bool:
        return self._process.poll() is None

    def close(self) -> None:
        """End it; again does nothing."""
        if self._process.stdout is not None and not self._process.stdout.closed:
            self._process.send_signal(signal.SIGINT)
            _, self._said = self._process.communicate(timeout=30.0)

    @property
    def excuse(self) -> str:
        """Of a closed one: how late its board was, where that is too late; empty else."""
        told = re.search(r"the emulated board ran ([\d.]+) ms late as a mean, (\d+) ms at worst", self._said)
        if told and (float(told[1]) > 1e3 * BOARD_MAY_BE_LATE or float(told[2]) > 1e3 * AT_WORST):
            return told[0]
        return ""


def wristctl(*arguments: str) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "wristctl", *arguments]
    pipes: dict[str, Any] = dict.fromkeys(("stdin", "stdout", "stderr"), subprocess.PIPE)
    return subprocess.Popen(command, env={**os.environ, "PYTHONPATH": str(ROOT)}, text=True, **pipes)


@pytest.fixture
def bridge(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[..., Bridge]]:
    """Starts bridges; commands leave their runs in a folder of the test's."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "experiments").symlink_to(ROOT / "experiments")
    open_now: list[Bridge] = []

    def start(*options: str) -> Bridge:
        while open_now:
            open_now.pop().close()
        open_now.append(Bridge(*options))
        return open_now[-1]

    yield start
    while open_now:
        open_now.pop().close()


def do(command: str, typed: str = "", timeout: float = 240.0) -> tuple[int, str, str]:
    """A command as it is typed, and the answers to what it asks."""
    process = wristctl(*shlex.split(command))
    out, err = process.communicate(typed, timeout)
    return process.returncode, out, err


def test_a_slow_link_and_camera_are_named_and_the_latency_is_found_to_three_milliseconds(
    bridge: Callable[..., Bridge],
) -> None:
    slow = ("bench.line.adapter=ftdi", "bench.camera.frame_rate=15", "bench.camera.delay_frames=0.9",
            "bench.camera.dropped=0", "priority=true")  # fmt: skip
    served = bridge(*(part for each in slow for part in ("--set", each)))
    with in_time(served):
        code, out, err = do(
            f"hw check --rig --yes --json --set priority=true --port {served.port} --camera {served.camera}"
        )
        assert code == 3, err
        found = json.loads(out)
        latency = found["cameras"][0]["latency"]
        age = latency["delay"]  # till it came, which is when a stream's picture is stamped
        print(f"latency {1e3 * age:.2f} ms of 60, sd {1e3 * latency['sd']:.2f} ms")
        told = "; ".join(each["what"] for each in found["troubles"])
        assert 15.0 < 1e3 * found["round_trip"]["median"] < 18.0
        rate = re.search(r"gives ([\d.]+) pictures/s; the loop's observer counts on 60", told)
        assert rate and float(rate[1]) == pytest.approx(15.0, abs=0.5), told
        assert "older than their time stamps say" in told
        assert age == pytest.approx(0.060, abs=3e-3)


def steps(planes: int) -> list[str]:
    """The commands of first-power-up.md, in their order; those of two planes stand for the others that they replace."""
    text = (ROOT / "docs" / "hardware" / "first-power-up.md").read_text(encoding="utf-8")
    one, two = (re.findall(r"^ {4,}wristctl (.+)$", part, re.MULTILINE) for part in text.split("## In two planes"))
    return one if planes == 1 else [two[0], *one[1 : 1 - len(two)], *two[1:]]


def typed_at(process: subprocess.Popen[str], question: str, answer: str) -> str:
    """What a process has said until it asks this; it is answered."""
    assert process.stdin is not None and process.stderr is not None
    said = ""
    while question not in said.lower():
        assert select.select([process.stderr], [], [], 60.0)[0]
        more = os.read(process.stderr.fileno(), 4096).decode()
        assert more, said
        said += more
    process.stdin.write(answer)
    process.stdin.flush()
    return said


def pressed_in_a_jog(command: str, served: Bridge) -> str:
    """The button, while the motor creeps."""
    process = wristctl(*command.split())
    said = typed_at(process, "type yes", "yes\n")
    time.sleep(0.5)  # drives settle for 0.2 s, and 3 mm take 0.5 s
    served.type("press")
    _, err = process.communicate(timeout=60.0)
    assert process.returncode == 5, err
    served.type("release")
    return said + err


def _steps_per_radian(planes: int) -> float:
    """Of a tendon that bends the wrist alone, toward itself: one camera sees the part in its plane."""
    wrist = WristParameters()
    reeled = wrist.tendon_radius if planes == 2 else 2.0 * wrist.tendon_offset
    return reeled / HwRunSettings().actuator.step_length


def _pictures(rate: int) -> list[str]:
    """Options that have each camera draw so many pictures a second."""
    return [part for camera in ("camera", "camera_2") for part in ("--set", f"bench.{camera}.frame_rate={rate}")]


FOUR_CORES = (os.cpu_count() or 1) >= 4
"""Whether two cameras at their usual rate can be drawn beside board and loop."""


@pytest.mark.skipif(not BOOT_LOADER.exists(), reason="needs arduino-core-avr (the stock boot loader)")
@pytest.mark.parametrize("planes", [1, 2])
def test_first_power_up_is_walked_from_flashing_to_the_first_motion(bridge: Callable[..., Bridge], planes: int) -> None:
    walk = iter(steps(planes))
    hw, emulate, wrist, *options = next(walk).split()
    assert (hw, emulate, wrist) == ("hw", "emulate", "--wrist")
    # nobody looks at pictures before step 10
    rate = 30 if FOUR_CORES else 30 // planes
    unseen, seen = ([*options, *_pictures(each)] for each in (5, rate))
    served = bridge("--boot-loader", str(BOOT_LOADER), *unseen, *TENDONS_OFF)

    def here() -> str:
        return served.at_its(next(walk))

    with in_time(served):
        flash, check = here(), here()
        code, out, err = do(flash)
        assert code == 0 and "written, verified and answering" in out, err
    # a pseudo-terminal has no modem lines: the host cannot know that opening it starts a boot loader
    served = bridge(*unseen, *TENDONS_OFF)
    check = check.replace(flash.split()[-1], served.port)
    with in_time(served):
        for act, state, fault in (("press", "FAULT", "ESTOP_INPUT"), ("release", "DISABLED", "none")):
            served.type(act)
            code, out, err = do(check)
            assert code == 0 and re.search(rf"state +{state}", out) and re.search(rf"faults +{fault}", out), out + err
        assert float(re.search(r"STATUS +200 +([\d.]+)", out)[1]) < 9.0  # type: ignore[index]
        code, out, err = do(here(), "yes\n")
        assert code == 0, err
        assert "emergency stop" in pressed_in_a_jog(here(), served)
        code, out, err = do(here(), "yes\n")
        assert code == 0, err
        code, out, err = do(here(), "yes\n-1\n\n")
        assert code == 0 and "axis 1: +68 steps" in out and "axis 1: -68 steps" in out, out + err
        code, out, err = do(here(), "yes\n")
        assert code == 0 and "is refused, on all axes" in out, err
    served = bridge(*unseen)  # tendons on
    with in_time(served):
        code, out, err = do(here(), "yes\n\n")
        assert code == 0 and "axis 2: +20 steps" in out, out + err
        code, out, err = do(here(), "yes\n")
        assert code == 0 and "paid out" in out, err
        code, out, err = do(here(), "yes\n2 0.2\n\n")
        assert code == 0 and "positions (0, 0, 14, 0)" in out, out + err
    served = bridge(*seen)  # its tendons as they were before
    in_both, slower = " in two planes" * (planes == 2), _SLOWER * (planes == 2 and not FOUR_CORES)
    with in_time(served):
        code, out, err = do(here() + slower, "yes\n")
        assert code == 0 and out.startswith(f"This rig can run the loop of 10 ms{in_both}"), out + err
        older = re.search(r"--set device\.delay=([\d.]+)", out)  # a stream's stamps are from when its pictures come
        age = HwRunSettings().bench.camera.delay_frames / rate
        assert older and float(older[1]) == pytest.approx(age, abs=0.01), out
        longer = re.search(r"--set safety\.stale=[\d.]+", out)  # of pictures that are few and old
        changed = " ".join([slower, older[0], *([longer[0]] if longer else [])])
        code, out, err = do(here() + changed, "yes\nyes\n")
        taken_up = re.search(r"^ *2 +4 +\+1 +([\d.]+)", out, re.MULTILINE)  # slack of 0.4 mm, and 1 deg in both planes
        assert code == 0 and taken_up and 0.9 < float(taken_up[1]) < 1.5, out + err
        code, out, err = do(here() + changed, "yes\nyes\n")
        assert code == 0, err
        slopes = np.array(re.findall(r"^ *\d +\d +\+1 +([\d.]+) +([\d.]+)", out, re.MULTILINE), float)
        assert slopes.shape == (4, 2) and slopes[:, 0] == pytest.approx(slopes[:, 1], rel=0.15), "by the model"
        stretch = slopes[:, 1] / _steps_per_radian(planes) - 1.0
        assert stretch.min() > 0.0 and stretch.max() < 0.1
        code, out, err = do(here() + changed, "yes\nyes\n")
        assert code == 0 and "No trial ended early" in " ".join(out.split()), out + err
        assert next(walk, None) is None and served.alive


@pytest.mark.parametrize("planes", [1, 2])
def test_slack_is_taken_up_by_word_and_by_camera_and_ctrl_c_lets_the_drives_go(
    bridge: Callable[..., Bridge], planes: int
) -> None:
    """In two planes the first camera is enough: each tendon bends the wrist in both."""
    slack = "bench.motors.slack=[0.0003, 0.0003, 0.0009, 0.0003]"
    sets = (f"planes={planes}", slack, "bench.camera.frame_rate=15", "bench.camera_2.frame_rate=15", "priority=true")
    served = bridge(*(part for each in sets for part in ("--set", each)))
    tension = f"hw tension --port {served.port} --set safety.watchdog=0.5"
    with in_time(served):
        code, out, err = do(f"{tension} --axis 1 --mm 0.2", "yes\nm\nquick\nm\n\n")
        assert code == 0 and out == "axis 1: taut after 0.60 mm, and paid out by 0.6 mm\n", out + err
        assert err.count("axis 1: 0.40 mm reeled in") == 2, "asked again"
        code, out, err = do(f"{tension} --axis 2 --yes --camera {served.camera}")
        taken_up = re.fullmatch(r"axis 2: taut after ([\d.]+) mm, and paid out by 0\.6 mm\n", out)
        assert code == 0 and taken_up and 0.9 < float(taken_up[1]) < 1.6, out + err
        process = wristctl(*tension.split(), "--axis", "3")
        typed_at(process, "type yes", "yes\n")
        typed_at(process, "axis 3: 0.10 mm", "m\n")
        typed_at(process, "axis 3: 0.20 mm", "")
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=30.0)
        assert process.returncode == 130 and out == "", err
        assert "interrupted: axis 3 is not done, and its drive lets go; go on: wristctl hw tension --axis 3" in err
        code, out, err = do(f"hw check --port {served.port}")
        assert code == 0 and re.search(r"state +DISABLED", out) and re.search(r"faults +none", out), out + err


def test_hostile_bytes_at_full_rate_for_a_minute_do_not_end_the_bench(bridge: Callable[..., Bridge]) -> None:
    served, rng = bridge("--set", "bench.camera.frame_rate=15"), np.random.default_rng(0)
    port, said = os.open(served.port, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK), 0
    end = time.monotonic() + 60.0
    while time.monotonic() < end:
        if select.select([], [port], [], 0.1)[1]:
            said += os.write(port, rng.bytes(4096))
    os.close(port)
    assert served.alive and said > 60.0 * 15_000, f"{said} bytes"
    code, out, err = do(f"hw check --port {served.port}")
    assert code == 0 and "DISABLED" in out, err
