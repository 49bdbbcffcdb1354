"""Logs of simulated wrists, damaged as users' logs are: is each damage named, or are the numbers as of the sound log?

`python -m tests.identification.damaged_logs` damages five sound logs, writes each as the table that a user would have,
and identifies it as `wristctl identify FILE` does; forty more sound logs are to stay as they are, with intervals that
hold the truth. What has ended is kept, and a later run goes on from there. Writes docs/damaged-logs.md; exit code 1
where a damaged log gave a number that is confident and wrong, or a sound one was met as damaged.
"""

from __future__ import annotations

import json
import math
import re
import sys
import tempfile
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

import wristctl
from tests.drawn_rigs import options, tried
from wristctl.arrays import Array
from wristctl.commands.identify.logs import LogTold, logs_of, read_logs
from wristctl.config.plant import Actuator, TrueWrist
from wristctl.config.study import Study
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.simulation.spool_driven import SpooledWrist, spooled
from wristctl.wrist.tendon_layout import TendonLayout

SEED = 20261129
PAGE = Path(__file__).parents[2] / "docs" / "damaged-logs.md"
BELIEVED = WristParameters(gravity=(0.0, 0.0), gravity_flexion=0.0, hand_mass=0.0)
_STEP, _SEGMENTS, _NOISE_DEG = 1e-3, 2, 0.03
# Range of a spool's way [m] and of the speeds of its sines [rad/s], and length reeled in on the straight wrist [m].
_WAY, _SPEEDS, _TIGHT = (4e-3, 8e-3), (1.0, 10.0), 1e-4
# Length of a count [mm] where a spool is written as a counter.
_COUNT = 0.002


class Kind(NamedTuple):
    """A kind of log: planes, tendons, rows per second, rows of which one has a bend, and length [s]."""

    planes: int
    tendons: int
    rate: float
    every: int = 1
    length: float = 10.0
    friction: float = 0.0
    """Coefficient of the tendons' friction."""

    @property
    def words(self) -> str:
        """The kind in words, for a table."""
        planes = "one plane" if self.planes == 1 else "two planes"
        return f"{planes}, {self.tendons} tendons, {self.rate / self.every:g} bends/s"


KINDS = (
    Kind(1, 2, 50.0), Kind(1, 2, 100.0, friction=0.1), Kind(1, 4, 30.0, length=16.0), Kind(2, 3, 50.0),
    Kind(2, 4, 100.0, every=2),
)  # fmt: skip


class Made(NamedTuple):
    """A sound log as its table has it, and what its wrist is."""

    table: pd.DataFrame
    truth: Mapping[str, float]


def believed(kind: Kind) -> dict[str, Any]:
    """The settings of the wrist that a user describes."""
    return {
        "gravity": [0.0, 0.0], "gravity_flexion": 0.0, "hand_mass": 0.0,
        "tendons": "three" if kind.tendons == 3 else "four",
    }  # fmt: skip


