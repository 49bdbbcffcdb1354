"""Transitions of a wrist in motion, from which `train` learns its dynamics."""

from __future__ import annotations

import shlex
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from wristctl.commands.answer import Answer
from wristctl.commands.loop_warnings import warn_of_one_plane
from wristctl.commands.printed_table import Table
from wristctl.commands.quantities import RANGE, Quantity, keep_range
from wristctl.commands.results import StudyResult
from wristctl.commands.session import Session
from wristctl.config.study import Study

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

    from wristctl.learning.transitions import Transitions

QUANTITIES = {
    "bend": Quantity("bend", "rad", "bend of the last disc", shown="deg"),
    "rate": Quantity("rate", "rad/s", "its rate"),
    "torque": Quantity("torque", "N m", "torque of the commanded tensions until the next tick"),
    "acceleration": Quantity("acceleration", "rad/s^2", "mean acceleration until then"),
}
"""Quantities of a plane, by name."""


@dataclass(frozen=True, repr=False, eq=False)
class Moved(StudyResult):
    """Recordings of a wrist under random torques, and samples of them."""

    kind = "gen-data"

    samples: Transitions

    @property
    def answer(self) -> Answer:
        """What was drawn, with its ranges."""
        samples, planes = self.samples, " in two planes" * (self.samples.planes == 2)
        seconds = samples.period * samples.bend[:, :, 0].size
        sentence = (
            f"{len(samples.tick)} transitions{planes} from {len(samples.bend)} random motions, {seconds:.3g} s in all, "
            f"at a period of {1e3 * samples.period:g} ms."
        )
        notes = []
        if self.place:
            words = ["wristctl", "train", f"{self.place}/config.yaml", "--preset", "recommended", "--data", self.place]
            notes = ["Next, train a network of the wrist's dynamics on them:", f"$ {shlex.join(words)}"]
        more = f"The transitions: {self.place}/data/samples.npz" if self.place else ""
        return Answer(sentence, self.tables[0], notes, more)

    def frame(self) -> pd.DataFrame:
        """One row per sample: recording, tick, bend, rate, torque and acceleration of each plane; SI units."""
        return transitions_table(self.samples)


def transitions_table(samples: Transitions) -> pd.DataFrame:
    """One row per sample; in two planes the names of planes follow those of quantities."""
    import numpy as np
    import pandas as pd

    from wristctl.simulation.trajectory import PLANES

    ends = [""] if samples.planes == 1 else [f"_{plane}" for plane in PLANES]
    names = [f"{name}{end}" for name in QUANTITIES for end in ends]
    values = np.hstack([samples.inputs, samples.targets])
    columns = dict(zip(names, values.T, strict=True))
    return pd.DataFrame({"recording": samples.recording, "tick": samples.tick} | columns)


def plan_transitions(study: Study) -> str:
    """Plan of the recordings. Raises UserError."""
    from wristctl.commands.truth_table import truth_told
    from wristctl.learning.dataset import planes_of_samples
    from wristctl.learning.transitions import RECORDINGS, SECONDS

    settings = study.gen_data
    planes = " in two planes" * (planes_of_samples(settings, study.wrist) == 2)
    truth = truth_told(study.wrist, {"gen-data": settings.loop})
    return f"{settings.drawn_samples} transitions of {RECORDINGS} random motions of {SECONDS:g} s{planes}{truth}"


def record_transitions(session: Session) -> Moved:
    """Record the wrist in random motions, and draw samples of that."""
    import numpy as np

    from wristctl.learning.dataset import asked_of
    from wristctl.learning.transitions import draw_transitions

    study, findings = session.study, session.findings
    warn_of_one_plane(study.wrist, [asked_of(study.gen_data)])
    entropy = findings.stream("samples")
    with session.progress("moving"):
        samples = draw_transitions(study.gen_data, study.wrist, np.random.default_rng(entropy))
    table = transitions_table(samples)
    findings.arrays("data/samples.npz", samples.arrays())
    findings.figure("coverage", coverage, table)
    findings.metric("samples", len(table), meaning="number of transitions")
    rows = [keep_range(findings, _quantity(column), table[column]) for column in table.columns[2:]]
    findings.headline("samples")
    return Moved(study, findings, [Table("", RANGE, rows)], samples)


def _quantity(column: str) -> Quantity:
    """The quantity of a column, in two planes toward one of them."""
    name, _, plane = column.partition("_")
    toward, of_plane = plane and f" toward {plane}", QUANTITIES[name]
    return replace(of_plane, name=column, heading=f"{name}{toward}", meaning=f"{of_plane.meaning}{toward}")


def coverage(table: pd.DataFrame) -> Figure:
    """Rates and torques over the bends at which they were met."""
    import numpy as np

    from wristctl.plotting.style import BLUE, figure, title

    bends = [column for column in table.columns if column.startswith("bend")]
    picture, axes = figure(len(bends), 2, height=2.8 * len(bends))
    for row, bend in zip(axes, bends, strict=True):
        for panel, (name, unit) in zip(row, (("rate", "rad/s"), ("torque", "N m")), strict=True):
            values = table[bend.replace("bend", name)]
            panel.plot(np.degrees(table[bend]), values, ".", color=BLUE, markersize=2.0, rasterized=True)
            panel.set(xlabel="bend [deg]", ylabel=f"{name} [{unit}]")
        title(row[0], f"{len(table)} transitions" + bend.replace("bend", "").replace("_", " toward "))
    return picture
