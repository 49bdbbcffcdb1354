"""The motions of a run as a LeRobotDataset (v3): a folder that LeRobot, its viewers and `identify` open.

A motion is an episode, its rows stand at even times. A row holds the values that were taken last, in single precision
as policies want them; `observed` has them in double precision and `observed_at` when each was taken, from which the
samples come back as they were. Both have no value where none was taken; `observation.state` has 0 there. The layout is
that of LeRobot's documentation (https://huggingface.co/docs/lerobot/lerobot-dataset-v3): meta/info.json,
meta/stats.json, meta/tasks.parquet, meta/episodes/chunk-000/file-000.parquet, data/chunk-000/file-000.parquet and, with
pictures, videos/KEY/chunk-000/file-000.mp4.
"""

from __future__ import annotations

import json
import logging
import math
import shutil
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.commands.export.pictures import Pictures
from wristctl.commands.export.recorded_motions import RecordedMotion, Stream, motions_of, si_unit
from wristctl.errors import FILE, UserError, writing
from wristctl.records import Run
from wristctl.records.log_columns import units_of
from wristctl.records.parquet_logs import ACTION, OBSERVED, OBSERVED_AT, STATE

_log = logging.getLogger(__name__)

_WANTED = "observation.environment_state"
# Features of the cameras' pictures, and the names of their films in a run.
_CAMERAS = {"observation.images.camera": "raw", "observation.images.camera_2": "raw_2"}
_PART = "chunk-{chunk_index:03d}/file-{file_index:03d}"
_COUNTED = ("frame_index", "episode_index", "index", "task_index")
_QUANTILES = {"q01": 0.01, "q10": 0.1, "q50": 0.5, "q90": 0.9, "q99": 0.99}
# Part of a row's time by which a sample may come later than it: what rounding makes of equal times.
_ROUNDING = 1e-4
# Part of a stream's rate by which clocks make it differ from a whole number.
_UNEVEN = 1e-3
# Most rows a second, which no tick or camera here exceeds.
_FASTEST = 10_000

_CARD = """---
license: other
tags: [LeRobot, wristctl]
---
Motions of the {kind} run {run} of wristctl, {rate} rows a second.

- `observation.state`: values measured last, 0 where none was; `action`: what was commanded;
  `observation.environment_state`: bends that the controller followed. Units are in `meta/info.json`.
- `observed`: measured values in double precision; `observed_at`: when each was taken, from the start of the motion [s].

`wristctl identify` reads this folder.
"""


@dataclass(frozen=True)
class _Rows:
    """Values of one motion at N even times, and when they were taken (N, Q); nan where none ever was."""

    values: Array
    taken: Array
    lost: int
    """Samples that share a row with a later one."""


def write_data_set(run: Run, path: Path) -> None:
    """Write the motions of a run as a LeRobotDataset into a new folder.

    Raises UserError for a run without motions, and without pyarrow.
    """
    motions = [motion for motion in motions_of(run) if any(len(stream.time) for stream in motion.measured)]
    if not motions:
        raise UserError("its motions ended before anything was measured", str(run.path), "name another run")
    rate = _rate(motions)
    names = _parts(motions)
    tasks = list(dict.fromkeys(motion.task for motion in motions))
    films = {key: film for key, name in _CAMERAS.items() if (film := Pictures.of(run, name))}
    columns: dict[str, list[Any]] = {key: [] for key in (*names, OBSERVED, OBSERVED_AT, "timestamp", *_COUNTED)}
    lengths, shown, lost = list[int](), list[Array](), 0
    for episode, motion in enumerate(motions):
        begin, count = _span(motion, rate)
        lengths.append(count)
        time = begin + np.arange(count) / rate
        shown.append(time + (motion.begin or 0.0))
        for key, streams in _streams(motion).items():
            if key not in names:
                continue
            rows = _sampled(streams, names[key], begin, count, rate)
            columns[key].append(rows.values.astype(np.float32))
            if key == STATE:
                measured = [name for name in names[STATE] if units_of(name) is not None]
                exact = [names[STATE].index(name) for name in measured]
                columns[OBSERVED].append(np.where(np.isnan(rows.taken), np.nan, rows.values)[:, exact])
                columns[OBSERVED_AT].append(rows.taken[:, exact])
                lost += rows.lost
        at = np.arange(count)
        columns["timestamp"].append((at / rate).astype(np.float32))
        columns["frame_index"].append(at)
        columns["episode_index"].append(np.full(count, episode))
        columns["index"].append(sum(lengths[:-1]) + at)
        columns["task_index"].append(np.full(count, tasks.index(motion.task)))
    if lost:
        _log.warning("%d samples share a row of 1/%d s with a later one, and are left out", lost, rate)
    table = {key: np.concatenate(parts) for key, parts in columns.items()}
    features = _features(names)
    with _new_folder(path) as folder:
        for key, film in films.items():
            if described := _film(folder, key, film, shown, rate):
                features[key] = described
        _write(folder, table, features, lengths, [motion.task for motion in motions], tasks, rate, run)


