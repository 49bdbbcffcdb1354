"""The answer of an audit says what the verdicts say, whichever way they come out, and fits a screen."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from wristctl.commands.answer import LINES, Answer
from wristctl.commands.audit.answer import answer_of
from wristctl.commands.printed_table import COLUMNS
from wristctl.comparison.claims import Grounds, LoopCondition, Metrics, judge_all
from wristctl.comparison.paper import T2
from wristctl.comparison.robust import Strip
from wristctl.config.audit import Claim
from wristctl.config.loop import LOOPS
from wristctl.study_files.load import load_study

LEDGER = Path(__file__).parents[2] / "experiments" / "claims.yaml"
CLAIMS = load_study([LEDGER]).audit.claims
ROWS = ("smc/printed", "smc/exchanged", "pid/printed", "mrac/default", "gvsc/default", "nc/default")
CELLS = ("raw-coupled", "raw-decoupled", "scaled-coupled", "scaled-decoupled")


def loop(missing: Mapping[str, float], rmse: Mapping[str, float], peak: float = 10.0) -> pd.DataFrame:
    """What a comparison found on one loop, on both moves alike; rows that are not named arrive with T2's RMSE."""
    rows = []
    for label in ROWS:
        law, gains = label.split("/")
        for seconds in (1, 2):
            row: dict[str, str | float] = {
                "controller": law,
                "gains": gains,
                "reference": f"minimum jerk {seconds} s 30 deg",
            }
            row |= {"missing": missing.get(label, 0.0), "rmse": rmse.get(label, T2[law].rmse), "rmse_move": 1e-9}
            rows.append(row | {"settling_after": 0.0, "steady_state": T2[law].steady_state, "peak_tension": peak})
    return pd.DataFrame(rows)


def answered(loops: Mapping[str, pd.DataFrame], trained: Metrics | None = None, strips: Any = ()) -> Answer:
    """The answer, having checked that it fits."""
    shown: dict[LoopCondition, pd.DataFrame] = {(name, 1.0): each for name, each in loops.items()}
    shown |= {(name, 0.7): each for name, each in loops.items()}
    trainings = {} if trained is None else {"table1": trained}
    answer = answer_of(judge_all(CLAIMS, Grounds(shown, trainings, None, 60.0)), strips, 60.0)
    lines = answer.lines()
    assert len(lines) <= LINES and max(map(len, lines)) <= COLUMNS
    return answer


def said(loops: Mapping[str, pd.DataFrame], trained: Metrics | None = None, strips: Any = ()) -> str:
    """The answer in one line."""
    return " ".join(" ".join(answered(loops, trained, strips).lines()).split())


def sentence(text: str, *words: str) -> str:
    """The one sentence with all of these words."""
    (found,) = [each for each in re.split(r"(?<=[a-z)%])\. ", text) if all(word in each for word in words)]
    return found


def trained(best: set[str] = frozenset(), beaten: set[str] = frozenset(), dead: set[str] = frozenset()) -> Metrics:  # type: ignore[assignment]
    """A run of table1 with what it found of sigmoid in each way to train."""
    found = {str(claim.metric): {"value": 1.0, "n": 10} for claim in CLAIMS if claim.evidence == "table1"}
    for cell in CELLS:
        found[f"c16_{cell}-sigmoid_is_best"] = {"value": float(cell in best)}
        found[f"c16_{cell}-sigmoid_is_beaten"] = {"value": float(cell in beaten)}
        found[f"{cell}-sigmoid_median_r2"] = {"value": float(cell not in dead)}
    return found


NOTHING = {"smc/printed": 1.0, "smc/exchanged": 1.0, "pid/printed": 1.0}


SMC, SWAPPED, PID = "(SMC)", "SMC with P1 and P2 exchanged", "PID with the paper"


@pytest.mark.slow
def test_each_loop_is_named_by_what_it_is() -> None:
    answer = answered(dict.fromkeys(LOOPS, loop({}, {})))
    assert answer.table is not None
    heads = answer.table.columns[2:-1]
    assert len(set(heads)) == len(LOOPS) and not {"exact", "default"} & set(heads)
    first = answer.sentence.split(". ")[0]
    assert all(head in first for head in heads) and "any tension" in first and "60 N" in first


