"""Robots that MuJoCo simulates, tried by commands: `python docs/mujoco_rig.py` writes the tables of docs/mujoco-rig.md.

The paper's wrist is exported to MuJoCo, with spools, elastic tendons and their friction. `recommend` finds a controller
for it; masses, springs and friction of ten copies are drawn, and the controller believes the first. The tapering chain
is identified from the log of its own trials, and follows tips through a network that learned from them.
"""

from __future__ import annotations

import math
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree

import numpy as np
import pandas as pd
import yaml
from numpy.typing import NDArray

from wristctl.commands.adoption import adopted
from wristctl.config.hw_run import HwRunSettings, RigRow
from wristctl.config.plant import Actuator
from wristctl.config.study import Study
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.plugins.places import load
from wristctl.records import Run
from wristctl.simulation.references import minimum_jerk
from wristctl.trial.experiment import Experiment, log_of
from wristctl.trial.guarded_rig import GuardedRig
from wristctl.trial.rig_stand import RigStand
from wristctl.trial.trials import Trial
from wristctl.wrist.hinge_chain import HingeChain, Spools, mjcf

HERE = Path(__file__).parent
PAGE = HERE / "mujoco-rig.md"
CHAIN = f"{HERE.parent / 'experiments' / 'own_rigs' / 'tapering_chain.py'}:RIG"
MODELS, BY = 10, 0.2
"""Models that are drawn, and the share by which their masses, springs and friction go to either side."""
HORIZON, REST, SWING_DEG = 2.5, 0.5, 0.2
"""Duration of a trial and of its end [s], and the swing there, peak to peak, beyond which a trial does not hold."""
SHORT = (
    "controllers=[pid-ff]", "draws=4", "validation=4", "tests=10", "candidates=4", "iterations=2", "frequencies=[0.2]",
    "payloads=[0.1]",
)  # fmt: skip
"""Settings of `recommend` with which it takes minutes."""
KP, KD, KI, TIMES_MORE = 0.396, 0.00792, 4.75, 3.0
"""Gains of pid-ff that `recommend --rig` has for the chain, and how many times as large they are tried too."""
TRIED = {
    "feedforward": "{controller: feedforward, gains: default}",
    **{
        name: f"{{controller: pid-ff, gains: {{Kp: {more * KP:g}, Kd: {more * KD:g}, Ki: {more * KI:g}}}}}"
        for name, more in (("pid-ff", 1.0), (f"pid-ff, gains x {TIMES_MORE:g}", TIMES_MORE))
    },
}
"""Rows of `hw-run` for the chain, by what the page calls them."""
CIRCLE = "--reference", "circumduction", "--set", "reference.angle_deg=25", "--horizon", "8"
SPIRAL_DEG, TURNS, LASTS, TIMES = 28.0, 4, 16.0, 3
"""Largest bend of the spiral that is learned from, its turns, its duration [s], and its repetitions."""
POINTS, POINT_DEG, APART = (0.0, 120.0, 240.0), 20.0, 3.0
"""Directions and bend of the tips that are asked for, and the time from one to the next [s], half of it at rest."""
LENGTH = 0.2
"""Of the chain [m]."""
Values = NDArray[np.float64]
DRAWN = """
from wristctl.mujoco_rig import MujocoRig
from wristctl.plugins.import_hook import data_file
from wristctl.rig import Drive

GIVEN = {"bend": "tip", "tension": 60.0, "drive": Drive(delay=0.01)}
BELIEVED = MujocoRig(data_file(__file__, "wrist.xml"), **GIVEN).facts
RIG = MujocoRig(data_file(__file__, "MODEL"), tendons=BELIEVED.tendons, wrist=BELIEVED.wrist, **GIVEN)
"""