def _streams(motion: RecordedMotion) -> dict[str, Sequence[Stream]]:
    """Streams of a motion by the feature that they are in."""
    commands = [motion.commands] if motion.commands else []
    wanted = [motion.reference] if motion.reference else []
    return {STATE: motion.measured, ACTION: commands, _WANTED: wanted}


def _parts(motions: Sequence[RecordedMotion]) -> dict[str, list[str]]:
    """Names of each feature's parts, without features that no motion has."""
    names = {
        key: sorted({name for motion in motions for stream in _streams(motion)[key] for name in stream.columns})
        for key in (STATE, ACTION, _WANTED)
    }
    return {key: parts for key, parts in names.items() if parts}


def _rate(motions: Sequence[RecordedMotion]) -> int:
    """Rows a second: as many as the fastest stream has samples, a whole number."""
    steps = [
        float(np.median(np.diff(stream.time)))
        for motion in motions
        for streams in _streams(motion).values()
        for stream in streams
        if len(stream.time) > 1
    ]
    fastest = 1.0 / min((step for step in steps if step > 0.0), default=1.0)
    even = round(fastest) if abs(fastest - round(fastest)) < _UNEVEN * fastest else math.ceil(fastest)
    return min(max(1, even), _FASTEST)


def _span(motion: RecordedMotion, rate: int) -> tuple[float, int]:
    """Time of the first row [s] and number of rows: the fastest stream's samples stand at rows."""
    streams = [stream for stream in motion.measured if len(stream.time)]
    fastest = max(streams, key=lambda stream: len(stream.time))
    first = min(float(stream.time.min()) for stream in streams)
    begin = float(fastest.time[0]) - math.ceil((float(fastest.time[0]) - first) * rate - _ROUNDING) / rate
    last = max(float(stream.time.max()) for stream in streams)
    return begin, 1 + math.ceil((last - begin) * rate - 0.5)


def _sampled(streams: Sequence[Stream], names: Sequence[str], begin: float, count: int, rate: int) -> _Rows:
    """Values at even times: the last that was taken by then, before the first one that."""
    values, taken, lost = np.zeros((count, len(names))), np.full((count, len(names)), np.nan), 0
    for stream in streams:
        place = (stream.time - begin) * rate
        even = len(stream.time) > 1 and float(np.median(np.diff(stream.time))) * rate < 1.5
        # Samples as frequent as rows keep their own row whatever their jitter, others wait for the next one.
        rows = np.clip(np.round(place) if even else np.ceil(place - _ROUNDING), 0, count - 1).astype(int)
        for name, column in stream.columns.items():
            there = np.isfinite(column)
            if not there.any():
                continue
            kept = dict(zip(rows[there].tolist(), np.flatnonzero(there).tolist(), strict=True))
            lost += int(there.sum()) - len(kept)
            at = np.array(sorted(kept))
            sample = np.array([kept[row] for row in at])
            last = sample[np.maximum(np.searchsorted(at, np.arange(count), side="right") - 1, 0)]
            q = names.index(name)
            values[:, q], taken[:, q] = column[last], stream.time[last]
    return _Rows(values, taken, lost)


def _features(names: Mapping[str, Sequence[str]]) -> dict[str, dict[str, Any]]:
    """Description of each column, as info.json has it."""
    features: dict[str, dict[str, Any]] = {}
    for key, parts in names.items():
        written = [f"{name} [{si_unit(name)}]" for name in parts]
        features[key] = {"dtype": "float32", "shape": [len(parts)], "names": written}
        if key == STATE:
            exact = [name for name, whole in zip(written, parts, strict=True) if units_of(whole) is not None]
            features[OBSERVED] = {"dtype": "float64", "shape": [len(exact)], "names": exact}
            features[OBSERVED_AT] = {"dtype": "float64", "shape": [len(exact)], "names": exact}
    features["timestamp"] = {"dtype": "float32", "shape": [1], "names": None}
    return features | {key: {"dtype": "int64", "shape": [1], "names": None} for key in _COUNTED}


def _film(folder: Path, key: str, film: Pictures, shown: Sequence[Array], rate: int) -> dict[str, Any] | None:
    """Write the picture of every row, and describe them; None where no encoder is there, which is said."""
    file = folder / "videos" / key / f"{_PART.format(chunk_index=0, file_index=0)}.mp4"
    file.parent.mkdir(parents=True)
    size = film.write_mp4(file, np.concatenate(shown), rate)
    if size is None:
        shutil.rmtree(folder / "videos" / key)
        if not any((folder / "videos").iterdir()):
            (folder / "videos").rmdir()
        _log.warning("the video is left out: OpenCV has no encoder for MP4 here")
        return None
    height, width = size
    about: dict[str, Any] = {"video.fps": rate, "video.height": height, "video.width": width, "video.channels": 3}
    about |= {"video.codec": "mpeg4", "video.pix_fmt": "yuv420p", "video.is_depth_map": False, "has_audio": False}
    return {"dtype": "video", "shape": [height, width, 3], "names": ["height", "width", "channels"], "info": about}


