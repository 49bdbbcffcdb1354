"""The functions that `import wristctl` offers: what the commands do, for notebooks and scripts.

Each takes a study, its file or the name of an experiment, and keyword arguments that come on top of it: sections of a
study (`wrist`, `seed`), or keys of the command's own section (`controller`, `reference`, `horizon`), as a study file
has them: `wristctl.simulate(wrist={"length": 0.095}, controller="ct-dob")`. `wrist` may be a study file too, whose
section `wrist` is taken. The types of all of them are in `wristctl.arguments`.

Each returns a result with `.metrics`, `.tables`, `.figures` (drawn when asked for), `.frame()` and `.run`, which a
notebook shows as its answer, table and first figure. Inputs are named as on the command line (a path, an id, the
beginning of one, latest:<kind>), or are `Run` objects, or earlier results. With `out=None` nothing is written; with a
folder the result is also a sealed run directory there, as the command writes it. Nothing is printed: `progress(what,
count, total, figures)` is called as it goes on, warnings go to the logger "wristctl". What is wrong is a UserError that
says what, where and how to mend it.
"""

from __future__ import annotations

import inspect
import json
import logging
import textwrap
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from wristctl import arguments
from wristctl.commands.analyse.command import ANALYSE
from wristctl.commands.analyse.hysteresis_results import Hysteresis
from wristctl.commands.analyse.results import Analysed
from wristctl.commands.audit.command import AUDIT, Audited
from wristctl.commands.compare.command import COMPARE, Compared
from wristctl.commands.gen_data.command import GEN_DATA, Generated
from wristctl.commands.gen_data.transitions import Moved
from wristctl.commands.hw_run.command import HW_RUN
from wristctl.commands.hw_run.results import Performed
from wristctl.commands.identify.command import IDENTIFY, AnyTold, Identified
from wristctl.commands.perform import RESULTS, Folder, Ref, StudyOrFile, carry_out, in_python, study_with
from wristctl.commands.progress import Watch
from wristctl.commands.recommend.answer import Recommended
from wristctl.commands.recommend.command import RECOMMEND
from wristctl.commands.simulate.command import SIMULATE
from wristctl.commands.simulate.results import Simulated
from wristctl.commands.study.command import FAIR_STUDY
from wristctl.commands.study.units import Studied
from wristctl.commands.train.command import TRAIN, Trained
from wristctl.commands.train.learned_dynamics import TrainedDynamics
from wristctl.commands.tune.command import TUNE, Tuned
from wristctl.config.study import Study
from wristctl.errors import UserError
from wristctl.records import Run
from wristctl.records import open_run as _open_run
from wristctl.study_files.keys import keys_of
from wristctl.study_files.load import load_study as _load_study
from wristctl.study_files.load import read_study
from wristctl.study_files.typed_controllers import STUDIES

if TYPE_CHECKING:
    from typing import Unpack

    import pandas as pd

    from wristctl.arguments import (
        AnalyseArguments,
        CompareArguments,
        GenDataArguments,
        HwRunArguments,
        IdentifyArguments,
        RecommendArguments,
        SimulateArguments,
        StudyArguments,
        TrainArguments,
        TuneArguments,
    )

# What identify tells: of trials, or of logs by their model.
Told = Identified | AnyTold
_log = logging.getLogger(__name__)


@in_python()
def load_study(file: str | Path | None = None, *overrides: str, trust_code: bool = False, force: bool = False) -> Study:
    """The study of a YAML file, of an experiment by its name ("quick"), or of defaults only.

    `overrides` such as "wrist.length=0.09" win over the file and over what `from_identified` tells, later ones over
    earlier ones; quantities are in the units that `wristctl COMMAND --dry-run --all` shows: SI, but for suffixes like
    _deg. Raises UserError for an unknown key or a value that cannot be, with file and line, and what was meant; and,
    but for `force`, for a size that cannot well be meant, as a length in millimetres. `trust_code` lets the code run
    that a run carries.
    """
    if others := [given for given in (file, *overrides) if not isinstance(given, str | Path | None)]:
        what = f"a {type(others[0]).__name__} is neither a file nor an override"
        fix = 'text, "simulate.horizon=2"; or give it to the command: simulate(horizon=2.0)'
        raise UserError(what, "load_study", fix)
    return _load_study([Path(file)] if file else [], list(overrides), trust_code=trust_code, force=force)


