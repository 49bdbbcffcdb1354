"""The answer of a comparison: what to use where, what not and why, what of the paper holds, on one screen."""

from __future__ import annotations

import re
from dataclasses import replace
from unittest.mock import patch

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from wristctl.commands.answer import LINES
from wristctl.commands.compare.answer import answer_of, head_with_the_best, presets_of_names
from wristctl.commands.printed_table import COLUMNS, two
from wristctl.commands.ranking_answer import DIGITS, advice, condition, names_of, not_to_use, winner
from wristctl.commands.ranking_tables import answer_tables, controllers_table, standings_table
from wristctl.commands.results import Findings
from wristctl.comparison.combinations import CLASSES
from wristctl.comparison.controller_ranking import Ranking, Traits
from wristctl.comparison.model_confidence_set import LEAST_PAIRS
from wristctl.comparison.tie_groups import standing

RMSE = {
    "mrac/default": 1e-4, "smc/exchanged": 4e-3, "smc/printed": 0.3, "pid/printed": 3e-3, "gvsc/default": 5e-3,
    "nc/default": 2e-3, "feedforward/default": 1e-1, "pd-ff/default": 1e-3, "pid-ff/default": 5e-4,
}  # fmt: skip
TRAITS = {
    "camera and tendons": Traits(True, True, True),
    "pushed": Traits(load=True),
    "off-nominal": Traits(unknown=True),
}


def stands(
    name: str = "sampled",
    rmse: dict[str, float] | None = None,
    swings: tuple[str, ...] = (),
    away: tuple[str, ...] = (),
    strained: tuple[str, ...] = (),
    motions: int = 12,
    chatters: tuple[str, ...] = (),
    unconverged: tuple[str, ...] = (),
    failed: dict[str, int] | None = None,
    waits: dict[str, float] | None = None,
) -> Ranking:
    """Rows on so many motions, each its RMSE times what all share; `failed` rows in the first so many motions.

    `waits` is the share of time at the motors' limits, where it is known.
    """
    errors = RMSE if rmse is None else rmse
    rng = np.random.default_rng(5)
    shared, own = rng.normal(0.0, 0.5, motions), 0.02 * rng.standard_normal((len(errors), motions))
    scores = np.array(list(errors.values()))[:, None] * np.exp(shared + own)
    labels = list(errors)
    for label, count in (failed or {}).items():
        scores[labels.index(label), :count] = np.inf
    swing = np.array([0.05 if label in swings else 0.0 for label in labels])
    peak = np.array([70.0 if label in strained else 0.0 for label in labels])
    short = np.array([motions if label in away else 0 for label in labels])
    slams = np.array([300.0 if label in chatters else 0.0 for label in labels])
    drifts = np.array([label in unconverged for label in labels])
    holds = {"limit cycle": swing > 0.0, "chatters": slams > 0.0, "not converged": drifts}
    swinging = np.repeat(np.any(list(holds.values()), axis=0)[:, None], motions, axis=1)
    steps = name.endswith(", steps")
    return Ranking(
        name=name, unit="case", labels=labels, scores=scores,
        standing=standing(scores, swinging, 0, short=short > 0, unphysical=peak > 0.0),
        swing=swing, chatter=slams, peak=peak, away=short, motions=motions, loops=["a"],
        unsound={kind: np.isfinite(scores).sum(axis=1) * flags for kind, flags in holds.items()},
        traits=TRAITS.get(name.removesuffix(", steps"), Traits())._replace(jumps=steps),
        at_limit={} if waits is None else {"tensions": np.zeros(len(labels)),
                                           "motors": np.array([waits.get(label, 0.0) for label in labels])},
    )  # fmt: skip