class Held(NamedTuple):
    """A trial on one drawn model."""

    factors: tuple[float, ...]
    """Of the links' masses, the hand's, the springs and the friction."""
    ends: str
    error_deg: float
    """RMSE of the true bend, over both planes."""
    swing_deg: float

    @property
    def holds(self) -> bool:
        """Whether it ended by itself, and the wrist stands at its end."""
        return self.ends == "ok" and self.swing_deg <= SWING_DEG


def typed(folder: Path, *words: object) -> str:
    """Run a command in a folder; the last line of what it prints. Raises RuntimeError where it fails."""
    command = [sys.executable, "-m", "wristctl", *map(str, words)]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(f"{words}: {done.stderr}")
    return done.stdout.strip().splitlines()[-1]


def wristctl(folder: Path, *words: object) -> Run:
    """The run of a command in a folder."""
    return Run(Path(typed(folder, *words, "--out", folder / "results")))


def exported(folder: Path) -> Path:
    """The paper's wrist as MuJoCo's model, as `export-model --to mujoco --planes 2 --motors spools` writes it."""
    wrist = WristParameters()
    spools = Spools.of(Actuator(level="tendon", friction=0.1), wrist)
    file = folder / "wrist.xml"
    file.write_text(mjcf(HingeChain.of(wrist, 4, 2), "the paper's wrist", spools), encoding="utf-8")
    return file


def drawn(model: Path, number: int) -> tuple[str, tuple[float, ...]]:
    """A rig's FILE.py:NAME of a model with other masses, springs and friction, and the factors."""
    factors = tuple((1.0 + np.random.default_rng(number).uniform(-BY, BY, 4)).tolist())
    links, hand, springs, friction = factors
    tree = ElementTree.parse(model)
    inertias = tree.findall(".//inertial")
    for inertia in inertias:
        inertia.set("mass", repr(float(inertia.attrib["mass"]) * (hand if inertia is inertias[-1] else links)))
    for joint in tree.findall(".//body/joint"):
        joint.set("stiffness", repr(float(joint.attrib["stiffness"]) * springs))
    for tendon in tree.findall(".//tendon/spatial"):
        tendon.set("frictionloss", repr(float(tendon.attrib["frictionloss"]) * friction))
    file = model.with_name(f"wrist_{number}.xml")
    tree.write(file)
    rig = model.with_name(f"wrist_{number}.py")
    rig.write_text(DRAWN.replace("MODEL", file.name).lstrip(), encoding="utf-8")
    return f"{rig}:RIG", factors


def tried(folder: Path, model: Path, number: int, row: RigRow) -> Held:
    """Home a drawn model and bend it toward ulnar or, every second one, toward flexion."""
    rig, factors = drawn(model, number)
    direction = ("ulnar", "flexion")[number % 2]
    study = adopted(Study(hw_run=HwRunSettings(rig=rig, rows=(row,), horizon=HORIZON)), "hw-run").study
    settings, data = study.hw_run, folder / f"data_{number}"
    data.mkdir()
    robot, _ = load(rig)
    log = log_of(data, settings, study.wrist)
    experiment = Experiment(settings, study.wrist, [Trial(0, direction, 0, 0.0, 0)], log)
    try:
        experiment.run(RigStand(GuardedRig(robot, rig)))
    except UserError as error:
        return Held(factors, str(error.what), math.nan, math.nan)
    finally:
        log.close()
    ticks, motion = pd.read_csv(data / "log.csv"), robot.motion
    names = ["bend_ref_ulnar", "bend_ref_flexion"]
    during = motion[(motion[:, 0] >= ticks["clock"].iloc[0]) & (motion[:, 0] <= ticks["clock"].iloc[-1])]
    wanted = np.column_stack([np.interp(during[:, 0], ticks["clock"], ticks[name]) for name in names])
    assert experiment.zero is not None
    off = np.degrees(during[:, 1:3] - wanted - np.array(experiment.zero.markers))
    swing = np.ptp(np.degrees(during[during[:, 0] > during[-1, 0] - REST, 1:3]), axis=0).max()
    return Held(
        factors, experiment.outcomes[0], float(np.sqrt(np.square(off).sum(axis=1).mean())), float(swing)
    )  # fmt: skip


