"""Which random streams a repetition meets: noise by scenario, the plant for all scenarios alike.

Nothing here knows of rows: in a repetition all controllers, gains, inverses and loops meet the same noise and the same
draw of the plant (common random numbers), and another row, loop or reference changes nothing for those that were there.
"""

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
        return *stream(self.seed, self._camera(scenario)), repetition

    def plant(self, repetition: int) -> Entropy:
        """The drawn plant."""
        return *stream(self.seed, self._plant()), repetition

    def names(self, loops: Iterable[Loop], scenarios: Iterable[str]) -> list[str]:
        """The named streams that such loops draw from: what a run notes of them."""
        chosen = list(loops)
        cameras = [self._camera(each) for each in scenarios] if any(map(sees_noise, chosen)) else []
        return [*dict.fromkeys(cameras), *([self._plant()] if any(map(has_drawn_plant, chosen)) else [])]

    def _camera(self, scenario: str) -> str:
        return f"{self.purpose} camera: {scenario}"

    def _plant(self) -> str:
        return f"{self.purpose} plant"


def sees_noise(loop: Loop) -> bool:
    """Whether a camera draws noise and lost frames."""
    return loop.sensor.level == "camera"


def has_drawn_plant(loop: Loop) -> bool:
    """Whether each repetition has a plant of its own."""
    return any((loop.plant.stiffness_spread, loop.plant.damping_spread, loop.plant.payload_spread))


def is_random(loop: Loop) -> bool:
    """Whether repetitions of this loop differ."""
    return sees_noise(loop) or has_drawn_plant(loop)