def test_where_all_that_tie_wait_for_their_motors_it_is_said_that_motors_decide() -> None:
    """Not where one of them does not, nor where the best is alone; the share at a limit is told in any case."""
    alike = {"mrac/default": 1e-3, "pid-ff/default": 1e-3, "feedforward/default": 1e-2}
    apart = alike | {"pid-ff/default": 3e-3}
    slow, one = dict.fromkeys(alike, 0.4), {"mrac/default": 0.4, "pid-ff/default": 0.02}
    for errors, waits, motors in ((alike, slow, True), (alike, one, False), (apart, slow, False)):
        found = stands("camera and tendons", errors, waits=waits)
        assert (len(found.standing.groups[0]) > 1) == (errors is alike)
        assert found.motors_decide == motors and ("motors decide" in told(found)) == motors
        assert "of the best: tensions 0 %, motors" in told(found)
        assert "of the best: motors + camera tensions 0 %, motors" in told(found, stands("ideal", errors, waits={}))
    for waits, motors in ((dict.fromkeys(alike, 0.4), True), ({}, False)):
        useless = stands("camera and tendons", alike, away=tuple(alike), waits=waits)
        assert not useless.standing.groups and ("motors decide" in told(useless)) == motors
    assert "at a limit" not in told(stands())
    assert "of the best: none." in told(stands(waits={}))


def told(*rankings: Ranking) -> str:
    """The answer in one line, with all its notes however long it is."""
    with patch("wristctl.commands.answer.LINES", 99):
        answer = answer_of(rankings)
    assert answer is not None
    return " ".join(" ".join(answer.lines()).split())


def test_the_rig_is_answered_first_and_what_is_best_elsewhere_is_warned_of_where_it_swings() -> None:
    rig = stands("camera and tendons", swings=("mrac/default", "pid/printed"))
    said = told(stands(), rig, stands("pushed"))
    assert said.index("use pid-ff/default") < said.index("use mrac/default")
    assert "(sampled and push), use mrac/default" in said
    warned = said[said.index("use mrac/default") :]
    assert "Do not use mrac/default in motors + camera: it swings 5.7 deg peak to peak in 12 of 12 cases." in warned
    assert "Do not use: in motors + camera mrac and pid/printed." in said


def test_the_page_and_the_listing_are_headed_by_the_condition_that_the_answer_speaks_of_first() -> None:
    usual, pushed = {"pid-ff/default": 1e-3, "mrac/default": 2e-3}, {"pid-ff/default": 3e-3, "mrac/default": 2e-3}
    rig, steps = stands("camera and tendons", usual), stands("camera and tendons, steps", usual)
    findings = Findings(0)
    head_with_the_best(findings, [stands("exact", usual), rig, steps])
    assert findings.overview.cards == ["best_camera_and_tendons", "best_exact", "best_camera_and_tendons_steps"]
    assert next(iter(findings.metrics)) == "best_exact"
    others = [stands("exact", pushed), stands("sampled", usual), stands("off-nominal", usual)]
    head_with_the_best(findings, others)
    assert findings.overview.cards == ["best_sampled", "best_off-nominal", "best_exact"], "where what it uses is best"
    head_with_the_best(findings, [stands("exact", usual), stands("camera and tendons", swings=tuple(RMSE))])
    assert findings.overview.cards == ["best_exact"], "of a condition without a usable one there is none"


def test_every_fault_is_named_with_its_size_and_its_number_of_cases() -> None:
    one = stands(
        swings=("smc/exchanged",), away=("smc/printed",), strained=("gvsc/default",), chatters=("pid/printed",),
        unconverged=("nc/default",), failed={"pd-ff/default": 5},
    )  # fmt: skip
    cells = {
        "smc/exchanged": "swings 5.7 deg in 12 of 12", "smc/printed": "stops short in 12 of 12",
        "gvsc": "pulls 70 N in 12 of 12", "pid/printed": "chatters 300/s in 12 of 12",
        "nc": "depends on step in 12 of 12", "pd-ff": "fails in 5 of 12",
    }  # fmt: skip
    rows = controllers_table([one], names_of([one])).rows
    assert {name: cell for name, cell in rows if not cell[0].isdigit()} == cells
    everyone = {label.split("/default")[0]: cell for label, cell in standings_table([one]).rows}
    assert {name: everyone[name] for name in cells} == cells
    both = stands(swings=("pd-ff/default",), failed={"pd-ff/default": 5})
    fault = both.fault(both.labels.index("pd-ff/default"))
    assert fault is not None and (fault.kind, fault.times) == ("fails", 5), "of two faults the graver one"
    assert stands().fault(0) is None


