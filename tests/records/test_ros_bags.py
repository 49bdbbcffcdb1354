"""Bags that rosbags wrote with typed messages are read with each stream at its own times."""

import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from wristctl.errors import UserError
from wristctl.records.log_converters import read_log

SPOOLS = "spool_1=/motors.m1.position [10 mm], spool_2=/motors.m2.position [10 mm]"
BEGIN = 1_795_906_800 * 10**9


def bag(folder: Path, mcap: bool, messages: Iterable[tuple[str, str, int, Any]]) -> Path:
    """A bag of ROS 2 in its folder: topic, type, time [ns] from its begin, and what a type makes its message of."""
    rosbag2 = pytest.importorskip("rosbags.rosbag2")
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    storage = rosbag2.StoragePlugin.MCAP if mcap else rosbag2.StoragePlugin.SQLITE3
    connections: dict[str, Any] = {}
    with rosbag2.Writer(folder / "bag", version=9, storage_plugin=storage) as writer:
        for topic, kind, time, make in messages:
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=store)
            stamp = store.types["builtin_interfaces/msg/Time"](*divmod(BEGIN + time, 10**9))
            message = make(store.types, store.types["std_msgs/msg/Header"](stamp, ""))
            writer.write(
                connections[topic], BEGIN + time + 1_000_000 + time % 3_000_000, store.serialize_cdr(message, kind)
            )
    return next(file for file in (folder / "bag").iterdir() if file.suffix in (".mcap", ".db3"))


def joints(*positions: float) -> Any:
    values = np.array(positions)
    return lambda types, header: types["sensor_msgs/msg/JointState"](
        header, ["m1", "m2"], values, 0 * values, 3 + values
    )


def pose(bend: float, x: float) -> Any:
    def made(types: Any, header: Any) -> Any:
        place = types["geometry_msgs/msg/Point"](x, 0.0, 0.0)
        turn = types["geometry_msgs/msg/Quaternion"](0.0, 0.0, *np.array([np.sin(bend / 2), np.cos(bend / 2)]).tolist())
        return types["geometry_msgs/msg/PoseStamped"](header, types["geometry_msgs/msg/Pose"](place, turn))

    return made


def imu(bend: float, known: bool = True) -> Any:
    def made(types: Any, header: Any) -> Any:
        turn = types["geometry_msgs/msg/Quaternion"](*Rotation.from_rotvec([0.0, 0.0, bend]).as_quat().tolist())
        vector, covariance = types["geometry_msgs/msg/Vector3"](0.0, 0.0, 0.0), np.zeros(9)
        unknown = covariance if known else np.full(9, -1.0)
        return types["sensor_msgs/msg/Imu"](header, turn, unknown, vector, covariance, vector, covariance)

    return made


@pytest.mark.parametrize("mcap", [True, False])
def test_joints_and_poses_of_a_bag_stand_at_their_own_times(tmp_path: Path, mcap: bool) -> None:
    kinds = "sensor_msgs/msg/JointState", "geometry_msgs/msg/PoseStamped"
    messages = [("/motors", kinds[0], 10_000_000 * k, joints(0.1 * k, -0.1 * k)) for k in range(4)]
    messages += [("/hand", kinds[1], 5_000_000 + 10_000_000 * k, pose(0.3 + 0.2 * k, 0.58)) for k in range(3)]
    messages += [("/base", kinds[1], 20_000_000 * k, pose(0.1, 0.5)) for k in range(3)]
    file = bag(tmp_path, mcap, messages)
    log = read_log(file, SPOOLS)
    np.testing.assert_allclose(log.columns["time"], [0.0, 0.005, 0.01, 0.015, 0.02, 0.025, 0.03, 0.04], atol=1e-12)
    nan = np.nan
    np.testing.assert_allclose(log.columns["spool_1"], [0.0, nan, 1e-3, nan, 2e-3, nan, 3e-3, nan])
    np.testing.assert_allclose(log.columns["bend_y"], [nan, 0.2, nan, 0.4, nan, 0.6, nan, nan], atol=1e-12)
    assert np.nanmin(log.columns["tip_x"]) == pytest.approx(0.08 * np.cos(0.1))
    assert "rigid body /hand against rigid body /base" in log.remarks[0]


def test_poses_that_are_recorded_late_stand_at_their_stamps(tmp_path: Path) -> None:
    """The one of 2.9 ms is recorded after the one of 3.0 ms."""
    kind, times = "geometry_msgs/msg/PoseStamped", (0, 1_000_000, 2_900_000, 3_000_000, 4_000_000)
    messages = [("/hand", kind, time, pose(1e-7 * time, 0.08)) for time in times]
    recorded = [1_000_000 + time + time % 3_000_000 for time in times]
    assert recorded[2] > recorded[3]
    log = read_log(bag(tmp_path, True, messages), "tip=/hand, along=x")
    np.testing.assert_allclose(log.columns["time"], 1e-9 * np.array(times), atol=1e-12)
    np.testing.assert_allclose(log.columns["bend_y"], 1e-7 * np.array(times), atol=1e-9)


def test_an_inertial_unit_is_a_body_and_one_without_orientation_is_none(tmp_path: Path) -> None:
    kind = "sensor_msgs/msg/Imu"
    file = bag(tmp_path, True, [("/imu", kind, k * 10**7, imu(0.1 * k, known=k != 2)) for k in range(4)])
    log = read_log(file)
    np.testing.assert_allclose(log.columns["bend_y"], [0.0, 0.1, 0.3], atol=1e-12)
    assert "tip_x" not in log.columns


def test_columns_of_a_bag_are_proposed(tmp_path: Path) -> None:
    messages = [("/motors", "sensor_msgs/msg/JointState", 0, joints(0.1, 0.2))]
    messages.append(("/angle_deg", "std_msgs/msg/Float64", 0, lambda types, _: types["std_msgs/msg/Float64"](5.0)))
    with pytest.raises(UserError) as caught:
        read_log(bag(tmp_path, False, messages))
    proposed = "spool_1=/motors.m1.position [mm], spool_2=/motors.m2.position [mm]"
    assert proposed in caught.value.fix and "bend_y=/angle_deg [deg]" in caught.value.fix
    assert "tension_1=/motors.m1.effort [N]" in caught.value.fix and "velocity=" not in caught.value.fix


def test_what_is_no_bag_or_has_nothing_of_use_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("rosbags")
    torn = tmp_path / "log.mcap"
    torn.write_bytes(b"\x89MCAP0\r\n")
    with pytest.raises(UserError, match="cannot read the log"):
        read_log(torn)
    words = bag(
        tmp_path, True, [("/say", "std_msgs/msg/String", 0, lambda types, _: types["std_msgs/msg/String"]("a"))]
    )
    with pytest.raises(UserError, match="no topic of a type that is read, but std_msgs/msg/String"):
        read_log(words)
    for name in [name for name in sys.modules if name.startswith("rosbags")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "rosbags", None)
    with pytest.raises(UserError, match=r"rosbags, which is not installed - .* - fix: pip install 'wristctl\[logs\]'"):
        read_log(words)