@in_python()
def gen_data(
    study: StudyOrFile | None = None, *, run: Ref | Simulated | Compared | None = None, out: Folder | None = None,
    label: str = "", progress: Watch | None = None,
    **settings: Unpack[GenDataArguments],
) -> Generated | Moved:  # fmt: skip
    """Samples of tip positions [m] and bends [rad], or of the wrist in motion, by the study's `gen-data` section.

    `run` (hw-run, track, simulate or compare) holds the recordings to take them from where `source` is `run`; `csv`
    takes files. The result has `.samples`; `.frame()` is a row per sample. Raises UserError for a run without courses,
    a file that is none, or too few samples.

    With a folder `out` it is a sealed run directory too, named by `label`; `progress` is called as it goes on.
    `settings` are sections or keys of a study, on top of `study`.
    """
    return carry_out(GEN_DATA, study, {"run": run}, out, label, progress, settings=settings)


@in_python()
def train(
    study: StudyOrFile | None = None, *, data: Ref | Generated | Moved | None = None, resume: Ref | None = None,
    out: Folder | None = None, label: str = "", progress: Watch | None = None,
    **settings: Unpack[TrainArguments],
) -> Trained | TrainedDynamics:  # fmt: skip
    """Networks from tip position [m] to bend [rad], or of the wrist's dynamics, by the study's `train` section.

    `data` (gen-data) holds the samples; without it those of the study's `gen-data` section are drawn. `resume` is a
    train run that was stopped, taken up in a run directory. The result has `.network`, `.trials`, `.samples`, `.split`
    and, of a search, `.choice`; `.frame()` is a row per network and seed. Where the samples are transitions it has
    `.dynamics`, over which `wristctl.learning.learned_mpc.learned_mpc` makes the controller. Raises UserError where the
    split leaves too few samples to judge by, or every training diverged.

    With a folder `out` it is a sealed run directory too, named by `label`; `progress` is called as it goes on.
    `settings` are sections or keys of a study, on top of `study`.
    """
    return carry_out(TRAIN, study, {"data": data, "resume": resume}, out, label, progress, settings=settings)


@in_python()
def tune(
    study: StudyOrFile | None = None, *, network: Ref | Trained | None = None,
    from_identified: Ref | Told | None = None, executor: str = "serial", out: Folder | None = None,
    label: str = "", progress: Watch | None = None, **settings: Unpack[TuneArguments],
) -> Tuned:  # fmt: skip
    """Gains by search, by the study's `tune` section: the same budget and objective for every controller.

    `network` (train) stands behind references with `inverse: network`; the parameters of `from_identified` (identify)
    replace the study's. The result has `.gains`, by controller and name in the units of the controller's table, and
    `.searches`; `.frame()` is a row per candidate. Raises UserError for an unknown controller, one without gains, or a
    network that is missing.

    Where the study has a `sweep` the result is a table of its points, which `executor` computes. `out`, `label`,
    `progress` and `settings` are as in `gen_data`.
    """
    given = {"network": network, "from_identified": from_identified}
    return carry_out(TUNE, study, given, out, label, progress, executor, settings=settings)


@in_python()
def compare(
    study: StudyOrFile | None = None, *, network: Ref | Trained | None = None, tuned: Ref | Tuned | None = None,
    from_identified: Ref | Told | None = None, executor: str = "serial", out: Folder | None = None,
    label: str = "", progress: Watch | None = None,
    **settings: Unpack[CompareArguments],
) -> Compared:  # fmt: skip
    """Controllers x loops x references, by the study's `compare` section, beside the paper's numbers.

    Where it names worlds of a family, the rows ranked on those: `.rankings`, of smooth motions and of steps.

    `network` (train) stands behind references with `inverse: network`, `tuned` (tune) behind rows with `gains: tuned`.
    The parameters of `from_identified` (identify) replace the study's. The result has `.rows`, each with the simulation
    of its loop; `.frame()` is a row per combination: RMSE [rad], settling [s], tensions [N], ... Raises UserError for
    unknown controllers or gains, inputs that are missing, or controllers that would be judged on what they were tuned
    on.

    Where the study has a `sweep` the result is a table of its points, which `executor` computes. `out`, `label`,
    `progress` and `settings` are as in `gen_data`.
    """
    given = {"network": network, "tuned": tuned, "from_identified": from_identified}
    return carry_out(COMPARE, study, given, out, label, progress, executor, settings=settings)