def test_a_controller_is_a_line_and_a_condition_a_column_in_the_order_that_was_typed() -> None:
    """The error with its interval; the best and what ties with it marked."""
    typed = {"pid-ff": 2e-3, "adrc/hardware": 1e-3, "mine": 1e-3, "pid/printed": 0.1}
    one, other = stands(rmse=typed), stands("pushed", rmse=typed | {"pid-ff": 1e-4}, swings=("mine",))
    table = controllers_table([one, other], names_of([one, other]))
    assert table.columns == ("controller", "sampled (12)", "push (12)")
    drawn = replace(one, unit="world")
    for rankings, counted in (([one, other], "; (n): motions"), ([drawn], "; (n): worlds"), ([one, drawn], "tied")):
        assert str(controllers_table(rankings, names_of(rankings)).title).endswith(counted)
    assert [row[0] for row in table.rows] == list(typed)
    assert names_of([one, other])["adrc/hardware"] == "adrc/hardware", "adrc alone would be another row"
    first = one.labels[winner(one, [one, other]) or 0]
    for label, cells in zip(typed, [row[1:] for row in table.rows], strict=True):
        for ranking, cell in zip((one, other), cells, strict=True):
            mean, tied = ranking.means[one.labels.index(label)], ranking is one and label in ("adrc/hardware", "mine")
            mark = " *" if label == (first if ranking is one else "pid-ff") else " =" * tied
            ends = f" [{two(np.degrees(mean.low))}, {two(np.degrees(mean.high))}]"
            swings = ranking is other and label == "mine"
            assert cell == (
                "swings 5.7 deg in 12 of 12" if swings else f"{two(np.degrees(mean.value), DIGITS)}{ends}{mark}"
            )
    given = controllers_table([stands()], names_of([stands()]))
    assert "more" not in given.title


def test_a_name_alone_is_told_with_its_preset_under_each_condition() -> None:
    """Behind motors and camera the one for them; what has no such preset is named, and what was typed whole is not."""
    typed = {"pid-ff": 2e-3, "smc": 1e-3, "mine": 1e-3, "feedforward": 0.1, "adrc/hardware": 1e-3}
    exact, rig = stands(rmse=typed), stands("camera and tendons", rmse=typed)
    default, hardware = {"pid-ff/default": {"Kp": 1.0}}, {"pid-ff/hardware": {"Kp": 5.0}}
    one = {"mine/default": {"k": 1.0}}
    gains = {
        **default,
        **hardware,
        "smc/printed": {"P1": 1.0},
        "smc/hardware": {"P1": 2.0},
        **one,
        "feedforward/default": {},
    }
    said = presets_of_names([exact, rig], gains | {"adrc/hardware": {"wc": 30.0}})
    assert "hardware in motors + camera, default elsewhere (smc printed; mine default in all)" in said
    assert "adrc" not in said and "feedforward" not in said
    assert "preset hardware:" in presets_of_names([rig], hardware) and "preset default:" in presets_of_names(
        [exact], default
    )
    assert not presets_of_names([stands()], {"pid-ff/default": {"Kp": 1.0}}), "none was typed by its name alone"


def test_that_no_gains_are_tuned_is_said_of_the_rows_that_it_is_true_of() -> None:
    alone = {"smc": 1e-3, "pid-ff": 2e-3, "feedforward": 0.1}
    gains = {"smc/default": {"P1": 1.0}, "pid-ff/default": {"Kp": 1.0}, "ct-dob/tuned": {"w": 30.0}}
    said = presets_of_names([stands(rmse=alone)], gains)
    assert "none is tuned" in said and "smc" not in said
    said = presets_of_names([stands(rmse=alone | {"ct-dob/tuned": 1e-3})], gains)
    assert "(smc and pid-ff)" in said and "none" not in said and "ct-dob" not in said


