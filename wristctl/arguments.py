"""Keyword arguments of the functions of wristctl.api, by their types; `docs/argument_types.py` writes this file.

What may be a key, with meaning, default and source: documentation: Every setting. Values are in the unit behind a key.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal, TypedDict


class WristKeys(TypedDict, total=False):
    """A tendon-driven wrist of rigid discs and springs; SI units."""

    discs: int
    length: float  # m
    mass: float  # kg
    hand_mass: float  # kg
    hand_offset: float  # m
    stiffness: float  # N m/rad
    flexion_ratio: float
    stiffness_axis_deg: float  # deg
    taper: float
    damping: float  # N m s/rad
    tendon_radius: float  # m
    tendons: Literal["three", "four", "five", "six"] | Sequence[TendonPlaceKeys | float]
    pretension: float  # N
    tension_limit: float  # N
    range_deg: float  # deg
    gravity: Sequence[float]  # m/s^2
    gravity_flexion: float  # m/s^2


class LoopKeys(TypedDict, total=False):
    """The plant and the timing. Controllers always see one segment (E13: a scalar input)."""

    plant_segments: int
    plant: Mapping[str, Any]
    disturbances: DisturbancesKeys
    actuator: ActuatorKeys | str
    sensor: SensorKeys | str
    control_period: float  # s
    substeps: int | None
    limits: bool
    planes: Literal[1, 2] | None
    coupling: Literal["compensated", "ignored"]
    stiffness: float | None  # N m/rad
    stiffness_over_deg: float  # deg
    spool_lead: bool


class RowKeys(TypedDict, total=False):
    """One controller with one set of gains."""

    controller: str
    gains: str | Mapping[str, float]


class ReferenceKeys(TypedDict, total=False):
    """The wanted motion, from rest and straight."""

    kind: str
    angle_deg: float | None  # deg
    tip: Sequence[float] | None  # m
    angles_deg: Sequence[float]  # deg
    tips: Sequence[Sequence[float]] | None  # m
    tip_ratios: Sequence[Sequence[float]] | None
    duration: float  # s
    frequency: float  # 1/s
    file: str | None
    column: str | None
    columns: str | None
    listen: str | None
    inverse: Literal["none", "closed-form", "network"]
    offset_deg: float  # deg
    phase_deg: float  # deg
    end_frequency: float  # 1/s
    speed: float  # deg/s
    seed: float
    scale: float
    noise_deg: float  # deg
    rate_deg: float  # deg/s
    smoothing: float  # s
    limit_deg: float  # deg
    jump_deg: float  # deg
    silence: float  # s
    hold: float  # s
    turn: float  # s
    toward_deg: float  # deg
    ratio: float


class ActuatorKeys(TypedDict, total=False):
    """Motors and tendons. ideal: tension = command; lagged: first-order lag, in steps; tendon: stepper, elastic."""

    level: Literal["ideal", "lagged", "tendon", "servo"]
    lag: float  # s
    resolution: float  # m
    tendon_stiffness: float  # N/m
    friction: float
    sheath: float  # rad
    presliding: float  # m
    motor_steps: int
    microstep: int
    pulley_radius: float  # m
    step_rate: float  # 1/s
    step_acceleration: float  # 1/s^2
    ramp: float  # 1/s^2
    command_delay: float  # s
    update: float  # s


class SensorKeys(TypedDict, total=False):
    """ideal: angle and rate as they are; camera: late, noisy, dropped frames, and an observer for every controller."""

    level: Literal["ideal", "camera"]
    frame_rate: float  # 1/s
    delay_frames: float
    noise_deg: float  # deg
    dropped: float
    torque_noise: float  # N m s^0.5
    load_drift: float  # N m/s^0.5


class PushKeys(TypedDict, total=False):
    """A person's push on the last disc: half a sine in time."""

    force: float  # N
    start: float  # s
    duration: float  # s


class TendonPlaceKeys(TypedDict, total=False):
    """A place in the wrist's cross-section where a tendon runs, or several alike that are pulled together."""

    angle_deg: float  # deg
    radius: float | None  # m
    ends_at: int | None
    multiplicity: int