@pytest.mark.slow
def test_whatever_arrives_is_said_to_and_nothing_else() -> None:
    names = list(LOOPS)
    there, away = loop({}, {}), loop(NOTHING, dict.fromkeys(NOTHING, 0.5))
    everywhere, nowhere = said(dict.fromkeys(LOOPS, there)), said(dict.fromkeys(LOOPS, away))
    for who in (SMC, SWAPPED + " (", PID):
        assert "on all loops" in sentence(everywhere, who, "arrives")
        assert re.search(r"arrives( \(.*\))? on no loop$", sentence(nowhere, who, "arrives"))
    some = said({names[0]: there, names[1]: loop({"smc/printed": 1.0}, {}), names[2]: away})
    assert "%) on the ideal loop only" in sentence(some, SMC)
    assert "arrives on the ideal and sampled loops" in sentence(some, SWAPPED + " (")


@pytest.mark.slow
def test_the_printed_error_comes_out_where_it_does_and_beyond_the_tendons_strength_it_says_so() -> None:
    off = dict.fromkeys(NOTHING, 0.5)
    ideal, sampled, segments = LOOPS
    mixed = sentence(said({ideal: loop({}, {}, 1e5), sampled: loop({}, {}), segments: loop({}, off)}), SMC)
    assert "on the ideal and sampled loops" in mixed and mixed.endswith("no tendon bears on the ideal loop")
    alone = said({ideal: loop({}, {}, 1e5), sampled: loop({}, off), segments: loop({}, off)})
    assert re.search("RMSE on the ideal loop only, .*no tendon bears$", sentence(alone, PID))
    sound = said(dict.fromkeys(LOOPS, loop({}, {})))
    assert "RMSE on all loops" in sentence(sound, PID) and "no tendon" not in sound
    assert "RMSE on no loop" in sentence(said(dict.fromkeys(LOOPS, loop({}, off))), PID)


@pytest.mark.slow
def test_the_ranking_is_that_of_the_numbers() -> None:
    printed = dict.fromkeys(LOOPS, loop({}, {}))
    last = list(LOOPS)[-1]
    assert sentence(said(printed), "smaller RMSE").count("on all loops") == 2
    assert "on all loops" in sentence(said(printed), "our designs")
    found = said({**printed, last: loop({}, {"pid/printed": 1e-5})})
    assert sentence(found, "smaller RMSE").count("on the ideal and sampled loops") == 2
    assert "on the ideal and sampled loops" in sentence(found, "our designs")
    one_link = said(dict.fromkeys(LOOPS, loop({}, {"gvsc/default": 0.09})))
    assert "on no loop" in sentence(one_link, "our designs"), "GVSC above NC alone breaks it"
    alike = sentence(said(dict.fromkeys(LOOPS, loop({}, {"smc/printed": 1.5e-3}))), "smaller RMSE")
    assert "on no loop, with equal errors on the ideal, sampled and 4-segment loops with the paper's" in alike
    differ = loop({}, {})
    differ.loc[(differ["gains"] == "exchanged") & differ["reference"].str.contains(" 2 s"), "rmse"] = 1.0
    told = sentence(said({**printed, last: differ}), "smaller RMSE")
    within = "on the ideal and sampled loops, in one of two moves on the 4-segment loop with P1 and P2 exchanged"
    assert told.endswith(within)


@pytest.mark.slow
def test_an_error_below_the_papers_is_told_apart_from_one_above() -> None:
    ideal, sampled, segments = LOOPS
    found = {ideal: loop({}, {"pid/printed": 1e-9}), sampled: loop({}, {}), segments: loop({}, {"pid/printed": 0.5})}
    assert "on the sampled loop only (less on the ideal loop)" in sentence(said(found), PID)
    above = {**found, ideal: loop({}, {"pid/printed": 0.5})}
    assert "less" not in sentence(said(above), PID)


@pytest.mark.slow
def test_soft_springs_are_told_by_what_they_add() -> None:
    stiff = dict.fromkeys(LOOPS, loop({}, {}))
    assert "On no loop springs of 70 % stiffness" in said(stiff), "both stiffnesses have one error"
    shown: dict[LoopCondition, pd.DataFrame] = {(name, 1.0): loop({}, {}) for name in LOOPS}
    shown |= {(name, 0.7): loop({}, {"smc/exchanged": 0.157}) for name in LOOPS}
    judged = judge_all(CLAIMS, Grounds(shown, {}, None, 60.0))
    assert "On all loops springs of 70 % stiffness (ours) add the paper's 9 deg." in " ".join(
        map(str, answer_of(judged, (), 60.0).notes)
    )
    added = dict(zip(LOOPS, (0.157, 1e-3, 1.0), strict=True))
    shown |= {(name, 0.7): loop({}, {"smc/exchanged": error}) for name, error in added.items()}
    told = " ".join(map(str, answer_of(judge_all(CLAIMS, Grounds(shown, {}, None, 60.0)), (), 60.0).notes))
    assert "On the ideal loop only springs of 70 %" in told


