"""One answer: every sentence of the README and the pages that names a best controller, and that none contradict."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml

from wristctl.config.choices import CONTROLLERS

ROOT = Path(__file__).parents[1]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
ANSWERS: list[dict[str, Any]] = yaml.safe_load((ROOT / "docs" / "answers.yaml").read_text(encoding="utf-8"))
OLDER = "**Older than today's controllers**"

_NAMES = "|".join(sorted((re.escape(name) for name in CONTROLLERS), key=len, reverse=True))
_WHO = re.compile(rf"(?<![\w/.-])`?({_NAMES})(?:/[a-z:-]+)?`?(?![\w-])", re.IGNORECASE)
_BEST = re.compile(
    r"\b(best|lowest|least error|errs? (?:the )?least|comes? first|wins?|winner|recommended)\b"
    rf"|\b(?:run|use) \W*(?:{_NAMES})\b",
    re.IGNORECASE,
)


def sentences(text: str) -> Iterator[str]:
    """Sentences that name a controller and call something best; code and tables are none."""
    prose = re.sub(r"```.*?```", "", text, flags=re.DOTALL)
    prose = "\n".join(line for line in prose.splitlines() if not line.startswith("|"))
    for paragraph in re.split(r"\n\s*\n|\n(?=- |#|\d\. )", prose):
        for part in re.split(r"(?<=[.;:])\s+(?=[A-Z`*(]|the |with )", re.sub(r"\s+", " ", paragraph).strip()):
            if _WHO.search(part) and _BEST.search(part):
                yield part


def contradictions(answers: list[dict[str, Any]]) -> list[tuple[str, str]]:
    """Pairs of sentences of today's controllers, on the same worlds and gains, that name other controllers."""
    told: dict[tuple[str, str], dict[str, Any]] = {}
    pairs = []
    for answer in answers:
        if not answer.get("older"):
            first = told.setdefault((answer["worlds"], answer["gains"]), answer)
            if set(first["best"]) != set(answer["best"]):
                pairs.append((first["sentence"], answer["sentence"]))
    return pairs


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_a_page_names_a_best_controller_only_with_its_run_and_worlds(page: Path) -> None:
    name, text = page.relative_to(ROOT).as_posix(), page.read_text(encoding="utf-8")
    answers = [answer for answer in ANSWERS if answer["page"] == name]
    assert sorted(sentences(text)) == sorted(answer["sentence"] for answer in answers), "docs/answers.yaml"
    for answer in answers:
        assert answer["run"] in text and answer["worlds"] and answer["gains"]
        assert set(answer["best"]) <= {name.lower() for name in _WHO.findall(answer["sentence"])}, answer["sentence"]
    assert any(answer.get("older", False) for answer in answers) == (OLDER in text)


def test_no_page_contradicts_another_and_one_that_did_would_be_seen() -> None:
    assert contradictions(ANSWERS) == []
    one = {"worlds": "camera", "gains": "tuned", "best": ["pid"], "sentence": "run pid"}
    other = one | {"best": ["mpc"], "sentence": "run mpc"}
    assert contradictions([one, other]) == [("run pid", "run mpc")]
    assert contradictions([one, other | {"older": True}]) == contradictions([one, other | {"gains": "presets"}]) == []


@pytest.mark.parametrize(
    "text",
    [
        "Use ct-dob.",
        "Run **mpc/tuned** here.",
        "On a rig `pid-ff/hardware` is best.",
        "mpc has the lowest error.",
        "The winner:\nsmc.",
    ],
)
def test_a_sentence_that_names_a_winner_is_found(text: str) -> None:
    assert len(list(sentences(text))) == 1
    assert not list(sentences("ct-dob has an observer. The best is said elsewhere.")) and not list(
        sentences(f"```\n{text}\n```")
    )
