"""A network of the wrist's dynamics from transitions, and the controller over it."""

from __future__ import annotations

import math
import re
import shlex
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

from wristctl.commands.answer import Answer
from wristctl.commands.printed_table import Table, degrees
from wristctl.commands.results import StudyResult
from wristctl.commands.session import Session
from wristctl.config.learning import TrainSettings
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.records.files import sha256_of
from wristctl.wrist.directions import in_plane

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

    from wristctl.arrays import Array
    from wristctl.learning.dataset import Split
    from wristctl.learning.learned_dynamics import Dynamics, Model
    from wristctl.learning.training_result import TrainingResult
    from wristctl.learning.transitions import Rows, Transitions

# Files of the run: the controller, and beside it its network.
CONTROLLER, NETWORK, NAME = "code/learned_mpc.py", "dynamics.safetensors", "LEARNED_MPC"
# Times ahead at which predictions are judged [s].
AHEAD = (0.02, 0.2)
_HEADS = ("model", "acceleration [rad/s^2]", "after 0.02 s [deg]", "after 0.2 s [deg]", "largest then [deg]")
# What some of them mean; the others are RMSE of the bend.
_MEANT = {"acceleration": "RMSE of the acceleration", "largest then": "largest error of the bend after 0.2 s"}
_TEXT = f'''"""The controller learned-mpc over the network that this run trained: FILE:{NAME} names it."""

from wristctl.learning.learned_mpc import learned_mpc
from wristctl.learning.learned_dynamics import load_dynamics
from wristctl.plugins.import_hook import data_file

{NAME} = learned_mpc(load_dynamics(data_file(__file__, "{NETWORK}")))
'''


@dataclass(frozen=True, repr=False, eq=False)
class TrainedDynamics(StudyResult):
    """A network from bend, rate and torque to acceleration, and what it predicts of motions that it has not seen."""

    kind = "train"

    dynamics: Dynamics
    trials: list[TrainingResult]
    """Every training."""
    samples: Transitions
    held_out: Rows
    """Recordings that it was not trained on."""
    data: str = ""
    """Path of the run with the samples; empty where there is none."""

    @property
    def answer(self) -> Answer:
        """Errors of its predictions, beside those of the one-segment model."""
        (_, _, _, rmse, largest), (_, _, _, believed, _), *_ = self.tables[0].rows
        many = f"{len(self.held_out)} motion{'s' * (len(self.held_out) != 1)}"
        said = [degrees(math.radians(value)) for value in (rmse, largest, believed)]
        sentence = (
            f"In {many} that it was not trained on the network predicts the bend 0.2 s ahead with an RMSE of "
            f"{said[0]} deg, at most {said[1]} deg off; the one-segment model as believed with {said[2]} deg."
        )
        notes = []
        if self.place:
            words = ["wristctl", "simulate", f"{self.data or self.place}/config.yaml"]
            words += ["--controller", f"{self.place}/{CONTROLLER}:{NAME}"]
            notes = ["Next, control the wrist with it:", f"$ {shlex.join(words)}"]
        more = f"The controller and its network: {self.place}/{CONTROLLER}" if self.place else ""
        return Answer(sentence, self.tables[0], notes, more)

    def frame(self) -> pd.DataFrame:
        """One row per model: errors of its accelerations and predictions."""
        import pandas as pd

        return pd.DataFrame(list(self.tables[0].rows), columns=list(_HEADS))


def check_dynamics(settings: TrainSettings) -> None:
    """UserError for settings of networks from tip to bend, and for a network that no controller could evaluate."""
    from wristctl.learning.learned_dynamics import MOST_WEIGHTS

    for name, asked in (("search", settings.search), ("rows", settings.rows), ("inputs", settings.inputs == "tip")):
        if asked:
            problem = "this is for networks of tips, and the data are transitions"
            raise UserError(problem, f"train.{name}", "leave it out")
    if settings.split == "sample":
        problem = "transitions beside each other are alike: whole recordings are split"
        raise UserError(problem, "train.split", "split: recording")
    sizes = (6, *settings.hidden, 2)
    weights = sum((into + 1) * out for into, out in pairwise(sizes))
    if weights > MOST_WEIGHTS:
        problem = f"a controller evaluates this network at every tick; with {weights} weights it is too large for that"
        raise UserError(problem, "train.hidden", f"--preset recommended, or layers with at most {MOST_WEIGHTS}")


