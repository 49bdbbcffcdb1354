"""What strangers might add to wristctl: one file each, and one line here, in a table."""

from __future__ import annotations

from elsewhere.coordinate_search import CoordinateSearch
from elsewhere.hinge import HINGE
from elsewhere.lqr import LQR
from elsewhere.motions import CHIRP, TREMOR
from elsewhere.smoothness import JERK
from wristctl.control.table import CONTROLLERS
from wristctl.simulation.disturbances import DISTURBANCES
from wristctl.simulation.metrics import METRICS
from wristctl.simulation.reference import REFERENCES
from wristctl.tuning.optimisers import OPTIMISERS
from wristctl.wrist.plant import PLANTS

CONTROLLERS["lqr"] = LQR
REFERENCES["sweep"] = CHIRP
DISTURBANCES["tremor"] = TREMOR
METRICS["jerk"] = JERK
OPTIMISERS["coordinates"] = CoordinateSearch
PLANTS["hinge"] = HINGE
