"""Closed loops whose numbers are recorded to the last bit, read from the kernel's arrays by name.

`python -m tests.simulation.golden_loops` writes the records. Only the two functions at the end know how the arrays lie.
Gains are values, kept with the records, so that a preset may change. A camera's gains, which come from LAPACK and so
depend on the processor in their last bits, are rounded to single precision.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from wristctl.arrays import Array
from wristctl.config.choices import PLANTS
from wristctl.config.loop import Loop, Reference, sample_period
from wristctl.config.wrist import WristParameters
from wristctl.control.table import CONTROLLERS, controller, gains_of
from wristctl.lanes.blocks import to_rows
from wristctl.simulation.batch import Batch, Lanes, batch
from wristctl.simulation.kernel import Span, columns_of_sample, run_blocks
from wristctl.simulation.motion import Motion
from wristctl.simulation.observer import Watch
from wristctl.simulation.reference import motion
from wristctl.simulation.references import minimum_jerk
from wristctl.simulation.sums import SUMS
from wristctl.simulation.worlds import World
from wristctl.wrist.directions import in_plane
from wristctl.wrist.plant import kernel_of
from wristctl.wrist.spatial.pcc_in_space import PCC_IN_SPACE
from wristctl.wrist.tendon_layout import TendonLayout

RECORDS = Path(__file__).parents[1] / "data" / "golden_loops.json"
# Samples of which values are kept beside the hashes, and lanes.
_EVERY, _KEPT = 4, 2
# Of a hash in hexadecimal.
_DIGITS = 16


class Case(NamedTuple):
    """A batch of one law: the same loop in all lanes, or one after the other of several."""

    law: str
    loops: tuple[dict[str, Any], ...]
    lanes: int
    wrist: Mapping[str, Any] = MappingProxyType({})
    horizon: float = 2.0


Numbers = dict[str, Array]

_SPOOLS: dict[str, Any] = {"level": "tendon", "friction": 0.0}
_RIG: dict[str, Any] = {
    "control_period": 0.01,
    "substeps": 10,
    "actuator": {"level": "tendon", "sheath": 1.0},
    "sensor": {"level": "camera"},
    "plant": {
        "inner_friction": 0.01, "creep": 0.05, "end_stop_deg": 31.0,
        "actuator": {"backlash": 1e-5, "slips_at": 1.2, "broken_at": 1.6, "creep": 0.05},
    },
    "disturbances": {"load": 0.5, "push": {"force": 1.0, "start": 0.5}},
}  # fmt: skip
_FINE = {"substeps": 1}
_QUICK = {"control_period": 2.5e-4, "substeps": 1}
_SLOW = {"control_period": 0.01, "substeps": 10, "actuator": _SPOOLS}
_OTHER_RIGS = tuple(
    _RIG | {"sensor": {"level": "camera", "frame_rate": rate}, "disturbances": {"load": load}}
    for rate, load in ((60.0, 0.0), (30.0, 1.0), (25.0, -1.0))
)


def _hinged(loop: dict[str, Any]) -> dict[str, Any]:
    return loop | {"plant": loop.get("plant", {}) | {"model": "hinges"}}


def one_plane() -> dict[str, Case]:
    """Cases in one plane by name: all laws on an ideal loop and on a rig with all that a rig has, and plants."""
    cases = {}
    for law in CONTROLLERS:
        for lanes in (1, 8):
            cases[f"{law}, ideal, {lanes}"] = Case(law, (_FINE,), lanes)
            cases[f"{law}, rig, {lanes}"] = Case(law, (_RIG,), lanes)
    for lanes in (1, 8):
        cases[f"hinges, ideal, {lanes}"] = Case("pid-ff", (_hinged(_FINE),), lanes)
        cases[f"hinges, rig, {lanes}"] = Case("pid-ff", (_hinged(_RIG),), lanes)
    cases["lagged"] = Case("pid-ff", (_FINE | {"actuator": {"level": "lagged"}},), 8)
    cases["elastic"] = Case("pid-ff", (_FINE | {"actuator": _SPOOLS},), 8)
    cases["three cameras"] = Case("pid-ff", _OTHER_RIGS, 9)
    cases["four ticks a sample"] = Case("mpc", (_QUICK,), 8, horizon=0.6)
    cases["lost"] = Case(
        "pid-ff", (_FINE | {"disturbances": {"load": 90.0}}, _FINE | {"disturbances": {"load": -90.0}}), 8
    )
    cases["without limits"] = Case("pid-ff", (_FINE | {"limits": False, "plant_segments": 1},), 8)
    return cases


def two_planes() -> dict[str, Case]:
    """Cases in two planes by name: layouts of 3, 4 and 6 tendons, drives, faults, what the planes do to each other."""
    three, four = {"tendons": "three"}, {"tendons": "four"}
    six = {"tendons": tuple({"angle_deg": 60.0 * k + 15.0} for k in range(6))}
    aside = {"load": 1.0, "toward_deg": 60.0, "push": {"force": 2.0, "start": 0.5}}
    alone, rubbing = {"coupling": "ignored"}, {"level": "tendon", "friction": 0.1, "sheath": 1.0}
    camera = {"sensor": {"level": "camera"}}
    elastic = _FINE | {"actuator": _SPOOLS}
    faults = {"slack": (0.0, 2e-4, 0.0, 1e-4), "broken_at": 1.2, "broken_tendon": 2, "backlash": 1e-5}
    stops, against = {"tension_limit": 20.0}, {"push": {"force": -12.0, "start": 1.0}, "toward_deg": 45.0}
    return {
        "three, ideal": Case("pid-ff", (_FINE | {"disturbances": aside},), 8, three),
        "three, camera": Case("pid-ff", (_SLOW | camera | alone,), 8, three),
        "three, saturated, both planes at once": Case(
            "clf-qp", (_FINE | {"disturbances": against},), 8, three | {"tension_limit": 20.0}
        ),
        "four, ideal, 1": Case("pid-ff", (_FINE,), 1, four),
        "four, ideal, 8": Case("mpc", (_QUICK | alone,), 8, four, 0.6),
        "four, saturated": Case("pid-ff", (_FINE | alone | {"disturbances": against},), 8, stops),
        "four, lost": Case("pid-ff", (_FINE | alone | {"disturbances": {"load": 90.0, "toward_deg": 20.0}},), 8),
        "four, lagged": Case("pid-dob", (_FINE | {"actuator": {"level": "lagged"}},), 8, four),
        "four, elastic": Case("pid-ff", (elastic | alone | {"plant": {"actuator": faults}},), 8, four),
        "four, camera": Case(
            "pid-ff", (_SLOW | camera | {"actuator": rubbing, "disturbances": aside, "plant": {"actuator": faults}},), 8
        ),
        "six, ideal": Case("adrc", (_FINE | alone,), 8, six),
        "six, lagged": Case("pid-ff", (_FINE | alone | {"actuator": {"level": "lagged"}},), 8, six),
        "six, camera": Case("pid-ff", (_SLOW | camera | alone,), 8, six),
    }  # fmt: skip


def told(numbers: Numbers) -> dict[str, Any]:
    """What is kept of a case's numbers: a hash of each array, and some of the values."""
    kept: dict[str, Any] = {}
    for name, values in numbers.items():
        canonical = np.ascontiguousarray(np.where(np.isnan(values), np.nan, values))
        kept[name] = hashlib.sha256(canonical.tobytes()).hexdigest()[:_DIGITS]
    return kept


