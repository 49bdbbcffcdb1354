"""The ledger in one picture: our number over the paper's, claim by claim and loop by loop."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from wristctl.comparison.ledger import Judgement
from wristctl.comparison.paper import FACTOR
from wristctl.report.style import BLUE, GREY, LIGHT, ORANGE, VERMILLION, figure, legend_below, logarithmic

_LOOPS = {"exact": (BLUE, "o"), "sampled": (ORANGE, "s"), "default": (VERMILLION, "^")}
_REACH = (1e-8, 1e5)


def ours_over_the_papers(judged: Sequence[Judgement]) -> Figure:
    """Ranges over the stated motions, on each loop; the band is what counts as reproduced.

    What never settles, or fails, stands at the right edge; a hollow mark is of a law that the paper only names.
    """
    own = [j for j in judged if j.claim.value and j.claim.sense == "about" and any(name for name in j.found)]
    made, axes = figure(height=1.2 + 0.26 * len(own))
    panel = axes[0, 0]
    panel.axvspan(1.0 / FACTOR, FACTOR, color=LIGHT, lw=0, zorder=0)
    named: set[str] = set()
    for place, each in enumerate(reversed(own)):
        assert each.claim.value
        for at, (loop, found) in enumerate(each.found.items()):
            colour, mark = _LOOPS.get(loop, (GREY, "d"))
            ends = np.array([found.low, found.high]) / each.claim.value
            ends = np.clip(np.where(np.isfinite(ends), ends, _REACH[1]), *_REACH)
            label = None if loop in named else loop
            named.add(loop)
            fill = "none" if each.claim.unspecified else colour
            y = place + 0.24 * (1 - at)
            panel.plot(ends, [y, y], marker=mark, ms=4, mfc=fill, color=colour, lw=1.2, label=label)
    logarithmic(panel.xaxis)
    panel.set_xlim(_REACH[0] / 3.0, _REACH[1] * 3.0)
    panel.set_yticks(range(len(own)), [each.claim.id for each in reversed(own)], fontsize=8.0)
    panel.set_ylim(-0.6, len(own) - 0.4)
    panel.set_xlabel(
        "ours over the paper's (band: within a factor of 1.5; left edge: 0; right edge: never)", fontsize=9.0
    )
    legend_below(made)
    return made
