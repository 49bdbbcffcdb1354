"""docs/benchmarks.md from one run's results: `python benchmarks/peers/docs.py FOLDER`.

The folder holds peers.json of run.py, cold_start.json, cost_model.json and scaling.json; a part whose file is missing
is left out.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

from bend_truth import SIZE_DEG, TURN, WRIST
from bends import FINE, SAME
from claims import Claim, beside_peers, in_two_planes, of_cold_start, of_costs
from picture import figure
from rates import Result
from report import claims_table, markdown
from table import OURS

from wristctl.lanes.types import LANES

ONE_LANE = (
    "One rollout alone runs in a kernel of its own, one lane wide, and has the bits that it has in a block of many: a "
    "product and a sum fuse where the equations are written so, whatever the width. C's one lane is a build of its own "
    "as well. JAX compiles anew for every number of lanes, and runs one rollout four lanes wide, where it is fastest.\n"
)
DOCS = Path(__file__).resolve().parents[2] / "docs"


def about(result: Result) -> str:
    """What was measured, on what, and where a side's problem is another one."""
    raw, machine = result.raw, result.raw["machine"]
    lines = [
        "# How fast\n",
        "Made by `make bench-all`, which measures, and writes this page. One closed loop, run by everything that can "
        "run it: the planar wrist of n segments, the paper's sliding mode control at 1 kHz (P1, P2, P3 = "
        f"{', '.join(f'{g:g}' for g in raw['task']['gains'])}), tendons with limits, a 30 degree minimum-jerk move of "
        f"{raw['task']['move']:g} s. Speed is simulated seconds per second of wall time, compiled before, the median "
        "of alternating runs; one thread means one core. Error is the largest difference of the tip angle over the "
        "first second from an implicit solution (SciPy's Radau at 1e-10 on the same equations; for a side that solves "
        "other equations, from itself with much smaller steps). A side runs with one integration step a tick and, "
        "where that is less exact than wristctl, with the fewest steps (in powers of two) that reach its error.\n",
        f"Machine: {machine['processor']}, {machine['cores']} cores{', AVX-512' if machine['avx512'] else ''}; "
        f"{machine['compiler']}; Python {machine['python']}; wristctl {machine['commit']}; {machine['date']}; load "
        f"{machine['load']:.1f} at the start. Peers: "
        + "; ".join(" ".join(names) for names in machine["requirements"].values()) + ".\n",
        "| side | problem it solves | its own motion differs from the wrist's by [rad] |\n|---|---|---|",
    ]  # fmt: skip
    for side, of in raw["sides"].items():
        found = {n: known[side] for n, known in raw["errors"].items() if "errors" in known.get(side, {})}
        apart = [f"{known['model_difference']:.1e} (n = {n})" for n, known in found.items()]
        same = of["problem"].startswith("the same equations")
        lines.append(f"| {side} | {of['problem']} | {'-' if same else ', '.join(apart)} |")
    missing = [f"- {line}" for line in result.failures()]
    return "\n".join([*lines, *(["\nLeft out:\n", *missing] if missing else [])]) + "\n"


