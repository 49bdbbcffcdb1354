"""`wristctl runs figures --width`: widths in the units that journals give."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace

import pytest

from tests.cli.conftest import Call
from wristctl.config.study import Study
from wristctl.records import start_run


@pytest.fixture
def laid_out(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> list[float]:
    """Widths [in] for which figures were laid out; there are none to draw."""
    widths: list[float] = []

    @contextmanager
    def for_paper(width: float) -> Iterator[None]:
        widths.append(width)
        yield

    monkeypatch.setattr("wristctl.plotting.style.for_paper", for_paper)
    monkeypatch.setattr("wristctl.commands.perform.redrawn", lambda run, progress: SimpleNamespace(figures={}))
    with start_run("simulate", Study(), "a", tmp_path / "results"):
        pass
    return widths


@pytest.mark.parametrize(
    ("width", "inches"),
    [
        ("88mm", 88.0 / 25.4),
        ("18 cm", 18.0 / 2.54),
        ("7in", 7.0),
        ("3.5 in", 3.5),
        (" 40mm ", 40.0 / 25.4),
        ("101cm", 101.0 / 2.54),
    ],
)  # fmt: skip
def test_a_width_is_the_same_in_any_unit(call: Call, laid_out: list[float], width: str, inches: float) -> None:
    code, _, err = call("runs", "figures", "latest:simulate", "--width", width)
    assert code == 0, err
    assert laid_out == [pytest.approx(inches)]


@pytest.mark.parametrize("width", ["38mm", "3.8cm", "1.4in", "102cm", "40.1in", "0mm", "-88mm", "88", "88pt", "mm"])
def test_a_width_that_no_figure_has_is_refused(call: Call, laid_out: list[float], width: str) -> None:
    code, _, err = call("runs", "figures", "latest:simulate", f"--width={width}")
    assert code == 2 and width in err and "--width 88mm" in err and laid_out == []
