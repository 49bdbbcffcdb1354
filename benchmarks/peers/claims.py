"""What is claimed of wristctl's speed, held against the measurements."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Any

from rates import Result
from table import ELASTIC

_AT_EQUAL_ERROR = (
    # peer, segments, lanes, all cores, least ratio
    ("soromox", 4, 1024, True, 100.0),
    ("MuJoCo", 4, 1024, True, 30.0),
    ("MuJoCo", 1, 1024, True, 50.0),
    ("JAX", 1, 1024, True, 2.0),
    ("JAX", 4, 1024, True, 10.0),
    ("soromox", 1, 1, False, 5.0),
    ("soromox", 4, 1, False, 5.0),
    ("MuJoCo", 1, 1, False, 5.0),
    ("MuJoCo", 4, 1, False, 5.0),
    ("JAX", 1, 1, False, 5.0),
    ("JAX", 4, 1, False, 5.0),
)
_OF_C_IN_TWO_PLANES = {4: 0.75, 1: 0.65}
"""Share of the plain C loop's rate, by segments."""
_OF_HELD_PULLS = 0.88
_PEERS_IN_TWO_PLANES = {"MuJoCo": 80.0, "soromox": 400.0}
_IN_TWO_PLANES = {(4, 64): 1200.0, (1, 64): 5800.0, (4, 1): 150.0, (1, 1): 1000.0}
"""Rates by segments and lanes on one core of a machine whose planar C loop of four segments does `_PLANAR`."""
_PLANAR = 8500.0
_ELASTIC_COSTS = (
    "each step also ramps a motor for every tendon, delays its command, and follows friction's deflection and slack, "
    "which held pulls have not"
)
_IMPORTS = "half of it goes into importing 1,900 modules, those of numba, SciPy, pandas and matplotlib above all"


@dataclass(frozen=True)
class Claim:
    """A wish, a measurement, and whether one meets the other; `holds` is None where nothing was measured."""

    wanted: str
    measured: str
    holds: bool | None
    why: str = ""
    """What stops it where it is missed."""

    @property
    def verdict(self) -> str:
        """PASS, FAIL or not measured."""
        return {True: "PASS", False: "FAIL", None: "not measured"}[self.holds]


def beside_peers(result: Result) -> list[Claim]:
    """Ratios to the peers at equal or smaller error, and the share of the plain C loop."""
    claims = []
    cores = max(result.axis("threads"))
    for peer, n, lanes, everywhere, least in _AT_EQUAL_ERROR:
        if n not in result.axis("segments") or lanes not in result.axis("lanes"):
            continue
        threads = cores if everywhere else 1
        where = f"n = {n}, {lanes:,} lane{'s' if lanes > 1 else ''}, {'all cores' if everywhere else 'one thread'}"
        wanted = f"{where}: at least {least:g} times {peer} at equal or smaller error"
        found = result.ratio(peer, n, threads, lanes)
        if found is None:
            claims.append(Claim(wanted, "no side of it reached the error" if _ran(result, peer, n) else "-", None))
            continue
        coarse = result.ratio(peer, n, threads, lanes, equal=False)
        more = f"; {coarse[0]:,.3g} times {coarse[1]}, whatever its error" if coarse and coarse[1] != found[1] else ""
        why = _beside_c(result, n, threads, lanes, found[0])
        claims.append(Claim(wanted, f"{found[0]:,.3g} times {found[1]}{more}", found[0] >= least, why))
    for n in result.axis("segments"):
        for threads in result.axis("threads"):
            lanes = max(result.axis("lanes"))
            where = f"n = {n}, {lanes:,} lanes, {threads} thread{'s' if threads > 1 else ''}"
            wanted = f"{where}: half of the plain C loop's rate"
            share = result.ratio("C", n, threads, lanes)
            measured = f"{100.0 * share[0]:.0f} % of {share[1]}" if share else "-"
            claims.append(Claim(wanted, measured, share[0] >= 0.5 if share else None))
    return claims


def _beside_c(result: Result, n: int, threads: int, lanes: int, times: float) -> str:
    """How many times a peer's rate the plain C loop of the same equations has, where wristctl has so many times it."""
    share = result.ratio("C", n, threads, lanes)
    if share is None:
        return ""
    return f"the plain C loop of the same equations, compiled for this processor, is {times / share[0]:.3g} times it"


def _ran(result: Result, peer: str, n: int) -> bool:
    return any(variant.peer == peer for variant in result.variants(n))