def test_gains_by_value_have_a_short_name_where_the_controller_has_one_row_of_them() -> None:
    first, other, third = "pid-ff/Kp=7.2346 Kd=0.144692 Ki=86.8152", "pid-ff/Kp=1", "ct-dob/w=35 zeta=0.6 wo=300"
    gains = {first: {"Kp": 7.2346, "Kd": 0.144692, "Ki": 86.8152}, third: {"w": 35.0}}
    answer = answer_of([stands(rmse={first: 1e-3, third: 2e-3, "smc/default": 3e-3})], gains=gains, asked=[first])
    assert answer is not None and answer.table is not None
    assert [row[0] for row in answer.table.rows] == ["pid-ff/given", "ct-dob/given", "smc/default"]
    assert "use pid-ff/given: RMSE" in answer.sentence
    said = " ".join(" ".join(answer.lines()).split())
    assert "pid-ff/given has Kp = 7.235 N m/rad" in said and "given by value" in said
    several = answer_of([stands(rmse={first: 1e-3, other: 2e-3, third: 3e-3})])
    assert several is not None and "use pid-ff/Kp=7.2346" in several.sentence and several.table is not None
    assert [row[0] for row in several.table.rows][1:] == ["pid-ff/Kp=1", "ct-dob/given"]


def test_beyond_a_dozen_the_table_has_the_best_the_asked_for_and_the_number_of_the_rest() -> None:
    many = {f"c{number:02d}/default": 1e-3 * (1.0 + number) for number in range(30)}
    one, other = stands(rmse=many), stands("pushed", rmse=many | {"c29/default": 1e-5})
    names = names_of([one, other])
    table = controllers_table([one, other], names, ["c20/default"])
    shown = [row[0] for row in table.rows]
    assert len(shown) == 12 and {"c00", "c20", "c29"} <= set(shown) and shown == sorted(shown)
    assert table.title.endswith("; 18 more controllers: --all")
    assert all("[" in cell for row in table.rows for cell in row[1:]), "intervals, where there is room for them"
    five = [stands(name, rmse=many) for name in CLASSES]
    narrow = controllers_table(five, names)
    assert len(narrow.rows) == 12 and not any("[" in cell for row in narrow.rows for cell in row[1:])
    few = [stands(name, rmse=dict(list(many.items())[:5])) for name in CLASSES]
    for table in (narrow, controllers_table(few, names_of(few))):  # a short table alone goes on below
        assert len(table.within(COLUMNS).columns) == len(table.columns)
    asked = controllers_table([one, other], names, list(many)[:15])
    assert [row[0] for row in asked.rows] == sorted([*(f"c{number:02d}" for number in range(15)), "c29"])
    assert asked.title.endswith("; 14 more controllers: --all")


def test_the_sentence_says_by_how_much_and_where_not() -> None:
    rows = {"a/default": 1e-4, "b/default": 4e-3, "c/default": 0.1}
    one, other = stands(rmse=rows), stands("pushed", rmse=rows | {"a/default": 0.05})
    ratio = one.means[1].value / one.means[0].value
    assert f", {two(ratio, DIGITS)} times less than b/default, the next." in told(one)
    assert "In push use b/default." in told(one, other)
    swings = stands("pushed", rmse=rows, swings=("a/default",))
    said = told(one, stands("off-nominal", rmse=rows), swings)
    assert (
        "Do not use a/default in push: it swings 5.7 deg peak to peak in 12 of 12 cases." in said
        and "In push use" not in said
    )
    best = {"f1": "a", "f2": "a", "f3": "b", "f4": "c", "f5": "d"}
    several = [stands(name, rmse=rows | {"d/default": 0.2, f"{law}/default": 1e-5}) for name, law in best.items()]
    assert advice(several).endswith(" Others are better in f3, f4 and f5.")
    assert advice(several).startswith("With exact angles and torques (f1 and f2), use a/default: RMSE ")


