"""The chosen model's intervals have what terms change that the data neither want nor refuse."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from tests.identification.test_log_model import WRIST, planar
from wristctl.identification.arc_fit import ArcFit, fit_arcs
from wristctl.identification.arc_robot import ArcRecording
from wristctl.identification.log_model import everything_fitted, recordings_of_logs, robot_of_logs
from wristctl.identification.model_choice import TriedModel, whole_fit
from wristctl.identification.prediction_scores import Score


@pytest.fixture(scope="module")
def recordings() -> list[ArcRecording]:
    log = planar()
    return recordings_of_logs([log], robot_of_logs([log], WRIST, 0.01))


@pytest.fixture(scope="module")
def plain(recordings: list[ArcRecording]) -> ArcFit:
    return fit_arcs(robot_of_logs([planar()], WRIST, 0.01), (), recordings)


def with_term(plain: ArcFit, shift: float, ratio: Score) -> tuple[TriedModel, TriedModel, TriedModel]:
    """Elastic arcs alone, with slack that is unwanted, and with creep, which makes tendons stiffer by so much."""
    without = TriedModel((), (plain,), None)
    unknowns = len(plain.values)
    changed = np.insert(plain.x, unknowns, [0.1, 5.0])
    changed[list(plain.values).index("tendon")] += shift
    model = TriedModel(("creep",), (replace(plain, terms=("creep",), x=changed),), without)
    model.__dict__["ratio"] = ratio
    slack = TriedModel(("slack",), (plain,), without)
    slack.__dict__["ratio"] = Score(1.1, 1.05, 1.2, 8)
    return without, slack, model


@pytest.mark.parametrize("shift", [1.5, -3.0])
@pytest.mark.parametrize(("error", "likely"), [(1.0, 0.5), (0.98, 0.98), (1.01, 0.15)])
def test_a_term_that_is_not_told_widens_by_its_shift_as_likely_as_it_predicts_better(
    recordings: list[ArcRecording], plain: ArcFit, shift: float, error: float, likely: float
) -> None:
    models = with_term(plain, shift, Score(error, 0.98 * error, 1.02 * error, 8))
    assert models[2].verdict == "not told" and models[2].likely == pytest.approx(likely, abs=0.02)
    whole = whole_fit(models, everything_fitted(recordings))
    assert whole.left_open["tendon"] == pytest.approx(math.sqrt(models[2].likely) * abs(shift))
    bare = replace(whole, left_open={})
    for name in ("gain", "tendon"):
        half, alone = ((fit.told[name].high - fit.told[name].value) for fit in (whole, bare))
        added = 1.96 * whole.left_open[name]
        assert math.isinf(half) or half == pytest.approx(math.hypot(alone, added), rel=1e-3)
    assert whole.told["gain"] == bare.told["gain"]


@pytest.mark.parametrize(("error", "verdict"), [(0.9, "wanted"), (1.1, "unwanted")])
def test_a_term_on_which_the_data_decide_widens_nothing(
    recordings: list[ArcRecording], plain: ArcFit, error: float, verdict: str
) -> None:
    models = with_term(plain, 2.0, Score(error, 0.98 * error, 1.02 * error, 8))
    assert models[2].verdict == verdict
    assert not any(whole_fit(models, everything_fitted(recordings)).left_open.values())


def rival_of(
    plain: ArcFit, monkeypatch: pytest.MonkeyPatch, ratio: Score, more: float
) -> tuple[TriedModel, TriedModel, TriedModel]:
    """Arcs alone, a chosen model with inner friction, and one with creep that predicts by this ratio to the chosen."""
    without = TriedModel((), (plain,), None)
    unknowns = len(plain.values)
    chosen_x = np.insert(plain.x, unknowns, [0.06, 0.01])
    chosen = TriedModel(("inner friction",), (replace(plain, terms=("inner friction",), x=chosen_x),), without)
    rival_x = np.insert(plain.x, unknowns, [0.2, 5.0])
    rival_x[list(plain.values).index("tendon")] += more
    rival = TriedModel(("creep",), (replace(plain, terms=("creep",), x=rival_x),), without)
    for model, error in ((chosen, 0.7), (rival, 0.71), (without, 1.0)):
        model.__dict__["score"] = Score(error, 0.98 * error, 1.02 * error, 8)
        model.__dict__["ratio"] = Score(error, 0.9 * error, 1.1 * error, 8) if model.without else None
    ratios = {id(rival.fits): ratio, id(without.fits): Score(1.4, 1.3, 1.5, 8)}
    monkeypatch.setattr("wristctl.identification.model_choice.ratio_of", lambda fits, others: ratios[id(fits)])
    return without, chosen, rival


@pytest.mark.parametrize("more", [2.0, -1.0])
def test_a_rival_that_predicts_as_well_widens_what_it_shifts_and_the_amount_that_it_has_not(
    recordings: list[ArcRecording], plain: ArcFit, monkeypatch: pytest.MonkeyPatch, more: float
) -> None:
    models = rival_of(plain, monkeypatch, Score(1.0, 0.97, 1.03, 8), more)
    left_open = whole_fit(models, everything_fitted(recordings)).left_open
    assert left_open["tendon"] == pytest.approx(math.sqrt(0.5) * abs(more))
    assert left_open["inner_friction"] == pytest.approx(math.sqrt(0.5) * 0.06)
    assert left_open["gain"] == 0.0 == left_open["inner_presliding"]


def test_a_rival_that_predicts_worse_beyond_chance_widens_nothing(
    recordings: list[ArcRecording], plain: ArcFit, monkeypatch: pytest.MonkeyPatch
) -> None:
    models = rival_of(plain, monkeypatch, Score(1.05, 1.01, 1.09, 8), 2.0)
    assert not any(whole_fit(models, everything_fitted(recordings)).left_open.values())


def test_a_term_beside_another_model_than_the_chosen_one_widens_nothing(
    recordings: list[ArcRecording], plain: ArcFit
) -> None:
    without, slack, model = with_term(plain, 2.0, Score(1.0, 0.98, 1.02, 8))
    elsewhere = replace(model, without=replace(without, terms=("inner friction",)))
    elsewhere.__dict__["ratio"] = model.ratio
    assert not any(whole_fit([without, slack, elsewhere], everything_fitted(recordings)).left_open.values())
