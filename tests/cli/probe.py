"""Stand-ins for `wristctl gen-data` and `wristctl train` that do as their environment says."""

from __future__ import annotations

import os
import sys
import time
from types import SimpleNamespace

from wristctl.cli import app as application
from wristctl.cli.command import EarlierRun, Session, Table, study_command
from wristctl.config.errors import UserError


def gen_data(session: Session) -> Table:
    """Sample."""
    import pandas as pd

    run = session.run
    run.table("data/samples.csv", pd.DataFrame({"x": [0.1, 1 / 3]}), units={"x": "m"}, meaning={"x": "tip"})
    run.metric("rmse", 1e-3, unit="rad", better="lower")
    with session.progress("sampling", total=3, unit="samples") as done:
        for count in range(1, 4):
            done(count, loss=1.0 / count)
        action = os.environ.get("PROBE", "")
        if action == "sleep":
            print("ready", flush=True)
            time.sleep(60)
    if action == "bug":
        raise ZeroDivisionError("of this probe")
    if action == "check":
        raise UserError("the check failed", "here", "mend it", exit_code=3)
    return Table("Samples", ("set", "value [m]"), [("first", 0.123456), ("second", float("nan"))])


def train(session: Session) -> None:
    """Train."""
    session.run.metric("samples", len(session.inputs["data"].data("samples")))


_PROBES = {
    "gen-data": study_command(
        "gen-data", work=gen_data, plan=lambda study, inputs: f"{study.gen_data.samples} samples"
    ),
    "train": study_command("train", work=train, inputs=(EarlierRun("data", "gen-data"),), shortcuts=("epochs",)),
}
for _name, _app in _PROBES.items():
    sys.modules[f"probe-{_name}"] = SimpleNamespace(app=_app)  # type: ignore[assignment]
COMMANDS = {name: (f"probe-{name}", "Probe", name) for name in _PROBES}


if __name__ == "__main__":
    application.COMMANDS.clear()
    application.COMMANDS.update(COMMANDS)
    application.main()