@cache
def made(kind: Kind, number: int) -> Made:
    """A log of a wrist that nobody knows: springs, damping, tendons and radius drawn, and a motion of three sines."""
    rng = np.random.default_rng([SEED, KINDS.index(kind), number])
    drawn = {
        "stiffness": BELIEVED.stiffness * rng.uniform(0.7, 1.1),
        "damping": BELIEVED.damping * rng.uniform(0.8, 1.2),
        "tendon_radius": BELIEVED.tendon_radius * (1.0 + 0.01 * rng.standard_normal()),
    }
    described = {"tendons": "three"} if kind.tendons == 3 else {}
    wrist = BELIEVED.model_copy(update=drawn | described)
    motors = Actuator(level="tendon", friction=kind.friction)
    motors = motors.model_copy(update={"tendon_stiffness": motors.tendon_stiffness * rng.uniform(0.8, 1.2)})
    time = np.arange(0.0, kind.length, 1.0 / kind.rate)
    sizes, phases, way = rng.uniform(0.3, 1.0, (2, 3)), rng.uniform(0.0, math.tau, (2, 3)), rng.uniform(*_WAY)
    speeds = np.exp(rng.uniform(math.log(_SPEEDS[0]), math.log(_SPEEDS[1]), (2, 3)))

    def wanted(at: Array) -> Array:
        waves = sizes[:, :, None] * np.sin(speeds[:, :, None] * at + phases[:, :, None])
        still = np.minimum(1.0, at)
        return np.asarray(way * still * waves.sum(axis=1) / sizes.sum(axis=1)[:, None])

    if kind.planes == 1:
        angles = np.array([0.0, math.pi])
        radius = wrist.tendon_offset
    else:
        places = [place for place in TendonLayout.of(wrist).places if place.radius > 0.0]
        angles, radius = np.array([place.angle for place in places]), places[0].radius
    if kind.planes == 1 and kind.tendons == 4:
        columns, numbers = [0, 0, 1, 1], [1, 2, 3, 4]
    else:
        columns = list(range(len(angles)))
        numbers = [1, 2, 4, 5] if kind.planes == 2 and kind.tendons == 4 else [1 + k for k in columns]

    def reeled(at: Array) -> Array:
        y, z = wanted(at)
        return np.stack([_TIGHT + np.cos(angle) * y + np.sin(angle) * z for angle in angles], axis=1)

    lane = SpooledWrist(wrist, motors, np.zeros(_SEGMENTS * kind.planes), plant=TrueWrist(), planes=kind.planes)
    steps = math.ceil(time[-1] / _STEP) + 2
    done = spooled([lane], lambda at, which: reeled(at)[:, :, None], steps, _STEP)
    fine = _STEP * np.arange(steps)
    spools = 1e3 * reeled(time)[:, columns]
    table = {"time [s]": time}
    seen = np.arange(len(time)) % kind.every == 0
    for plane, name in enumerate(("bend_y", "bend_z")[: kind.planes]):
        bend = np.degrees(np.interp(time, fine, done.bends[0, :, plane])) + _NOISE_DEG * rng.standard_normal(len(time))
        table[f"{name} [deg]"] = np.where(seen, bend, np.nan)
    table |= {f"spool_{number} [mm]": spools[:, k] for k, number in enumerate(numbers)}
    together = 2.0 if kind.planes == 1 and kind.tendons == 2 else 1.0
    truth = {
        "gain": (BELIEVED.tendon_offset if kind.planes == 1 else BELIEVED.tendon_radius) / radius,
        "tendon": together * motors.tendon_stiffness * radius**2 / wrist.stiffness,
        "delay": 0.0, "damping": wrist.damping / wrist.stiffness, "turn": 0.0,
    }  # fmt: skip
    return Made(pd.DataFrame(table), truth)


# --- damages ---------------------------------------------------------------------------------------------------------

Damaged = tuple[pd.DataFrame, str, dict[str, float]]
"""A table, the damage in words, and what it adds to parameters."""


def _spools(table: pd.DataFrame) -> list[str]:
    return [name for name in map(str, table) if name.startswith("spool")]


def _bends(table: pd.DataFrame) -> list[str]:
    return [name for name in map(str, table) if name.startswith("bend")]


def _permuted(table: pd.DataFrame, rng: np.random.Generator) -> Damaged:
    spools = _spools(table)
    order = list(range(len(spools)))
    while order == sorted(order):
        order = rng.permutation(len(spools)).tolist()
    changed = table.copy()
    changed[spools] = table[[spools[k] for k in order]].to_numpy()
    numbers = [name.split()[0].removeprefix("spool_") for name in spools]
    return changed, "columns hold spools " + ", ".join(numbers[k] for k in order), {}


def _signed(table: pd.DataFrame, rng: np.random.Generator) -> Damaged:
    name = str(rng.choice(_spools(table) + _bends(table)))
    return table.assign(**{name: -table[name]}), f"{name} with the other sign", {}


