"""Cameras of a batch with the observers behind them, as blocks of lanes."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.control.response import OF_A_PLANE
from wristctl.lanes.blocks import lanes_of, spread
from wristctl.seeds import Entropy
from wristctl.simulation.frames import frame_counts, readings, remembered, side_by_side
from wristctl.simulation.observer import NoCamera, Observer, Schedule, Watch
from wristctl.simulation.simulated_drives import SIDES
from wristctl.simulation.stationary_filter import beliefs_of, stationary_gains
from wristctl.simulation.worlds import World
from wristctl.wrist.tendon_layout import TendonLayout


def cameras_of(
    worlds: Sequence[World],
    which: NDArray[np.int64],
    streams: Sequence[Entropy],
    horizon: float,
    begin: Array,
    layout: TendonLayout | None,
) -> tuple[Watch, Schedule] | tuple[NoCamera, NoCamera]:
    """Cameras with their observers by block, of rollouts in these worlds (count,), each with its stream of noise.

    `begin` is the bend at which each world's wrist rests at first (worlds, P) [rad]; `layout` has the places of tendons
    in two planes.
    """
    loop, count, planes = worlds[0].loop, len(which), 1 if layout is None else 2
    if loop.sensor.level == "ideal":
        return NoCamera(), NoCamera()
    sensors = [world.sensor for world in worlds]
    believed, period = [world.loop.sensor for world in worlds], loop.control_period
    tables, camera = side_by_side(sensors, believed, period, horizon)
    bursts = [worlds[index].loop.plant.sensor.burst for index in which]
    counts, cameras = frame_counts(sensors, horizon)[which].tolist(), [sensors[index] for index in which]
    taken = readings(counts, cameras, streams, bursts)
    for plane in range(1, planes):  # each sees with noise of its own, and all a frame or none
        more = readings(counts, cameras, [(*stream, plane) for stream in streams], bursts)
        taken = np.insert(taken, plane, more[:, :, 0], axis=2)
    zeros = [worlds[index].loop.plant.sensor.zero_deg for index in which]
    taken[:, :, :planes] += np.deg2rad(zeros)[:, None, None]
    order = lanes_of(count)
    blocks, wide = 1 if count == 1 else len(order), order.shape[1:]
    by_block = np.array(
        [np.moveaxis(taken[block], 0, -1) for block in order.reshape(blocks, -1)]
    )  # (blocks, F, P + 1, lanes)
    different = camera[which][order].reshape(blocks, -1)
    different = different if different.any() else different[:1]
    frames = Schedule(*(np.ascontiguousarray(np.moveaxis(table[..., different], -2, 0)) for table in tables))
    gains = np.concatenate(
        [stationary_gains(beliefs) for beliefs in zip(*(beliefs_of(world, layout) for world in worlds), strict=True)],
        axis=1,
    )
    start = np.zeros((len(worlds), OF_A_PLANE * planes))
    start[:, ::OF_A_PLANE] = begin
    now, places = spread(start[which], count), len(SIDES) if layout is None else len(layout.places)
    observer = Observer(
        gain=spread(gains[which], count),
        delivered=np.zeros((blocks, remembered(sensors, believed, period), places, *wide)),
        fused=now, now=now.copy(), at=np.zeros((blocks, 1, *wide)),
    )  # fmt: skip
    pictures = np.zeros((blocks, taken.shape[1], planes, *wide))
    turn = np.zeros((blocks, 2, order.size // blocks), np.int64)
    arriving = np.zeros((blocks, planes + 3, *wide))
    late = np.array([[worlds[index].loop.plant.sensor.dated_late] for index in which])
    arriving[:, planes + 2] = spread(late, count)[:, 0]
    return Watch(by_block.reshape(*by_block.shape[:3], *wide), pictures, turn, arriving, observer), frames
