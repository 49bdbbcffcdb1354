"""The page of what can be chosen is what its script makes of tables and schema: no default changes unseen."""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path
from types import ModuleType

import pytest

from wristctl.config.choices import METRICS
from wristctl.simulation.metrics import Metric

DOCS = Path(__file__).parents[2] / "docs"


@pytest.fixture(scope="module")
def choices() -> ModuleType:
    """docs/choices.py"""
    spec = importlib.util.spec_from_file_location("choices", DOCS / "choices.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_page_is_what_its_script_makes(choices: ModuleType) -> None:
    assert (DOCS / "choices.md").read_text() == choices.page(), "make it anew: python docs/choices.py"


def test_a_newcomer_to_a_table_stands_on_the_page(choices: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(METRICS, "jerk", Metric("rad/s^3", "RMS of the angle's third derivative", heading="jerk"))
    assert "| `jerk` | rad/s^3 | jerk | RMS of the angle's third derivative | failed |" in choices.page()


def test_every_link_within_the_page_leads_to_a_heading() -> None:
    page = (DOCS / "choices.md").read_text()
    headings = {line.lstrip("# ").lower().replace(" ", "-") for line in page.splitlines() if line.startswith("#")}
    assert set(re.findall(r"\]\(#([^)]*)\)", page)) <= headings