def table(names: tuple[str, ...], rows: list[list[str]]) -> str:
    """A table as Markdown."""
    return "\n".join(f"| {' | '.join(row)} |" for row in (list(names), ["---"] * len(names), *rows))


def wrists(folder: Path) -> str:
    """The wrists that are drawn, under the controller that `recommend` has for the first."""
    model = exported(folder)
    (folder / "wrist.py").write_text(DRAWN.replace("MODEL", model.name).lstrip(), encoding="utf-8")
    settings = [word for setting in SHORT for word in ("--set", setting)]
    run = wristctl(folder, "recommend", "--rig", f"{folder / 'wrist.py'}:RIG", *settings)
    recommended = yaml.safe_load(run.file("data/recommended.yaml").read_text(encoding="utf-8"))
    row = RigRow.model_validate(recommended["hw-run"]["controllers"][0])
    found = [tried(folder, model, number, row) for number in range(MODELS)]
    names = ("links' mass", "hand's mass", "springs", "friction", "RMSE [deg]", "swing [deg]", "ends")
    cells = [
        [*(f"{factor:.2f}" for factor in one.factors), f"{one.error_deg:.3f}", f"{one.swing_deg:.3f}", one.ends]
        for one in found
    ]
    worst = max((one.error_deg for one in found if one.ends == "ok"), default=math.nan)
    assert isinstance(row.gains, dict)
    gains = ", ".join(f"{name} = {value:.3g}" for name, value in row.gains.items())
    return (
        f"It recommends {row.controller} with {gains}, which holds {sum(one.holds for one in found)} of {len(found)} "
        f"drawn wrists, with a true error of {worst:.2f} deg RMSE at worst:\n\n{table(names, cells)}"
    )


def spiral(file: Path) -> None:
    """Bends that go out and come back around the straight chain."""
    share = np.linspace(0.0, 1.0, 1 + round(100 * LASTS))
    size, angle = SPIRAL_DEG * np.sin(np.pi * share), 2.0 * np.pi * TURNS * share
    columns = {"time [s]": LASTS * share, "bend_y [deg]": size * np.cos(angle), "bend_z [deg]": size * np.sin(angle)}
    pd.DataFrame(columns).to_csv(file, index=False)


def tips(looks: pd.DataFrame, file: Path) -> Values:
    """Write a recording that goes from tip to tip, of those that were seen about some bends; these (N, 3) [m]."""
    bends = np.degrees(looks[["bend_ulnar", "bend_flexion"]].to_numpy())
    seen = looks[["tip_x", "tip_y", "tip_z"]].to_numpy()
    angles = np.radians(POINTS)
    about = POINT_DEG * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    asked = [seen[np.argsort(np.hypot(*(bends - bend).T))[:6]].mean(axis=0) for bend in [np.zeros(2), *about]]
    time: Values = 0.02 * np.arange(round(APART * len(POINTS) / 0.02), dtype=float)
    path = asked[0] + sum(
        minimum_jerk(time - APART * k, 0.5 * APART)[0][:, None] * (asked[k + 1] - asked[k]) for k in range(len(POINTS))
    )
    names = ("tip_x [mm]", "tip_y [mm]", "tip_z [mm]")
    pd.DataFrame({"time [s]": time, **dict(zip(names, 1e3 * path.T, strict=True))}).to_csv(file, index=False)
    return np.array(asked[1:])


def ends(run: Run, asked: Values) -> Values:
    """Distances [m] from each tip that was asked for to the mean of where it was seen at the end of its rest."""
    looks = run.data("looks")
    looks, found = looks[looks["trial"] == 0], []
    for number, tip in enumerate(asked, 1):
        rest = looks[(looks["time"] > APART * number - REST) & (looks["time"] <= APART * number)]
        found.append(float(np.linalg.norm(rest[["tip_x", "tip_y", "tip_z"]].to_numpy().mean(axis=0) - tip)))
    return np.array(found)