def _other_unit(table: pd.DataFrame, rng: np.random.Generator) -> Damaged:
    others = {
        "time [s]": ("time [ms]", "time [s]", 1e3), "bend": ("[rad]", "[deg]", 180.0 / math.pi),
        "spool": ("[m]", "[mm]", 1e3),
    }  # fmt: skip
    which, up = str(rng.choice(list(others))), bool(rng.integers(2))
    small, large, _ = others[which]
    if which == "time [s]":  # numbers in s under a head of ms, or numbers in ms under a head of s
        if up:
            return table.rename(columns={"time [s]": "time [ms]"}), "s under a head of ms", {}
        return table.assign(**{"time [s]": 1e3 * table["time [s]"]}), "ms under a head of s", {}
    names = [name for name in map(str, table) if name.startswith(which)]
    if which == "spool" and rng.integers(2):
        names = [str(rng.choice(names))]
    factor = others[which][2]
    if up:  # numbers of the finer unit under a head of the coarser
        heads = {name: name.replace(large, small) for name in names}
        return table.rename(columns=heads), f"{', '.join(names)} under {small}", {}
    return table.assign(**{name: table[name] / factor for name in names}), f"{', '.join(names)} in {small}", {}


def _shifted(table: pd.DataFrame, rng: np.random.Generator) -> Damaged:
    late = float(np.exp(rng.uniform(math.log(0.05), 0.0))) * (1.0 if rng.random() < 0.6 else -1.0)
    time, changed = table["time [s]"].to_numpy(), table.copy()
    for name in _bends(table):
        there = table[name].notna().to_numpy()
        moved = np.interp(time - late, time[there], table[name].to_numpy()[there], np.nan, np.nan)
        changed[name] = np.where(there, moved, np.nan)
    return changed, f"bends {abs(late):.3f} s {'late' if late > 0 else 'early'}", {"delay": late}


def _reset(table: pd.DataFrame, rng: np.random.Generator) -> Damaged:
    row = int(rng.uniform(0.03, 0.9) * len(table))
    time = table["time [s]"].to_numpy().copy()
    time += float(rng.choice([0.0, 5.0, 100.0]))
    time[row:] -= table["time [s]"].iloc[row] + (time[0] if rng.integers(2) else 0.0)
    return table.assign(**{"time [s]": time}), f"clock starts again at row {row} of {len(table)}", {}


def _wrapped(table: pd.DataFrame, rng: np.random.Generator) -> Damaged:
    name = str(rng.choice(_spools(table)))
    counts = np.round(table[name].to_numpy() / _COUNT)
    size = int(rng.choice([256, 1000, 1024, 2048, 4096, 2**16]))
    middle = rng.uniform(np.quantile(counts, 0.2), np.quantile(counts, 0.8))
    wrapped = np.mod(counts - round(middle), size)
    head = name.replace("[mm]", f"[{_COUNT} mm]")
    changed = table.assign(**{name: wrapped.astype(int)}).rename(columns={name: head})
    return changed, f"{name.split()[0]} a counter that wraps at {size}", {}


def _with_gap(table: pd.DataFrame, rng: np.random.Generator) -> Damaged:
    time = table["time [s]"]
    length = float(np.exp(rng.uniform(math.log(0.05), math.log(3.0))))
    begin = rng.uniform(1.0, float(time.iloc[-1]) - length - 1.0)
    lost = (time > begin) & (time < begin + length)
    return table[~lost].reset_index(drop=True), f"{length:.2f} s without rows", {}


def _frozen(table: pd.DataFrame, rng: np.random.Generator) -> Damaged:
    time, changed = table["time [s]"].to_numpy(), table.copy()
    length = float(np.exp(rng.uniform(math.log(0.05), math.log(3.0))))
    begin = rng.uniform(1.0, time[-1] - length - 1.0)
    rows = (time > begin) & (time < begin + length)
    names = {0: _bends(table), 1: [str(rng.choice(_spools(table)))], 2: _spools(table)}[int(rng.integers(3))]
    for name in names:
        column = table[name].to_numpy()
        held = column[: int(np.argmax(rows))]
        last = held[np.isfinite(held)][-1]
        changed[name] = np.where(rows & np.isfinite(column), last, column)
    return changed, f"{', '.join(name.split()[0] for name in names)} stand for {length:.2f} s", {}


def _repeated(table: pd.DataFrame, rng: np.random.Generator) -> Damaged:
    first, count = int(rng.integers(20, len(table) - 120)), int(rng.choice([1, 3, 10, 40, 80]))
    rows = np.arange(len(table))
    if rng.integers(2):  # a block twice
        order = np.concatenate([rows[: first + count], rows[first:]])
        return table.iloc[order].reset_index(drop=True), f"{count} rows stand twice, as a block", {}
    twice = np.sort(rng.choice(rows, count, replace=False))
    order = np.sort(np.concatenate([rows, twice]))
    return table.iloc[order].reset_index(drop=True), f"{count} rows stand twice", {}


