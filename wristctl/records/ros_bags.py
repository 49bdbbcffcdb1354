"""Recordings of ROS: MCAP and SQLite files of ROS 2, bags of ROS 1, read by rosbags without a ROS installation.

A message is a row at the time of its header's stamp, or of its recording where it has none. Columns are
`/topic.joint.position` of JointState, `/topic` of numbers; rigid bodies are poses, transforms and inertial units by
their topics. Joints that are named as the spools and bends of an open log, `spool_1` and `bend_y`, need no other name:
ROS has metres, radians and newtons. A String on a topic named `trial` parts the bag into recordings.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from wristctl.errors import UserError
from wristctl.plain_files import LARGEST_DATA, open_plain
from wristctl.records.log_columns import head_of_open_log
from wristctl.records.recorded_table import INSTALL, RecordedTable, RigidBody, cannot_read, unit_quaternions

SUFFIXES = (".mcap", ".db3", ".bag")
"""Endings of files that are bags."""

_NUMBERS = ("Float64", "Float32", "Int32", "Int64", "UInt32", "UInt16", "Int16")
_VECTORS = ("Float64MultiArray", "Float32MultiArray", "Int32MultiArray")
_POSES = ("PoseStamped", "PoseWithCovarianceStamped", "TransformStamped", "Odometry", "Imu")
_READ = ("JointState", *_NUMBERS, *_VECTORS, *_POSES)
_NANOSECONDS = 10**9
TRIAL, BASE_FRAME = "trial", "wrist_base"
"""Topic that names the trial, and frame of poses in the axes of an open log."""
_WANTED = re.compile("cmd|command|ref|target|desired|goal|setpoint|soll|consigne")
_JOINT = re.compile(r"(spool|bend)_([1-9]\d*|[yz])")
_STANDING = {
    ("spool", "position"): "spool_{} [m]",
    ("spool", "effort"): "tension_{} [N]",
    ("bend", "position"): "bend_{} [rad]",
}


def bag_table(file: Path, what: str) -> RecordedTable:
    """Columns and rigid bodies of a bag; `what` is what an error calls it.

    Raises UserError for a file that cannot be read, or without messages of the types that are read.
    """
    try:
        from rosbags.highlevel import AnyReader
        from rosbags.typesys import Stores, get_typestore
    except ImportError:
        raise UserError("bags are read by rosbags, which is not installed", str(file), INSTALL) from None
    columns = dict[str, dict[int, float]]()
    poses = dict[str, dict[int, list[float]]]()
    trials = dict[int, str]()
    types = set[str]()
    try:
        open_plain(file, LARGEST_DATA).close()
        with AnyReader([file], default_typestore=get_typestore(Stores.LATEST)) as reader:
            types = {connection.msgtype for connection in reader.connections}
            wanted = [one for one in reader.connections if _kind(one) in _READ or _names_trial(one)]
            for connection, recorded, raw in reader.messages(wanted) if wanted else ():
                message: Any = reader.deserialize(raw, connection.msgtype)
                if _names_trial(connection):
                    trials[recorded] = message.data
                    continue
                _note(connection.topic, _kind(connection), message, recorded, columns, poses)
    except Exception as error:  # of a torn file the library's reader fails in any way
        raise cannot_read(what, file, error, "a bag of ROS, closed properly (`ros2 bag reindex`)") from error
    if not columns and not poses:
        problem = f"no topic of a type that is read, but {', '.join(sorted(types)) or 'none at all'}"
        raise UserError(
            problem, str(file), "JointState, PoseStamped, TransformStamped, Odometry, Imu or Float64 in the bag"
        )
    return _table(columns, poses, trials)


def _kind(connection: Any) -> str:
    """Type of a topic's messages, without its package."""
    return str(connection.msgtype.rpartition("/")[2])


def _names_trial(connection: Any) -> bool:
    return bool(connection.topic.rpartition("/")[2] == TRIAL) and _kind(connection) == "String"


