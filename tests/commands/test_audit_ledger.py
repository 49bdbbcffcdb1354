"""Every claim of an audit stands in one table of its page, with the number, verdict and reason that it has."""

from __future__ import annotations

import math
from typing import Any

from wristctl.commands.audit.ledger import ledger_tables
from wristctl.commands.printed_table import Table
from wristctl.comparison.claims import Judgement
from wristctl.comparison.verdicts import Finding
from wristctl.config.audit import Claim


def judged(name: str, found: dict[str, Finding], shown_by: tuple[str, ...] = (), **more: Any) -> Judgement:
    given = {
        "id": name,
        "says": f"{name} says",
        "evidence": "selection",
        "metric": "rmse",
        "value": 2.0,
        "unit": "N",
    } | more
    return Judgement(Claim.model_validate(given), found, shown_by)


HOLDS, FAILS = Finding("reproduced", 1.5, 2.5), Finding("contradicted", math.nan, math.nan, "fails at 1 s", "odd")
ALL = [
    judged("T1", {"exact": HOLDS, "sampled": FAILS}, sense="at most"),
    judged("T2", {"exact": HOLDS}, sense="at least", reason="as printed"),
    judged("T3", {"": HOLDS}, ("equation 7", "rollout"), source="a letter"),
    judged("T4", {"": Finding("open", reason="a camera would tell")}, value=None, evidence="text", verdict="open"),
    judged("T5", {"": FAILS}, part_of="T1"),
    judged("T6", {"exact": HOLDS}, whose="ours"),
    judged("T7", {"": HOLDS}, whose="group", source="a talk"),
    judged("T8", {}),
]


def tables() -> dict[str, Table]:
    return {table.title: table for table in ledger_tables(ALL)}


def named(table: Table) -> list[str]:
    return [row[0] for row in table.rows]


def test_each_claim_stands_in_the_section_of_who_says_it_and_what_decides_it() -> None:
    sections = {title: named(table) for title, table in tables().items()}
    for title in ("Why", "Still open", "Verdicts on the claims of the paper"):
        del sections[title]
    assert list(sections.values()) == [["T1", "T2"], ["T3", "T4"], ["T5"], ["T6"], ["T7"], ["T8"]]
    assert all(len(row) == len(table.columns) for table in tables().values() for row in table.rows)


def test_a_claim_has_a_range_and_a_verdict_for_each_loop_and_nothing_where_it_was_not_run() -> None:
    table = tables()["Claims of the paper that rollouts decide"]
    assert list(table.columns)[-4:] == ["ours, exact", "verdict, exact", "ours, sampled", "verdict, sampled"]
    (first, second) = (dict(zip(table.columns, row, strict=True)) for row in table.rows)
    assert (first["paper"], second["paper"]) == ("<= 2", ">= 2") and first["verdict, exact"] == "reproduced"
    assert "1.5" in first["ours, exact"] and "2.5" in first["ours, exact"]
    assert first["ours, sampled"] and first["verdict, sampled"].endswith("(odd)")
    assert (second["ours, sampled"], second["verdict, sampled"]) == ("", "")


def test_other_claims_say_what_shows_them_and_their_source_where_one_has_one() -> None:
    table = tables()["Other claims of the paper"]
    assert [row[-1] for row in table.rows] == ["a letter", ""] and table.columns[-1] == "source"
    assert dict(zip(table.columns, table.rows[0], strict=True))["shown by"] == "equation 7, rollout"
    unsaid = dict(zip(table.columns, table.rows[1], strict=True))
    assert (unsaid["paper"], unsaid["ours"]) == ("", "")
    assert tables()["Other details"].columns[-1] == "shown by"


def test_reasons_open_claims_and_the_count_of_the_papers_verdicts_stand_at_the_end() -> None:
    assert {row[0]: row[2] for row in tables()["Why"].rows}["T2"] == "as printed"
    assert not set(named(tables()["Why"])) & {"T4", "T6", "T7", "T8"} and "T5" in named(tables()["Why"])
    assert tables()["Still open"].rows == [("T4", "a camera would tell")]
    counted = {str(row[0]): row[1] for row in tables()["Verdicts on the claims of the paper"].rows}
    assert sum(counted.values()) == 4 and counted["open"] == 1 and counted["reproduced"] == 2
    assert list(counted) == sorted(counted)
