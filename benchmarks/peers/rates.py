"""Questions to the result of one run: rates of sides and of peers at equal error."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from table import OURS


@dataclass(frozen=True)
class Variant:
    """One side with its number of integration steps a tick."""

    side: str
    peer: str
    steps: int
    error: float
    equal: bool
    """Whether its error is at most wristctl's."""

    @property
    def name(self) -> str:
        """What a table says."""
        return self.side if self.steps == 1 else f"{self.side}, {self.steps} steps"


class Result:
    """What run.py wrote."""

    def __init__(self, raw: dict[str, Any]) -> None:
        self.raw = raw

    def axis(self, name: str) -> list[int]:
        """Values of `segments`, `threads` or `lanes` that were measured."""
        return sorted({row[name] for row in self.raw["speeds"]})

    def variants(self, segments: int) -> list[Variant]:
        """All that have a rate, in the order of the table of sides."""
        found = []
        for side, known in self.raw["errors"].get(str(segments), {}).items():
            steps = {row["steps"] for row in self._rows(side, segments) if "rate" in row}
            for count in sorted(steps):
                error = {int(key): value for key, value in known["errors"].items()}[count]
                equal = known["reached"] and count == known["steps"]
                found.append(Variant(side, self.raw["sides"][side]["peer"], count, error, equal))
        return found

    def rate(self, variant: Variant, segments: int, threads: int, lanes: int) -> float | None:
        """Median rate; where it was measured with fewer lanes only, the rate of those."""
        rows = [row for row in self._rows(variant.side, segments) if "rate" in row]
        rows = [row for row in rows if (row["steps"], row["threads"]) == (variant.steps, threads)]
        rows = [row for row in rows if row["lanes"] <= lanes]
        return max(rows, key=lambda row: row["lanes"])["rate"] if rows else None

    def own_rate(self, segments: int, threads: int, lanes: int) -> float | None:
        """wristctl's rate, with one step a tick."""
        return self.rate(Variant(OURS, OURS, 1, 0.0, True), segments, threads, lanes)

    def ratio(self, peer: str, segments: int, threads: int, lanes: int, equal: bool = True) -> tuple[float, str] | None:
        """wristctl's rate over the fastest of a peer's variants at equal error (else of all), and which that is."""
        ours = self.own_rate(segments, threads, lanes)
        rates = {
            variant.name: rate
            for variant in self.variants(segments)
            if variant.peer == peer and (variant.equal or not equal)
            and (rate := self.rate(variant, segments, threads, lanes)) is not None
        }  # fmt: skip
        if ours is None or not rates:
            return None
        fastest = max(rates, key=lambda name: rates[name])
        return ours / rates[fastest], fastest

    def failures(self) -> list[str]:
        """Sides that are missing, with the reason."""
        lines = [f"{name}: {why}" for name, why in self.raw["missing"].items()]
        for segments, sides in self.raw["errors"].items():
            lines += [f"{name}, n = {segments}: {of['failed']}" for name, of in sides.items() if "failed" in of]
        lines += [
            f"{row['side']}, n = {row['segments']}, {row['lanes']} lanes: {row['failed']}"
            for row in self.raw["speeds"] if "failed" in row
        ]  # fmt: skip
        return lines

    def _rows(self, side: str, segments: int) -> list[dict[str, Any]]:
        return [row for row in self.raw["speeds"] if (row["side"], row["segments"]) == (side, segments)]