def roofline(result: Result) -> str:
    """Operations and bytes a tick, and the share of the peak that wristctl and the C loop reach."""
    raw = result.raw
    if "peaks" not in raw:
        return ""
    lines = [
        "## How close to the machine\n",
        "Operations of one lane's tick, counted by running the equations on numbers that count (controller, "
        "allocation, a step of RODAS3, metrics); the peak is that of independent fused multiply-adds in the widest "
        "registers, measured in the same run; a division takes the time of as many operations as the ratio "
        "of the two peaks.\n",
        "| n | threads | + | x | / | peak [GF/s] | wristctl [GF/s] | share | C loop [GF/s] | share |\n"
        "|---|---|---|---|---|---|---|---|---|---|",
    ]  # fmt: skip
    for n in result.axis("segments"):
        counts = raw["operations"][str(n)]
        flops = sum(counts.values())
        for threads in result.axis("threads"):
            peak, lanes = raw["peaks"][str(threads)]["multiply_add"], max(result.axis("lanes"))
            cells = [f"{n}", f"{threads}", *(f"{counts[name]:,}" for name in "+*/"), f"{peak / 1e9:.0f}"]
            for peer in (OURS, "C"):
                fastest = max(
                    (result.rate(v, n, threads, lanes) or 0.0 for v in result.variants(n) if v.peer == peer),
                    default=0.0,
                )
                reached = flops * fastest / raw["task"]["period"]
                cells += [f"{reached / 1e9:.1f}", f"{100.0 * reached / peak:.0f} %"]
            lines.append("| " + " | ".join(cells) + " |")
    peak = raw["peaks"]["1"]
    cost = peak["multiply_add"] / peak["divide"]
    notes = []
    for n in result.axis("segments"):
        counts, rate = raw["operations"][str(n)], result.own_rate(n, 1, 1024)
        if rate:
            dividing = counts["/"] / peak["divide"] * rate / raw["task"]["period"]
            notes.append(f"{100.0 * dividing:.0f} % of the time at n = {n}")
    sizes = ", ".join(f"{size / 1024:.0f} KiB (n = {n})" for n, size in raw["scratch"].items())
    lines.append(
        f"\nFrom memory a tick of a block of {LANES} lanes reads one row of its reference, 24 bytes for each motion; "
        f"its own state and scratch ({sizes}) fit the nearest caches. So memory's bandwidth is no limit: this is the "
        "roofline's flat part. What keeps the loop below the peak is that only a product next to a sum fuses with it, "
        "that one step is a chain of operations that wait for each other, loads and stores of the scratch, and "
        f"divisions: {cost:.0f} operations' time each, {', '.join(notes)}. What that led to: series of as few terms as "
        "their accuracy needs, summed by Estrin's scheme, which waits less than Horner's; blocks of one register, so "
        "that four segments' matrices stay in them; one division in the allocation instead of two; tendon torques once "
        "a stage; no product with a zero acceleration; one call for many blocks. What it suggests next: a symmetric "
        "factorisation of the mass matrix.\n"
    )
    return "\n".join(lines)


def two_planes(result: Result) -> str:
    """The same comparison for the wrist that bends in two planes."""
    apart = ", ".join(f"{apart:.1e} rad (n = {n})" for n, apart in result.raw["apart"].items())
    lines = [
        "## Two planes\n",
        f"The hand circles about the straight wrist by {SIZE_DEG:g} degrees, a turn in {TURN:g} s. The paper's sliding "
        "mode control runs once for each plane at 1 kHz, with the gains above; what the planes do to each other is "
        "left to it. One allocation shares both torques among four tendons, and the bend is measured as it is. Gravity "
        f"is ({', '.join(f'{g:g}' for g in (*WRIST.gravity, WRIST.gravity_flexion))}) m/s^2, and springs are "
        f"{WRIST.flexion_ratio:g} times as stiff toward flexion as toward ulnar. "
        "One core. wristctl and C sum what metrics are made of; C keeps one lane's motion beside, wristctl that of a "
        f"lane alone. Their coordinates differ by at most {apart or '-'} over the first "
        f"second; {SAME:g} rad would end the run. Error is the largest difference of a segment's bend over the first "
        f"second from wristctl's motion with {FINE} steps a tick; for a side that solves other equations, from its own "
        "motion with much smaller steps.\n",
        *(f"- {side}: {of['problem']}" for side, of in result.raw["sides"].items()),
    ]  # fmt: skip
    lines += [f"- left out: {line}" for line in result.failures()]
    return "\n".join(lines) + "\n\n" + markdown(result)


def cold_start(rows: dict[str, Any]) -> str:
    """Seconds of each command."""
    lines = ["## Cold start\n"]
    lines.append(
        "Seconds of each command's smallest run (medians), its cache of compiled kernels empty, then filled; in "
        "brackets until its first report of progress; beside it the processor time. The first run compiles, the "
        "second does not.\n"
    )
    lines.append("| command | import | first | again | processor: first | again |\n|---|---|---|---|---|---|")
    for command, row in rows.items():
        first, again = (
            f"{run['whole']:.1f}" + (f" ({run['first_progress']:.1f})" if "first_progress" in run else "")
            for run in (row["first"], row["again"])
        )
        spent = " | ".join(f"{row[turn]['processor']:.1f}" for turn in ("first", "again"))
        lines.append(f"| {command} | {row['import']:.2f} | {first} | {again} | {spent} |")
    return "\n".join(lines) + "\n"


