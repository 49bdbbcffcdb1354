"""A controller on wrists that MuJoCo simulates: `python docs/mujoco_rig.py` writes the table of docs/mujoco-rig.md.

The paper's wrist is exported to MuJoCo, with spools, elastic tendons and their friction. Masses, springs and friction
of ten copies are drawn; the controller believes the first. Each is homed, and bent by 30 deg in 1 s.
"""

from __future__ import annotations

import math
import tempfile
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree

import numpy as np
import pandas as pd

from wristctl.commands.adoption import adopted
from wristctl.config.hw_run import HwRunSettings, RigRow
from wristctl.config.plant import Actuator
from wristctl.config.study import Study
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.plugins.places import load
from wristctl.trial.guarded_rig import GuardedRig
from wristctl.trial.log import TrialLog
from wristctl.trial.rig_belief import layout_of_rig, numbers_of
from wristctl.trial.rig_experiment import RigExperiment
from wristctl.trial.trials import Trial
from wristctl.wrist.hinge_chain import HingeChain, Spools, mjcf

HERE = Path(__file__).parent
BEGIN, END = "<!-- tables by docs/mujoco_rig.py -->\n", "<!-- end -->"
MODELS, BY = 10, 0.2
"""Models that are drawn, and the share by which their masses, springs and friction go to either side."""
HORIZON, REST, SWING_DEG = 2.5, 0.5, 0.2
"""Duration of a trial and of its end [s], and the swing there, peak to peak, beyond which a trial does not hold."""
ROW = RigRow(controller="pid-ff", gains="hardware")
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


def tried(folder: Path, model: Path, number: int) -> Held:
    """Home a drawn model and bend it toward ulnar or, every second one, toward flexion."""
    rig, factors = drawn(model, number)
    direction = ("ulnar", "flexion")[number % 2]
    study = adopted(Study(hw_run=HwRunSettings(rig=rig, rows=(ROW,), horizon=HORIZON)), "hw-run").study
    settings, data = study.hw_run, folder / f"data_{number}"
    data.mkdir()
    robot, _ = load(rig)
    tendons = numbers_of(layout_of_rig(settings, study.wrist))
    log = TrialLog(data, None, settings.control_period, planes=settings.planes, tendons=tendons, wired=False)
    experiment = RigExperiment(settings, study.wrist, [Trial(0, direction, 0, 0.0, 0)], log)
    try:
        experiment.run(GuardedRig(robot, rig))
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


def table(found: list[Held]) -> str:
    """The answer and a row for each model, as Markdown."""
    names = ("links' mass", "hand's mass", "springs", "friction", "RMSE [deg]", "swing [deg]", "ends")
    cells = [
        [*(f"{factor:.2f}" for factor in one.factors), f"{one.error_deg:.3f}", f"{one.swing_deg:.3f}", one.ends]
        for one in found
    ]
    rows = "\n".join(f"| {' | '.join(row)} |" for row in (names, ["---"] * len(names), *cells))
    worst = max((one.error_deg for one in found if one.ends == "ok"), default=math.nan)
    return (
        f"{ROW.controller} with its {ROW.gains} gains holds {sum(one.holds for one in found)} of {len(found)} drawn "
        f"wrists, with a true error of {worst:.2f} deg RMSE at worst:\n\n{rows}"
    )


def main() -> None:
    """Try all; the page's table has those that have ended."""
    page = HERE / "mujoco-rig.md"
    before, _, rest = page.read_text(encoding="utf-8").partition(BEGIN)
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        model, found = exported(folder), list[Held]()
        for number in range(MODELS):
            found.append(tried(folder, model, number))
            page.write_text(f"{before}{BEGIN}\n{table(found)}\n\n{END}{rest.partition(END)[2]}", encoding="utf-8")


if __name__ == "__main__":
    main()
