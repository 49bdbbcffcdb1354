"""Random streams: every one of them has a name under the root seed of a study."""

import hashlib
from functools import lru_cache

Entropy = tuple[int, ...]
"""Of a random stream, for `numpy.random.default_rng` or `numpy.random.SeedSequence`."""


@lru_cache(maxsize=256)
def stream(seed: int, name: str) -> tuple[int, int]:
    """Entropy of the named random stream under a root seed."""
    return seed, int.from_bytes(hashlib.sha256(name.encode()).digest()[:8], "big")
