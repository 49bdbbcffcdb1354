"""Is a law from elsewhere what a law is? It is tried on a few states before anything relies on it."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numba.core.runtime import _nrt_python, rtsys

from wristctl.arrays import Array
from wristctl.config.foreign import PLAIN
from wristctl.config.wrist import WristParameters
from wristctl.control.design import LawDesign
from wristctl.control.law import NOW, Controller, now_of, signals_of, wrist_of
from wristctl.errors import UserError
from wristctl.lanes.blocks import to_blocks, to_rows
from wristctl.lanes.compiled import kernel
from wristctl.lanes.lane import zero_like
from wristctl.lanes.rows import beyond, lanes_like, part, rows_of
from wristctl.wrist.segments import segments

_STATES = 32
# Values on both sides of what a law may read or write.
_GUARD = 256
_PARTS = ("what it sees", "the wrist", "its gains", "its memory")
_READ_BEYOND = {
    "its memory": "reads more memory than the {0.memory} values it declares",
    "what it sees": "looks further ahead than the {0.preview} periods of its preview",
}


class TriedStates(NamedTuple):
    """States at which a law was tried: signals (S, signals), gains (S, g), and its torques (S,)."""

    signals: Array
    gains: Array
    torques: Array


def law_of(entry: Any, where: str, settings: Mapping[str, Mapping[str, float]]) -> Controller:
    """The controller behind what a file or an entry point has, made of its settings where it has some.

    Raises UserError for what is neither a Controller nor a LawDesign, and for settings of a law that has none.
    """
    if isinstance(entry, LawDesign):
        return entry.made(settings.get(entry.name, {}))
    if not isinstance(entry, Controller):
        problem = f"{where.rpartition(':')[2]} is a {type(entry).__name__}, and no Controller"
        raise UserError(problem, where, "name the Controller of that file: `wristctl new controller NAME` writes one")
    if settings.get(entry.name.removesuffix(PLAIN)):
        raise UserError(
            f"{entry.name} has no settings",
            f"controller-settings.{entry.name}",
            "leave them out, or make it a LawDesign",
        )
    return entry


# Moment arms [m] of both sides where a law is tried in one plane.
_ARMS = (1.0, -1.0)


@kernel
def call_in_one_plane(law: Any, now: Any, wrist: Any, gains: Any, memory: Any, out: Any, times: int) -> None:
    """Write the torque of a law after so many calls; two tendons reach what its signals say.

    `now`, `wrist`, `gains`, `memory` and `out` are arrays, [row, lane] of a block or [row] of a rollout alone.
    """
    signals = now_of(now)
    pair = part(rows_of(now), 0, (0, 0))
    arms, least, greatest = lanes_like(pair), lanes_like(pair), lanes_like(pair)
    for t in range(2):
        arms[t], least[t] = _ARMS[t] + zero_like(signals.period), zero_like(signals.period)
    greatest[0], greatest[1] = signals.torque_high, -signals.torque_low
    for _ in range(times):
        law(
            signals, wrist_of(wrist), rows_of(gains), rows_of(memory), beyond(arms, 0), beyond(least, 0),
            beyond(greatest, 0), rows_of(out),
        )  # fmt: skip


def call_law(controller: Controller, signals: Array, gains: Array, wide: bool = False, times: int = 1) -> Array:
    """The torques (S,) at states of what a law sees (S, signals) with gains (S, g), its memory empty before the first.

    Each state stands for so many ticks; `wide` calls it for blocks of lanes. Raises what a plain law raises.
    """
    count = len(signals)
    groups = [np.arange(count)] if wide else [np.array([state]) for state in range(count)]
    torques, law = np.empty(count), controller.compiled(count if wide else 1)
    for group in groups:
        wrists = np.tile(segments(WristParameters(), 1), (len(group), 1))
        kept, out = np.zeros((len(group), controller.memory + 1)), np.zeros((len(group), 1))
        rows = (signals[group], wrists, np.pad(gains[group], ((0, 0), (0, 1))), kept, out)
        signal_blocks, wrist_blocks, gain_blocks, memory, answers = (to_blocks(row) for row in rows)
        for block in range(len(signal_blocks)):
            call_in_one_plane(
                law, signal_blocks[block], wrist_blocks[block], gain_blocks[block], memory[block], answers[block], times
            )
        torques[group] = to_rows(answers, len(group))[:, 0]
    law.check()
    return torques


def vet(controller: Controller, where: str) -> TriedStates:
    """Call a law on random states with the gains of each preset.

    Raises UserError where it does not compile, allocates, changes what it sees, reads or writes more memory than it
    declares, raises, or returns what is no finite torque.
    """
    rng, torques = np.random.default_rng(0), []
    law, wrist = controller.compiled(), segments(WristParameters(), 1)
    rows = [controller.values(preset) for preset in controller.presets.values()]
    rows = rows or [tuple(np.sqrt(gain.low * gain.high) for gain in controller.gains.values())]
    gains = np.array([[*rows[state % len(rows)]] for state in range(_STATES)]).reshape(_STATES, -1)
    signals = np.array([_state(rng, controller.preview) for _ in range(_STATES)])
    for state, state_gains in zip(signals, gains, strict=True):
        first, left = _guarded(controller, law, (state, wrist, state_gains), "", where)
        for beside, fault in ({} if controller.plain else _READ_BEYOND).items():  # Python checks, and may remember
            again, also = _guarded(controller, law, (state, wrist, state_gains), beside, where)
            if not (_same(first, again) and _same(left, also)):
                fix = "declare them: memory=... and preview=... of its Controller"
                raise UserError(f"{controller.name} {fault.format(controller)}", where, fix)
        if not np.isfinite(first):
            now = dict(zip(NOW, state, strict=False))
            problem = (
                f"{controller.name} returned {first} at theta = {now['theta']:.3g} rad, rate = {now['rate']:.3g} rad/s"
            )
            raise UserError(problem, where, "return a finite torque [N m] at every state and preset")
        torques.append(first)
    if not controller.plain and (allocations := _allocated(law, (signals[0], wrist, gains[0]), controller.memory)):
        problem = f"{controller.name} allocates memory, {allocations} times a call"
        raise UserError(problem, where, "lanes, tuples and memory[k] in place of arrays (documentation: Compiled code)")
    return TriedStates(signals, gains, np.array(torques))


def _state(rng: np.random.Generator, preview: int) -> Array:
    """Random signals of a law: angles within 50 deg, tendons that can pull either way, a control period of 1 ms."""
    signals = np.zeros(signals_of(preview))
    largest = {"theta": 0.9, "rate": 5.0, "theta_ref": 0.9, "rate_ref": 5.0, "acceleration_ref": 50.0, "load": 0.3}
    for name, most in largest.items():
        signals[NOW.index(name)] = rng.uniform(-most, most)
    signals[NOW.index("torque_low")], signals[NOW.index("torque_high")] = -rng.uniform(0.2, 2.0), rng.uniform(0.2, 2.0)
    signals[NOW.index("period")] = 1e-3
    signals[len(NOW) :] = rng.uniform(-0.9, 0.9, len(signals) - len(NOW))
    return signals


def _guarded(
    controller: Controller, law: Any, arguments: tuple[Array, Array, Array], unknown: str, where: str
) -> tuple[float, Array]:
    """The torque, and what it leaves in its memory; nan stands on both sides of what is `unknown`, else zeros."""
    sizes = [len(argument) for argument in arguments] + [controller.memory]
    beside = [np.nan if name == unknown else 0.0 for name in _PARTS]
    blocks = [np.full(size + 2 * _GUARD, value) for size, value in zip(sizes, beside, strict=True)]
    for block, argument in zip(blocks, (*arguments, np.zeros(controller.memory)), strict=True):
        block[_GUARD : _GUARD + len(argument)] = argument
    before = [block.copy() for block in blocks]
    now, wrist, gains, memory = (b[_GUARD : _GUARD + size] for b, size in zip(blocks, sizes, strict=True))
    out = np.zeros(1)
    call_in_one_plane(law, now, wrist, gains, memory, out, 1)
    law.check()
    for name, block, old in zip(_PARTS[:3], blocks, before, strict=False):
        if not _same(block, old):
            problem = f"{controller.name} changes {name}, which it is only shown"
            raise UserError(problem, where, "write to memory[k] alone, and declare how many: memory=...")
    outside = np.ones(len(blocks[3]), bool)
    outside[_GUARD : _GUARD + controller.memory] = False
    if not _same(blocks[3][outside], before[3][outside]):
        problem = f"{controller.name} writes more memory than the {controller.memory} values it declares"
        raise UserError(problem, where, "declare them: memory=... of its Controller")
    return float(out[0]), memory.copy()


def _allocated(law: Any, arguments: tuple[Array, Array, Array], memory: int) -> int:
    """Number of times that a call takes memory from the system."""
    counted = _nrt_python.memsys_stats_enabled()
    kept, out = np.zeros(memory + 1), np.zeros(1)
    _nrt_python.memsys_enable_stats()
    try:
        counts = [rtsys.get_allocation_stats().alloc]
        for times in (1, 2):  # handing arrays over takes memory too, and as much each time
            call_in_one_plane(law, *arguments, kept, out, times)
            counts.append(rtsys.get_allocation_stats().alloc)
        return int(counts[2] - 2 * counts[1] + counts[0])
    finally:
        if not counted:
            _nrt_python.memsys_disable_stats()


def _same(a: Any, b: Any) -> bool:
    return np.array_equal(a, b, equal_nan=True)
