"""The trials while they go on: a live panel on a terminal, plain lines elsewhere."""

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from rich.live import Live
from rich.panel import Panel
from rich.progress_bar import ProgressBar
from rich.table import Table as Grid

from wristctl.cli.progress import Terminal
from wristctl.commands.session import Session
from wristctl.trial.control_loop import Shown
from wristctl.trial.trials import Trial

# Panels a second.
_PICTURES = 8.0


class _Panel:
    """The newest tick, drawn when asked."""

    def __init__(self, trials: Sequence[Trial]) -> None:
        self._trials, self._row = trials, dict[str, Any]()
        self._begun, self._verdict = 0, "-"

    def take(self, row: dict[str, Any]) -> None:
        self._row, self._begun = row, max(self._begun, row["trial"] + 1)
        newest = [str(value) for name, value in row.items() if name.startswith("verdict") and value]
        self._verdict = ", ".join(newest) or self._verdict  # most ticks have no new frame

    def __rich__(self) -> Panel:
        row = self._row
        if not row:
            return Panel("homing: each motor reels in until its tendon bends the wrist", title="hw-run")
        number = row["trial"]
        grid = Grid.grid(padding=(0, 2))
        for angle, suffix in (("theta", ""),) if "theta" in row else (("bend", "_ulnar"), ("bend", "_flexion")):
            bent, wanted = (math.degrees(row[f"{name}{suffix}"]) for name in (angle, f"{angle}_ref"))
            load = f"{row[f'load{suffix}']:+.3f} N m"
            name = f"toward {suffix[1:]}" if suffix else "angle"
            grid.add_row(name, f"{bent:7.2f} deg", "reference", f"{wanted:7.2f} deg", "load", load)
        for name, unit in (("tension", "N"), ("sent", "steps/s")):
            own = {key.removeprefix(f"{name}_"): value for key, value in row.items() if key.startswith(f"{name}_")}
            values = (f"{tendon}: {value:6.1f}" for tendon, value in own.items())
            grid.add_row(name, *values, unit)
        grid.add_row("motors", row["state"], "seen", self._verdict, "late", f"{max(0.0, 1e3 * row['late']):.2f} ms")
        grid.add_row("time", f"{row['time']:.2f} s")
        title = "between trials" if number < 0 else _title(self._trials[number], len(self._trials))
        layout = Grid.grid()
        layout.add_row(grid)
        layout.add_row(ProgressBar(total=len(self._trials), completed=self._begun - (number >= 0), width=60))
        return Panel(layout, title=title)


@contextmanager
def panel_shown(console: Terminal, trials: Sequence[Trial]) -> Iterator[Shown]:
    """Show each tick that is handed in."""
    panel = _Panel(trials)
    with Live(panel, console=console, refresh_per_second=_PICTURES, transient=True):
        yield panel.take


@contextmanager
def trials_counted(session: Session, trials: Sequence[Trial]) -> Iterator[Shown]:
    """Count the trials by the ticks that are handed in."""
    with session.progress("homing, then trials", len(trials), "trials") as advance:
        begun = -1

        def take(row: dict[str, Any]) -> None:
            nonlocal begun
            if row["trial"] > begun:
                begun = row["trial"]
                advance(begun)

        yield take
        advance(begun + 1)


def _title(trial: Trial, count: int) -> str:
    """A trial in a few words."""
    pushed = f", pushed with {trial.push:g} N" if trial.push else ""
    return f"trial {trial.number + 1} of {count}: {trial.direction}{pushed}"
