"""The page of what can be chosen is what its script makes of tables and schema: no default changes unseen."""

from __future__ import annotations

import re
from types import ModuleType

import pytest

from tests.documented import DOCS, script_of_docs
from wristctl.config.choices import METRICS
from wristctl.simulation.metrics import Metric


@pytest.fixture(scope="module")
def choices() -> ModuleType:
    """docs/choices.py"""
    return script_of_docs("choices")


def test_the_page_is_what_its_script_makes(choices: ModuleType) -> None:
    assert (DOCS / "choices.md").read_text() == choices.page(), "make it anew: python docs/choices.py"


def test_a_newcomer_to_a_table_stands_on_the_page(choices: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(METRICS, "jerk", Metric("rad/s^3", "RMS of the angle's third derivative", heading="jerk"))
    assert "| `jerk` | rad/s^3 | jerk | RMS of the angle's third derivative | failed |" in choices.page()


def test_every_link_within_the_page_leads_to_a_heading() -> None:
    page = (DOCS / "choices.md").read_text()
    headings = {line.lstrip("# ").lower().replace(" ", "-") for line in page.splitlines() if line.startswith("#")}
    assert set(re.findall(r"\]\(#([^)]*)\)", page)) <= headings
