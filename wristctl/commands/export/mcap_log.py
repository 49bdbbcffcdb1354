"""A run as an MCAP log: each table that goes on in time as a channel of JSON, videos as pictures of Foxglove's kind."""

from __future__ import annotations

import base64
import json
import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from mcap.writer import Writer

from wristctl.arrays import Array
from wristctl.errors import UserError
from wristctl.records import Run

if TYPE_CHECKING:
    import pandas as pd

# Columns that hold the time of a row; the first that a table has counts.
_TIMES = ("clock", "time", "captured")
_PICTURE = {
    "type": "object",
    "title": "foxglove.CompressedImage",
    "properties": {
        "timestamp": {"type": "object", "properties": {"sec": {"type": "integer"}, "nsec": {"type": "integer"}}},
        "frame_id": {"type": "string"},
        "data": {"type": "string", "contentEncoding": "base64"},
        "format": {"type": "string"},
    },
}
_TYPES = {"b": "boolean", "i": "integer", "u": "integer", "f": "number"}

# Tables by name, with unit and meaning of their columns.
Tables = Mapping[str, tuple["pd.DataFrame", Mapping[str, tuple[str, str]]]]


def write_mcap(run: Run, tables: Tables, about: Mapping[str, Mapping[str, str]], path: Path) -> None:
    """Write a run as an MCAP log. Times are those of the run's clock, from 0.

    Raises UserError for a run without a table over time.
    """
    begins = _begins(tables)
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start(profile="", library="wristctl")
        written = 0
        for name, (table, columns) in tables.items():
            seconds = _seconds(table, begins)
            if seconds is None:
                continue
            channel = _channel(writer, f"/{run.kind}/{name}", f"wristctl.{name}", _schema(name, table, columns))
            for index, (second, row) in enumerate(zip(seconds.tolist(), _rows(table), strict=True)):
                _add(writer, channel, second, index, row)
            written += len(table)
        for name in ("raw", "video"):
            written += _film(writer, run, name, tables)
        for name, values in about.items():
            writer.add_metadata(name, dict(values))
        writer.finish()  # type: ignore[no-untyped-call]
    if not written:
        raise UserError(f"nothing in that {run.kind} run went on in time", str(run.path), "--to mat")


def _begins(tables: Tables) -> dict[int, float]:
    """Start of each trial on the run's clock [s]."""
    log = tables["log"][0] if "log" in tables else None
    if log is None or not {"trial", "time", "clock"} <= set(log.columns):
        return {}
    first = log.drop_duplicates("trial")
    return dict(zip(first["trial"].tolist(), (first["clock"] - first["time"]).tolist(), strict=True))


def _seconds(table: pd.DataFrame, begins: Mapping[int, float]) -> Array | None:
    """Time of each row [s]; None of a table that does not go on in time."""
    name = next((column for column in _TIMES if column in table.columns), None)
    if name is None or not len(table):
        return None
    seconds: Array = table[name].to_numpy(np.float64)
    if name != "clock" and "trial" in table.columns:
        seconds = seconds + np.array([begins.get(int(trial), 0.0) for trial in table["trial"]])
    return seconds if np.isfinite(seconds).all() else None


def _schema(name: str, table: pd.DataFrame, columns: Mapping[str, tuple[str, str]]) -> dict[str, Any]:
    properties = {}
    for key, values in table.items():
        unit, meaning = columns.get(str(key), ("", ""))
        kind = _TYPES.get(values.to_numpy().dtype.kind, "string")
        description = f"{meaning} [{unit}]" if unit else meaning
        properties[str(key)] = {"type": [kind, "null"], "description": description.strip()}
    return {"type": "object", "title": name, "properties": properties}


def _rows(table: pd.DataFrame) -> Iterator[dict[str, Any]]:
    """Rows of a table by column, with null for a missing value."""
    names, columns = [str(key) for key in table.columns], [table[key].tolist() for key in table.columns]
    for cells in zip(*columns, strict=True):
        values = (None if isinstance(cell, float) and not math.isfinite(cell) else cell for cell in cells)
        yield dict(zip(names, values, strict=True))


def _film(writer: Writer, run: Run, name: str, tables: Tables) -> int:
    """The pictures of a video, whose times stand in raw.csv; how many there are."""
    import cv2

    if "raw" not in tables or not run.has(f"data/{name}.avi"):
        return 0
    seconds, capture = tables["raw"][0]["clock"].tolist(), cv2.VideoCapture(str(run.file(f"data/{name}.avi")))
    channel, count = _channel(writer, f"/{run.kind}/{name}_video", "foxglove.CompressedImage", _PICTURE), 0
    while count < len(seconds) and (read := capture.read())[0]:
        nanoseconds = round(1e9 * seconds[count])
        stamp = {"sec": nanoseconds // 10**9, "nsec": nanoseconds % 10**9}
        jpeg = base64.b64encode(cv2.imencode(".jpg", read[1])[1].tobytes()).decode()
        picture = {"timestamp": stamp, "frame_id": "camera", "data": jpeg, "format": "jpeg"}
        _add(writer, channel, seconds[count], count, picture)
        count += 1
    capture.release()
    return count


def _channel(writer: Writer, topic: str, schema: str, content: Mapping[str, Any]) -> int:
    schema_id = writer.register_schema(name=schema, encoding="jsonschema", data=json.dumps(content).encode())
    return int(writer.register_channel(topic=topic, message_encoding="json", schema_id=schema_id))


def _add(writer: Writer, channel: int, second: float, number: int, message: Mapping[str, Any]) -> None:
    nanoseconds = max(0, round(1e9 * second))  # frames of the moment before a run's clock began
    content = json.dumps(message, allow_nan=False).encode()
    writer.add_message(
        channel_id=channel, log_time=nanoseconds, publish_time=nanoseconds, sequence=number, data=content
    )
