"""Results of a study: kept in memory, and written at once into the run directory where there is one."""

from __future__ import annotations

import base64
import html
import io
import json
import logging
import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Literal

from wristctl.commands.answer import Answer
from wristctl.commands.printed_table import Table
from wristctl.config.study import Study
from wristctl.errors import UserError, meant, reason_of
from wristctl.interrupt import asked
from wristctl.records import LiveRun, Run, stream
from wristctl.records.formats import own_look
from wristctl.records.manifest import OVERVIEW, Overview

if TYPE_CHECKING:
    import numpy as np
    import pandas as pd
    from matplotlib.figure import Figure

    from wristctl.records.formats import Columns


_log = logging.getLogger(__name__)
# Figures of a block that failed between them.
_FURTHER = "further figures"


class Metrics(dict[str, float]):
    """Numbers by name. An unknown name is a KeyError that says which is meant."""

    def __missing__(self, name: str) -> float:
        raise KeyError(f"no metric {name!r}: {meant(str(name), self)}")


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
        if name not in self._drawers:
            raise KeyError(f"no figure {name!r}: {meant(str(name), self._drawers)}")
        if name not in self._drawn:
            with own_look():
                self._drawn[name] = self._drawers[name]()
        return self._drawn[name]

    def __contains__(self, name: object) -> bool:  # a mapping's own would draw it
        return name in self._drawers

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
        """Head of the run's page, and the order of its figures."""
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
        """Record a metric: its value in `unit`, None where there is none, of `n` samples, with its 95 % interval."""
        entry = {"value": value, "unit": unit, "better": better, "n": n, "interval": interval, "meaning": meaning}
        self.metrics[name] = entry
        if self.run:
            self.run.metric(name, value, unit, better, n, interval, meaning)

    def figure(
        self, name: str, draw: Callable[..., Figure], *of: Any, caption: str = "", later: bool = False, **options: Any
    ) -> None:
        """Record a figure that `draw` makes of these arguments: drawn now into a run, else when somebody asks for it.

        Its caption is the first line of `draw`'s docstring where none is given. With `later` it waits with a run too.
        """
        drawer = partial(draw, *of, **options)
        self.figures.add(name, drawer)
        self.overview.captions[name] = caption or (draw.__doc__ or "").partition("\n")[0].removesuffix(".")
        if self.run and self._draws and not later:
            self.run.figure(name, drawer)

    @contextmanager
    def drawing(self) -> Iterator[None]:
        """A block that draws: where it fails, what was computed stands without the figures that were to come."""
        try:
            yield
        except UserError:  # the disk, above all
            raise
        except Exception as error:
            if asked():
                raise
            if self.run:
                self.run.undrawn(_FURTHER, error)
            else:
                _log.warning("%s could not be drawn: %s", _FURTHER, reason_of(error))

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
        """Path for a file of another format; None without a run."""
        return self.run.file(name) if self.run else None

    def event(self, name: str, /, **fields: Any) -> None:
        """A line of the run's journal."""
        if self.run:
            self.run.event(name, **fields)

    def numerics(self, **facts: Any) -> None:
        """Note in the run's manifest how numbers were computed."""
        if self.run:
            self.run.numerics(**facts)

    def summary(self, markdown: str) -> None:
        """Words for the run's README.md."""
        if self.run:
            self.run.summary(markdown)


@dataclass(frozen=True, repr=False, eq=False)
class StudyResult(ABC):
    """A study's metrics, tables and figures; each kind of study adds what else it found.

    The same with and without a run directory.
    """

    kind: ClassVar[str]
    """The command that makes such a result."""

    study: Study
    """As it was performed: inputs that have a run directory are named in it."""
    findings: Findings
    tables: Sequence[Table]
    """Tables that the command prints."""

    @abstractmethod
    def frame(self) -> pd.DataFrame:
        """The main table."""

    def courses(self) -> Mapping[str, Mapping[str, Any]]:
        """Columns over time, under the name of the file in which a run directory keeps them; none by default."""
        return {}

    @property
    def fault(self) -> UserError | None:
        """Error with which the command ends after a complete study: a result that cannot stand; None where it can."""
        return None

    @property
    def answer(self) -> Answer | None:
        """The answer for one screen; None where the tables are the answer."""
        return None

    @property
    def place(self) -> str:
        """Path of the run directory; empty where the result is in memory only."""
        return str(self.findings.run.path) if self.findings.run else ""

    @cached_property
    def summary(self) -> Sequence[str]:
        """The answer in lines of at most 100 columns; empty where the tables are the answer."""
        return self.answer.lines() if self.answer is not None else ()

    def at_a_point(self) -> tuple[Mapping[str, Sequence[Any]], Mapping[str, Mapping[str, Any]]]:
        """What a sweep keeps of it at one point: columns of values by name, and what is known of each of these.

        Here a row of metrics with their units, in the units of metrics.json.
        """
        metrics = self.findings.metrics
        values = {name: [value] for name, value in self.metrics.items()}
        return values, {name: {"unit": metric["unit"]} for name, metric in metrics.items()}

    @property
    def marks(self) -> list[str]:
        """Why a result is no good, in a word or two each: the verdict on the run's page; empty where it is sound."""
        return []

    @property
    def metrics(self) -> Metrics:
        """Numbers by name, in the units that the run's metrics.json gives; nan where there is none."""
        values = {name: metric["value"] for name, metric in self.findings.metrics.items()}
        return Metrics({name: math.nan if value is None else value for name, value in values.items()})

    @property
    def figures(self) -> Figures:
        """matplotlib figures by name, each drawn when it is first asked for."""
        return self.findings.figures

    @cached_property
    def run(self) -> Run | None:
        """The sealed run directory; None where the result is in memory only."""
        return Run(self.findings.run.path) if self.findings.run else None

    def _repr_html_(self) -> str:
        """The answer and its table as the run's page shows them, then the figure of the answer, for a notebook.

        An answer without a table has the metrics that head the page in its place.
        """
        from wristctl.plotting.page import blocks, for_a_page, headline, render

        answer = for_a_page(blocks(self.summary or str(self).split("\n")))
        tabled = any(block["kind"] == "table" for block in answer)
        metrics = [] if tabled else headline(self.findings.metrics, self.findings.overview.cards, ended=True)
        name = self.findings.overview.figure or next(iter(self.figures), "")
        return render("notebook.html", answer=answer, headline=metrics) + (_picture(self.figures, name) if name else "")

    def __str__(self) -> str:
        return "\n\n".join([*["\n".join(self.summary)] * bool(self.summary), *(table.text() for table in self.tables)])

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {self.place or 'in memory'}; {len(self.metrics)} metrics; {self.figures!r}>"


def _picture(figures: Figures, name: str) -> str:
    """A figure for a notebook; the reason where it cannot be drawn."""
    content = io.BytesIO()
    try:
        with own_look():
            figures[name].savefig(content, format="png", dpi=100)
    except Exception as error:
        return f"<p>{html.escape(f'figure {name} could not be drawn: {reason_of(error)}')}</p>"
    source = f"data:image/png;base64,{base64.b64encode(content.getvalue()).decode('ascii')}"
    return f'<img alt="{html.escape(name)}" style="max-width: 100%" src="{source}">'