@pytest.mark.slow
def test_the_networks_are_told_by_the_ways_to_train_them() -> None:
    loops = dict.fromkeys(LOOPS, loop({}, {}))
    assert "--table1 RUN" in said(loops)
    none = said(loops, trained(beaten={"raw-coupled", "scaled-coupled", "scaled-decoupled"}, dead={"raw-coupled"}))
    assert "sigmoid is shown to be the most accurate in none, and another to be more accurate in 3." in none
    assert "Sigmoid does not learn (R^2 of 0.5) with raw inputs, coupled decay." in none
    assert "--table1 RUN" not in none and "--selection RUN" in none
    two = said(loops, trained(best={"raw-decoupled", "scaled-coupled"}))
    assert "in 2 (raw inputs, decoupled decay; scaled inputs, coupled decay)" in two
    assert "another to be more accurate in none" in two and "Sigmoid learns (R^2 of 0.5) in all of them." in two
    assert "most accurate in 4, and another" in said(loops, trained(best=set(CELLS)))


@pytest.mark.slow
def test_what_cannot_be_told_is_what_is_judged_so() -> None:
    loops = dict.fromkeys(LOOPS, loop({}, {}))
    cannot = sentence(said(loops), "too little")
    assert "the payload" in cannot and "global stability" not in cannot, "which here holds nowhere"
    first = next(iter(LOOPS))
    tight = {name: each.assign(steady_state=1e-9 if name == first else 0.1) for name, each in loops.items()}
    assert "global stability" in sentence(said(tight), "too little"), "here the loop decides"


@pytest.mark.slow
def test_the_heaviest_claims_have_both_numbers_in_degrees_and_where_they_agree() -> None:
    ideal, sampled, segments = LOOPS
    fails, off = loop({}, {"smc/printed": float("nan"), "pid/printed": 0.25}), loop({}, {"smc/exchanged": 0.5})
    answer = answered({ideal: fails, sampled: loop({}, {}), segments: off})
    assert answer.table is not None and "[deg]" in answer.table.title and len(answer.table.rows) == 5
    printed, exchanged, pid, *_ = (list(row[1:]) for row in answer.table.rows)
    assert printed == ["0.015", "fails", "0.015", "0.015", "sampled, 4-segment"]
    assert exchanged == ["0.015", "0.015", "0.015", "29", "ideal, sampled"]
    assert pid == ["0.086", "14", "0.086", "0.086", "sampled, 4-segment"]
    whole = answered(dict.fromkeys(LOOPS, loop({}, {}))).table
    assert whole is not None and whole.rows[0][-1] == "all loops" and whole.rows[-1][-1] == "no loop"
    for row in whole.rows:
        assert row[0] in whole.text(COLUMNS), "nothing is cut off"


@pytest.mark.slow
def test_a_range_of_errors_and_another_unit_are_told_as_they_are() -> None:
    moves = loop({}, {})
    moves["rmse"] = moves["rmse"].where(moves["reference"].str.contains(" 1 s"), 1e-9)
    table = answered(dict.fromkeys(LOOPS, moves)).table
    assert table is not None and table.rows[0][2] == "<0.001 to 0.015"
    weighed = [claim.model_copy(update={"weight": 6}) if claim.id == "T2-smc-settling" else claim for claim in CLAIMS]
    shown: dict[LoopCondition, pd.DataFrame] = {(name, 1.0): loop({}, {}) for name in LOOPS}
    mixed = answer_of(judge_all(weighed, Grounds(shown))).table
    assert mixed is not None and "[deg]" not in mixed.title
    assert mixed.rows[0][0].endswith("[s]") and mixed.rows[0][1] == "1.2"
    assert mixed.rows[1][0].endswith("[deg]") and mixed.rows[1][1] == "0.015"


def test_no_id_of_a_claim_is_on_the_first_screen() -> None:
    found = said(dict.fromkeys(LOOPS, loop({}, {})), trained(dead=set(CELLS)))
    words = set(found.replace(",", " ").replace(":", " ").split())
    assert not words & {claim.id for claim in CLAIMS}


