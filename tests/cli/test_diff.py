"""The tables of `wristctl runs diff`: what changed, from what to what, and by how much."""

from __future__ import annotations

import re
from pathlib import Path

from tests.cli.conftest import Call
from wristctl.config.study import Study
from wristctl.records import InputRun, Run, start_run


def _made(kind: str, metrics: dict[str, float | None], *inputs: InputRun, out: Path = Path("results")) -> Run:
    with start_run(kind, Study(), "", out, inputs=inputs) as live:
        for name, value in metrics.items():
            live.metric(name, value)
    return Run(live.path)


def test_a_change_is_told_in_its_unit_and_in_per_cent_of_what_was(call: Call) -> None:
    before = {"rise": 2.0, "fall": -4.0, "zero": 0.0, "lost": 1.0, "found": None, "same": 7.0}
    after = {"rise": 3.0, "fall": -5.0, "zero": 5.0, "lost": None, "found": 1.0, "same": 7.0}
    a, b = _made("tune", before), _made("tune", after, out=Path("elsewhere"))
    code, out, _ = call("runs", "diff", a.id, str(b.path))
    rows = {line.split()[0]: line.split()[1:] for line in out.splitlines() if line}
    assert code == 0 and re.search(r"metric +before +after +change +change \[%\]", out)
    assert rows["rise"] == ["2", "3", "1", "50"] and rows["fall"] == ["-4", "-5", "-1", "-25"]
    assert rows["zero"] == ["0", "5", "5", "-"], "nothing is a part of nothing"
    assert rows["lost"] == ["1", "-", "-", "-"] and rows["found"] == ["-", "1", "-", "-"]
    assert "same" not in rows and "Configuration" not in rows


def test_metrics_stand_after_the_configuration_and_inputs_last(call: Call) -> None:
    data = _made("gen-data", {})
    a, b = _made("train", {"rmse": 1.0}), _made("tune", {"rmse": 2.0}, InputRun("data", data))
    out = call("runs", "diff", a.id, b.id, "--all")[1]
    assert out.index("Configuration") < out.index("Metrics") < out.index("Inputs")
    (row,) = [line.split() for line in out[out.index("Inputs") :].splitlines() if line.startswith("data")]
    assert row == ["data", "-", data.result_hash]


def test_of_many_differences_or_unlike_runs_a_few_lines_say_so(call: Call) -> None:
    many: dict[str, float | None] = {f"m{number}": float(number) for number in range(60)}
    after: dict[str, float | None] = dict.fromkeys(many, -1.0)
    a, b = _made("tune", many), _made("tune", after, out=Path("elsewhere"))
    short, whole = (call("runs", "diff", a.id, str(b.path), *more)[1] for more in ((), ("--all",)))
    assert len(short.splitlines()) <= 10 and "--all" in short and "57 more" in short and "m3 " not in short
    assert len(whole.splitlines()) > 60 and "--all" not in whole
    other = _made("train", {"m0": 0.0})
    unlike = call("runs", "diff", a.id, other.id)[1]
    assert len(unlike.splitlines()) <= 10 and "different kinds: tune and train" in unlike
    assert "different kinds" not in short + whole
