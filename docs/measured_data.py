"""From trials to data to a network and back to trials, on the emulated rig: `python docs/measured_data.py [FOLDER]`.

It writes the tables of docs/measured-data.md and docs/images/measured-data.png. Runs stay in the folder, and what is
there already is not done again; from nothing it takes ten minutes on one core, most of it emulated motors and camera.
"""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from scipy import stats

import wristctl
from wristctl.arrays import Array
from wristctl.commands.train.command import Trained
from wristctl.learning.inference import Polynomial
from wristctl.learning.network import Network
from wristctl.records import Run, list_runs
from wristctl.records.formats import write_figure
from wristctl.wrist.kinematics import chain_tip, exact_angle

HERE = Path(__file__).parent
BEGIN, END = "<!-- tables by docs/measured_data.py -->\n", "<!-- end -->"
SPLITS = 10
TIP_NOISE = 1e-4
TARGETS = (15.0, 30.0)
"""Angles [deg] at whose tips, as measured, a trial is to end."""
LAW = "controllers=[{controller: pid-ff, gains: hardware}]"
HW_RUN = ("hw-run", "--optics", "latest:calibrate-camera", "--set", LAW, "--set", "directions=[ulnar, radial]")
SINE = "reference={kind: two-sided-sine, angle_deg: 40, frequency: 0.2}"
DAILY = "reference={kind: 'adl:all-deviation'}"


def performed(results: Path, label: str, *command: str) -> Run:
    """The run of this label, made now where there is none."""
    found = [run for run in list_runs(results) if run.state == "ok" and run.manifest.label == label]
    if not found:
        whole = [sys.executable, "-m", "wristctl", *command, "--out", str(results), "--label", label, "--quiet"]
        subprocess.run(whole, check=True, stdout=subprocess.DEVNULL)
        found = [run for run in list_runs(results) if run.state == "ok" and run.manifest.label == label]
    return found[-1]


def courses(run: Run) -> pd.DataFrame:
    """Tips [m] and angles [rad] of every frame: as measured, and as the emulated wrist was."""
    frames, truth = run.data("frames"), run.data("truth")
    found = []
    for trial, seen in frames[frames["verdict"] == "ok"].groupby("trial"):
        own = truth[truth["trial"] == trial]
        angles = [np.interp(seen["captured"], own["time"], own[f"theta_{k}"]) for k in (1, 2, 3, 4)]
        tip = chain_tip(np.column_stack(angles), run.config.wrist.length)
        true = {"true_x": tip[:, 0], "true_y": tip[:, 1], "true_theta": np.sum(angles, axis=0)}
        found.append(seen[["trial", "captured", "tip_x", "tip_y", "theta"]].assign(**true))
    return pd.concat(found, ignore_index=True)


def with_noise(measured: pd.DataFrame, folder: Path, noise: float) -> list[str]:
    """A CSV file of each trial, its tips with normal noise [m] besides; their names."""
    folder.mkdir(exist_ok=True)
    rng, names = np.random.default_rng(0), []
    for trial, own in measured.groupby("trial"):
        tip = own[["tip_x", "tip_y"]].to_numpy() + noise * rng.standard_normal((len(own), 2))
        lines = [
            f"{1e3 * x:.4f},{1e3 * y:.4f},{angle:.4f}"
            for (x, y), angle in zip(tip, np.degrees(own["theta"]), strict=True)
        ]
        file = folder / f"trial-{trial}.csv"
        file.write_text("\n".join(["tip_x [mm],tip_y [mm],angle [deg]", *lines]) + "\n")
        names.append(str(file))
    return names


def trained(files: Sequence[str], inputs: str) -> list[Trained]:
    """A network for each way to part the recordings."""
    named = json.dumps(list(files))
    settings = ("gen-data.source=csv", f"gen-data.files={named}", "gen-data.samples=2000")
    data = wristctl.gen_data(wristctl.load_study(None, *settings))
    own = ("train.preset=recommended", "train.workers=1", "train.train_share=0.6", f"train.inputs={inputs}")
    results = [wristctl.train(wristctl.load_study(None, f"seed={k}", *own), data=data) for k in range(SPLITS)]
    return [result for result in results if isinstance(result, Trained)]


def interval(values: Sequence[float]) -> str:
    """Mean over the splits with its 95 % interval (Student's t)."""
    mean, spread = float(np.mean(values)), float(stats.sem(values))
    half = spread * float(stats.t.ppf(0.975, len(values) - 1))
    return f"{mean:.3f} +- {half:.3f}"