def _write(
    folder: Path,
    table: Mapping[str, NDArray[Any]],
    features: Mapping[str, Mapping[str, Any]],
    lengths: Sequence[int],
    task_of: Sequence[str],
    tasks: Sequence[str],
    rate: int,
    run: Run,
) -> None:
    """Write the files of a data set."""
    import pandas as pd
    import pyarrow as pa
    import pyarrow.parquet as pq

    # Missing values stay nan: LeRobot makes tensors of lists, and has none for null.
    arrays = {
        key: pa.FixedSizeListArray.from_arrays(pa.array(values.ravel()), values.shape[1])
        if values.ndim == 2 and values.shape[1] > 1
        else pa.array(values.ravel())
        for key, values in table.items()
    }
    ends = np.cumsum(lengths)
    described = {key: values for key, values in table.items() if key in features}
    episodes: list[dict[str, Any]] = []
    for number, (length, end) in enumerate(zip(lengths, ends.tolist(), strict=True)):
        row: dict[str, Any] = {"episode_index": number, "tasks": [task_of[number]], "length": length}
        row |= {
            "data/chunk_index": 0,
            "data/file_index": 0,
            "dataset_from_index": end - length,
            "dataset_to_index": end,
        }
        for key in _CAMERAS.keys() & features.keys():
            row |= {f"videos/{key}/chunk_index": 0, f"videos/{key}/file_index": 0}
            row |= {f"videos/{key}/from_timestamp": (end - length) / rate, f"videos/{key}/to_timestamp": end / rate}
        of_episode = {key: _statistics(values[end - length : end]) for key, values in described.items()}
        row |= {f"stats/{key}/{name}": value for key, each in of_episode.items() for name, value in each.items()}
        episodes.append(row | {"meta/episodes/chunk_index": 0, "meta/episodes/file_index": 0})
    info = {
        "codebase_version": "v3.0",
        "robot_type": "wristctl",
        "total_episodes": len(lengths),
        "total_frames": int(ends[-1]),
        "total_tasks": len(tasks),
        "chunks_size": 1000,
        "data_files_size_in_mb": 100,
        "video_files_size_in_mb": 200,
        "fps": rate,
        "splits": {"train": f"0:{len(lengths)}"},
        "data_path": f"data/{_PART}.parquet",
        "video_path": f"videos/{{video_key}}/{_PART}.mp4" if _CAMERAS.keys() & features.keys() else None,
        "features": features,
    }
    statistics = {key: _statistics(values) for key, values in described.items()}
    _write_json(folder / "meta" / "info.json", info)
    _write_json(folder / "meta" / "stats.json", statistics)
    index = pd.Index(tasks, name="task")
    pd.DataFrame({"task_index": range(len(tasks))}, index=index).to_parquet(folder / "meta" / "tasks.parquet")
    part = f"{_PART.format(chunk_index=0, file_index=0)}.parquet"
    for content, place in ((pa.Table.from_pylist(episodes), "meta/episodes"), (pa.table(arrays), "data")):
        (folder / place / part).parent.mkdir(parents=True)
        pq.write_table(content, folder / place / part)
    (folder / "README.md").write_text(_CARD.format(run=run.id, kind=run.kind, rate=rate), encoding="utf-8")


def _statistics(values: NDArray[Any]) -> dict[str, list[float]]:
    """Least, greatest, mean, standard deviation and quantiles of each part, without values that nobody took."""
    parts = values.reshape(len(values), -1).astype(float)
    empty = ~np.isfinite(parts).any(axis=0)
    parts = np.where(empty, 0.0, parts)
    found = {
        "min": np.nanmin(parts, 0),
        "max": np.nanmax(parts, 0),
        "mean": np.nanmean(parts, 0),
        "std": np.nanstd(parts, 0),
    }
    found |= {name: np.nanquantile(parts, share, axis=0) for name, share in _QUANTILES.items()}
    return {name: value.tolist() for name, value in found.items()} | {"count": [len(parts)]}


def _write_json(file: Path, content: object) -> None:
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(json.dumps(content, indent=4, allow_nan=False) + "\n", encoding="utf-8")


@contextmanager
def _new_folder(path: Path) -> Iterator[Path]:
    """A folder that takes the name `path` when the block ends well. Raises UserError where it cannot be written."""
    try:
        import pyarrow  # noqa: F401
    except ImportError:
        from wristctl.records.recorded_table import INSTALL

        raise UserError("LeRobot's files need pyarrow, which is not installed", "--to lerobot", INSTALL) from None
    part = path.with_name(f".{path.name}.part")
    shutil.rmtree(part, ignore_errors=True)
    try:
        with writing(path, FILE):
            part.mkdir()
            yield part
            part.rename(path)
    finally:
        shutil.rmtree(part, ignore_errors=True)
