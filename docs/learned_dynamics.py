"""What learned dynamics are worth to predictive control: `python docs/learned_dynamics.py` writes the page of it.

The RMSE over both planes of a motion of daily living, with torques as commanded and on a rig with motors, elastic
tendons and a camera; on the wrist as it is believed and on another, of which a network may have been trained.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np

import wristctl
from wristctl.commands.printed_table import degrees
from wristctl.study_files.load import load_study

PAGE = Path(__file__).parent / "learned-dynamics.md"
OTHER = {"plant.stiffness": "x0.7", "plant.payload": "0.1"}
WRISTS: dict[str, dict[str, str]] = {"wrist as believed": {}, "other wrist": OTHER}
RIG = {"control_period": "0.01", "sensor.level": "camera", "actuator.level": "tendon", "actuator.sheath": "1"}
LOOPS: dict[str, tuple[dict[str, str], str]] = {"torques as commanded": ({}, "default"), "rig": (RIG, "hardware")}
GAINS = {"default": "w=50,zeta=1", "hardware": "w=45,zeta=0.8"}
MOTION = ("simulate.reference.kind=adl:mean", "simulate.reference.duration=0.7", "simulate.repetitions=8")
# Bandwidth of an observer that finds nothing in the time [rad/s].
NO_OBSERVER = 0.1


def trained(out: Path, wrist: str) -> str:
    """The controller over a network of a wrist in two planes."""
    loop = [f"gen-data.loop.{key}={value}" for key, value in WRISTS[wrist].items()]
    data = wristctl.gen_data(load_study([], ["gen-data.source=transitions", "gen-data.planes=2", *loop]), out=out)
    found = wristctl.train(load_study([], ["train.preset=recommended"]), data=data, out=out)
    return f"{found.place}/code/learned_mpc.py:LEARNED_MPC"


def rmse(controller: str, loop: str, wrist: str, observer: float | None) -> str:
    """The mean RMSE over the repetitions [deg]; `observer` is its bandwidth [rad/s], None: the preset's."""
    settings, gains = LOOPS[loop]
    changes = [f"simulate.loop.{key}={value}" for key, value in (settings | WRISTS[wrist]).items()]
    named = f"simulate.gains={gains}"
    if observer is not None:
        given = ", ".join(each.replace("=", ": ") for each in GAINS[gains].split(","))
        named = f"simulate.gains={{{given}, wo: {observer}}}"
    study = load_study([], [*MOTION, f"simulate.controller={controller}", named, *changes])
    found = wristctl.simulate(study)
    return "fails" if found.repeated.failed.any() else degrees(float(np.mean(found.repeated.metrics["rmse"])), 3)


def main() -> None:
    """Train a network of either wrist, and write the page."""
    with tempfile.TemporaryDirectory() as folder:
        networks = {wrist: trained(Path(folder), wrist) for wrist in WRISTS}
        known, other = networks["wrist as believed"], networks["other wrist"]
        rows: list[tuple[str, str, float | None]] = [
            ("mpc", "mpc", None),
            ("mpc, observer of 20 rad/s", "mpc", 20.0),
            ("mpc without its observer", "mpc", NO_OBSERVER),
            ("learned-mpc, trained on the wrist as believed", known, None),
            ("the same without its observer", known, NO_OBSERVER),
            ("learned-mpc, trained on the other wrist", other, None),
            ("the same without its observer", other, NO_OBSERVER),
        ]
        heads = [(loop, wrist) for loop in LOOPS for wrist in WRISTS]
        lines = [f"| controller | {' | '.join(f'{loop}, {wrist}' for loop, wrist in heads)} |"]
        lines += ["| --- |" + " --- |" * len(heads)]
        for name, controller, observer in rows:
            lines.append(f"| {name} | {' | '.join(rmse(controller, *head, observer) for head in heads)} |")
    PAGE.write_text("\n".join([*_BEGIN, *lines, *_END]) + "\n")


_BEGIN = """# Learned dynamics

`learned-mpc` is predictive control over a network of the wrist's dynamics: from bend, rate and torque of each plane to
the acceleration. Its plan is that of `mpc`; the network takes the place of the one-segment model in it, so what you
believe of the wrist plays no part. Two commands make it:

```bash
wristctl gen-data mywrist.yaml --source transitions --label mine
wristctl train mywrist.yaml --preset recommended --data latest:gen-data:mine
wristctl simulate mywrist.yaml --controller RUN/code/learned_mpc.py:LEARNED_MPC
```

`RUN` is the folder of the training, whose answer prints the last line whole. Every command that takes a controller
takes that one; runs copy the file and its network, and are repeated from their copies. Of a run that is not yours you
are asked before its code runs, [as of all controllers from files](your-own-controller.md).

- **Transitions** are of a simulated wrist in random motions of up to 0.7 of its range under smooth random torques, 24
  recordings of 2 s; `gen-data.loop` says how the wrist differs from the one that is believed, as in
  `--set loop.plant.stiffness=x0.7`. Torques are those of the commanded tensions, so learn with `actuator.level: ideal`.
  Planes are found as those of a loop; a network of one plane learns the one toward ulnar, and is used for each plane by
  itself.
- **Errors** that `train` prints are of whole recordings held out: of one period's acceleration, and of the bend 0.02
  and 0.2 s ahead under the recorded torques, beside the one-segment model as believed and the nearest linear model.
  Acceleration is a mean over the period of the data. A wrist of four segments begins to move at once when torques jump,
  which no model of bend and rate has: that is most of the network's error.
- **Outside what it learned** bends and rates count as those at the edge, and torques add by their slope there.

## What it buys

RMSE [deg] over both planes of `adl:mean`, strokes of 0.7 s, the paper's wrist with four tendons, means of eight
repetitions. "Other wrist": 0.7 of the springs' stiffness and 0.1 kg in the hand. With torques as commanded the gains
are `default`, on the rig (10 ms, motors, elastic tendons, 1 rad of sheath, a camera) `hardware`. Networks of two
planes, 24-12 tanh, learned with torques as commanded every millisecond. Made by `python docs/learned_dynamics.py`.

""".splitlines()
_END = """
- On a wrist that is as believed a network buys nothing: with the same observer `mpc` errs as little.
- Trained on the wrist as it is, where `mpc` believes another, it errs a seventeenth of `mpc` with torques as commanded.
  On the rig that is a quarter, and without an observer of its own: the camera's filter still believes the wrong wrist,
  and two observers of the same load are one too many.
- Trained on a wrong wrist it is no better than a wrong model.

What a network learns here a model with the right stiffness and mass has too: [identify](identify.md) first. The network
is for what the model cannot be given.
""".splitlines()


if __name__ == "__main__":
    main()