def keep_dynamics(
    session: Session, samples: Transitions, split: Split, trials: list[TrainingResult], believed: WristParameters
) -> TrainedDynamics:
    """Judge the best of the trainings on transitions, and leave the controller over it.

    `believed` is the wrist as its model has it. Raises KeyboardInterrupt where a training was interrupted.
    """
    import numpy as np

    from wristctl.learning.learned_dynamics import Dynamics, predicted, save_dynamics
    from wristctl.learning.training_result import best_of

    settings, findings = session.study.train, session.findings
    kept = best_of(trials)
    dynamics = Dynamics.of(kept.network, samples)
    run, data = findings.run, session.inputs.runs().get("data")
    if run is not None:
        record = {
            "seed": session.study.seed,
            "settings": settings.model_dump(mode="json", exclude={"data", "resume", "workers"}),
            "samples_sha256": sha256_of((data.path if data else run.path) / "data" / "samples.npz"),
        }
        save_dynamics(dynamics, run.file(f"code/{NETWORK}"), record)
        findings.text(CONTROLLER, _TEXT)
    if any(trial.interrupted for trial in trials):
        raise KeyboardInterrupt
    held_out = np.unique(samples.recording[split.test])
    rows = []
    for name, model in models(dynamics, samples, split.train, believed).items():
        errors = [model(*_parts(samples, split.test)) - samples.targets[split.test]]
        for ahead in AHEAD:
            found, true = predicted(model, samples, held_out, max(1, round(ahead / samples.period)))
            errors.append(np.degrees(found - true))
        sizes = [np.hypot.reduce(np.abs(error), axis=1) for error in errors]
        values = [*(float(np.sqrt(np.mean(size**2))) for size in sizes), float(sizes[-1].max())]
        rows.append((name, *values))
        key = name.replace("-", "_").replace(" ", "_")
        for head, value, size in zip(_HEADS[1:], values, (*sizes, sizes[-1]), strict=True):
            measure, _, unit = head.rstrip("]").partition(" [")
            label = f"{key}_{_in_ms(measure).replace(' ', '_')}"
            meaning = f"{name}: {_MEANT.get(measure) or f'RMSE of the bend {measure}'} in held-out motions"
            findings.metric(label, value, unit, "lower", len(size), meaning=meaning)
    findings.headline("network_after_200_ms", "network_acceleration", "one_segment_model_after_200_ms")
    findings.figure("prediction", prediction, dynamics, samples, int(held_out[0]))
    tables = [Table("", _HEADS, rows)]
    where = str(data.path) if data else ""
    return TrainedDynamics(session.study, findings, tables, dynamics, trials, samples, held_out, where)


def _in_ms(measure: str) -> str:
    """A measure with its time in whole milliseconds, as a name of a metric can have it: after 200 ms."""
    return re.sub(r"([\d.]+) s\b", lambda found: f"{1e3 * float(found[1]):g} ms", measure)


def _parts(samples: Transitions, rows: Rows) -> tuple[Array, Array, Array]:
    """Bends, rates and torques (N, P) of samples."""
    inputs, planes = samples.inputs[rows], samples.planes
    return inputs[:, :planes], inputs[:, planes : 2 * planes], inputs[:, 2 * planes :]


def models(dynamics: Dynamics, samples: Transitions, train: Rows, believed: WristParameters) -> dict[str, Model]:
    """The network, the one-segment model of the wrist as believed, and the linear model nearest to the samples."""
    import numpy as np

    from wristctl.control.plain_model import plain_one_segment
    from wristctl.wrist.segments import segments

    planes = ("ulnar", "flexion")[: samples.planes]
    wrists = [segments(in_plane(believed, plane), 1) for plane in planes]

    def one_segment(bend: Array, rate: Array, torque: Array) -> Array:
        accelerations = np.empty_like(bend)
        for p, wrist in enumerate(wrists):
            for k in range(len(bend)):
                inertia, load = plain_one_segment(wrist, float(bend[k, p]), float(rate[k, p]))
                accelerations[k, p] = (torque[k, p] - load) / inertia
        return accelerations

    inputs = np.column_stack([samples.inputs[train], np.ones(len(train))])
    factors = np.linalg.lstsq(inputs, samples.targets[train], rcond=None)[0]

    def linear(bend: Array, rate: Array, torque: Array) -> Array:
        nearest: Array = np.column_stack([bend, rate, torque, np.ones(len(bend))]) @ factors
        return nearest

    return {"network": dynamics.acceleration, "one-segment model": one_segment, "linear model": linear}


def prediction(dynamics: Dynamics, samples: Transitions, recording: int) -> Figure:
    """A motion that the network was not trained on, and its predictions over 0.2 s each."""
    import numpy as np

    from wristctl.plotting.style import BLACK, BLUE, figure, legend, title

    periods, h = max(2, round(AHEAD[1] / samples.period)), samples.period
    picture, axes = figure(samples.planes, 1, height=2.6 * samples.planes, sharex=True)
    bend, rate, torque = (values[recording] for values in (samples.bend, samples.rate, samples.torque))
    time = h * np.arange(len(bend))
    for p, row in enumerate(axes[:, 0]):
        row.plot(time, np.degrees(bend[:, p]), color=BLACK, label="wrist")
        row.set(ylabel="bend [deg]")
    for start in range(0, len(bend) - periods, periods):
        at, speed, course = bend[start : start + 1], rate[start : start + 1], []
        for k in range(periods):
            course.append(at[0])
            acceleration = dynamics.acceleration(at, speed, torque[start + k : start + k + 1])
            at, speed = at + h * (speed + 0.5 * h * acceleration), speed + h * acceleration
        for p, row in enumerate(axes[:, 0]):
            label = "network" if start == 0 else None
            row.plot(time[start : start + periods], np.degrees(np.array(course)[:, p]), "--", color=BLUE, label=label)
    axes[-1, 0].set(xlabel="time [s]")
    title(axes[0, 0], f"a motion held out of training, predicted {AHEAD[1]:g} s ahead time after time")
    legend(axes[0, 0])
    return picture