class DisturbancesKeys(TypedDict, total=False):
    """Disturbances of the wrist, unknown to its controller."""

    push: PushKeys
    load: float  # N
    drift: Mapping[str, Any]
    grasp: Mapping[str, Any]
    toward_deg: float  # deg


class SharedArguments(TypedDict, total=False):
    """Keywords of every function."""

    seed: int
    wrist: WristKeys | str | Path


class GenDataArguments(SharedArguments, total=False):
    """Keywords of `gen_data`."""

    source: Literal["pcc", "plant", "run", "csv", "transitions"]
    samples: int | None
    sampling: Literal["uniform", "latin-hypercube", "sobol"]
    stretch: Sequence[float]
    planes: Literal[1, 2] | None
    segments: int
    poses: Sequence[float]  # deg
    rolls: Sequence[float]  # deg
    held_out_poses: Sequence[float]  # deg
    payload: Sequence[float]
    held_out_payload: Sequence[float]
    files: Sequence[str]
    columns: str | None
    loop: LoopKeys


class TrainArguments(SharedArguments, total=False):
    """Keywords of `train`."""

    preset: Literal["t1-sigmoid", "t1-relu", "t1-leaky-relu", "t1-tanh", "recommended"] | None
    inputs: Literal["all", "tip"]
    hidden: Sequence[int]
    activation: Literal["sigmoid", "relu", "leaky-relu", "tanh", "silu"]
    optimiser: Literal["adam", "adamw", "sgd", "levenberg-marquardt"]
    standardise: bool
    learning_rate: float
    schedule: Literal["constant", "cosine"]
    beta1: float
    weight_decay: float
    batch: int
    epochs: int
    patience: int
    train_share: float
    split: Literal["recording", "sample"]
    seeds: int
    rows: Sequence[Mapping[str, Any]]
    search: bool
    grid: Mapping[str, Any]
    workers: int
    device: Literal["auto", "cpu", "cuda"]
    gen_data: Mapping[str, Any]


class TuneArguments(SharedArguments, total=False):
    """Keywords of `tune`."""

    controllers: Sequence[str]
    optimiser: str
    candidates: int
    iterations: int
    restarts: int
    finalists: int
    objective: Mapping[str, Any]
    worlds: Mapping[str, Any]
    scenarios: Sequence[Mapping[str, Any]]
    loops: Mapping[str, LoopKeys]
    horizon: float  # s
    repetitions: int
    kept: Sequence[str]
    resume: str | None
    families: Mapping[str, Mapping[str, Any]]
    controller_settings: Mapping[str, Mapping[str, float]]
    sweep: Sequence[str]


class CompareArguments(SharedArguments, total=False):
    """Keywords of `compare`."""

    controllers: Sequence[RowKeys | str]
    loops: Mapping[str, LoopKeys]
    references: Sequence[ReferenceKeys | str]
    inverses: Sequence[Literal["none", "closed-form", "network"]]
    directions: Sequence[Literal["ulnar", "radial", "flexion", "extension"]]
    worlds: Mapping[str, Any]
    horizon: float  # s
    repetitions: int
    kept: Sequence[str]
    tuning: Mapping[str, Any] | None
    families: Mapping[str, Mapping[str, Any]]
    controller_settings: Mapping[str, Mapping[str, float]]
    sweep: Sequence[str]


class StudyArguments(SharedArguments, total=False):
    """Keywords of `study`."""

    controllers: Sequence[str]
    families: Sequence[str]
    presets: Sequence[RowKeys | str]
    terms: Mapping[str, Sequence[str]]
    optimiser: str
    objective: Mapping[str, Any]
    tolerated: float
    variants: Mapping[str, Mapping[str, Any]]
    varied: str
    budget: str
    budgets: Mapping[str, Mapping[str, Any]]
    controller_settings: Mapping[str, Mapping[str, float]]


