"""Settings of `compare`: controllers under the same conditions."""

from wristctl.config.controller_row import REPETITIONS, Row
from wristctl.config.families import Worlds
from wristctl.config.loop import CAMERA, LOOPS, DirectionName, InverseName, Loop, Loops, Reference
from wristctl.config.section import Section, choice, kept_settings, quantity, seldom
from wristctl.config.tune import TuneSettings

# Preset of gains for motors, tendons and a camera.
_HARDWARE = "hardware"
# Controllers compared where none are named, with gains that need no tuning.
_PRESETS = (
    {"smc": "printed", "pid": "printed", "mrac": "default", "gvsc": "default", "feedforward": "default"},
    dict.fromkeys(("mrac", "nc", "pd-ff", "pid-ff", "pid-dob", "smc-dob", "ct-dob"), _HARDWARE),
    {"smc": "exchanged"},
)
_ROWS = tuple(Row(controller=name, gains=gains) for presets in _PRESETS for name, gains in presets.items())
# Loops compared on where none are named: as believed, behind a rig, pushed, and of a wrist softer than believed.
_LOOPS: dict[str, Loop] = {
    **{name: loop for name, loop in LOOPS.items() if loop == Loop()},
    "camera": CAMERA,
    "push": Loop.model_validate({"disturbances": {"push": {"force": 2.0}}}),
    "soft": Loop.model_validate({"plant": {"stiffness_scale": 0.8}}),
}
# Angle [deg] and duration [s] of the moves compared on where none are named: fewer than eight have no interval.
_MOVES = ((30, 1.0), (30, 2.0), (-30, 1.0), (-30, 2.0), (15, 1.0), (-15, 1.0), (40, 1.5), (-40, 1.5))


class CompareSettings(Section):
    """Controllers x loops x references x inverses, beside the paper's T2."""

    rows: tuple[Row, ...] = choice(
        _ROWS,
        "controllers with their gains; `tuned:worlds`: those shipped of `worlds.family`",
        min_length=1,
        alias="controllers",
    )
    loops: Loops = choice(
        _LOOPS,
        "the loops to compare on; naming any replaces these (`exact: {}` is the built-in one)",
        min_length=1,
    )
    references: tuple[Reference, ...] = choice(
        tuple(Reference(kind="minimum-jerk", angle_deg=angle, duration=duration) for angle, duration in _MOVES),
        "references, each followed from rest",
        min_length=1,
    )
    inverses: tuple[InverseName, ...] = choice(
        ("network", "closed-form"), "how tip targets become angles; overrides the references' own", min_length=1
    )
    directions: tuple[DirectionName, ...] = choice(
        ("ulnar",), "directions of bending, each by its own plane", min_length=1
    )
    worlds: Worlds = Worlds()
    horizon: float = quantity(5.0, "s", "duration of one rollout", "assumed", gt=0)
    repetitions: int = choice(1, REPETITIONS, ge=1, le=1000)
    network: str | None = choice(None, "train run: path, id or latest:train")
    tuned: str | None = choice(None, "tune run: path, id or latest:tune")
    from_identified: str | None = seldom(None, "", "identify run whose parameters replace the study's")
    kept: tuple[str, ...] = kept_settings()
    tuning: TuneSettings | None = choice(None, "a search for the controllers with gains: tuned, in place of a tune run")