@in_python()
def study(
    study: StudyOrFile | None = None, *, resume: Ref | None = None, executor: str = "serial",
    out: Folder | None = None, label: str = "", progress: Watch | None = None,
    **settings: Unpack[StudyArguments],
) -> Studied:  # fmt: skip
    """Every law tuned and judged at equal budget on families of worlds, by the study's `study` section.

    `resume` is a study run that was stopped, whose units of work are taken over; `executor` (serial, processes[:N],
    dask://host:port, module:factory) does them. The result has `.rankings` by family, `.terms`, `.shifts`, `.searches`;
    `.frame()` is a row per family and law. With a folder `out` it is also a sealed run directory there, `label` part of
    its name; `progress(what, count, total, figures)` is called. Raises UserError for unknown laws or families, and for
    workers that compute other numbers or are gone.
    `settings` are sections or keys of a study, on top of `study`.
    """
    return carry_out(FAIR_STUDY, study, {"resume": resume}, out, label, progress, executor, settings)


@in_python()
def recommend(
    study: StudyOrFile | None = None, *, from_identified: Ref | Told | None = None, out: Folder | None = None,
    label: str = "", progress: Watch | None = None, **settings: Unpack[RecommendArguments],
) -> Recommended:  # fmt: skip
    """A controller with gains for the study's wrist, by its `recommend` section.

    Presets are scaled to the wrist, tuned shortly on simulated rigs, and tested on others. `from_identified` (identify)
    gives the wrist's parameters. The result has `.best` (controller, origin, gains), `.ranking`, `.motions` and
    `.payloads` (what it holds), `.reach_deg`; `.frame()` is a row per candidate. Raises UserError for a wrist that its
    tendons cannot bend by 5 deg.

    With a folder `out` it is a sealed run directory too, named by `label`; `progress` is called as it goes on.
    `settings` are sections or keys of a study, on top of `study`.
    """
    return carry_out(RECOMMEND, study, {"from_identified": from_identified}, out, label, progress, settings=settings)


@in_python()
def simulate(
    study: StudyOrFile | None = None, *, network: Ref | Trained | None = None, tuned: Ref | Tuned | None = None,
    from_identified: Ref | Told | None = None, executor: str = "serial",
    out: Folder | None = None, label: str = "", progress: Watch | None = None,
    **settings: Unpack[SimulateArguments],
) -> Simulated:  # fmt: skip
    """One closed loop, by the study's `simulate` section.

    `network` (train) stands behind a reference with `inverse: network`, `tuned` (tune) behind `gains: tuned`; the
    parameters of `from_identified` (identify) replace the study's. The result has `.course` (a DataFrame of time, bend,
    reference, torque, tension and tip, as that of `hw_run`), `.trajectory`, of which `.frame()` has every column, and
    `.failed`, whether the wrist left its range. SI units. Raises UserError for unknown controllers
    or gains, a reference out of reach, inputs that are missing, or a start in equilibrium of a wrist that buckles.

    Where the study has a `sweep` the result is a table of its points, which `executor` computes. `out`, `label`,
    `progress` and `settings` are as in `gen_data`.
    """
    given = {"network": network, "tuned": tuned, "from_identified": from_identified}
    return carry_out(SIMULATE, study, given, out, label, progress, executor, settings=settings)