def test_of_several_conditions_the_least_lead_over_the_next_is_told() -> None:
    """Where the next is another in each, it is the one behind the least lead; without a next there is no lead."""
    apart = {"a/default": 1e-4, "b/default": 1e-3, "last/default": 1e-1}
    one, other = stands(rmse=apart), stands("pushed", rmse=apart | {"b/default": 0.2, "last/default": 3e-4})
    ratio = two(other.means[2].value / other.means[0].value, DIGITS)
    assert f", at least {ratio} times less than last/default, the next." in told(one, other)
    tiny = stands(rmse=apart | {"a/default": 1e-9})
    assert "use a/default: RMSE <0.001 deg, more than" in told(tiny) and "at least more" not in told(tiny, other)
    tied = {"a/default": 1e-3, "b/default": 1e-3}
    assert "the next" not in told(stands(rmse=tied)) and "the next" not in told(one, stands("pushed", rmse=tied))


def test_what_is_recommended_and_seldom_swings_is_told_so() -> None:
    one = stands(swings=("mrac/default",))
    seldom = replace(one, unsound={kind: np.minimum(counts, 1) for kind, counts in one.unsound.items()},
                     standing=stands().standing)  # fmt: skip
    assert "Even so it swings 5.7 deg peak to peak in 1 of 12 cases." in told(seldom) and "Even so" not in told(
        stands()
    )
    steps = stands("camera and tendons, steps", swings=("pid-ff/default",))
    rig = stands("camera and tendons", rmse=RMSE | {"pid-ff/default": 1e-5})
    assert "Do not use pid-ff/default in motors + camera (steps): it swings" in advice([rig, steps]), (
        "also where it is not asked"
    )
    pushed = stands("pushed", swings=("pid-ff/default",), rmse=RMSE | {"pid-ff/default": 1e-5})
    assert "Do not use pid-ff/default in motors + camera (steps) and push: it" in advice([rig, steps, pushed])


def test_what_must_not_be_used_is_named_by_condition_and_of_many_the_number() -> None:
    for count in (6, 7):
        bad = tuple(f"c{number}/default" for number in range(count))
        rig = stands("camera and tendons", rmse=dict.fromkeys(bad, 1e-2) | {"good/default": 1e-3}, swings=bad)
        said = not_to_use([rig, stands()], names_of([rig, stands()]))
        assert said.startswith("Do not use: in motors + camera ") and "sampled" not in said and "good" not in said
        assert len(set(re.findall(r"\bc\d\b", said))) == (6 if count == 6 else 0)
        assert ("in motors + camera 7 controllers." in said) == (count == 7)
    alike = [stands(name, swings=("nc/default",)) for name in ("sampled", "pushed")]
    assert not_to_use(alike, names_of(alike)) == "Do not use: in sampled and push nc."
    sound = stands("camera and tendons")
    assert not_to_use([sound], names_of([sound])) == "Every controller here can be used."


def test_presets_are_explained_that_take_part_and_no_others() -> None:
    rows = {"smc/printed": 3e-3, "smc/tuned": 1e-3, "pd-ff/hardware": 2e-3, "feedforward/default": 1e-1}
    (said,) = re.findall(r"Presets: ([^.]*)\.", told(stands(rmse=rows)))
    assert said.startswith("hardware") and "tuned" in said and "default" not in said and "printed" not in said
    assert "Presets" not in told(stands(rmse={"smc/printed": 3e-3, "feedforward/default": 1e-1}))


def test_the_gains_of_what_is_recommended_are_printed_with_units_and_no_others() -> None:
    rig = stands("camera and tendons", swings=("mrac/default",))
    gains = {"pid-ff/default": {"Kp": 3.0, "Ki": 20.0, "Kd": 0.1}, "pd-ff/default": {"Kp": 7.0, "Kd": 0.1}}
    answer = answer_of([stands(), rig], "", gains)
    assert answer is not None
    said = " ".join(" ".join(answer.lines()).split())
    assert "Gains: pid-ff/default has Kp = 3 N m/rad, Ki = 20 N m/(rad s), Kd = 0.1 N m s/rad." in said
    assert "Kp = 7" not in said and "Gains: " not in told(stands(), rig)