def table(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Markdown."""
    return "\n".join(f"| {' | '.join(row)} |" for row in (heads, ["---"] * len(heads), *rows))


def rmse(angle: Array, true: Array) -> float:
    """[deg]"""
    return float(np.degrees(np.sqrt(np.mean((angle - true) ** 2))))


def elsewhere(networks: Sequence[Trained], other: pd.DataFrame) -> dict[str, list[float]]:
    """RMSE [deg] on another motion of what each split has found."""
    tip, theta = other[["tip_x", "tip_y"]].to_numpy(), other["theta"].to_numpy()
    found: dict[str, list[float]] = {"network": [], "polynomial": [], "exact inverse": []}
    for each in networks:
        rows = each.split.train
        polynomial = Polynomial.fit(each.samples.tip[rows], each.samples.theta[rows])
        for name, angle in (
            ("network", each.network.angle),
            ("polynomial", polynomial.angle),
            ("exact inverse", exact_angle),
        ):
            found[name].append(rmse(angle(tip), theta))
    return found


def target_of(measured: pd.DataFrame, degrees: float) -> tuple[float, float]:
    """Where the tip was, on average, when the measured angle was this [m]."""
    near = measured[np.abs(np.degrees(measured["theta"]) - degrees) < 0.5]
    return float(near["tip_x"].mean()), float(near["tip_y"].mean())


def arrived(run: Run, tip: tuple[float, float]) -> list[float]:
    """How far from the tip that was asked for each trial ended, by the true tip over its last second [mm]."""
    found = []
    directions = run.data("trials").set_index("trial")["direction"]
    for trial, own in courses(run).groupby("trial"):
        last = own[own["captured"] > own["captured"].max() - 1.0]
        side = 1.0 if directions[trial] == "ulnar" else -1.0
        off = last[["true_x", "true_y"]].mean().to_numpy() - np.array([tip[0], side * tip[1]])
        found.append(1e3 * float(np.hypot(*off)))
    return found


def picture(measured: pd.DataFrame, network: Network) -> Figure:
    """Errors over the angle, on the true tips of the trials: what of each inverse is no noise of the camera."""
    tip, theta = measured[["true_x", "true_y"]].to_numpy(), measured["true_theta"].to_numpy()
    figure = Figure(figsize=(7.0, 3.4), layout="constrained")
    axes = figure.subplots()
    for name, angle, colour in (("exact inverse", exact_angle, "#D55E00"), ("network", network.angle, "#0072B2")):
        axes.plot(
            np.degrees(theta), np.degrees(angle(tip) - theta), ".", ms=1.5, color=colour, label=name, rasterized=True
        )
    axes.axhline(0.0, color="0.5", lw=0.8)
    axes.set(xlabel="bending angle [deg]", ylabel="error of the angle [deg]")
    axes.legend(markerscale=6, loc="upper left")
    axes.grid(alpha=0.3)
    return figure


def main(folder: Path) -> None:
    """Trials, data, networks, trials again; the page's tables and the picture."""
    results, files = folder / "runs", folder / "files"
    files.mkdir(parents=True, exist_ok=True)
    performed(results, "optics", "hw", "calibrate", "camera")
    first = performed(results, "measure", *HW_RUN, "--set", SINE, "--set", "repetitions=3")
    other = performed(results, "daily", *HW_RUN, "--set", DAILY, "--set", "push.force=0")
    measured, daily = courses(first), courses(other)
    rows = []
    kept: list[Trained] = []
    for name, noise in (("as the camera measures", 0.0), (f"with {1e3 * TIP_NOISE:g} mm more in each tip", TIP_NOISE)):
        networks = trained(with_noise(measured, files / f"noise-{1e6 * noise:.0f}-um", noise), "tip")
        kept = kept or networks
        away = elsewhere(networks, daily)
        for inverse, begin in (("exact inverse", "exact_"), ("polynomial", "polynomial_"), ("network", "")):
            held = [each.metrics[f"{begin}rmse_deg"] for each in networks]
            rows.append([name, inverse, interval(held), interval(away[inverse])])
    heads = ["tips", "inverse", "held-out trials", "another motion"]
    data = performed(results, "data", "gen-data", "--source", "run", "--run", first.id, "--samples", "2000")
    own = ("--set", "preset=recommended", "--set", "train_share=0.6")
    net = performed(results, "network", "train", "--data", data.id, *own)
    closed = []
    for degrees in TARGETS:
        tip = target_of(measured, degrees)
        for inverse in ("exact", "network"):
            goal = f"reference={{tip: [{tip[0]:.5f}, {tip[1]:.5f}], inverse: {inverse}}}"
            given = ("--set", goal, "--set", "push.force=0", "--network", net.id)
            run = performed(results, f"{inverse}-{degrees:g}", *HW_RUN, *given)
            place = f"({1e3 * tip[0]:.1f}, {1e3 * tip[1]:.1f}) mm"
            closed.append([place, inverse, *(f"{each:.2f}" for each in arrived(run, tip))])
    true = measured[["true_x", "true_y"]].to_numpy()
    scatter = 1e3 * (measured[["tip_x", "tip_y"]].to_numpy() - true).std(axis=0)
    turning = float(np.degrees((measured["theta"] - measured["true_theta"]).std()))
    counted = f"{len(measured)} frames of {measured['trial'].nunique()} trials"
    told = (
        f"Measured: {counted}; the tip scatters by {scatter[0]:.3f} mm along and {scatter[1]:.3f} mm across, the angle "
        f"by {turning:.3f} deg. RMSE [deg] of the angle from the tip alone, mean over {SPLITS} ways to part the trials "
        "with its 95 % interval:"
    )
    ends = "A tip is asked for in trials of both directions; where the true tip ends, away from it [mm]:"
    text = "\n\n".join([told, table(heads, rows), ends, table(["tip", "inverse", "ulnar", "radial"], closed)])
    page = HERE / "measured-data.md"
    before, _, rest = page.read_text(encoding="utf-8").partition(BEGIN)
    page.write_text(f"{before}{BEGIN}\n{text}\n\n{END}{rest.partition(END)[2]}", encoding="utf-8")
    write_figure(HERE / "images" / "measured-data", picture(measured, kept[0].network))
    (HERE / "images" / "measured-data.svg").unlink()


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "build/measured-data"))
