"""What a study has found so far: kept in memory, and written at once into the run directory where there is one."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from wristctl.records import LiveRun, stream
from wristctl.records.manifest import OVERVIEW
from wristctl.records.overview import Overview

if TYPE_CHECKING:
    import numpy as np
    from matplotlib.figure import Figure

    from wristctl.records.formats import Columns


class Figures(Mapping[str, "Figure"]):
    """Figures by name, each drawn when it is first asked for."""

    def __init__(self) -> None:
        self._drawers: dict[str, Callable[[], Figure]] = {}
        self._drawn: dict[str, Figure] = {}

    def add(self, name: str, draw: Callable[[], Figure]) -> None:
        """One more, or another in place of one that was there."""
        self._drawers[name] = draw
        self._drawn.pop(name, None)

    def __getitem__(self, name: str) -> Figure:
        if name not in self._drawn:
            self._drawn[name] = self._drawers[name]()
        return self._drawn[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._drawers)

    def __len__(self) -> int:
        return len(self._drawers)

    def __repr__(self) -> str:
        return f"figures {', '.join(self)}"


class Findings:
    """Metrics and figures of a study; with a run directory these, tables, arrays and files are written as they come.

    Without one nothing touches the disk: what is only written is passed over. Where it `draws` not, every figure is for
    later.
    """

    def __init__(self, seed: int, run: LiveRun | None = None, draws: bool = True) -> None:
        self.run = run
        self.metrics: dict[str, dict[str, Any]] = {}
        """value, unit, better, n, interval and meaning by name, as a run's metrics.json has them"""
        self.figures = Figures()
        self.overview = Overview()
        """What the run's page begins with, and in which order it shows the figures."""
        self._seed, self._draws = seed, draws

    def stream(self, name: str) -> tuple[int, int]:
        """Entropy of the random stream `name` for `numpy.random.default_rng`: the same with and without a run."""
        return self.run.stream(name) if self.run else stream(self._seed, name)

    def note_streams(self, names: Iterable[str]) -> None:
        """Note in the run which streams were drawn from."""
        for name in names:
            self.stream(name)

    def metric(
        self,
        name: str,
        value: float | None,
        unit: str = "",
        better: Literal["lower", "higher", ""] = "",
        n: int = 1,
        interval: tuple[float, float] | None = None,
        meaning: str = "",
    ) -> None:
        """A number with unit, better direction, sample size and interval; None: there is none."""
        known = {"value": value, "unit": unit, "better": better, "n": n, "interval": interval, "meaning": meaning}
        self.metrics[name] = known
        if self.run:
            self.run.metric(name, value, unit, better, n, interval, meaning)

    def figure(
        self, name: str, draw: Callable[..., Figure], *of: Any, caption: str = "", later: bool = False, **how: Any
    ) -> None:
        """The figure that `draw(*of, **how)` gives: drawn now into a run, else when somebody asks for it.

        The `caption` says what it shows; one for `later` is drawn when somebody asks for it in any case.
        """
        drawer = partial(draw, *of, **how)
        self.figures.add(name, drawer)
        self.overview.captions[name] = caption
        if self.run and self._draws and not later:
            self.run.figure(name, drawer())

    def headline(self, *metrics: str) -> None:
        """The metrics that head the run's page."""
        self.overview.cards[:] = metrics

    def keep_overview(self) -> None:
        """Write down for the run's page what is known of it by now."""
        if self.run:
            self.run.file(OVERVIEW).write_text(self.overview.text(), encoding="utf-8")

    def table(
        self,
        name: str,
        columns: Columns,
        units: Mapping[str, str] | None = None,
        meaning: Mapping[str, str] | None = None,
    ) -> None:
        """Columns, or a DataFrame, for a CSV file of the run; the columns' units and meaning are noted."""
        if self.run:
            self.run.table(name, columns, units, meaning)

    def arrays(self, name: str, arrays: Mapping[str, np.ndarray]) -> None:
        """Arrays for an npz file of the run."""
        if self.run:
            self.run.arrays(name, arrays)

    def text(self, name: str, text: str) -> None:
        """A text file of the run."""
        if self.run:
            self.run.file(name).write_text(text, encoding="utf-8")

    def plain(self, name: str, content: Any, volatile: bool = False) -> None:
        """A JSON file of the run; volatile ones stand outside the result hash."""
        self.text(name, json.dumps(content, indent=2, allow_nan=False) + "\n")
        if self.run and volatile:
            self.run.volatile(name)

    def file(self, name: str) -> Path | None:
        """Where to write a file of another format; None without a run."""
        return self.run.file(name) if self.run else None

    def event(self, name: str, /, **fields: Any) -> None:
        """A line of the run's journal."""
        if self.run:
            self.run.event(name, **fields)

    def numerics(self, **facts: Any) -> None:
        """How numbers were computed, for the run's manifest."""
        if self.run:
            self.run.numerics(**facts)

    def summary(self, markdown: str) -> None:
        """Words for the run's README.md."""
        if self.run:
            self.run.summary(markdown)
