"""A disturbance observer that laws may carry: the load torque by which the wrist's momentum differs from the model's.

Ohnishi, Shibata and Murakami, IEEE/ASME Trans. Mechatronics 1 (1996) 54, on the momentum M rate (De Luca and Mattone,
ICRA 2003), so that no acceleration is measured. It needs three values of memory, from `first` on.
"""

from typing import Any

from wristctl.control.model import one_segment_terms
from wristctl.lanes.compiled import compiled
from wristctl.lanes.functions import clip, expm1_of_negative
from wristctl.lanes.lane import where, zero_like

# Memory that it needs: the load that it has found, the momentum that it expects, and whether it has begun.
VALUES = 3


@compiled
def disturbance(now: Any, wrist: Any, bandwidth: Any, memory: Any, first: int) -> Any:
    """The load torque [N m] that acts on the one-segment wrist beside the law's, low-passed at `bandwidth` [rad/s].

    What the momentum has gained over a period beyond the model's is the error of the load held until now; a share
    1 - exp(-bandwidth period) of it is taken up, so that any bandwidth is stable, and an infinite one takes the last
    period's load. What slow motors have withheld is no load (anti-windup).
    """
    inertia, _, _ = one_segment_terms(wrist, now.theta)
    expected = memory[first + 1] - now.period * now.withheld
    gained = where(memory[first + 2] > 0.0, inertia * now.rate - expected, 0.0)
    return memory[first] - expm1_of_negative(-bandwidth * now.period) * gained / now.period


@compiled
def remember(now: Any, wrist: Any, load: Any, torque: Any, memory: Any, first: int) -> None:
    """Keep the load found and the momentum that the model expects a period from now under `torque` and that load.

    The tendons reach no more torque than `now` says.
    """
    inertia, curving, gravity = one_segment_terms(wrist, now.theta)
    resisting = gravity + wrist.damping * now.rate + wrist.stiffness * now.theta - curving * now.rate * now.rate
    delivered = clip(torque, now.torque_low, now.torque_high)
    memory[first] = load
    memory[first + 1] = inertia * now.rate + now.period * (delivered + load - resisting)
    memory[first + 2] = 1.0 + zero_like(load)
