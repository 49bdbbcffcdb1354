from __future__ import annotations

import numpy as np
import pytest

from wristctl.config.learning import DataSettings, NetworkSettings
from wristctl.config.wrist import WristParameters
from wristctl.learning.dataset import Samples, Split, draw_samples, split_samples
from wristctl.learning.training import train_one
from wristctl.learning.training_result import Job, TrainingResult


@pytest.fixture(scope="session")
def quick() -> NetworkSettings:
    return NetworkSettings(hidden=(24, 16), activation="tanh", learning_rate=0.01, epochs=25, batch=50)


@pytest.fixture(scope="session")
def samples() -> Samples:
    return draw_samples(DataSettings(samples=400), WristParameters(), np.random.default_rng(1))


@pytest.fixture(scope="session")
def split(samples: Samples) -> Split:
    return split_samples(len(samples.theta), 0.75, np.random.default_rng(5))


@pytest.fixture(scope="session")
def trained(samples: Samples, split: Split, quick: NetworkSettings) -> TrainingResult:
    return train_one(samples, Job("quick", quick, split, np.random.SeedSequence(7)))
