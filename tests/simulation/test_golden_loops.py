"""Loops in one plane and in two give the numbers that are recorded, to the last bit (`golden_loops.py`).

Those bits are of processors with AVX-512, or of those without: NumPy has functions of its own for the former, by which
references differ in their last bits. On the other kind the values have to be as near as that makes them.
"""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest

from tests.simulation.golden_loops import RECORDS, Case, avx512, one_plane, record_of, two_planes

# A commanded pull [N] may differ by so much in two planes.
_PULL = 1e-12
# Values [rad, N] on a processor of the other kind differ by so much; those that swing or saturate in between by more.
_ELSEWHERE, _WIDER = 1e-11, {"pid-angle, ideal, 8": 1e-4, "three, saturated, both planes at once": 5e-3}
# Loops whose kernel other quick tests compile too.
_QUICK = ("pid-ff, ideal, 8", "mpc, ideal, 1")

recorded: dict[str, Any] = json.loads(RECORDS.read_text(encoding="utf-8"))


def differences(name: str, case: Case, planes: int) -> list[str]:
    """Arrays whose bits are not those that are recorded, and by how much some of their values differ."""
    expected = recorded[name]
    found, _ = record_of(case, expected["gains"], planes)
    wrong = [array for array, sha in expected["sha256"].items() if found["sha256"][array] != sha]
    values = "bend" if planes == 1 else "pulls"
    apart = float(np.abs(np.array(found[values]) - np.array(expected[values])).max())
    if expected.get("avx512", True) is not avx512():
        return [f"some {values} differ by {apart:.2g}"] if apart > _WIDER.get(name, _ELSEWHERE) else []
    if planes == 2:
        close = apart <= _PULL
        wrong = [array for array in wrong if array == "bend" or not close]
    return [f"{array}: other bits; some {values} differ by {apart:.2g}" for array in wrong]


@pytest.mark.parametrize("name", _QUICK)
def test_a_loop_gives_the_recorded_bits(name: str) -> None:
    assert differences(name, one_plane()[name], 1) == []


@pytest.mark.slow
@pytest.mark.parametrize("name", one_plane())
def test_loops_in_one_plane_give_the_recorded_bits(name: str) -> None:
    assert differences(name, one_plane()[name], 1) == []


@pytest.mark.slow
@pytest.mark.parametrize("name", two_planes())
def test_loops_in_two_planes_give_the_recorded_bends_and_pulls(name: str) -> None:
    assert differences(name, two_planes()[name], 2) == []


def test_every_record_is_of_a_case_that_runs() -> None:
    assert recorded.keys() == one_plane().keys() | two_planes().keys()