@in_python()
def analyse(
    study: StudyOrFile | None = None, *, network: Ref | Trained | None = None, tuned: Ref | Tuned | None = None,
    from_identified: Ref | Told | None = None, out: Folder | None = None, label: str = "",
    progress: Watch | None = None,
    **settings: Unpack[AnalyseArguments],
) -> Analysed | Hysteresis:  # fmt: skip
    """The loop of the study's `simulate` section, linearised about where it rests, by its `analyse` section.

    `network`, `tuned` and `from_identified` are as in `simulate`. The result has `.answer`, `.found` about each of
    `.angles`, `.locus`, `.portrait`; `.frame()` is a row per angle. Raises UserError as `simulate` does, and where the
    loop cannot rest.

    With `of="hysteresis"` it is the wrist without a controller, whose tendons have friction, by the study's section
    `hysteresis`: a `Hysteresis` with `.loops`, `.dead_bands` and `.circles`, whose `.frame()` is a row per loop, SI
    units. Raises UserError for ranges in which the wrist cannot be held. `out`, `label`, `progress` and `settings` are
    as in `gen_data`.
    """
    inputs = {"network": network, "tuned": tuned, "from_identified": from_identified}
    return carry_out(ANALYSE, study, inputs, out, label, progress, settings=settings)


@in_python()
def hysteresis(
    study: StudyOrFile | None = None, *, out: Folder | None = None, label: str = "", progress: Watch | None = None,
    **settings: Any,
) -> Analysed | Hysteresis | Told:  # fmt: skip
    """Former name of `analyse(of="hysteresis")` and, of a measured loop, of `identify(model="hysteresis")`."""
    files, base = ([], study) if isinstance(study, Study) else ([Path(study)] if study is not None else [], None)
    sections = {name.replace("-", "_"): name for name in keys_of(Study)}
    overrides = [f"{sections.get(key, f'hysteresis.{key}')}={json.dumps(value)}" for key, value in settings.items()]
    whole, _ = read_study(files, overrides, base=base)
    measured = whole.identify.model == "hysteresis"
    today = 'identify(runs=FILE, model="hysteresis")' if measured else 'analyse(of="hysteresis", hysteresis={...})'
    _log.warning("wristctl.hysteresis is now wristctl.%s", today)
    if measured:
        return carry_out(IDENTIFY, whole, {}, out, label, progress)
    return carry_out(ANALYSE, whole, {}, out, label, progress, settings={"of": "hysteresis"})


@in_python()
def identify(
    study: StudyOrFile | None = None, *, runs: Ref | Sequence[Ref] | None = None, out: Folder | None = None,
    label: str = "", progress: Watch | None = None, **settings: Unpack[IdentifyArguments],
) -> Told:  # fmt: skip
    """Stiffness, damping, tendons and delay of a real wrist from the logged trials of `runs` (hw-run).

    `study` may name runs too: what is `latest:...`, or has the end of a file other than a study's, is taken for `runs`.
    A run that is a file is an open log (documentation: The open log): the result then is a `LogTold`, what such logs
    tell, of a log of tensions or currents a `DrivenTold`, with `model="wrist"` a `BendsTold`, what logs in two planes
    tell of the study's wrist, or with `model="hysteresis"` a `LoopTold`, what a loop of tension and angle tells.

    By the study's `identify` section. The result has `.values`, `.fit`, `.knowledge` and `.yaml`, a study file of what
    was found; `.frame()` is a row per parameter with its 95 % interval and unit. Raises UserError without runs, and
    where these do not tell every parameter: it says what to add.

    With a folder `out` it is a sealed run directory too, named by `label`; `progress` is called as it goes on.
    `settings` are sections or keys of a study, on top of `study`.
    """
    is_text = runs is None and isinstance(study, str | Path)
    if is_text and (str(study).startswith("latest:") or Path(str(study)).suffix not in ("", *STUDIES)):
        study, runs = None, study
    several = [runs] if isinstance(runs, str | Path | Run) else list(runs or ())
    named = [str(each.path if isinstance(each, Run) else each) for each in several]
    every: Mapping[str, object] = {**settings, "runs": named} if named else settings
    return carry_out(IDENTIFY, study, {}, out, label, progress, settings=every)