def test_every_rank_of_every_controller_stands_in_a_table() -> None:
    one, other = stands(away=("smc/printed",)), stands("pushed")
    table = standings_table([one, other])
    rows = {row[0]: row[1:] for row in table.rows}
    assert set(rows) == set(RMSE) and table.columns[1:] == ("sampled", "push")
    assert rows["smc/printed"][0] == "stops short in 12 of 12" and rows["mrac/default"][1][:3] == "1: "
    for label, cells in rows.items():
        assert cells[1].split(":")[0] == str(other.standing.group(other.labels.index(label)))


def test_the_paper_is_answered_by_its_gains_and_the_conditions_in_which_they_work() -> None:
    said = told(
        stands("ideal", away=("smc/printed",), swings=("smc/exchanged",)),
        stands(away=("smc/printed",), chatters=("smc/exchanged",)),
        stands("pushed", swings=("pid/printed", "smc/exchanged"), failed={"smc/printed": 12}),
        stands("camera and tendons", rmse=RMSE | {"smc/printed": 0.01}, swings=("smc/exchanged",)),
    )
    paper = said[said.index("The paper's gains:") :]
    behind = r"smc/printed [\d.]+ deg in motors \+ camera \(place (\d)/\d\), elsewhere "
    assert re.search(behind + "(stops short or fails|fails or stops short)", paper)
    places = r"pid/printed .* in ideal .*, .* in sampled .* and .* in motors \+ camera .*"
    assert re.search(f"{places}, elsewhere swings;", paper)
    assert "smc/exchanged (P1, P2) swings or chatters in every condition" in paper
    assert "smc < mrac < pid < gvsc < nc holds in none of 4" in paper


def test_each_condition_is_said_once_and_a_rig_by_what_is_simulated_of_it() -> None:
    rig = stands("camera and tendons")
    said = told(stands(), rig, replace(rig, name="camera and tendons, steps"), stands("off-nominal"))
    assert said.count("spools follow the reference") == said.count("Sampled: ") == 1
    assert "motors + camera: spools" in said and "wrong model: another wrist" in said and "push: " not in said
    seen = told(replace(rig, traits=Traits(True, True, False)))
    assert "Camera: angles come from pictures" in seen and "spools" not in seen


def test_more_that_are_as_good_than_a_sentence_holds_are_counted() -> None:
    many = {f"c{number}/default": 1e-3 for number in range(6)}
    said = told(stands(rmse=many))
    assert re.search(r"use c\d/default: RMSE .*\. c\d/default, c\d/default and 3 more tie with it\.", said), said
    four = told(stands(rmse=dict(list(many.items())[:4])))
    assert re.search(r"\. c\d/default, c\d/default and c\d/default tie with it\.", four), four
    feedforward = told(stands(rmse=many | {"feedforward/default": 1e-3}))
    assert "feedforward (without feedback)" in feedforward or "No controller is better than feedforward" in feedforward


def test_a_place_counts_what_is_better_and_not_what_is_tied() -> None:
    rig = stands(
        "camera and tendons", rmse={"a/default": 1e-3, "b/default": 1e-3, "smc/printed": 0.01, "c/default": 0.1}
    )
    said = told(rig)
    assert re.search(r"smc/printed [\d.]+ deg in motors \+ camera \(place 3/4\)\.", said)
    first = told(stands(rmse={"smc/printed": 1e-3, "b/default": 1e-3, "c/default": 0.1}))
    assert "(place 1/3, tied)" in first


def test_the_papers_ranking_holds_where_it_does() -> None:
    order = dict(
        zip(("smc/tuned", "mrac/default", "pid/tuned", "gvsc/default", "nc/default"), (1, 2, 3, 4, 5), strict=True)
    )
    theirs = stands(rmse={label: 1e-3 * value for label, value in order.items()})
    assert "holds in sampled alone" in told(theirs, stands("pushed"))
    assert "holds in" not in told(stands(rmse={"smc/printed": 1e-3, "feedforward/default": 1e-2}))


def test_what_cannot_be_told_apart_is_named_and_marked() -> None:
    one = stands(rmse={"a/default": 1e-3, "b/default": 1e-3, "c/default": 5e-3})
    said = told(one)
    assert re.search(r"use (a/default: .*\. b|b/default: .*\. a)/default ties with it\.", said)
    cells = [row[1] for row in controllers_table([one], names_of([one])).rows]
    assert sorted(cell[-1] for cell in cells[:2]) == ["*", "="] and cells[2][-1] not in "*="


