"""Table of how stiff a wrist is while its motors hold still, and how stiff co-contraction makes it."""

from __future__ import annotations

import math

from wristctl.commands.printed_table import Table
from wristctl.config.loop import Loop
from wristctl.config.wrist import WristParameters


def stiffness_table(wrist: WristParameters, loop: Loop, planes: int) -> Table:
    """Table of the straight wrist's stiffness while its motors hold still, over bends, and the most it can have."""
    from wristctl.wrist.spatial.co_contraction import held_wrist, least_pulls, most_stiffness
    from wristctl.wrist.tendon_layout import TendonLayout

    layout = TendonLayout.of(wrist) if planes == 2 else None
    held = held_wrist(wrist, loop, layout)._replace(pulls=least_pulls(wrist, loop, layout))
    rows = []
    for degrees in sorted({0.01, loop.stiffness_over_deg, 3.0}):
        bend = math.radians(degrees)
        rows.append((degrees, *held.over(bend), most_stiffness(wrist, loop, layout, bend)))
    on = "spools" if loop.actuator.winds else "pulls"
    alike = ", ".join(f"{pull:.3g}" for pull in held.pulls / held.layout.multiplicity)
    title = f"Stiffness [N m/rad] of the straight wrist on held {on}, its tendons pulling {alike} N"
    return Table(title, ("over [deg]", "least", "largest", "least, by co-contraction"), rows)
