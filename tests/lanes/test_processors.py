"""A rollout's bits where it is compiled for another processor, in a process of its own."""

from __future__ import annotations

import os
import platform
import subprocess
import sys

import pytest

NARROW = {"NUMBA_CPU_NAME": "haswell", "NUMBA_CPU_FEATURES": "+avx,+avx2,+fma"}
"""Registers of four numbers, and few of them."""

ROLLOUTS = """
import hashlib
import numpy as np
from wristctl.config.loop import Loop, Reference
from wristctl.config.wrist import WristParameters
from wristctl.control.table import controller, gains_of
from wristctl.simulation.reference import motion
from wristctl.simulation.rollout import rollout

law, wrist, loop = controller("smc"), WristParameters(), Loop(plant_segments=4)
followed = [motion(Reference(), wrist, 0.3, 1e-3)]
gains = np.array(gains_of(law, "initial")) * np.linspace(1.0, 3.0, 17)[:, None]
for chosen in gains, gains[:1]:
    done = rollout(law, chosen, followed, np.zeros(len(chosen), np.int64), loop, wrist, record=True, threads=1)
    print(hashlib.sha256(done.samples.tobytes()).hexdigest())
"""


def bits(**environment: str) -> list[str]:
    command = [sys.executable, "-c", ROLLOUTS]
    done = subprocess.run(command, env=os.environ | environment, capture_output=True, text=True, check=True)
    return done.stdout.splitlines()


@pytest.mark.skipif(platform.machine() not in ("x86_64", "AMD64"), reason="the other one is of this family")
def test_rollouts_have_the_same_bits_whatever_the_processors_registers() -> None:
    here = bits()
    assert len(set(here)) == 2
    assert bits(**NARROW) == here