def test_of_equal_errors_the_one_is_best_that_is_so_in_most_conditions() -> None:
    tiny = {"a/default": 1e-9, "b/default": 1e-7, "c/default": 5e-3}
    other = stands("pushed", rmse={"a/default": 5e-3, "b/default": 1e-9, "c/default": 5e-3})
    one = stands(rmse=tiny)
    assert one.labels[winner(one, [one, other]) or 0] == "b/default" and winner(one) == 0
    assert "use b/default: RMSE <0.001 deg" in told(one, other)
    findings = Findings(0)
    head_with_the_best(findings, [one, other])
    heads = [about["meaning"] for about in findings.metrics.values()]
    assert len(heads) == 2 and all("RMSE of b/default, the best there" in head for head in heads), (
        "as the table's stars"
    )


def test_too_few_cases_are_no_ranking_and_no_tie() -> None:
    apart = {"a/default": 1e-3, "b/default": 1e-1}
    said = told(stands(rmse=apart, motions=3))
    assert f"(3 cases, {LEAST_PAIRS} are needed)" in said and "no ranking" in said
    assert "with it." not in said and " use " not in said.split("no ranking")[0]
    mixed = told(stands(rmse=apart, motions=3), stands("pushed", rmse=apart))
    assert "use a/default" in mixed and "There is no ranking in sampled: too few cases." in mixed


def test_steps_are_columns_of_their_own_and_no_part_of_what_is_advised_for_moves() -> None:
    """pd-ff is best on steps alone."""
    steps = stands("sampled, steps", rmse=RMSE | {"pd-ff/default": 1e-7})
    one = stands()
    table = controllers_table([one, steps], names_of([one, steps]))
    assert table.columns[1:] == ("sampled (12)", "sampled (steps) (12)")
    best = {column: next(row[0] for row in table.rows if row[column].endswith("*")) for column in (1, 2)}
    assert best == {1: "mrac", 2: "pd-ff"}
    assert "use mrac/default" in told(one, steps) and "use pd-ff" not in told(one, steps)
    assert "use pd-ff/default" in told(steps), "where there is nothing else"


def test_nothing_that_is_usable_is_told() -> None:
    rows = {"a/default": 1e-3, "b/default": 1e-2}
    assert "use none of these" in told(stands(rmse=rows, swings=tuple(rows)))


def test_who_has_a_wrist_of_their_own_is_not_told_how_to_begin_one() -> None:
    rows = {"a/default": 1e-3, "b/default": 1e-2}
    theirs, default = (str(answer_of([stands(rmse=rows)], own_wrist=own)) for own in (True, False))
    assert "wristctl init" in default and "wristctl init" not in theirs


def test_no_comparison_has_no_answer() -> None:
    assert answer_of([]) is None and answer_tables([]) == []


@pytest.mark.parametrize("name", CLASSES)
def test_each_condition_is_called_by_another_name(name: str) -> None:
    names = {condition(stands(other)) for other in CLASSES} | {condition(stands(f"{name}, steps"))}
    assert len(names) == len(CLASSES) + 1


@example(5, ["a"], 0, True)
@settings(max_examples=25, deadline=None)
@given(
    st.integers(1, 5),
    st.lists(st.text("abcdefgh-", min_size=1, max_size=30), min_size=1, max_size=18, unique=True),
    st.integers(0, 1000),
    st.booleans(),
)
@pytest.mark.slow
def test_an_answer_fits_a_terminal_whatever_is_compared(classes: int, laws: list[str], seed: int, steps: bool) -> None:
    rng = np.random.default_rng(seed)
    rmse = {f"{law}/g{k}": float(10.0 ** rng.uniform(-6, 0)) for k, law in enumerate(laws)}
    swings, away = (tuple(label for label in rmse if rng.random() < 0.3) for _ in range(2))
    names = [*CLASSES[:classes], *(f"{name}, steps" for name in CLASSES[:classes] if steps)]
    answer = answer_of([stands(name, rmse, swings, away) for name in names], "results/20261124T162110Z-compare-x-1")
    assert answer is not None
    lines = answer.lines()
    assert len(lines) <= LINES and max(map(len, lines)) <= COLUMNS
    shown = re.sub(r"\s+", "", "".join(lines)).count("(12)")
    left = "steps: --all" in "\n".join(lines)
    assert shown == (classes if left else len(names)) and left <= steps, "no condition of smooth motions is left out"


