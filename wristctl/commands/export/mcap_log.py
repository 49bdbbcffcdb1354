"""A run as an MCAP log of ROS 2: its motions in ROS's own messages, every table over time, pictures of its camera.

The file is written by mcap, which keeps the run's id and metrics as metadata, messages are serialised by rosbags, whose
types need no ROS installation. Topics are `/tendons`, `/bend`, `/commands` and `/reference` (sensor_msgs/JointState),
`/joint_states` (the same, of the URDF's joints), `/tip` (geometry_msgs/PoseStamped in the frame `wrist_base`), `/trial`
(std_msgs/String), `/camera/compressed` (sensor_msgs/CompressedImage), and a topic for each table, whose messages'
definition is in the file.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from mcap.writer import Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from wristctl.arrays import Array
from wristctl.commands.export.pictures import Pictures
from wristctl.commands.export.recorded_motions import RecordedMotion, Stream
from wristctl.commands.export.urdf import joint_angles
from wristctl.errors import UserError
from wristctl.records import Run
from wristctl.records.ros_bags import BASE_FRAME, TRIAL
from wristctl.wrist.hinge_chain import HingeChain

if TYPE_CHECKING:
    import pandas as pd

# Columns that hold the time of a row; the first that a table has counts.
_TIMES = ("clock", "time", "captured")
_TYPES = {"b": "bool", "i": "int64", "u": "uint64", "f": "float64"}
_JOINTS, _POSE = "sensor_msgs/msg/JointState", "geometry_msgs/msg/PoseStamped"
_WORDS, _IMAGE = "std_msgs/msg/String", "sensor_msgs/msg/CompressedImage"
# Quantities of a joint by the columns of a motion: the joint, and the field of JointState.
_FIELDS = {
    "spool": ("spool", "position"),
    "tension": ("spool", "effort"),
    "bend": ("bend", "position"),
    "rate": ("bend", "velocity"),
    "torque": ("bend", "effort"),
}
# Time between two motions of a run without a clock [s].
_PAUSE = 1.0
_NANOSECONDS = 10**9

# Tables by name, with unit and meaning of their columns.
Tables = Mapping[str, tuple["pd.DataFrame", Mapping[str, tuple[str, str]]]]


class _Log:
    """An MCAP file of ROS 2 that is being written."""

    def __init__(self, stream: Any) -> None:
        self.store = get_typestore(Stores.ROS2_HUMBLE)
        self.written = 0
        self._writer, self._channels = Writer(stream), dict[str, tuple[int, str]]()
        self._writer.start(profile="ros2", library="wristctl")

    def declare(self, topic: str, kind: str, definition: str = "") -> None:
        """A topic of messages of a type; `definition` is that of a type that ROS does not have."""
        if topic in self._channels:
            return
        if definition:
            self.store.register(get_types_from_msg(definition, kind))
        else:
            definition, _ = self.store.generate_msgdef(kind, ros_version=2)
        schema = self._writer.register_schema(name=kind, encoding="ros2msg", data=definition.encode())
        qos = {"offered_qos_profiles": ""}
        channel = self._writer.register_channel(topic=topic, message_encoding="cdr", schema_id=schema, metadata=qos)
        self._channels[topic] = int(channel), kind

    def add(self, topic: str, second: float, message: Any) -> None:
        """A message of a topic at a time on the run's clock [s]."""
        channel, kind = self._channels[topic]
        nanoseconds = max(0, round(_NANOSECONDS * second))  # frames of the moment before a run's clock began
        content = bytes(self.store.serialize_cdr(message, kind))
        self._writer.add_message(
            channel_id=channel, log_time=nanoseconds, publish_time=nanoseconds, sequence=self.written, data=content
        )
        self.written += 1

    def header(self, second: float, frame: str = "") -> Any:
        """Header of a message."""
        seconds, nanoseconds = divmod(max(0, round(_NANOSECONDS * second)), _NANOSECONDS)
        stamp = self.store.types["builtin_interfaces/msg/Time"](seconds, nanoseconds)
        return self.store.types["std_msgs/msg/Header"](stamp, frame)

    def finish(self, about: Mapping[str, Mapping[str, str]]) -> None:
        """Close the file, with what is known of the run."""
        for name, values in about.items():
            self._writer.add_metadata(name, dict(values))
        self._writer.finish()  # type: ignore[no-untyped-call]


