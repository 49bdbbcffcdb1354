"""A rollout's bits where it is compiled for another processor, in a process of its own."""

from __future__ import annotations

import os
import platform
import subprocess
import sys
from pathlib import Path

import pytest

THOROUGH = bool(os.environ.get("WRISTCTL_THOROUGH"))

NARROW = {"NUMBA_CPU_NAME": "haswell", "NUMBA_CPU_FEATURES": "+avx,+avx2,+fma", "OPENBLAS_CORETYPE": "Prescott"}
"""Registers of four numbers, and few of them; and matrices multiplied as on a processor of 2004."""
OTHERS = {
    "narrow": NARROW,
    "generic": {"NUMBA_CPU_NAME": "generic", "OPENBLAS_CORETYPE": "Prescott", "NPY_DISABLE_CPU_FEATURES": "AVX2 FMA3"},
    "wide": {"NUMBA_CPU_NAME": "skylake-avx512", "OPENBLAS_CORETYPE": "SkylakeX"},
}
"""Processors by what they can; a wide one only where this one is."""

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
for each in (followed[0], motion(Reference(kind="sine"), wrist, 0.3, 1e-3)):
    held = (each.theta_ref, each.rate_ref, each.acceleration_ref, each.tip_desired)
    print(hashlib.sha256(b"".join(part.tobytes() for part in held)).hexdigest())
"""


def bits(**environment: str) -> list[str]:
    command = [sys.executable, "-c", ROLLOUTS]
    done = subprocess.run(command, env=os.environ | environment, capture_output=True, text=True, check=True)
    return done.stdout.splitlines()


@pytest.mark.skipif(not THOROUGH, reason="compiles all anew: WRISTCTL_THOROUGH=1 (make test-trust)")
@pytest.mark.skipif(platform.machine() not in ("x86_64", "AMD64"), reason="the others are of this family")
def test_rollouts_and_references_have_the_same_bits_whatever_the_processor() -> None:
    here = bits()
    assert len(set(here)) == 4
    wide = "avx512f" in Path("/proc/cpuinfo").read_text() if Path("/proc/cpuinfo").exists() else False
    for name in [name for name in OTHERS if name != "wide" or wide]:
        assert bits(**OTHERS[name]) == here, name