def _noisy(table: pd.DataFrame, rng: np.random.Generator) -> Damaged:
    changed = table.copy()
    if rng.integers(2):
        size = float(np.exp(rng.uniform(math.log(0.1), math.log(3.0))))
        names, unit = (_bends(table), "deg") if rng.integers(2) else (_spools(table), "mm")
        size *= 1.0 if unit == "deg" else 0.1
        for name in names:
            changed[name] = table[name] + size * rng.standard_normal(len(table))
        return changed, f"noise of {size:.2f} {unit} on {', '.join(name.split()[0] for name in names)}", {}
    name, count = str(rng.choice(_bends(table) + _spools(table))), int(rng.choice([1, 3, 10]))
    there = np.flatnonzero(table[name].notna())
    rows = rng.choice(there, count, replace=False)
    column = table[name].to_numpy().copy()
    column[rows] = 0.0 if rng.integers(2) else column[rows] + np.ptp(column[there]) * rng.uniform(0.3, 3.0, count)
    return changed.assign(**{name: column}), f"{count} values of {name.split()[0]} are wrong", {}


class Damage(NamedTuple):
    """A way to damage a log, and what a finding that names it says."""

    change: Callable[[pd.DataFrame, np.random.Generator], Damaged]
    named: str
    """Regular expression that a finding which names it matches."""


DAMAGES = {
    "tendons exchanged": Damage(_permuted, "exchanged|turned by|not two on either|places"),
    "a sign": Damage(_signed, "exchanged|other sign|counted the other way|senses|turned by|not two on either"),
    "a unit": Damage(_other_unit, r"is it in|is time in|under its head|unit|in ms|in rad|in deg|between samples"),
    "a delay": Damage(_shifted, "behind the spools|ahead of the spools|of one clock"),
    "a clock that starts again": Damage(_reset, "starts again|goes back|two recordings"),
    "a counter that wraps": Damage(_wrapped, "wraps|begins again|jumps"),
    "a gap": Damage(_with_gap, "without a row"),
    "a sensor that stands": Damage(_frozen, "stands? at|stops at"),
    "rows that stand twice": Damage(_repeated, "stand twice|come late|goes back"),
    "noise": Damage(_noisy, "noise|scatter|alone|jumps|by its header"),
}


