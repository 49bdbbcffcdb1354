"""The ledger of the paper's claims, and how it is audited."""

from __future__ import annotations

from typing import Literal

from wristctl.config.section import Section, choice, quantity

Outcome = Literal["reproduced", "not reproduced", "contradictory", "not specified enough", "open", "taken over"]


class Claim(Section):
    """One number or statement of the paper, and what decides it."""

    id: str
    says: str
    evidence: Literal["comparison", "settings", "text", "network", "hardware"]
    value: float | None = None
    unit: str = ""
    controller: str | None = None
    gains: str | None = None
    metric: str | None = None
    verdict: Outcome | None = None
    reason: str = ""


class Ledger(Section):
    """The file of claims."""

    claims: tuple[Claim, ...]


class AuditSettings(Section):
    """Which claims, and over which horizon their rollouts go."""

    claims: str = choice("experiments/claims.yaml", "ledger of claims")
    horizon: float = quantity(5.0, "s", "duration of one rollout", "assumed", gt=0)
