"""The ledger of the paper's claims, and how it is audited."""

from collections import Counter
from typing import Annotated, Literal, Self

from pydantic import BeforeValidator, model_validator

from wristctl.config.loop import DirectionName
from wristctl.config.section import Section, choice, quantity
from wristctl.config.unknowns_box import Box

VerdictName = Literal[
    "reproduced",
    "better than the paper",
    "worse than the paper",
    "does not hold",
    "contradicted",
    "not specified enough",
    "open",
]
WhoseName = Literal["paper", "ours", "group"]
# Verdict of a claim. Older ledgers say contradictory.
_Written = Annotated[
    VerdictName, BeforeValidator(lambda verdict: "contradicted" if verdict == "contradictory" else verdict)
]
SenseName = Literal["about", "exactly", "at least", "at most"]

_NEEDED = {
    "comparison": ("value", "controller", "gains", "metric"),
    "ordering": ("controller", "gains", "than", "metric"),
    "arrival": ("controller", "gains"),
    "together": ("controller", "gains"),
    "symmetry": ("controller", "gains", "metric"),
    "table1": ("value", "metric"),
    "selection": ("value", "metric"),
    "hardware": ("value", "metric"),
    "equation": ("value", "metric"),
    "text": ("verdict",),
}


class Claim(Section):
    """One number or statement of the paper, and what decides it."""

    id: str
    says: str
    whose: WhoseName = "paper"
    """Who says it: the paper, we as its auditors, or the paper's authors elsewhere. The paper's are counted."""
    part_of: str = ""
    """Id of the statement that this is a detail of. Only the statement is counted."""
    topic: str = ""
    """Topic of the claim in a few words, for the first screen of an audit. A claim without one is not shown there."""
    weight: int = 0
    """Weight of the claim for a reader of the paper. The first screen shows both numbers of the heaviest claims."""
    source: str = ""
    """Source of the claim, if outside the paper."""
    evidence: Literal[
        "comparison", "ordering", "arrival", "together", "symmetry", "table1", "selection", "hardware", "equation",
        "text", "parts", "settings",
    ]  # fmt: skip
    value: float | None = None
    sense: SenseName = "about"
    """Meaning of `value`: within a factor, exact, or a bound."""
    printed: bool = True
    """Whether `value` is printed in the paper, and so rounded to its last digit; false: a threshold of ours."""
    ends: tuple[float, float] | None = None
    """Between which the printed value lies, where its digits as written here do not tell."""
    unit: str = ""
    controller: str | None = None
    gains: str | None = None
    than: str | None = None
    """Controller/gains with the larger metric in an ordering, by the paper."""
    metric: str | None = None
    """Metric of a loop or a run, or the name of an equation in wristctl.comparison.derived_claims."""
    direction: DirectionName | None = None
    """Direction of the hardware trials that count."""
    pushed: bool = False
    """Whether hardware trials with a push count, else those without."""
    stiffness_scale: float = 1.0
    """Ratio of the springs' stiffness to the controller's value, in a comparison."""
    derived: bool = False
    """The paper derives it from its equations, which contradict it where, solved as they stand, they do not give it."""
    unspecified: str = ""
    """Quantity that the paper leaves open. Our number then stands beside the claim and decides nothing."""
    assuming: str = ""
    """Assumption of the verdict that the paper does not give, for example a step as reference. It is shown beside."""
    verdict: _Written | None = None
    reason: str = ""

    @property
    def label(self) -> str:
        """controller/gains"""
        return f"{self.controller}/{self.gains}"

    @model_validator(mode="after")
    def _can_be_judged(self) -> Self:
        missing = [name for name in _NEEDED.get(self.evidence, ()) if getattr(self, name) is None]
        if missing:
            raise ValueError(f"claim {self.id} by {self.evidence} needs {' and '.join(missing)}")
        if self.than is not None and self.than.count("/") != 1:
            raise ValueError(f"claim {self.id}: than: is controller/gains, not {self.than}")
        if self.sense == "about" and self.value is not None and self.value <= 0.0 and self.evidence not in _AS_IT_IS:
            raise ValueError(f"claim {self.id}: no factor leads to {self.value:g}; give sense: at most, or exactly")
        return self


_AS_IT_IS = ("settings", "text")


class AuditSettings(Section):
    """Claims of an audit, the runs that show some of them, and the horizon of the rollouts for the others."""

    claims: tuple[Claim, ...] = choice((), "the ledger: claims with what decides them; experiments/claims.yaml has all")
    table1: str | None = choice(None, "train run of experiments/table1.yaml: path, id or latest:train")
    selection: str | None = choice(None, "train run of experiments/model_selection.yaml: path, id or latest:train")
    hardware: str | None = choice(None, "hw-run run that decides the experiment's claims: path, id or latest:hw-run")
    horizon: float = quantity(5.0, "s", "duration of one rollout", "assumed", gt=0)
    box: Box = Box()

    @model_validator(mode="after")
    def _ids_differ(self) -> Self:
        twice = [name for name, count in Counter(claim.id for claim in self.claims).items() if count > 1]
        if twice:
            raise ValueError(f"claim {twice[0]} stands there twice: give each an id of its own")
        undivided = {claim.id for claim in self.claims if not claim.part_of}
        for claim in self.claims:
            if claim.part_of and claim.part_of not in undivided:
                raise ValueError(f"claim {claim.id}: part_of: names no statement '{claim.part_of}' of this ledger")
        parts = {claim.part_of for claim in self.claims}
        empty = [claim.id for claim in self.claims if claim.evidence == "parts" and claim.id not in parts]
        if empty:
            raise ValueError(f"claim {empty[0]} by parts has none: give some claim part_of: {empty[0]}")
        return self