def damaged(number: int) -> tuple[Kind, str, Damaged]:
    """A sound log of each kind in turn, with one of the damages in turn."""
    kinds = list(DAMAGES)
    name, kind = kinds[number % len(kinds)], KINDS[(number // len(kinds)) % len(KINDS)]
    rng = np.random.default_rng([SEED, 1, number])
    return kind, name, DAMAGES[name].change(made(kind, 0).table, rng)


# --- what comes of them ----------------------------------------------------------------------------------------------


class Finding(NamedTuple):
    """What identify makes of a log: why it is refused, else what it remarks and, where wanted, what it tells."""

    refused: str
    remarks: Sequence[str]
    told: Mapping[str, tuple[float, float, float]]
    """Value and ends of its interval of each parameter that is told."""


def _study(table: pd.DataFrame, kind: Kind, folder: Path) -> Study:
    file = folder / "log.csv"
    table.to_csv(file, index=False, float_format="%.5f")
    settings = (f"wrist={json.dumps(believed(kind))}", f"identify.logs=[{json.dumps(str(file))}]")
    return wristctl.load_study(None, *settings)


def found(table: pd.DataFrame, kind: Kind, stop_at: str = "(?!)") -> Finding:
    """What identify makes of a table; where a remark matches `stop_at` nothing is fitted."""
    with tempfile.TemporaryDirectory() as folder:
        study = _study(table, kind, Path(folder))
        try:
            remarks = _of_damage(read_logs(logs_of(study), study).remarks)
            if any(re.search(stop_at, remark) for remark in remarks):
                return Finding("", remarks, {})
            result = wristctl.identify(study)
        except UserError as error:
            return Finding(str(error).replace(folder, ""), [], {})
    assert isinstance(result, LogTold)
    told = {name: (one.value, one.low, one.high) for name, one in result.fit.told.items() if one.known}
    return Finding("", _of_damage(result.remarks), told)


def _of_damage(remarks: Sequence[str]) -> list[str]:
    """Remarks without those that sound logs have: how many samples are used, and which tendons pull to which side."""
    return [remark for remark in remarks if not re.match(r"Of \d+ samples|Tendons ", remark)]


class Outcome(NamedTuple):
    """What a damaged log comes to beside the sound one."""

    verdict: str
    """named, refused, same, wider, untold or wrong."""
    finding: str
    """What names or refuses it, or the parameters that are wrong."""


def judged(finding: Finding, sound: Callable[[], Finding], named: str, adds: Mapping[str, float]) -> Outcome:
    """What a finding is beside that of the sound log, which is asked for where numbers decide.

    named: a sentence names the damage, or refuses the log by it; refused: by another sentence. Else the numbers say.

    same: every value lies in the sound log's interval; wider: else its own interval holds the sound log's value;
    untold: the parameters that would be off are not told; wrong: a parameter is told that is neither.
    """
    if finding.refused:
        return Outcome("named" if re.search(named, finding.refused) else "refused", finding.refused)
    for remark in finding.remarks:
        if re.search(named, remark):
            return Outcome("named", remark)
    wrong, wider, true_log = list[str](), False, sound().told
    for name, (value, low, high) in finding.told.items():
        if name not in true_log:
            continue
        true, least, most = (x + adds.get(name, 0.0) for x in true_log[name])
        if least <= value <= most:
            continue
        wider = True
        if not low <= true <= high:
            wrong.append(f"{name} {value:.3g} [{low:.3g}, {high:.3g}], not {true:.3g} [{least:.3g}, {most:.3g}]")
    if wrong:
        return Outcome("wrong", "; ".join([*wrong, *finding.remarks]))
    lost = any(name not in finding.told for name in true_log)
    return Outcome("wider" if wider else "untold" if lost else "same", "; ".join(finding.remarks))


@cache
def sound_one(kind: Kind) -> Finding:
    """What the sound log of a kind tells, which its damages are held against."""
    return found(made(kind, 0).table, kind)


def outcome(number: int) -> dict[str, Any]:
    """A damaged log and what it comes to."""
    kind, name, (table, words, adds) = damaged(number)
    named = DAMAGES[name].named
    result = judged(found(table, kind, named), lambda: sound_one(kind), named, adds)
    return {"kind": kind.words, "damage": name, "what": words, **result._asdict()}


def sound(number: int) -> dict[str, Any]:
    """A sound log: whether it is met as one, and which intervals hold the truth."""
    kind = KINDS[number % len(KINDS)]
    log = made(kind, 1 + number // len(KINDS))
    finding = found(log.table, kind)
    holds = {name: low <= log.truth[name] <= high for name, (_, low, high) in finding.told.items() if name in log.truth}
    changed = not finding.refused and not unchanged(log.table, kind)
    return {"kind": kind.words, "refused": finding.refused, "remarks": finding.remarks, "changed": changed,
            "told": finding.told, "truth": log.truth, "holds": holds}  # fmt: skip


def unchanged(table: pd.DataFrame, kind: Kind) -> bool:
    """Whether the looks leave every number of a log as it was read: the fit is then that without them."""
    from wristctl.records.log_converters import read_log
    from wristctl.records.log_looks import looked_at

    with tempfile.TemporaryDirectory() as folder:
        offset = TendonLayout.of(_study(table, kind, Path(folder)).wrist).offset
        log = read_log(Path(folder) / "log.csv", tendon_offset=offset)
        seen = looked_at(log, tendon_offset=offset)
    same = all(np.array_equal(seen.columns[name], column, equal_nan=True) for name, column in log.columns.items())
    return same and seen.columns.keys() == log.columns.keys() and not seen.words


VERDICTS = ("named", "refused", "same", "wider", "untold", "wrong")


def page(rows: Sequence[Mapping[str, Any]], sounds: Sequence[Mapping[str, Any]]) -> str:
    """The tables: a row for each damage, sound logs, and what is wrong."""
    counts = {name: Counter(row["verdict"] for row in rows if row["damage"] == name) for name in DAMAGES}
    wrong = [row for row in rows if row["verdict"] == "wrong"]
    every = [holds for one in sounds for holds in one["holds"].values()]
    lines = [
        "# Damaged logs: named, or the same numbers", "",
        f"{len(rows)} damages, drawn at random, to {len(KINDS)} simulated logs, each written as a table and identified",
        "as `wristctl identify FILE` does. Made by `make damaged-logs`.", "",
        "- **named**: a sentence names the damage with its place, or refuses the log by it",
        "- **refused**: for another reason, such as a motion that the model misses",
        "- **same**: nothing is said, and every parameter lies in the sound log's 95 % interval",
        "- **wider**: nothing is said; a parameter lies outside, and its own interval holds the sound log's value",
        "- **untold**: parameters that the sound log tells are *not identifiable*, and the others are the same",
        "- **wrong**: nothing is said, and a parameter is told whose interval misses the sound log's value;",
        "  noise alone makes one interval of 95 % in twenty miss", "",
        f"| damage | {' | '.join(VERDICTS)} |", "|---" * (1 + len(VERDICTS)) + "|",
    ]  # fmt: skip
    for name, count in counts.items():
        lines.append(f"| {name} | {' | '.join(str(count[verdict]) for verdict in VERDICTS)} |")
    total = Counter(row["verdict"] for row in rows)
    lines += [f"| all | {' | '.join(str(total[verdict]) for verdict in VERDICTS)} |", ""]
    if wrong:
        lines += ["| confident and wrong | log | what is told |", "|---|---|---|"]
        lines += [f"| {row['what']} | {row['kind']} | {row['finding']} |" for row in wrong] + [""]
    if sounds:
        met = sum(bool(one["refused"] or one["changed"]) for one in sounds)
        told = sum(bool(one["remarks"]) for one in sounds)
        lines += [
            "## Sound logs", "",
            f"{len(sounds)} sound logs: {met} are refused or changed, {told} have a remark. No number is changed,",
            f"so the intervals are those without the looks. {sum(every)} of {len(every)} that are told hold the truth",
            f"({100.0 * sum(every) / max(1, len(every)):.0f} %), in the table by parameter. Each motion is a sum of",
            "three sines in each plane, of 1 to 10 rad/s and 4 to 8 mm of spool, with 0.03 deg of noise. The wrist",
            "that is seen 100 times a second has friction in its tendons, which not every such motion parts from their",
            "stiffness: there the interval is wide, or it is",
            "*not identifiable*.", "",
            "| log | logs | " + " | ".join(_PARAMETERS) + " |", "|---" * (2 + len(_PARAMETERS)) + "|",
        ]  # fmt: skip
        for kind in KINDS:
            some = [one["holds"] for one in sounds if one["kind"] == kind.words]
            cells = [[holds[name] for holds in some if name in holds] for name in _PARAMETERS]
            shown = [f"{sum(cell)} of {len(cell)}" if cell else "-" for cell in cells]
            lines.append(f"| {kind.words} | {len(some)} | {' | '.join(shown)} |")
    return "\n".join(lines).rstrip() + "\n"


_PARAMETERS = ("gain", "tendon", "delay", "damping", "turn")


def main() -> int:
    """Damage logs, look at sound ones, and write the page."""
    parser = options(__doc__, 200, "damaged-logs")
    parser.add_argument("--sound", type=int, default=40, help="number of sound logs")
    parser.add_argument("--page", type=Path, default=PAGE)
    asked = parser.parse_args()
    rows, sounds = list[Any](), list[Any]()
    for number, row in tried(asked, outcome, "damaged"):
        rows.append(row)
        print(number, *(row[name] for name in ("verdict", "kind", "what", "finding")), sep=" | ", flush=True)
    asked.first, asked.count = 0, asked.sound
    for number, row in tried(asked, sound, "sound"):
        sounds.append(row)
        print(number, row["kind"], row["refused"], row["remarks"], row["holds"], sep=" | ", flush=True)
    asked.page.write_text(page(rows, sounds), encoding="utf-8")
    met = any(one["refused"] or one["changed"] for one in sounds)
    return int(met or any(row["verdict"] == "wrong" for row in rows))


if __name__ == "__main__":
    sys.exit(main())