def errors(run: Run) -> list[tuple[float, float]]:
    """RMSE of each row [deg] in the rig's trial, and in its simulation."""
    table_of_trials = run.json("tables.json")[0]
    names = table_of_trials["columns"]
    of_rig, simulated = (names.index(name) for name in ("RMSE [rad]", "simulated RMSE [rad]"))
    return [(math.degrees(row[of_rig]), math.degrees(row[simulated])) for row in table_of_trials["rows"]]


def chain(folder: Path) -> str:
    """The chain by its facts, and identified from the log of its own trials."""
    file = folder / "spiral.csv"
    spiral(file)
    words = ("--rig", CHAIN, "--set", "reference.kind=recording", "--set", f"reference.file={file}")
    log = folder / "chain.csv"
    learned = wristctl(folder, "hw-run", "feedforward", *words, "--set", f"repetitions={TIMES}", "--horizon", LASTS)
    typed(folder, "runs", "export", learned.path, "--file", log)
    found = wristctl(folder, "identify", log, "--config", learned.path / "config.yaml")
    wide = ("hw-run", "--rig", CHAIN, "--set", f"controllers=[{', '.join(TRIED.values())}]", *CIRCLE)
    before, after = (
        errors(wristctl(folder, *wide, *identified)) for identified in ((), ("--from-identified", found.path))
    )
    rows = [
        [name, *(f"{size:.2f}" for size in facts + known)]
        for name, facts, known in zip(TRIED, before, after, strict=True)
    ]
    names = (
        "RMSE on a circle of 25 deg",
        "by the facts [deg]",
        "their simulation",
        "identified [deg]",
        "its simulation",
    )
    told = found.data("parameters").set_index("parameter").loc["gain"]
    through, asked = network(folder, learned)
    off = ends(through, asked)
    return (
        f"{table(names, rows)}\n\n"
        f"The log tells a gain of {told['value']:.3f} [{told['low']:.3f}, {told['high']:.3f}]. Of "
        f"{len(off)} tips that were asked for through the network the chain stands "
        f"{', '.join(f'{1e3 * one:.2f}' for one in off)} mm off: "
        f"{100.0 * off.max() / LENGTH:.2f} % of its length at most."
    )


def network(folder: Path, learned: Run) -> tuple[Run, Values]:
    """A network of the tips that a run has seen, and trials that follow tips through it, with the tips (N, 3) [m]."""
    data = wristctl(folder, "gen-data", "--source", "run", "--run", learned.path)
    trained = wristctl(folder, "train", "--data", data.path, "--preset", "recommended")
    asked = tips(learned.data("looks"), folder / "tips.csv")
    words = ("kind=recording", f"file={folder / 'tips.csv'}", "column=tip", "inverse=network")
    settings = [word for setting in words for word in ("--set", f"reference.{setting}")]
    horizon = APART * len(POINTS)
    wide = ("--network", trained.path, "--set", f"controllers=[{TRIED['pid-ff']}]", "--horizon", horizon)
    return wristctl(folder, "hw-run", "--rig", CHAIN, *settings, *wide), asked


PARTS = {"chain": chain, "wrists": wrists}
"""What writes each part of the page."""


def main() -> None:
    """Write the parts that are named, or all."""
    for name in sys.argv[1:] or list(PARTS):
        with tempfile.TemporaryDirectory() as scratch:
            text = PARTS[name](Path(scratch))
        begin, end = f"<!-- {name} by docs/mujoco_rig.py -->\n", "<!-- end -->"
        before, _, rest = PAGE.read_text(encoding="utf-8").partition(begin)
        PAGE.write_text(f"{before}{begin}\n{text}\n\n{end}{rest.partition(end)[2]}", encoding="utf-8")


if __name__ == "__main__":
    main()
