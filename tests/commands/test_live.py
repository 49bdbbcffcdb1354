"""A live reference through the commands: followed on a rig and in simulation, recorded, and replayed bit for bit."""

from __future__ import annotations

import json
import math
import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from tests.doors.conftest import wristctl
from tests.doors.test_own_rig import RIG
from wristctl import load_study, simulate
from wristctl.errors import UserError
from wristctl.records import Run
from wristctl.records.formats import read_table

RATE = math.radians(60.0)


def free_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
        return port


@contextmanager
def decoder(port: int, pair: bool, dies: Callable[[], bool] = lambda: False) -> Iterator[None]:
    """Sends a sine at 50 Hz, each tenth datagram lost, until it dies."""
    done = threading.Event()

    def send() -> None:
        began, number = time.monotonic(), 0
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
            while not done.wait(0.02) and not dies():
                bend = 15.0 * math.sin(4.0 * (time.monotonic() - began))
                if (number := number + 1) % 10:
                    content = {"bend": [bend, 5.0] if pair else bend, "seq": number}
                    sender.sendto(json.dumps(content).encode(), ("127.0.0.1", port))

    thread = threading.Thread(target=send)
    thread.start()
    try:
        yield
    finally:
        done.set()
        thread.join()


@pytest.mark.slow
def test_simulate_follows_a_decoder_and_its_record_gives_the_same_run_bit_for_bit(tmp_path: Path) -> None:
    port = free_port()
    settings = ["simulate={controller: pid-ff, gains: hardware, horizon: 1.5}"]
    live = f"simulate.reference={{kind: live, listen: '127.0.0.1:{port}'}}"
    with decoder(port, pair=False):
        followed = simulate(load_study(None, *settings, live), out=tmp_path)
    (run,) = (Run(path) for path in tmp_path.iterdir() if (path / "run.json").is_file())
    file = run.path / "data" / "reference.csv"
    assert 30 < followed.metrics["datagrams_followed"] < 75 and run.problems() == []
    record, course = read_table(file), followed.frame()
    assert np.degrees(np.abs(record["theta_ref"]).max()) > 8.0
    assert np.abs(np.diff(record["theta_ref"])).max() <= RATE * 1e-3 * 1.001
    np.testing.assert_array_equal(course["theta_ref"], record["theta_ref"])
    replayed = simulate(load_study(None, *settings, f"simulate.reference={{kind: live, file: '{file}'}}"))
    pd.testing.assert_frame_equal(replayed.frame(), course, check_exact=True)
    with pytest.raises(UserError, match="recorded in a run directory"):
        simulate(load_study(None, *settings, live))


@pytest.mark.slow
def test_a_trial_follows_a_decoder_and_when_it_dies_the_wrist_stands_and_goes_home(tmp_path: Path) -> None:
    """On a simulated robot, whose clock waits for the wall clock; homing is over before the trial begins."""
    port = free_port()
    (tmp_path / "rig.py").write_text(RIG, encoding="utf-8")

    def two_seconds_on() -> bool:
        logs = list(tmp_path.glob("results/*/data/log.csv"))
        return bool(logs) and logs[0].read_bytes().count(b"\n") > 200

    with decoder(port, pair=True, dies=two_seconds_on):
        done = wristctl(
            tmp_path, "hw-run", "pid-ff", "--rig", "rig.py:RIG", "--reference", "live", "--horizon", "5",
            "--set", f"reference={{kind: live, listen: '127.0.0.1:{port}', hold: 0.8}}", "-q",
        )  # fmt: skip
    assert done.returncode == 0, done.stderr
    run = Run(tmp_path / done.stdout.strip().splitlines()[-1])
    assert run.problems() == [] and run.data("trials")["outcome"].tolist() == ["ok"]
    log, record = run.data("log"), run.data("reference")
    for name in ("bend_ref_ulnar", "rate_ref_flexion", "acceleration_ref_ulnar"):
        np.testing.assert_array_equal(record[name].iloc[np.rint(log["time"] / 0.01).astype(int)], log[name])
    died = record["time"][record["state"] == "following"].iloc[-1] - 0.2
    bend = log[["bend_ulnar", "bend_flexion"]].apply(np.degrees)
    stands = (log["time"] > died + 0.5) & (log["time"] < died + 0.95)
    assert stands.sum() > 40 and np.ptp(bend[stands], axis=0).max() < 0.15
    assert np.hypot(*bend.to_numpy()[-1]) < 0.3
    assert np.hypot(record["rate_ref_ulnar"], record["rate_ref_flexion"]).max() <= RATE * (1.0 + 1e-9)
