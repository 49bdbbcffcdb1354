"""One step of any plant, with its tendons' state and an end where it leaves what it can be."""

from typing import Any

from wristctl.lanes.compiled import spelled_out
from wristctl.lanes.lane import where, zero_like
from wristctl.lanes.rows import lanes_like
from wristctl.wrist.elastic import update_memory
from wristctl.wrist.plant import advance, path_along, within


@spelled_out
def advance_or_stop(plant: Any, q: Any, rate: Any, spool_input: Any, tendons: Any, h: Any, alive: Any) -> Any:
    """`advance`, but a plant that leaves what it can be stays where it was for good.

    Returns which are still alive, and an estimate of the step's error as an angle [rad]: of a plant that leaves what it
    can be in this step 1, of one that is not alive 0.
    """
    before = lanes_like(q)
    for i in range(len(q)):
        before[i] = q[i]
    of_bend, of_rate = advance(plant, q, rate, spool_input, tendons, h)
    zero = zero_like(alive)
    well = where(within(plant, q), alive, zero)
    error = where(well > zero, abs(of_bend) + h * abs(of_rate), alive)
    for i in range(len(q)):
        q[i] = where(well > zero, q[i], before[i])
        rate[i] = where(well > zero, rate[i], zero)
    update_memory(tendons, q, spool_input, path_along(tendons, plant, q))
    return well, error
