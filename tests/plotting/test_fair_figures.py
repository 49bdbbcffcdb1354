"""Figures of a study: what is written on a colour can be read."""

from __future__ import annotations

import numpy as np
from matplotlib.collections import QuadMesh
from matplotlib.colors import to_rgb

from tests.comparison.test_fair_answer import ranked, row
from wristctl.commands.study.figures import laws_by_rig

LUMINANCE = np.array([0.299, 0.587, 0.114])


def test_every_ratio_can_be_read_on_its_cells_colour() -> None:
    """From 40 times worse than feedforward to 40 times better, the ends of the colours and their middle."""
    factors = (0.025, 0.1, 0.5, 2.0, 10.0, 40.0)
    rows = [row(f"law{k}/tuned", 4.0 * factor) for k, factor in enumerate(factors)]
    rows += [row(f"lost{k}/tuned", 4.0 * factor, swings=9) for k, factor in enumerate(factors)]
    (axes, *_) = laws_by_rig({"bench": ranked(*rows)}).axes
    (mesh,) = [each for each in axes.collections if isinstance(each, QuadMesh)]
    cells = np.asarray(mesh.to_rgba(np.asarray(mesh.get_array())))[..., :3].reshape(-1, 3) @ LUMINANCE
    inks = np.array([np.array(to_rgb(text.get_color())) @ LUMINANCE for text in axes.texts])
    assert len(inks) == len(cells) == 13 and np.ptp(cells) > 0.3
    assert np.abs(inks - cells).min() > 0.35
