"""The ledger of the paper's claims, and how it is audited."""

from __future__ import annotations

from collections import Counter
from typing import Literal, Self

from pydantic import model_validator

from wristctl.config.section import Section, choice, quantity

VerdictName = Literal["reproduced", "not reproduced", "contradictory", "not specified enough", "open", "taken over"]

_NEEDED = {
    "comparison": ("value", "controller", "gains", "metric"),
    "table1": ("value", "metric"),
    "selection": ("value", "metric"),
    "text": ("verdict",),
}


class Claim(Section):
    """One number or statement of the paper, and what decides it."""

    id: str
    says: str
    evidence: Literal["comparison", "table1", "selection", "settings", "text", "hardware"]
    value: float | None = None
    exact: bool = False
    unit: str = ""
    controller: str | None = None
    gains: str | None = None
    metric: str | None = None
    verdict: VerdictName | None = None
    reason: str = ""

    @model_validator(mode="after")
    def _can_be_judged(self) -> Self:
        missing = [name for name in _NEEDED.get(self.evidence, ()) if getattr(self, name) is None]
        if missing:
            raise ValueError(f"claim {self.id} by {self.evidence} needs {' and '.join(missing)}")
        return self


class AuditSettings(Section):
    """Which claims, the trainings that show some of them, and over which horizon the rollouts for others go."""

    claims: tuple[Claim, ...] = choice((), "the ledger: claims with what decides them; experiments/claims.yaml has all")
    table1: str | None = choice(None, "train run of experiments/table1.yaml: path, id or latest:train")
    selection: str | None = choice(None, "train run of experiments/model_selection.yaml: path, id or latest:train")
    horizon: float = quantity(5.0, "s", "duration of one rollout", "assumed", gt=0)

    @model_validator(mode="after")
    def _ids_differ(self) -> Self:
        twice = [name for name, count in Counter(claim.id for claim in self.claims).items() if count > 1]
        if twice:
            raise ValueError(f"claim {twice[0]} stands there twice: give each an id of its own")
        return self
