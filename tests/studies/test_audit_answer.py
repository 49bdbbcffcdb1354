"""The audit's answer fits a screen, and no part of it goes for another, however much there is to list."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from wristctl.studies.answer_lines import COLUMNS
from wristctl.studies.audit_answer import LINES, answer_of

LOOPS = ("exact", "sampled", "default")


def claim(name: str, verdict: str, places: tuple[str, ...] = LOOPS, mark: str = "", evidence: str = "") -> Any:
    found = {place: SimpleNamespace(verdict=verdict, mark=mark) for place in places}
    return SimpleNamespace(claim=SimpleNamespace(id=name, evidence=evidence), verdict=verdict, found=found)


def strip(name: str, label: str, share: float, told: str, than: str | None = None) -> Any:
    own = SimpleNamespace(id=name, label=label, than=than, unspecified=False)
    return SimpleNamespace(claim=own, verdicts=[""] * 1133, told=told, share=lambda _: SimpleNamespace(value=share))


STRIPS = [
    strip("A-smc-printed-arrives", "smc/printed", 0.0, ""),
    strip("A-smc-exchanged-arrives", "smc/exchanged", 0.61, "46 % where wrist.tension_limit < 21.1, 81 % above"),
    strip("O-rmse-smc-pid", "smc/exchanged", 0.22, "", "pid/printed"),
]


@pytest.mark.parametrize("count", [1, 9, 60])
def test_every_part_is_there_in_at_most_twelve_lines(count: int) -> None:
    judged = [claim(f"R-{k}", "reproduced", mark="not physical") for k in range(count)]
    judged += [claim(f"B-{k}", "reproduced", ("",)) for k in range(count)]
    judged += [claim(f"C-{k}", "contradicted", ("",)) for k in range(count)]
    judged += [claim(f"M-{k}", "open", ("",), evidence="table1") for k in range(count)]
    lines = answer_of(judged, STRIPS)
    said = " ".join(line.strip() for line in lines)
    assert len(lines) <= LINES and max(map(len, lines)) <= COLUMNS
    for part in (
        f"{4 * count} claim", f"On exact {count} of {count} reproduced, {count} of these not physical: R-0",
        "On sampled", "On default", "Without a rollout reproduced: B-0", "own equations or words: C-0",
        "Over 1133 settings that the paper may have had, 30 deg are reached by smc/printed in 0 %,",
        "smc/exchanged in 61 % (46 % where wrist.tension_limit < 21.1, 81 % above).",
        "orderings of its own two laws hold in: O-rmse-smc-pid 22 %.", "open, for want of --table1 RUN (train).",
        "wristctl audit",
    ):  # fmt: skip
        assert part in said, part
    assert ("..." in said.replace("audit ...", "")) == (count == 60), "only then lists are cut, with a mark"
