"""Stand-ins for `wristctl gen-data` and `wristctl train` that do as their environment says."""

from __future__ import annotations

import os
import sys
import time
from dataclasses import dataclass
from types import SimpleNamespace

import pandas as pd

from wristctl.cli import app as application
from wristctl.cli.command import study_command
from wristctl.config.errors import UserError
from wristctl.report.printed_table import Table
from wristctl.studies.inputs import EarlierRun
from wristctl.studies.procedure import Procedure
from wristctl.studies.session import Session
from wristctl.studies.study_result import StudyResult


@dataclass(frozen=True)
class Probed(StudyResult):
    """Nothing but the tables."""

    kind = "probe"

    def frame(self) -> pd.DataFrame:
        """No table."""
        return pd.DataFrame()


def gen_data(session: Session) -> Probed:
    """Sample."""
    findings = session.findings
    findings.table("data/samples.csv", pd.DataFrame({"x": [0.1, 1 / 3]}), units={"x": "m"}, meaning={"x": "tip"})
    findings.metric("rmse", 1e-3, unit="rad", better="lower")
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
    table = Table("Samples", ("set", "value [m]"), [("first", 0.123456), ("second", float("nan"))])
    return Probed(session.study, findings, [table])


def train(session: Session) -> Probed:
    """Train."""
    session.findings.metric("samples", len(session.inputs.runs()["data"].data("samples")))
    return Probed(session.study, session.findings, [])


_GEN_DATA = Procedure("gen-data", lambda study, inputs: f"{study.gen_data.samples} samples", gen_data)
_TRAIN = Procedure("train", lambda study, inputs: "", train, (EarlierRun("data", "gen-data"),))
_PROBES = {"gen-data": study_command(_GEN_DATA), "train": study_command(_TRAIN, shortcuts=("epochs",))}
for _name, _app in _PROBES.items():
    sys.modules[f"probe-{_name}"] = SimpleNamespace(app=_app)  # type: ignore[assignment]
COMMANDS = {name: (f"probe-{name}", "Probe", name) for name in _PROBES}


if __name__ == "__main__":
    application.COMMANDS.clear()
    application.COMMANDS.update(COMMANDS)
    application.main()