def test_the_tables_of_a_run_begin_with_the_answers() -> None:
    everyone, tree = answer_tables([stands(), stands("pushed")])
    assert [row[0] for row in everyone.rows] == list(RMSE) and everyone.columns == ("controller", "sampled", "push")
    assert tree.columns[0] == "push?" and len(answer_tables([stands()])) == 1, "one condition asks nothing"


@pytest.mark.parametrize(
    ("value", "said"),
    [(0.0123, "0.012"), (3.14e-5, "3.1e-5"), (15234.0, "15000"), (3.2e7, "3.2e7"), (0.0, "0"), (12.3, "12")],
)
def test_a_number_is_as_short_as_two_digits_are(value: float, said: str) -> None:
    assert two(value) == said


def test_an_interval_is_given_where_there_are_cases_enough() -> None:
    assert re.search(r"RMSE [\d.]+ deg \[", told(stands(motions=8)))
    assert re.search(r"RMSE [\d.]+ deg,", told(stands(motions=7)))
    scaled = replace(stands(), scores=stands().scores * 2.0)
    assert scaled.means[0].value == pytest.approx(2.0 * stands().means[0].value)


def test_of_several_conditions_errors_are_told_from_the_least_to_the_largest() -> None:
    one, other = stands(), stands("pushed", rmse={label: 3.0 * error for label, error in RMSE.items()})
    assert "at least" not in told(one)
    least, most = (two(np.degrees(ranking.means[0].value), DIGITS) for ranking in (one, other))
    assert f"RMSE {least} to {most} deg, at least " in told(one, other)


_RIG = r"(?:simulated motors, tendons (?:and|or) a camera|simulated motors and tendons|a simulated camera)"
_BEGINS = re.compile(
    rf"(?:With|For steps with) (?:exact angles and torques|{_RIG})(?: \([^)]*\))?, (?:use |there is no ranking)"
)
SETS = [Traits(), *(Traits(True, camera, tendons) for camera in (True, False) for tendons in (True, False))]


@pytest.mark.parametrize("jumps", [False, True])
@pytest.mark.parametrize("second", SETS)
@pytest.mark.parametrize("first", SETS)
def test_sentences_put_together_from_conditions_are_sentences(first: Traits, second: Traits, jumps: bool) -> None:
    """Of every pair of actuators and sensors, for smooth motions and for steps."""
    steps = ", steps" * jumps
    chosen = {f"camera and tendons{steps}": first, f"pushed{steps}": second}
    several, few = (
        [
            replace(
                stands(name, swings=bad, away=("nc/default",), motions=motions), traits=traits._replace(jumps=jumps)
            )
            for (name, traits), bad in zip(chosen.items(), (("mrac/default",), ("pid/printed",)), strict=True)
        ]
        for motions in (12, 3)
    )
    for rankings in (several, several[:1], few):
        said = told(*rankings)
        assert len(re.findall(_BEGINS, said)) == len({one.traits.rig for one in rankings}), said
        for wrong in (
            r"\b(simulated|with|in|the|a) an?d?\b (?!simulated camera|camera)",
            r"simulated a\b",
            r" [,;.:]",
            r"[,;:]{2}",
        ):
            assert not re.search(wrong, said), (wrong, said)
    one, other = first.camera, first.tendons
    rig = told(several[0])
    assert ("a simulated camera, use" in rig) == (first.rig and one and not other)
    assert ("simulated motors and tendons, use" in rig) == (first.rig and other and not one)
    assert ("simulated motors, tendons and a camera, use" in rig) == (one and other)
