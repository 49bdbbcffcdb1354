"""docs/benchmarks.md from committed results: `python benchmarks/peers/docs.py benchmarks/results/peers.json`.

Beside the result of run.py it takes cold_start.json and cost_model.json from the same folder where they are there.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

from report import figure, markdown

DOCS = Path(__file__).resolve().parents[2] / "docs"


def about(result: dict[str, Any]) -> str:
    """What was measured, on what, and where a side's problem is another one."""
    machine = result["machine"]
    lines = [
        "# How fast\n",
        "One closed loop, run by everything that can run it: the planar wrist of n segments, the paper's sliding mode "
        f"law at 1 kHz (P1, P2, P3 = {', '.join(f'{g:g}' for g in result['task']['gains'])}), tendons with limits, a "
        f"30 degree minimum-jerk move of {result['task']['move']:g} s. Speed is simulated seconds per second of wall "
        "time, compiled before, the median of alternating runs; one thread means one core. Error is the largest "
        "difference of the tip angle over the first second from an implicit solution (SciPy's Radau at 1e-10 on the "
        "same equations; for a side "
        "that solves other equations, from itself with much smaller steps).\n",
        f"Machine: {machine['processor']}, {machine['cores']} cores{', AVX-512' if machine['avx512'] else ''}; "
        f"{machine['compiler']}; Python {machine['python']}; wristctl {machine['commit']}; {machine['date']}; load "
        f"{machine['load']:.1f} at the start. Peers: "
        + "; ".join(" ".join(names) for names in machine["requirements"].values()) + ".\n",
        "| side | problem it solves | its own motion differs from the wrist's by [rad] |\n|---|---|---|",
    ]  # fmt: skip
    for side, of in result["sides"].items():
        found = {n: errors[side]["model_difference"] for n, errors in result["errors"].items() if side in errors}
        apart = [f"{value:.1e} (n = {n})" for n, value in found.items()]
        same = of["problem"].startswith("the same equations")
        lines.append(f"| {side} | {of['problem']} | {'-' if same else ', '.join(apart)} |")
    return "\n".join(lines) + "\n"


def cold_start(rows: dict[str, Any]) -> str:
    """Seconds of each command."""
    lines = ["## Cold start\n"]
    lines.append("Seconds of each command's smallest run, its cache of compiled kernels empty, then filled.\n")
    lines.append("| command | import | first | again |\n|---|---|---|---|")
    for command, row in rows.items():
        lines.append(f"| {command} | {row['import']:.2f} | {row['first']['whole']:.1f} | {row['again']['whole']:.1f} |")
    return "\n".join(lines) + "\n"


def cost_model(result: dict[str, Any]) -> str:
    """Slopes and what they mean for a study."""
    lines = ["## Cost model\n", "Time grows as size to the power of:\n", "| size | exponent |\n|---|---|"]
    lines += [f"| {name} | {value:.2f} |" for name, value in result["slope"].items()]
    lines.append(
        f"\nMemory: {result['bytes_per_lane']:,.0f} bytes a lane beyond the program itself. A million rollouts of 5 s "
        f"(n = 1, one thread), by extrapolation from {result['lanes']['1'][-1]['lanes']:,}: "
        f"{result['minutes_of_a_million_5_s_rollouts']:.0f} minutes."
    )
    return "\n".join(lines) + "\n"


def main() -> None:
    """Write docs/benchmarks.md and its picture."""
    source = Path(sys.argv[1])
    result = json.loads(source.read_text())
    parts = [about(result), "![rates](images/benchmarks.svg)\n", "## Rates\n", markdown(result)]
    for name, section in (("cold_start", cold_start), ("cost_model", cost_model)):
        if (file := source.with_name(f"{name}.json")).exists():
            parts.append(section(json.loads(file.read_text())))
    (DOCS / "images").mkdir(parents=True, exist_ok=True)
    (DOCS / "benchmarks.md").write_text("\n".join(parts))
    figure(result, DOCS / "images" / "benchmarks")


if __name__ == "__main__":
    main()
