"""Random search: what every other method has to beat at the same budget."""

from wristctl.arrays import Array
from wristctl.tuning.optimisers.base import Optimiser


class RandomSearch(Optimiser):
    """Candidates drawn evenly from the box, without memory."""

    name = "random"

    def propose(self) -> Array:
        """Draw anew."""
        return self.rng.random(self.points.shape)

    def learn(self, values: Array) -> None:
        """Nothing to remember."""
