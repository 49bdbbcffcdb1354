"""Which random streams a repetition meets: noise by scenario, the plant for all scenarios alike.

Nothing here knows of rows: in a repetition all controllers, gains, inverses and loops meet the same noise and the same
draw of the plant (common random numbers), and another row, loop or reference changes nothing for those that were there.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from wristctl.config.loop import Loop
from wristctl.seeds import Entropy, stream


@dataclass(frozen=True)
class Draws:
    """The streams under a root seed. What is tuned on and what is judged on have different `purpose`s: other noise."""

    seed: int
    purpose: str = "judged"

    def camera(self, scenario: str, repetition: int) -> Entropy:
        """Noise and dropped frames of a scenario, by the name of its reference and direction."""
        return *stream(self.seed, f"{self.purpose} camera: {scenario}"), repetition

    def plant(self, repetition: int) -> Entropy:
        """The drawn plant."""
        return *stream(self.seed, f"{self.purpose} plant"), repetition

    def streams(self, scenarios: Iterable[str]) -> dict[str, Entropy]:
        """Each stream by its name, its first repetition's: what a run notes of them."""
        cameras = {f"{self.purpose} camera: {each}": self.camera(each, 0) for each in scenarios}
        return {**cameras, f"{self.purpose} plant": self.plant(0)}


def is_random(loop: Loop) -> bool:
    """Whether repetitions of this loop differ: by a camera's noise or a drawn plant."""
    plant = loop.plant
    return loop.sensor.level == "camera" or (plant.stiffness_spread, plant.damping_spread, plant.payload_spread) != (
        0.0,
        0.0,
        0.0,
    )