def strip(evidence: str, label: str, share: float, left: int = 0) -> Any:
    """Over 200 settings, of which so many did not converge."""
    law, gains = label.split("/")
    claim = Claim.model_validate({"id": "A", "says": "", "evidence": evidence, "controller": law, "gains": gains})
    held = round((200 - left) * share)
    verdicts = ["reproduced"] * held + ["does not hold"] * (200 - left - held) + [None] * left
    return Strip(claim, None, verdicts, [], None, "")  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("share", "told"), [(0.0, "0 %"), (0.005, "0.5 %"), (0.615, "62 %"), (0.995, "99 %"), (1.0, "100 %")]
)
@pytest.mark.slow
def test_over_the_box_the_shares_are_told(share: float, told: str) -> None:
    strips = [strip("arrival", label, share) for label in ROWS[:3]] + [strip("together", "smc/exchanged", 0.02)]
    found = said(dict.fromkeys(LOOPS, loop(NOTHING, {})), trained(dead=set(CELLS)), strips)
    box = sentence(found, "Of 200 settings")
    assert box.count(f" in {told}") == 3 and "factor of 1.5, with SMC with P1 and P2 exchanged in 2 %" in box
    assert "did not converge" not in found


@pytest.mark.slow
def test_what_the_box_says_comes_with_what_must_be_known_of_it() -> None:
    """How many settings are not counted, and that some wrists rest at 30 deg whatever is asked of them."""
    loops = dict.fromkeys(LOOPS, loop(NOTHING, {}))
    arrives, away = strip("arrival", "smc/exchanged", 0.5), strip("arrival", "smc/printed", 0.0)
    for found in (said(loops, None, [arrives]), said(loops, None, [away, arrives])):
        assert "whatever is asked of them" in found
    assert "whatever is asked of them" not in said(loops, None, [away])
    open_ = [strip("arrival", "smc/exchanged", 0.5, left) for left in (3, 11)]
    assert "(11 did not converge and are not counted" in said(loops, None, open_[1:])
    both = said(loops, None, open_)
    assert "3 to 11 did not converge" in both and "50 %" in both, "of those that did"
    assert "in no setting that converged" in said(loops, None, [strip("arrival", "smc/exchanged", 0.5, 200)])


@pytest.mark.slow
def test_with_a_box_the_screen_still_says_what_cannot_be_told_and_what_is_contradicted() -> None:
    strips = [strip("arrival", label, 0.615, 17) for label in ROWS[:3]]
    strips += [strip("together", "smc/exchanged", 0.02, 9), strip("together", "pid/printed", 0.0, 12)]
    ideal, sampled, segments = LOOPS
    away = loop(NOTHING, dict.fromkeys(NOTHING, 0.5))
    mixed = {ideal: loop({"smc/printed": 1.0}, {"smc/printed": 0.5}, 1e5), sampled: away, segments: away}
    answer = answered(mixed, trained(dead=set(CELLS)), strips)
    notes = " ".join(map(str, answer.notes))
    places = [notes.index(each) for each in ("Of 200", "contradict", "too little")]
    assert places == sorted(places) and "whatever is asked of them" in notes
    assert answer.table is not None and len(answer.table.rows) == 3


def test_without_loops_there_is_no_sentence_and_no_table_about_them() -> None:
    text = [claim for claim in CLAIMS if claim.evidence == "text"]
    answer = answer_of(judge_all(text, Grounds()))
    assert answer.table is None and answer.sentence
    assert not any("loops" in str(note) or "RMSE" in str(note) for note in answer.notes) and answer.notes


@pytest.mark.parametrize(("lines", "apart", "kept"), [(5, True, 3), (27, False, 3), (29, False, 2), (31, False, 0)])
def test_what_ends_an_answer_stands_apart_then_together_then_loses_its_last_sentences(
    lines: int, apart: bool, kept: int
) -> None:
    """On a screen of 32 lines; a sentence fills a line, and an empty one stands before each paragraph."""
    sentences = [f"{letter * (COLUMNS - 10)}." for letter in "abc"]
    answer = Answer("It is so.", None, [f"$ {k}" for k in range((lines - 1) // 2)])
    assert len(answer.lines()) == lines
    ended = answer.ending(sentences)
    added = ended.notes[len(answer.notes) :]
    assert added == (sentences if apart else [" ".join(sentences[:kept])] if kept else [])
    assert ended.fits
