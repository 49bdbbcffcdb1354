"""How much each gain by itself matters to the objective that it was found by."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from wristctl.tuning.objective import Judge

_APART = 1.5
"""Factor by which gains are less or more."""


def tornado(name: str, gains: Mapping[str, float], judge: Judge) -> Figure:
    """The tornado of the gains found, judged as they were chosen."""
    import numpy as np

    from wristctl.control.table import controller
    from wristctl.report.tuning_figures import gain_sensitivity

    law = controller(name)
    base = np.array(law.values(gains))
    tried = np.tile(base, (1 + 2 * len(base), 1))
    for at in range(len(base)):
        tried[1 + 2 * at, at] /= _APART
        tried[2 + 2 * at, at] *= _APART
    return gain_sensitivity(name, list(law.gains), _APART, judge(law, tried))
