"""Table of the parameters of a loop's world that its controller does not know."""

from collections.abc import Mapping

from wristctl.commands.printed_table import Table
from wristctl.config.loop import Loop
from wristctl.config.wrist import WristParameters
from wristctl.simulation.worlds import World, mismatches

# Parameters that a figure's title names, at most.
_TOLD = 4


def truth_tables(wrist: WristParameters, loops: Mapping[str, Loop]) -> list[Table]:
    """A table of what differs in each loop, by its name, before spreads are drawn; none where nothing does."""
    worlds = {name: mismatches(World(loop, wrist)) for name, loop in loops.items()}
    rows = [(name, *mismatch) for name, differences in worlds.items() for mismatch in differences]
    if not rows:
        return []
    title = "What the world is and the controller does not know"
    return [Table(title, ("loop", "leaf", "believed", "actual", "unit"), rows)]


def truth_heading(wrist: WristParameters, loop: Loop) -> str:
    """The first of what differs, for over a figure; empty where nothing does."""
    names = [mismatch.key.rpartition(".")[2] for mismatch in mismatches(World(loop, wrist))]
    more = [f"{len(names) - _TOLD} more"] if len(names) > _TOLD else []
    return "not as believed: " + ", ".join(names[:_TOLD] + more) if names else ""


def truth_told(wrist: WristParameters, loops: Mapping[str, Loop]) -> str:
    """Differences between world and belief, a line for each, for a plan."""
    text = ""
    for table in truth_tables(wrist, loops):
        for loop, leaf, believed, actual, unit in table.rows:
            text += f"\n{loop}: {leaf} is {actual:g} {unit}".rstrip()
            text += ", believed none" if believed is None else f", believed {believed:g}"
    return text
