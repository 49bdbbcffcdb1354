"""wristctl: experiments with tendon-driven soft prosthetic wrists, from model to motors.

In a notebook:

    import wristctl

    wrist = {"tendons": "three", "length": 0.095, "stiffness": 1.1}
    done = wristctl.simulate(wrist=wrist, controller="ct-dob")
    done                                         # the answer, its table and its figure
    done.course                                  # a DataFrame: time, bend, reference, torque, tension, tip
    done.metrics["rmse"]                         # rad
    done.figures["angle"]                        # drawn now
    wristctl.compare("experiments/paper.yaml", controllers=["pid-ff", "my.py:LAW"], wrist=wrist)
    wristctl.runs(kind="compare", newer="2d")    # a DataFrame
    wristctl.open_run("latest:compare").data("comparison")

`gen_data`, `train`, `tune`, `study`, `hw_run`, `analyse`, `identify`, `recommend` and `audit` go the same way:
wristctl.api. What a person can mend is raised as `wristctl.UserError`.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from wristctl.version import __version__

if TYPE_CHECKING:
    from wristctl.api import (
        analyse,
        audit,
        compare,
        gen_data,
        hw_run,
        identify,
        load_study,
        open_run,
        recommend,
        runs,
        simulate,
        study,
        train,
        tune,
    )
    from wristctl.errors import UserError

__all__ = [
    "UserError",
    "__version__",
    "analyse",
    "audit",
    "compare",
    "gen_data",
    "hw_run",
    "identify",
    "load_study",
    "open_run",
    "recommend",
    "runs",
    "simulate",
    "study",
    "train",
    "tune",
]


def __getattr__(name: str) -> Any:
    """The functions are imported when one is first asked for, so that `import wristctl` stays light."""
    if name not in (*__all__, "hysteresis", "api"):  # a former name
        raise AttributeError(f"module 'wristctl' has no attribute {name!r}")
    import_module("wristctl.platforms").check()
    api = import_module("wristctl.api")
    globals()[name] = found = api if name == "api" else getattr(api, name)
    return found


def __dir__() -> list[str]:
    return sorted({*__all__, *(name for name in globals() if name.startswith("__"))})