def write_mcap(
    run: Run,
    motions: Sequence[RecordedMotion],
    chain: HingeChain,
    tables: Tables,
    about: Mapping[str, Mapping[str, str]],
    path: Path,
) -> None:
    """Write a run as an MCAP log. Times are those of the run's clock, from 0.

    Raises UserError for a run without motions and tables over time.
    """
    begins = _begins(tables)
    with path.open("wb") as stream:
        log = _Log(stream)
        _motions(log, motions, chain)
        for name, (table, columns) in tables.items():
            seconds = _seconds(table, begins)
            if seconds is not None:
                _table(log, f"/{_word(run.kind)}/{_word(name)}", f"{run.kind} {name}", table, columns, seconds)
        for end in ("", "_2"):
            for name, topic in (("raw", "compressed"), ("video", "annotated/compressed")):
                _film(log, Pictures.of(run, f"{name}{end}"), f"/camera{end}/{topic}")
        log.finish(about)
    if not log.written:
        raise UserError(f"nothing in that {run.kind} run went on in time", str(run.path), "--to mat")


def _motions(log: _Log, motions: Sequence[RecordedMotion], chain: HingeChain) -> None:
    """Motions one after the other; on the run's clock where it has one."""
    after = 0.0
    for motion in motions:
        streams = [stream for stream in motion.measured if len(stream.time)]
        if not streams:
            continue
        first = min(float(stream.time.min()) for stream in streams)
        begin = after - first if motion.begin is None else motion.begin
        after = begin + max(float(stream.time.max()) for stream in streams) + _PAUSE
        if motion.name:
            log.declare(f"/{TRIAL}", _WORDS)
            log.add(f"/{TRIAL}", begin + first, log.store.types[_WORDS](motion.name))
        for stream in streams:
            _joints(log, "/tendons", stream, begin, ("spool", "tension"))
            _joints(log, "/bend", stream, begin, ("bend", "rate"))
            _tips(log, stream, begin)
        _shown(log, streams, begin, chain)
        for topic, wanted in (("/commands", motion.commands), ("/reference", motion.reference)):
            if wanted is not None:
                _joints(log, topic, wanted, begin, tuple(_FIELDS))


def _joints(log: _Log, topic: str, stream: Stream, begin: float, quantities: Sequence[str]) -> None:
    """Spools with their tensions, or bends with their rates and torques, as joints; without those of empty cells."""
    joints = dict[str, dict[str, Array]]()
    for name, column in stream.columns.items():
        quantity, _, end = name.partition("_")
        if quantity in quantities:
            joint, of_joint = _FIELDS[quantity]
            joints.setdefault(f"{joint}_{end}", {})[of_joint] = column
    if not joints:
        return
    log.declare(topic, _JOINTS)
    there: dict[str, Any] = {
        name: np.isfinite(np.stack(list(columns.values()))).any(axis=0) for name, columns in joints.items()
    }
    used = {field for columns in joints.values() for field in columns}
    for row, second in enumerate((begin + stream.time).tolist()):
        named = [name for name in joints if there[name][row]]
        if not named:
            continue
        values = {
            field: np.array([float(joints[name][field][row]) if field in joints[name] else np.nan for name in named])
            for field in used
        }
        empty = np.empty(0)
        message = log.store.types[_JOINTS](
            log.header(second), named, *(values.get(field, empty) for field in ("position", "velocity", "effort"))
        )
        log.add(topic, second, message)