def in_two_planes(result: Result, planar: Result) -> list[Claim]:
    """Shares of the plain C loop and of held pulls, times peers, and rates in proportion to planar C; on one core."""
    claims = []
    counts, lanes = result.axis("segments"), max(result.axis("lanes"))
    for n, least in _OF_C_IN_TWO_PLANES.items():
        share = result.ratio("C", n, 1, lanes) if n in counts else None
        wanted = f"two planes, n = {n}, {lanes} lanes: {100.0 * least:.0f} % of the plain C loop's rate"
        measured = f"{100.0 * share[0]:.0f} % of {share[1]}" if share else "-"
        claims.append(Claim(wanted, measured, share[0] >= least if share else None))
    for n in counts:
        # wristctl over it: held pulls over elastic tendons
        held = result.ratio(ELASTIC, n, 1, lanes, equal=False)
        wanted = f"two planes, n = {n}, {lanes} lanes: elastic tendons at {100.0 * _OF_HELD_PULLS:.0f} % of held pulls"
        measured = f"{100.0 / held[0]:.0f} %" if held else "-"
        claims.append(Claim(wanted, measured, 1.0 / held[0] >= _OF_HELD_PULLS if held else None, _ELASTIC_COSTS))
    for (peer, least), n in itertools.product(_PEERS_IN_TWO_PLANES.items(), counts):
        found = result.ratio(peer, n, 1, lanes)
        wanted = f"two planes, n = {n}, {lanes} lanes: {least:g} times {peer} at equal or smaller error"
        measured = f"{found[0]:,.3g} times {found[1]}" if found else "-"
        why = _beside_c(result, n, 1, lanes, found[0]) if found else ""
        claims.append(Claim(wanted, measured, found[0] >= least if found else None, why))
    pace = _planar_pace(planar)
    for (n, lanes), least in _IN_TWO_PLANES.items():
        rate = result.own_rate(n, 1, lanes) if n in counts else None
        where = f"two planes, n = {n}, {lanes} lane{'s' if lanes > 1 else ''}"
        wanted = f"{where}: {least:,.0f} simulated s/s where planar C, n = 4, does {_PLANAR:,.0f}"
        if rate is None or pace is None:
            claims.append(Claim(wanted, "-", None))
            continue
        measured = f"{rate:,.0f}, {rate / pace:,.0f} in proportion (planar C: {pace * _PLANAR:,.0f})"
        share = result.ratio("C", n, 1, lanes)
        why = f"the plain C loop does {rate / share[0] / pace:,.0f} in proportion" if share else ""
        claims.append(Claim(wanted, measured, rate >= least * pace, why))
    return claims


def _planar_pace(planar: Result) -> float | None:
    """Rate of the fastest planar C loop of four segments on one core, over `_PLANAR`."""
    lanes = max(planar.axis("lanes"), default=0)
    rates = [planar.rate(variant, 4, 1, lanes) for variant in planar.variants(4) if variant.peer == "C"]
    return max((rate for rate in rates if rate), default=0.0) / _PLANAR or None


def of_costs(costs: dict[str, Any]) -> list[Claim]:
    """Growth with lanes, memory, and the studies that are named."""
    claims = []
    for n, slope in costs["slope_by_lanes"].items():
        first, last = (f"{costs['lanes'][n][k]['lanes']:,}" for k in (0, -1))
        wanted = f"n = {n}: time linear in lanes from {first} to {last}, exponent within 10 %"
        claims.append(Claim(wanted, f"{slope:.3f}", abs(slope - 1.0) <= 0.1))
    stream = costs["stream"]
    grown = stream["growth_mib"]
    claims.append(Claim(
        f"memory flat from the first to the last of {stream['batches']} batches of a stream, within 5 MiB",
        f"{grown:+.1f} MiB; {costs['bytes_per_lane']:,.0f} bytes a lane within a batch", grown <= 5.0,
    ))  # fmt: skip
    minutes = stream["seconds"] * 1e6 / stream["rollouts"] / 60.0
    claims.append(Claim(
        "a million rollouts of 5 s, n = 1: under 10 minutes",
        f"{minutes:.1f} minutes, from {stream['rollouts']:,} in {stream['seconds']:.1f} s", minutes < 10.0,
    ))  # fmt: skip
    claims.append(Claim(
        "tune: 40 particles, 60 iterations, two scenarios of 5 s, n = 4: 10 s or less, compiled",
        f"{costs['tune_seconds']:.1f} s", costs["tune_seconds"] <= 10.0,
        "candidates whose motion may depend on the step are run again with finer ones: 2,000 rollouts beside 4,800, "
        "a few at a time, so on one core",
    ))  # fmt: skip
    return claims


def of_cold_start(rows: dict[str, Any]) -> list[Claim]:
    """What a user waits for at first."""
    simulate, train = rows["simulate"], rows["train"]
    begun = train["first"].get("first_progress")
    return [
        Claim("first simulate, nothing compiled: under 20 s", f"{simulate['first']['whole']:.2f} s",
              simulate["first"]["whole"] < 20.0),
        Claim("second simulate: under 2 s", f"{simulate['again']['whole']:.2f} s",
              simulate["again"]["whole"] < 2.0, _IMPORTS),
        Claim("train's first epoch, nothing compiled: within 3 s", f"{begun:.2f} s" if begun else "-",
              begun < 3.0 if begun else None),
    ]  # fmt: skip
