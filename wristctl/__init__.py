"""wristctl: experiments with tendon-driven soft prosthetic wrists, from model to motors.

In a notebook:

    import wristctl

    study = wristctl.load_study("experiments/paper.yaml", "simulate.gains=exchanged")
    done = wristctl.simulate(study)
    done.trajectory.frame()                      # a DataFrame
    done.metrics["rmse"]
    wristctl.open_run("latest:compare").data("comparison")
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from wristctl.version import __version__

__all__ = ["__version__", "load_study", "open_run", "simulate"]

if TYPE_CHECKING:
    from wristctl.config.study import Study
    from wristctl.records import open_run
    from wristctl.simulation.closed_loop import simulate


def load_study(file: str | None = None, *overrides: str) -> Study:
    """The study of a YAML file, or of defaults only, with overrides such as "wrist.length=0.09"."""
    from pathlib import Path

    from wristctl.config.load import load_study as load

    return load([Path(file)] if file else [], list(overrides))


def __getattr__(name: str) -> Any:
    """Heavy parts are imported when first asked for, so that `import wristctl` stays light."""
    if name == "simulate":
        from wristctl.simulation.closed_loop import simulate

        return simulate
    if name == "open_run":
        from wristctl.records import open_run

        return open_run
    raise AttributeError(f"module 'wristctl' has no attribute {name!r}")