def _tips(log: _Log, stream: Stream, begin: float) -> None:
    """Middle of the last disc from the first, x along the straight wrist, turned from x to where it bends."""
    columns = stream.columns
    if "tip_x" not in columns or not {"bend_y", "bend_z"} & set(columns):
        return
    log.declare("/tip", _POSE)
    types, nothing = log.store.types, np.zeros(len(stream.time))
    place = np.stack([columns.get(name, nothing) for name in ("tip_x", "tip_y", "tip_z")], axis=1)
    bend = np.stack([columns.get(name, nothing) for name in ("bend_y", "bend_z")], axis=1)
    angle = np.linalg.norm(bend, axis=1)
    share = 0.5 * np.sinc(angle / (2.0 * math.pi))
    for row in np.flatnonzero(np.isfinite(place).all(axis=1) & np.isfinite(bend).all(axis=1)).tolist():
        y, z = (share[row] * bend[row]).tolist()
        second = begin + float(stream.time[row])
        turn = types["geometry_msgs/msg/Quaternion"](0.0, -z, y, math.cos(0.5 * float(angle[row])))
        pose = types["geometry_msgs/msg/Pose"](types["geometry_msgs/msg/Point"](*place[row].tolist()), turn)
        log.add("/tip", second, types[_POSE](log.header(second, BASE_FRAME), pose))


def _shown(log: _Log, streams: Sequence[Stream], begin: float, chain: HingeChain) -> None:
    """Joints of the URDF as the wrist bends, at each time at which a bend was measured; the other plane's is held."""
    seen = [
        (second, q, value)
        for stream in streams
        for q, name in enumerate(("bend_y", "bend_z"))
        if name in stream.columns
        for second, value in zip(stream.time.tolist(), stream.columns[name].tolist(), strict=True)
        if math.isfinite(value)
    ]
    if not seen:
        return
    bends, now = dict[float, tuple[float, float]](), [0.0, 0.0]
    for second, q, value in sorted(seen):
        now[q] = value
        bends[second] = now[0], now[1]
    angles = joint_angles(chain, np.array(list(bends.values())))
    names, positions, empty = list(angles), np.stack(list(angles.values()), axis=1), np.empty(0)
    log.declare("/joint_states", _JOINTS)
    for second, position in zip(bends, positions, strict=True):
        at = begin + second
        log.add("/joint_states", at, log.store.types[_JOINTS](log.header(at), names, position, empty, empty))


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


def _table(
    log: _Log, topic: str, title: str, table: pd.DataFrame, columns: Mapping[str, tuple[str, str]], seconds: Array
) -> None:
    """Rows of a table in messages of a type with a field for each column, whose unit and meaning are its comment."""
    kind = "wristctl_msgs/msg/" + "".join(part.capitalize() for part in _word(title).split("_"))
    names, lines, read = list[str](), list[str](), list[Callable[[Any], Any]]()
    for key, values in table.items():
        unit, meaning = columns.get(str(key), ("", ""))
        of_type = _TYPES.get(values.to_numpy().dtype.kind, "string")
        word = _word(str(key))  # of two alike the second ends in _2
        alike = (f"{word}_{k}" for k in range(2, 2 + len(names)))
        names.append(next(name for name in (word, *alike) if name not in names))
        told = " ".join(f"{f'[{unit}] ' if unit else ''}{meaning}".split())
        lines.append(f"{of_type} {names[-1]}{f'  # {told}' if told else ''}")
        read.append(_text if of_type == "string" else {"float64": float, "bool": bool}.get(of_type, int))
    log.declare(topic, kind, "\n".join(lines) + "\n")
    message = log.store.types[kind]
    for second, row in zip(seconds.tolist(), table.itertuples(index=False, name=None), strict=True):
        log.add(topic, second, message(*(value(cell) for value, cell in zip(read, row, strict=True))))


def _text(cell: Any) -> str:
    """A cell of words; empty where it is missing."""
    return "" if isinstance(cell, float) and math.isnan(cell) else str(cell)


def _word(name: str) -> str:
    """A name as ROS has them: small letters, digits and single underscores."""
    word = re.sub(r"[^a-z0-9]+", "_", name.lower()).strip("_")
    return word if word[:1].isalpha() else f"x{word}"


def _film(log: _Log, pictures: Pictures | None, topic: str) -> None:
    """Pictures of a video as JPEG."""
    import cv2

    if pictures is None:
        return
    log.declare(topic, _IMAGE)
    for second, picture in pictures:
        jpeg = np.frombuffer(cv2.imencode(".jpg", picture)[1].tobytes(), np.uint8)
        log.add(topic, second, log.store.types[_IMAGE](log.header(second, "camera"), "jpeg", jpeg))
