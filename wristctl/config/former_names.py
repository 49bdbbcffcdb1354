"""Former names of keys, gain presets and loops: studies and sealed runs that have them mean the same as ever."""

from collections.abc import Collection, Mapping
from pathlib import Path

# Key paths that studies had, and the paths of today.
KEYS: dict[tuple[str, ...], tuple[str, ...]] = {
    ("compare", "rows"): ("compare", "controllers"),
    ("hw-run", "rows"): ("hw-run", "controllers"),
    ("study", "laws"): ("study", "controllers"),
    ("laws",): ("controller-settings",),
    **{("hysteresis", "known", name): ("identify", name) for name in ("zero_error_deg", "spool_error", "radius_error")},
    **{
        ("hysteresis", name): ("identify", name)
        for name in ("columns", "trial", "known", "fix", "lack_of_fit", "misfit")
    },
}

# The key that named a loop to be fitted beside those of the model's loops, and keys of these that its fit read too.
MEASURED = ("hysteresis", "measured")
KEYS[MEASURED] = ("identify", "logs")
WITH_MEASURED: dict[tuple[str, ...], tuple[str, ...]] = {
    ("hysteresis", "segments"): ("identify", "segments"),
    ("hysteresis", "step"): ("identify", "step"),
    ("hysteresis", "tendon_stiffness"): ("identify", "known", "tendon_stiffness"),
}

# Settings by which commands of today do what runs of a former command were of.
OF_KINDS = {"hysteresis": "analyse.of=hysteresis"}

# Gain presets of the built-in controllers.
PRESETS = {"stepper": "hardware"}

# Built-in loops.
LOOPS = {"default": "four-segments"}

# Folders of files that come with wristctl.
FOLDERS = {"experiments/laws": "experiments/own_controllers"}


def key_today(
    path: tuple[str | int, ...], keys: Mapping[tuple[str, ...], tuple[str, ...]] = KEYS
) -> tuple[str | int, ...]:
    """A key path with its beginning as it is called today."""
    for before, today in keys.items():
        if path[: len(before)] == before:
            return (*today, *path[len(before) :])
    return path


def file_today(file: Path) -> Path:
    """Where a file stands today: in the folder's new name where only that has it."""
    for before, today in FOLDERS.items():
        moved = Path(file.as_posix().replace(f"/{before}/", f"/{today}/"))
        if moved != file and not file.exists() and moved.is_file():
            return moved
    return file


def preset_today(preset: str, presets: Collection[str]) -> str:
    """The name among these presets that a preset has today."""
    today = PRESETS.get(preset, preset)
    return preset if preset in presets or today not in presets else today


def column_of_loop(loop: str) -> str:
    """The part of a column's name that tells a loop: the former one, which stays as all that a run's files call so."""
    return next((former for former, today in LOOPS.items() if today == loop), loop)


def label_today(label: str) -> str:
    """A preset, or a controller with its gains, as it is called today: smc/stepper is smc/hardware."""
    before, slash, preset = label.rpartition("/")
    return f"{before}{slash}{PRESETS.get(preset, preset)}"