def sampled(values: Array) -> list[Any]:
    """Some of the values (count, T, columns): of the first lanes, at a few samples."""
    few = np.linspace(0, values.shape[1] - 1, _EVERY + 1).astype(np.int64)[1:]
    some: list[Any] = np.nan_to_num(values[:_KEPT][:, few]).tolist()
    return some


def record_of(case: Case, gains: list[float], planes: int) -> tuple[dict[str, Any], Numbers]:
    """The record of a case, and its numbers."""
    numbers = in_one_plane(case, gains) if planes == 1 else in_two_planes(case, gains)
    looked_at = "bend" if planes == 1 else "pulls"
    return {"sha256": told(numbers), looked_at: sampled(numbers[looked_at])}, numbers


def _gains(case: Case, gains: list[float]) -> Array:
    """Gains of each lane (count, g), a little apart."""
    return np.array([gains]).reshape(1, -1) * np.linspace(0.9, 1.1, case.lanes)[:, None]


def _lanes(case: Case) -> tuple[list[Loop], list[tuple[int, ...]]]:
    """The loops that there are, and each lane's stream."""
    return [Loop.model_validate(loop) for loop in case.loops], [(lane,) for lane in range(case.lanes)]


def _recorded(made: Batch, count: int) -> Array:
    """What a batch records, run to its end, (count, T, columns)."""
    if isinstance(made.state.watch, Watch):
        gain = made.state.watch.observer.gain
        gain[:] = np.float32(gain)
    span = Span(0, made.blocks, 0, made.samples)
    kernel_of(run_blocks, made.setup.plant)(made.setup, made.course, made.world, made.state, made.scratch(), span)
    record = made.state.record
    flat = record.reshape(len(record), -1, *record.shape[3:])
    return to_rows(np.ascontiguousarray(flat), count).reshape(count, *record.shape[1:3])


