"""Stand-ins for `wristctl gen-data` and `wristctl train` that do as their environment says."""

from __future__ import annotations

import os
import time
from dataclasses import dataclass

import pandas as pd

from wristctl.cli import commands
from wristctl.cli.app import main
from wristctl.cli.commands import Entry
from wristctl.commands.inputs import EarlierRun
from wristctl.commands.printed_table import Table
from wristctl.commands.procedure import Procedure
from wristctl.commands.results import StudyResult
from wristctl.commands.session import Session
from wristctl.errors import UserError


@dataclass(frozen=True)
class Probed(StudyResult):
    """Nothing but the tables."""

    kind = "probe"
    failed: UserError | None = None

    @property
    def fault(self) -> UserError | None:
        """The one that is to be."""
        return self.failed

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
    fault = UserError("the wrist buckled", "here", "less load", exit_code=3) if action == "fault" else None
    table = Table("Samples", ("set", "value [m]"), [("first", 0.123456), ("second", float("nan"))])
    return Probed(session.study, findings, [table], fault)


def train(session: Session) -> Probed:
    """Train."""
    session.findings.metric("samples", len(session.inputs.runs()["data"].data("samples")))
    return Probed(session.study, session.findings, [])


_GEN_DATA = Procedure("gen-data", lambda study, inputs: f"{study.gen_data.samples} samples", gen_data)
_TRAIN = Procedure("train", lambda study, inputs: "", train, (EarlierRun("data", "gen-data"),))
COMMANDS = {
    "gen-data": Entry(f"{__name__}:_GEN_DATA", "Probe", "gen-data"),
    "train": Entry(f"{__name__}:_TRAIN", "Probe", "train", shortcuts=("epochs",)),
}


if __name__ == "__main__":
    commands.COMMANDS.clear()
    commands.COMMANDS.update(COMMANDS)
    main()
