"""The study of laws on a family in two planes, on three tendons: all tendons count, workers agree, it repeats."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import wristctl
from wristctl.commands.study.units import golden_of, places_in
from wristctl.study_files.load import load_study

pytestmark = [pytest.mark.slow, pytest.mark.painted]

SMALL = """
seed: 3
wrist: {tendons: three}
families:
  both:
    about: both planes in small
    loop: {plant_segments: 1}
    draw: {plant.stiffness: x0.7..1.3, reference.angle_deg: 10..25, reference.toward_deg: -180..180}
    references: [{kind: diagonal, duration: 0.3}, {kind: ellipse, turn: 0.8}]
    horizon: 1.0
study:
  controllers: [pd-ff, pid-ff]
  terms: {an integral: [pd-ff/tuned, pid-ff/tuned]}
  budgets:
    small: {candidates: 4, iterations: 2, finalists: 2, tunings: 2, draws: 2, validation: 2, worlds: 10, noises: 1}
"""


def test_a_study_in_two_planes_ranks_laws_and_says_why_and_again_to_the_hash(tmp_path: Path) -> None:
    file = tmp_path / "both.yaml"
    file.write_text(SMALL)
    study = load_study([file])
    done = wristctl.study(study, out=tmp_path / "one")
    ranking = done.rankings["both"]
    assert {row.measured.places for row in ranking.rows} == {3} and places_in(study, "both") == 3
    assert np.isfinite(ranking.scores).all() and done.answer is not None
    assert any("All loops of both bend in two planes: " in note for note in map(str, done.answer.notes))
    error = {label: ranking.means[k].value for k, label in enumerate(ranking.labels)}
    assert error["pid-ff/tuned"] < error["feedforward/default"], "feedback helps where springs are not as believed"
    again = wristctl.study(study, out=tmp_path / "two")
    assert done.run is not None and again.run is not None and done.run.result_hash == again.run.result_hash


def test_workers_agree_on_numbers_of_the_planes_that_they_compute_in() -> None:
    three, four = load_study([], ["wrist.tendons=three"]), load_study([])
    family = load_study([Path("experiments/scenarios/ideal.yaml")]).families["ideal"]
    settings = {"families": {"ideal": family}, "study": three.study.model_copy(update={"families": ("ideal",)})}
    of_three, of_four = (golden_of(one.model_copy(update=settings)) for one in (three, four))
    assert of_three.spec["planes"] == [2] and of_four.spec["planes"] == [1]
    assert of_three.expected != of_four.expected