class RecommendArguments(SharedArguments, total=False):
    """Keywords of `recommend`."""

    controllers: Sequence[str]
    loop: LoopKeys
    draw: Mapping[str, str | Sequence[bool | int | float | str]]
    known: Mapping[str, str | Sequence[bool | int | float | str]]
    references: Sequence[ReferenceKeys | str]
    horizon: float  # s
    largest_deg: float  # deg
    draws: int
    validation: int
    tests: int
    candidates: int
    iterations: int
    frequencies: Sequence[float]  # Hz
    payloads: Sequence[float]  # kg
    rehearsed: int
    rig: str | None
    kept: Sequence[str]
    controller_settings: Mapping[str, Mapping[str, float]]


class SimulateArguments(SharedArguments, total=False):
    """Keywords of `simulate`."""

    controller: str
    gains: str | Mapping[str, float]
    loop: LoopKeys
    reference: ReferenceKeys | str
    direction: Literal["ulnar", "radial", "flexion", "extension"]
    start: Literal["straight", "equilibrium"]
    horizon: float  # s
    repetitions: int
    kept: Sequence[str]
    controller_settings: Mapping[str, Mapping[str, float]]
    sweep: Sequence[str]


class AnalyseArguments(SharedArguments, total=False):
    """Keywords of `analyse`."""

    controller: str
    gains: str | Mapping[str, float]
    loop: LoopKeys
    reference: ReferenceKeys | str
    direction: Literal["ulnar", "radial", "flexion", "extension"]
    start: Literal["straight", "equilibrium"]
    horizon: float  # s
    repetitions: int
    kept: Sequence[str]
    of: Literal["loop", "hysteresis"]
    angles_deg: Sequence[float]  # deg
    over: str
    span: float
    friction: Literal["slipping", "stuck"]
    simulate: Mapping[str, Any]
    controller_settings: Mapping[str, Mapping[str, float]]
    hysteresis: Mapping[str, Any]


class IdentifyArguments(SharedArguments, total=False):
    """Keywords of `identify`."""

    logs: Sequence[str]
    columns: str | None
    trial: str | None
    model: Literal["arcs", "wrist", "hysteresis"]
    fix: Mapping[str, Any]
    known: Mapping[str, Any]
    torque_constant: float | None  # N m/A
    spool_radius: float | None  # m
    segments: int
    step: float  # s
    radius_error: float
    presliding_error: float
    zero_error_deg: float  # deg
    spool_error: float  # m
    exposure: float | None  # s
    holding_torque: float | None  # N m
    rotor_inertia: float | None  # kg m^2
    rotor_damping: float  # N m s/rad
    clock_error: float  # s
    turn_error_deg: float  # deg
    view_error: float
    widest: float
    condition_limit: float
    lack_of_fit: float
    misfit: Literal["refuse", "tell"]


class HwRunArguments(SharedArguments, total=False):
    """Keywords of `hw_run`."""

    controller: str
    gains: str | Mapping[str, float]
    port: str | None
    baud: int
    planes: Literal[1, 2]
    camera: str
    camera_2: str
    real_time: bool
    priority: bool
    actuator: ActuatorKeys | str
    sensor: SensorKeys | str
    homing: Mapping[str, Any]
    safety: Mapping[str, Any]
    load_cells: Mapping[str, Any] | None
    markers: Mapping[str, Any]
    markers_2: Mapping[str, Any]
    gates: Mapping[str, Any]
    device: Mapping[str, Any]
    bench: Mapping[str, Any]
    optics: str | None
    optics_2: str | None
    rig: str | None
    controllers: Sequence[RowKeys | str]
    directions: Sequence[str]
    repetitions: int
    push: PushKeys
    push_toward_deg: float | None  # deg
    without_push: bool
    reference: ReferenceKeys | str
    horizon: float  # s
    payload: float  # kg
    tension_factor: float
    back: float  # s
    rest: float  # s
    control_period: float  # s
    positions: Literal["find", "stored"]
    kept: Sequence[str]
    video: bool
    controller_settings: Mapping[str, Mapping[str, float]]