@in_python()
def hw_run(
    study: StudyOrFile | None = None, *, network: Ref | Trained | None = None, tuned: Ref | Tuned | None = None,
    from_identified: Ref | Told | None = None, calibration: Ref | None = None, out: Folder = RESULTS,
    label: str = "", progress: Watch | None = None, **settings: Unpack[HwRunArguments],
) -> Performed:  # fmt: skip
    """Trials on the emulated rig, by the study's `hw-run` section: the same firmware, tendons and camera pictures.

    `network`, `tuned` and `from_identified` are as in `simulate`; `calibration` (calibrate-wrist) says how far each
    spool bends the wrist. Trials are logged as they go, so they always make a sealed run directory in the folder `out`,
    named by `label`. The result has `.course` (every tick of every trial) and `.twins`, the same trials simulated;
    `.frame()` is a row per trial. Raises UserError for a rig with a `port`, which the command line drives with a person
    beside it, and where a trial stops the motors.

    `progress` and `settings` are as in `gen_data`.
    """
    given = {"network": network, "tuned": tuned, "from_identified": from_identified, "calibration": calibration}
    whole, _ = study_with(study, "hw-run", settings)
    if whole.hw_run.port is not None:
        raise UserError(
            "motors that are real turn with a person beside them", "hw-run.port", "the command `wristctl hw-run`"
        )
    return carry_out(HW_RUN, study, given, out, label, progress, settings=settings)


@in_python()
def audit(
    study: StudyOrFile, *, table1: Ref | Trained | None = None, selection: Ref | Trained | None = None,
    hardware: Ref | None = None, out: Folder | None = None, label: str = "", progress: Watch | None = None,
) -> Audited:  # fmt: skip
    """Every claim of the paper in the study's `audit` section (experiments/claims.yaml has all) with a verdict.

    `table1` and `selection` are trainings by experiments/table1.yaml and experiments/model_selection.yaml, `hardware`
    is a run of hw-run; without them the claims that they would decide stay open. The result has `.judgements` and
    `.comparisons`, by loop; `.frame()` is a row per claim. Raises UserError without claims, and for a training that
    lacks what a claim asks for.

    With a folder `out` it is a sealed run directory too, named by `label`; `progress` is called as it goes on.
    """
    given = {"table1": table1, "selection": selection, "hardware": hardware}
    return carry_out(AUDIT, study, given, out, label, progress)


@in_python()
def runs(
    where: str | Sequence[str] = (), *, kind: str | None = None, label: str | None = None, state: str | None = None,
    tag: str | None = None, newer: str | None = None, older: str | None = None, sort: str = "started",
    reverse: bool = False, out: Folder = RESULTS,
) -> pd.DataFrame:  # fmt: skip
    """The run directories of the folder `out` as a table, oldest first: one row each, its metrics among the columns.

    `where` are conditions on metrics such as "rmse<1e-3", in SI as the columns are, or with the unit: "rmse<0.5deg";
    `kind` and `label` may be patterns with `*`; `state` is how a run ended, `tag` one that it has; `newer` and `older`
    are ages: 30m, 12h, 2d; `sort` is a column, `reverse` puts the largest or newest first. Raises UserError for a
    condition or age that cannot be read, a metric that no run has, or a folder that cannot be read.
    """
    import pandas as pd

    from wristctl.records.find import entries, in_order, select

    asked = [where] if isinstance(where, str) else list(where)
    found = in_order(select(entries(Path(out)), kind, label, state, tag, asked, newer, older), sort)
    own = ["id", "kind", "label", "state", "started", "wall_s", "note", "tags"]
    rows = [{name: getattr(each, name) for name in own} | each.metrics for each in found]
    return pd.DataFrame(rows[::-1] if reverse else rows, columns=None if rows else own)


@in_python()
def open_run(ref: str | Path, out: Folder = RESULTS) -> Run:
    """The run directory that `ref` names: a path, an id in `out` or its beginning, or latest:<kind> (that ended ok).

    Its `.data(name)`, `.metrics`, `.config`, `.file(name)`. Raises UserError where there is none, or more than one.
    """
    return _open_run(ref, Path(out))


def _say_keys(function: Callable[..., Any]) -> None:
    """Let `help` name the keys that a function takes by `settings`."""
    title = "".join(map(str.capitalize, function.__name__.split("_"))) + "Arguments"
    keys = ", ".join(getattr(arguments, title).__annotations__)
    told = textwrap.fill(f"Keys: {keys}; types and units: wristctl.arguments.{title}.", 110)
    function.__doc__ = f"{inspect.getdoc(function)}\n\n{told}"


for _function in (gen_data, train, tune, compare, study, recommend, simulate, analyse, identify, hw_run):
    _say_keys(_function)