def cost_model(costs: dict[str, Any]) -> str:
    """Exponents and what they mean for a study."""
    rows = [
        *((f"lanes, n = {n}", value, costs["lanes"][n], "lanes") for n, value in costs["slope_by_lanes"].items()),
        ("segments", costs["slope_by_segments"], costs["segments"], "segments"),
        ("horizon", costs["slope_by_horizon"], costs["horizon"], "horizon"),
    ]
    lines = ["## Cost model\n", f"Time grows as size to a power ({costs['threads']} threads):\n"]
    lines.append("| size | from | to | exponent |\n|---|---|---|---|")
    for name, value, points, over in rows:
        ends = (f"{points[k][over]:,g}: {points[k]['seconds']:.3g} s" for k in (0, -1))
        lines.append(f"| {name} | {' | '.join(ends)} | {value:.2f} |")
    stream = costs["stream"]
    lines.append(
        f"\nA lane of a batch takes {costs['bytes_per_lane']:,.0f} bytes beyond the program itself. A stream "
        f"(`wristctl.simulation.rollout`) of {stream['rollouts']:,} rollouts of 5 s, n = 1, in batches of "
        f"{stream['batch']:,} took {stream['seconds']:.1f} s; its peak memory grew by {stream['growth_mib']:.1f} MiB "
        "after the first batch."
    )
    return "\n".join(lines) + "\n"


def scaling(found: dict[str, Any]) -> str:
    """Shares of the workers' time that go to units of work, by their number."""
    dask, simulated, most = found["dask"], found["simulated"], found["most"]
    lines = [
        "## Over a cluster's workers\n",
        "A study is handed out in [units of work](cluster.md); one of tests takes 20 s or more of a core "
        f"([what rollouts cost](cost.md)). Here each unit waits for {found['takes']:g} s, so that cores are no limit. "
        "The table gives the share of the workers' time that units fill: of worker processes of a Dask scheduler on "
        "this machine, and of simulated workers. A simulated worker's unit ends by a clock, and no network lies "
        "between; handing units out and keeping their results is the program's own work. Measured on "
        f"{found['date']}.\n",
        "| workers | Dask processes | simulated |\n|---|---|---|",
    ]  # fmt: skip
    for many, share in simulated.items():
        measured = f"{100.0 * dask[many]:.0f} %" if many in dask else "-"
        lines.append(f"| {int(many):,} | {measured} | {100.0 * share:.0f} % |")
    least = max(map(int, simulated)) / most["dask"]
    lines.append(
        f"\nUnits that take no time are handed out and kept at {most['simulated']:.0f} a second, through Dask on this "
        f"machine at {most['dask']:.0f}. At that rate 1,000 workers are kept busy where a unit takes {least:.0f} s or "
        "more."
    )
    return "\n".join(lines) + "\n"


def main() -> None:
    """Write docs/benchmarks.md and its picture."""
    folder = Path(sys.argv[1])
    read = {name: folder / f"{name}.json" for name in ("peers", "cost_model", "cold_start", "scaling")}
    found = {name: json.loads(file.read_text()) for name, file in read.items() if file.exists()}
    result = Result(found["peers"])
    claims: list[Claim] = beside_peers(result)
    parts = [markdown(result)]
    if "bends" in result.raw:
        bends = Result(result.raw["bends"])
        claims += in_two_planes(bends, result)
        parts.append(two_planes(bends))
    parts.append(roofline(result))
    for name, claimed, section in (
        ("cost_model", of_costs, cost_model), ("cold_start", of_cold_start, cold_start),
    ):  # fmt: skip
        if name in found:
            claims += claimed(found[name])
            parts.append(section(found[name]))
    if "scaling" in found:
        parts.append(scaling(found["scaling"]))
    page = [about(result), "## Wanted and measured\n", claims_table(claims), ONE_LANE]
    page += [
        "![Closed loops a second by wristctl and its peers, and their ratios](images/benchmarks.svg)\n",
        "## Rates\n",
        *parts,
    ]
    (DOCS / "images").mkdir(parents=True, exist_ok=True)
    (DOCS / "benchmarks.md").write_text("\n".join(page))
    figure(result, DOCS / "images" / "benchmarks")
    for claim in claims:
        print(f"{claim.verdict:12} {claim.wanted}: {claim.measured}")


if __name__ == "__main__":
    main()
