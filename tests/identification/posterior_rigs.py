"""Is a law that is said to be best with probability p on an identified wrist the best on it in p of all cases?

Each rig has a true wrist, drawn at random. One bench is identified from its trials; what a rig's trials tell is drawn
around the truth with that identification's correlations, and with its deviations times a factor, as fewer trials would
leave them. With what is known of all rigs beforehand it is the posterior (normal distributions both). Laws are ranked
on worlds of the posterior, which says p, and on the true wrist.
`python -m tests.identification.posterior_rigs --count 100` keeps what has ended, and goes on from there.
"""

from __future__ import annotations

import json
import re
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np

from tests.drawn_rigs import options, tried
from tests.identification.benches import KNOWN, START, TENDONS, logged, problem
from wristctl.arrays import Array
from wristctl.commands.compare.answer import best_on_yours
from wristctl.comparison.world_ranking import WorldRanking, rank
from wristctl.config.controller_row import Row
from wristctl.config.identify import IdentifySettings
from wristctl.identification.fit import Fit, fit
from wristctl.identification.intervals import Knowledge, inverse, knowledge
from wristctl.identification.posterior import FAMILY, posterior_draws, posterior_yaml
from wristctl.identification.problem import Problem
from wristctl.identification.unknowns import identified_yaml
from wristctl.study_files.load import load_study

SEED = 20261127
LAWS = ("pd-ff", "pid-ff", "pid-dob")
CAMERA, PERIOD = {"frame_rate": 60.0, "delay_frames": 2.0, "noise_deg": 0.05}, 0.01
# How much wrists differ from the one that was identified: standard deviations of the coordinates of a fit.
SPREAD = {"stiffness": 0.15, "damping": 0.2, "tendon_stiffness": 0.1, "friction": 0.03, "sheath_friction": 0.015,
          "presliding": 0.5, "delay": 2e-3, "tendon_radius": 0.01}  # fmt: skip
# Mean of the sheaths' friction: none of it would be an edge.
SHEATH = 0.04
# By how much trials may tell less than those that were identified.
LESS = (1.0, 6.0)
DRAWS, WORLDS = 200, 40
# Ends of the bins of p.
BINS = (0.0, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0)


class Judged(NamedTuple):
    """A rig: the law that is said to be best with which probability, and how it does on the true wrist."""

    law: str
    probability: float
    best: bool
    """Whether its mean error over all motions is the least on the true wrist."""
    share: float
    """Share of single motions there in which its error is the least."""


def identified(kept: Path) -> tuple[Array, Array, Array]:
    """Estimate, deviations and correlations of a rehearsed bench, of one pose and steps to one side."""
    file = kept / "identification.json"
    if not file.is_file():
        trials, _ = logged(3, poses=(KNOWN,), directions=("ulnar",))
        found = fit(problem(trials))
        told, free = knowledge(found), len(found.problem.free)
        parts = found.x[:free], told.deviation[:free], told.correlation[:free, :free]
        file.write_text(json.dumps([part.tolist() for part in parts]))
    x, deviation, correlation = (np.array(part) for part in json.loads(file.read_text()))
    return x, deviation, correlation


def judged(number: int, kept: Path) -> Judged:
    """What is said of a rig's laws, and what is true of them."""
    rng = np.random.default_rng([SEED, number])
    x, deviation, correlation = identified(kept)
    empty = Problem([], START, IdentifySettings.model_validate({"fix": {"flexion_ratio": 1.0}}), TENDONS)
    low, high = (np.asarray(bound)[: len(x)] for bound in empty.bounds())
    spread = np.array([SPREAD[name] for name in empty.free])
    x[empty.free.index("sheath_friction")] = SHEATH
    true = np.clip(x + spread * rng.standard_normal(len(x)), low, high)
    less = deviation * np.exp(rng.uniform(*np.log(LESS)))
    spoken = true + less * (np.linalg.cholesky(correlation + 1e-9 * np.eye(len(x))) @ rng.standard_normal(len(x)))
    precision = np.linalg.inv(correlation * np.outer(less, less))
    covariance = np.linalg.inv(precision + np.diag(spread**-2))
    estimate = np.clip(covariance @ (precision @ spoken + x / spread**2), low, high)
    deviation = np.sqrt(np.diag(covariance))
    found = Fit.__new__(Fit)
    object.__setattr__(found, "problem", empty)
    object.__setattr__(found, "x", estimate)
    told = Knowledge(deviation, inverse(covariance / np.outer(deviation, deviation)), 1.0, 0.0, 1.0, np.zeros(len(x)))
    values, draws = empty.values(estimate), posterior_draws(found, told, DRAWS, rng)
    file = kept / f"{number}.yaml"
    ranked = {}
    for name, rows in (("posterior", draws), ("true", [empty.values(true)])):
        file.write_text(identified_yaml(values, CAMERA) + posterior_yaml(rows, values, CAMERA, PERIOD))
        ranked[name] = _ranking(file, 2 * number + (name == "true"))
    file.unlink()
    words = re.match(r"(\S+) is best.* with probability ([\d.]+) ", best_on_yours([ranked["posterior"]]))
    assert words is not None
    law, actual = words[1], ranked["true"]
    scores, row = actual.scores, actual.labels.index(words[1])
    means = np.log(scores).mean(axis=1)
    return Judged(
        law, float(words[2]), bool(means[row] <= means.min()), float(np.mean(scores[row] <= scores.min(axis=0)))
    )


def _ranking(file: Path, seed: int) -> WorldRanking:
    """The ranking of the laws on the worlds of a study file."""
    study = load_study([file])
    rows = tuple(Row(controller=law, gains="hardware") for law in LAWS)
    worlds = study.compare.worlds.model_copy(update={"family": FAMILY, "draws": WORLDS})
    compare = study.compare.model_copy(update={"rows": rows, "worlds": worlds})
    (ranking,) = rank(study.model_copy(update={"compare": compare, "seed": seed}))
    return ranking


def table(results: list[Judged]) -> list[str]:
    """A line for each bin of p: rigs, mean p, how often that law is the best, and its share of single motions."""
    lines = ["      p      rigs  mean p  best on the true wrist  best in a motion there"]
    for low, high in pairwise(BINS):
        inside = [one for one in results if low <= one.probability < high or one.probability == high == 1.0]
        if inside:
            p, best, share = (float(np.mean(column)) for column in list(zip(*inside, strict=True))[1:])
            lines.append(f"{low:.1f} to {high:.1f}  {len(inside):4d}  {p:.2f}  {best:.2f}  {share:.2f}")
    return lines


def main() -> None:
    """Judge rigs, and say how often what is said is true."""
    asked = options(__doc__, 100, "posterior-rigs").parse_args()
    results = [Judged(**rig) for _, rig in tried(asked, lambda number: judged(number, asked.kept)._asdict())]
    print("\n".join(table(results)), flush=True)


if __name__ == "__main__":
    main()
