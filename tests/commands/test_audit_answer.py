"""The first screen of an audit says what the verdicts say, whichever way they come out, and fits a terminal."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from wristctl.commands.audit.answer import LINES, answer_of
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


def said(loops: Mapping[str, pd.DataFrame], trained: Metrics | None = None, strips: Any = ()) -> str:
    """The first screen in one line, having checked that it fits."""
    shown: dict[LoopCondition, pd.DataFrame] = {(name, 1.0): each for name, each in loops.items()}
    shown |= {(name, 0.7): each for name, each in loops.items()}
    trainings = {} if trained is None else {"table1": trained}
    lines = answer_of(judge_all(CLAIMS, Grounds(shown, trainings, None, 60.0)), strips, 60.0)
    assert len(lines) <= LINES and max(map(len, lines)) <= COLUMNS
    return " ".join(" ".join(lines).split())


def trained(best: set[str] = frozenset(), beaten: set[str] = frozenset(), dead: set[str] = frozenset()) -> Metrics:  # type: ignore[assignment]
    """A run of table1 with what it found of sigmoid in each way to train."""
    found = {str(claim.metric): {"value": 1.0, "n": 10} for claim in CLAIMS if claim.evidence == "table1"}
    for cell in CELLS:
        found[f"c16_{cell}-sigmoid_is_best"] = {"value": float(cell in best)}
        found[f"c16_{cell}-sigmoid_is_beaten"] = {"value": float(cell in beaten)}
        found[f"{cell}-sigmoid_median_r2"] = {"value": float(cell not in dead)}
    return found


NOTHING = {"smc/printed": 1.0, "smc/exchanged": 1.0, "pid/printed": 1.0}


def test_whatever_arrives_is_said_to_and_nothing_else() -> None:
    there, away = loop({}, {}), loop(NOTHING, dict.fromkeys(NOTHING, 0.5))
    everywhere = said(dict.fromkeys(LOOPS, there))
    nowhere = said(dict.fromkeys(LOOPS, away))
    assert everywhere.count("(SMC) with the printed gains on all loops") == 1
    assert nowhere.count("(SMC) with the printed gains on no loop") == 1
    assert "(a guess of ours) on all loops" in everywhere and "(a guess of ours) on no loop" in nowhere
    assert "its PID with the printed gains on all loops" in everywhere
    assert "its PID with the printed gains on no loop" in nowhere
    some = said({"exact": there, "sampled": loop({"smc/printed": 1.0}, {}), "four-segments": away})
    assert "(SMC) with the printed gains on exact alone" in some
    assert "(a guess of ours) on exact and sampled" in some


def test_the_printed_error_comes_out_where_it_does_and_beyond_the_tendons_strength_it_says_so() -> None:
    off = dict.fromkeys(NOTHING, 0.5)
    mixed = said({"exact": loop({}, {}, 1e5), "sampled": loop({}, {}), "four-segments": loop({}, off)})
    assert "for SMC as printed on exact and sampled (on exact with tensions that no tendon" in mixed
    alone = said({"exact": loop({}, {}, 1e5), "sampled": loop({}, off), "four-segments": loop({}, off)})
    assert "for PID as printed on exact alone (with tensions that no tendon" in alone
    sound = said(dict.fromkeys(LOOPS, loop({}, {})))
    assert "for PID as printed on all loops." in sound and "no tendon" not in sound
    assert "for PID as printed on no loop." in said(dict.fromkeys(LOOPS, loop({}, off)))


def test_the_ranking_is_that_of_the_numbers() -> None:
    printed = dict.fromkeys(LOOPS, loop({}, {}))
    assert "SMC has less RMSE than PID: as printed on all loops; with P1 and P2 exchanged on all loops." in said(
        printed
    )
    assert "cannot be judged" in said(printed) and "it holds on all loops." in said(printed)
    turned = loop({}, {"pid/printed": 1e-5})
    found = said({**printed, "four-segments": turned})
    assert "as printed on exact and sampled; with" in found and "it holds on exact and sampled." in found
    one_link = loop({}, {"gvsc/default": 0.09})
    assert "it holds on no loop." in said(dict.fromkeys(LOOPS, one_link)), "GVSC above NC alone breaks it"
    alike = said(dict.fromkeys(LOOPS, loop({}, {"smc/printed": 1.5e-3})))
    assert "as printed on no loop, as much as it on exact, sampled and four-segments" in alike


def test_the_networks_are_told_by_the_ways_to_train_them() -> None:
    loops = dict.fromkeys(LOOPS, loop({}, {}))
    assert "Not tested here: the table of networks (--table1 RUN)" in said(loops)
    none = said(loops, trained(beaten={"raw-coupled", "scaled-coupled", "scaled-decoupled"}, dead={"raw-coupled"}))
    assert "sigmoid is shown to be the most accurate in none, and another to be more accurate in 3." in none
    assert "Sigmoid does not learn (R^2 of 0.5) with raw inputs, coupled decay." in none
    assert "table of networks" not in none
    two = said(loops, trained(best={"raw-decoupled", "scaled-coupled"}))
    assert "in 2 (raw inputs, decoupled decay; scaled inputs, coupled decay)" in two
    assert "another to be more accurate in none" in two and "Sigmoid learns (R^2 of 0.5) in all of them." in two
    assert "most accurate in 4, and another" in said(loops, trained(best=set(CELLS)))


def test_what_cannot_be_told_is_what_is_judged_so() -> None:
    loops = dict.fromkeys(LOOPS, loop({}, {}))
    found = said(loops)
    cannot = found[found.index("Cannot be told") :].split(". ")[0]
    assert "the payload" in cannot and "global stability" not in cannot, "which here holds nowhere"
    tight = {name: each.assign(steady_state=1e-9 if name == "exact" else 0.1) for name, each in loops.items()}
    told = said(tight)
    assert "global stability" in told[told.index("Cannot be told") :].split(". ")[0], "here the loop decides"


def test_the_heaviest_claims_have_both_numbers_with_their_unit_and_what_fails_says_so() -> None:
    found = said(dict.fromkeys(LOOPS, loop({}, {"smc/printed": float("nan"), "pid/printed": 0.25})))
    assert "RMSE, SMC as printed 0.00027 rad fails fails fails" in found
    assert "RMSE, PID as printed 0.0015 rad 0.25 0.25 0.25" in found
    assert "RMSE, SMC exchanged 0.00027 rad 0.00027* 0.00027* 0.00027*" in found


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
def test_over_the_box_the_shares_are_told(share: float, told: str) -> None:
    strips = [strip("arrival", label, share) for label in ROWS[:3]] + [strip("together", "smc/exchanged", 0.02)]
    found = said(dict.fromkeys(LOOPS, loop(NOTHING, {})), trained(dead=set(CELLS)), strips)
    assert f"Of 200 settings that the paper may have had 30 deg are reached with SMC as printed in {told}" in found
    assert "within a factor of 1.5, with SMC exchanged in 2 %" in found
    assert "did not converge" not in found


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


def test_with_a_box_the_screen_still_says_what_cannot_be_told_and_what_is_contradicted() -> None:
    strips = [strip("arrival", label, 0.615, 17) for label in ROWS[:3]]
    strips += [strip("together", "smc/exchanged", 0.02, 9), strip("together", "pid/printed", 0.0, 12)]
    mixed = {"exact": loop({"smc/printed": 1.0}, {}, 1e5), "sampled": loop({}, {}), "four-segments": loop(NOTHING, {})}
    found = said(mixed, trained(dead=set(CELLS)), strips)
    places = [
        found.index(each) for each in ("are reached", "RMSE comes out", "Cannot be told", "Contradicted", "Of 200")
    ]
    assert places == sorted(places)
    assert "whatever is asked of them" in found and "RMSE, SMC as printed" in found


def test_without_loops_or_claims_there_is_no_sentence_about_them() -> None:
    text = [claim for claim in CLAIMS if claim.evidence == "text"]
    lines = answer_of(judge_all(text, Grounds()))
    assert not any("loop" in line or "RMSE" in line for line in lines[:-1]) and lines