def in_one_plane(case: Case, gains: list[float]) -> Numbers:
    """Run a case in one plane; its arrays by name, (count, ...)."""
    loops, streams = _lanes(case)
    wrist, law = in_plane(WristParameters.model_validate(dict(case.wrist)), "ulnar"), controller(case.law)
    period = sample_period(loops[0].control_period)
    motions = [
        motion(Reference(kind="minimum-jerk", angle_deg=angle), wrist, case.horizon, period) for angle in (30.0, -20.0)
    ]
    model, lanes = PLANTS[loops[0].plant.model], np.arange(case.lanes)
    worlds = [World(loop, wrist) for loop in loops]
    count = len(columns_of_sample(1, 2)) + model.coordinates(loops[0].plant_segments)
    order = Lanes(lanes // 2 % 2, lanes % len(loops), streams)
    made = batch(law, _gains(case, gains), motions, worlds, order, model, None, count)
    record = _recorded(made, case.lanes)
    sums = to_rows(made.state.sums, case.lanes)
    last = SUMS.index("alive")  # tensions of the last tick, as recorded, stand before it
    later = SUMS.index("limited")  # a newer sum, of which there is no record
    sums = np.concatenate([sums[:, :last], sums[:, len(SUMS) :], sums[:, last:later]], axis=1)
    return {
        "bend": record[:, :, :1],
        "record": record,
        "sums": sums,
        "memory": to_rows(made.state.memory[:, 0], case.lanes),
        "coordinates": to_rows(made.state.coordinates, case.lanes),
    }


def in_two_planes(case: Case, gains: list[float]) -> Numbers:
    """Run a case in two planes; its arrays by name, (count, ...)."""
    (loop,), streams = _lanes(case)
    wrist, law = WristParameters.model_validate(dict(case.wrist)), controller(case.law)
    layout = TendonLayout.of(wrist)
    period = sample_period(loop.control_period)
    time: Array = period * np.arange(float(round(case.horizon / period)))
    there, back = minimum_jerk(time, 1.0), minimum_jerk(time - 0.8, 1.0)
    references = np.deg2rad(25.0) * np.stack([there - 0.5 * back, 0.75 * back - 0.25 * there])
    followed = Motion.of_bends(references, period, wrist.length)
    one, names = np.zeros(case.lanes, np.int64), columns_of_sample(2, len(layout.places))
    made = batch(
        law, _gains(case, gains), [followed], [World(loop, wrist)], Lanes(one, one, streams), PCC_IN_SPACE, None,
        len(names) + 2 * loop.plant_segments,
    )  # fmt: skip
    record = _recorded(made, case.lanes)

    def of(name: str) -> Array:
        """Columns of a name, of all planes or places."""
        return record[:, :, [number for number, column in enumerate(names) if column.rpartition("_")[0] == name]]

    return {
        "bend": of("bend"),
        "rate": of("rate"),
        "seen": of("seen"),
        "pulls": layout.multiplicity * of("tension"),
        "acting": layout.multiplicity * of("acting"),
        "delivered": of("delivered"),
        "wanted": of("torque_wanted"),
        "coordinates": record[:, :, len(names) :],
    }


def avx512() -> bool:
    """Whether NumPy has functions for this processor that take eight numbers at once."""
    return "X86_V4" in np.show_config(mode="dicts")["SIMD Extensions"].get("found", ())


def records() -> Iterator[tuple[str, dict[str, Any]]]:
    """All records, of all cases."""
    for planes, cases in ((1, one_plane()), (2, two_planes())):
        for name, case in cases.items():
            law = controller(case.law)
            gains = list(gains_of(law, list(law.presets)[-1]))
            record, _ = record_of(case, gains, planes)
            yield name, {"avx512": avx512(), "gains": gains, **record}


def main() -> None:
    """Write the records."""
    lines = [f"{json.dumps(name)}: {json.dumps(record)}" for name, record in records()]
    RECORDS.write_text("{\n" + ",\n".join(lines) + "\n}\n", encoding="utf-8")


if __name__ == "__main__":
    main()