def _note(
    topic: str,
    kind: str,
    message: Any,
    recorded: int,
    columns: dict[str, dict[int, float]],
    poses: dict[str, dict[int, list[float]]],
) -> None:
    """Put a message's numbers into the columns, its pose (place, then x, y, z, w) into the poses, at its time [ns]."""
    header = getattr(message, "header", None)
    stamp = _NANOSECONDS * header.stamp.sec + header.stamp.nanosec if header else 0
    time = stamp or recorded
    if kind == "JointState":
        for quantity in ("position", "velocity", "effort"):
            for joint, value in zip(message.name, getattr(message, quantity), strict=False):
                columns.setdefault(_head(topic, joint, quantity), {})[time] = float(value)
    elif kind in _NUMBERS:
        columns.setdefault(topic, {})[time] = float(message.data)
    elif kind in _VECTORS:
        for k, value in enumerate(message.data):
            columns.setdefault(f"{topic}.{k}", {})[time] = float(value)
    elif kind != "Imu" or message.orientation_covariance[0] != -1.0:  # -1: it has no orientation
        place, turn = _pose(kind, message)
        lost = [np.nan] * 3
        position = [place.x, place.y, place.z] if place is not None else lost
        poses.setdefault(topic, {})[time] = [*position, turn.x, turn.y, turn.z, turn.w]
        if (
            place is not None
            and header is not None
            and header.frame_id == BASE_FRAME
            and topic.rpartition("/")[2] == "tip"
        ):
            for axis, value in zip("xyz", position, strict=True):
                columns.setdefault(f"tip_{axis} [m]", {})[time] = float(value)


def _head(topic: str, joint: str, quantity: str) -> str:
    """Head of a joint's column; of a measured spool or bend the one that an open log has."""
    named = None if _WANTED.search(topic) else _JOINT.fullmatch(joint)
    standing = _STANDING.get((named[1], quantity)) if named and named[2].isdigit() == (named[1] == "spool") else None
    return standing.format(named[2]) if standing and named else f"{topic}.{joint}.{quantity}"


def _pose(kind: str, message: Any) -> tuple[Any, Any]:
    """Position, None of an inertial unit, and orientation."""
    if kind == "Imu":
        return None, message.orientation
    if kind == "TransformStamped":
        return message.transform.translation, message.transform.rotation
    pose = message.pose if kind == "PoseStamped" else message.pose.pose
    return pose.position, pose.orientation


def _table(
    columns: Mapping[str, Mapping[int, float]],
    poses: Mapping[str, Mapping[int, list[float]]],
    trials: Mapping[int, str],
) -> RecordedTable:
    """One row for each time that a message has, with empty cells where the others have none.

    Where joints stand under the names of an open log, what was wanted is no part of the recording.
    """
    standing = any(head_of_open_log(head) for head in columns)
    if standing:
        columns = {head: stream for head, stream in columns.items() if not _WANTED.search(head)}
    times = np.unique(np.array([time for stream in (*columns.values(), *poses.values()) for time in stream], np.int64))
    seconds = (times - times[0]) / _NANOSECONDS
    cells = [seconds]
    for stream in columns.values():
        column = np.full(len(times), np.nan)
        column[np.searchsorted(times, np.array(list(stream), np.int64))] = list(stream.values())
        cells.append(column)
    bodies = dict[str, RigidBody]()
    for topic, stream_of_poses in poses.items():
        rows = np.searchsorted(times, np.array(list(stream_of_poses), np.int64))
        values = np.array(list(stream_of_poses.values()))[np.argsort(rows)]
        rows = np.sort(rows)
        place = None if np.isnan(values[:, :3]).all() else values[:, :3]
        bodies[topic] = RigidBody(seconds[rows], unit_quaternions(values[:, 3:]), place, rows)
    heads = ["time [s]", *columns]
    if trials:
        begins = sorted(trials)
        which = np.maximum(np.searchsorted(begins, times, side="right") - 1, 0)
        heads, cells = ["trial", *heads], [np.array([trials[begin] for begin in begins])[which], *cells]
    return RecordedTable(heads, cells, bodies=bodies, others=standing)
