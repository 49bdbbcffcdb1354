"""README.md of a run: what a stranger needs to read it."""

from __future__ import annotations

import shlex

from wristctl.records.manifest import CONFIG, MANIFEST, PACKAGES, PATCH, SUMS, Manifest, TakenOver, command_of


def readme(manifest: Manifest, summary: str) -> str:
    """The run in a page: command, inputs, result, files with their columns, how to repeat and to check it."""
    lines = [
        f"# {manifest.id}",
        "",
        f"`{shlex.join(manifest.argv)}`: {manifest.state}, wristctl {manifest.code.version}, "
        f"seed {manifest.seed}, started {manifest.timing.started}, {manifest.timing.wall_s or 0:.1f} s.",
        *(
            f"\nInput `{each.role}`: {each.kind} run {each.run} (result {each.result_sha256[:12]})."
            for each in manifest.inputs
        ),
        *([_taken_over(manifest.units)] if manifest.units else []),
        *([f"\nError: {manifest.error.what} {manifest.error.where}".rstrip()] if manifest.error else []),
        *(["", "## Result", "", summary.strip()] if summary else []),
        *(["", "## Files", ""] if manifest.outputs else []),
    ]
    units = [each for each in manifest.outputs if each.path.startswith("units/")]
    if units:
        lines.append(
            f"- `units/` (outside the result hash): {len(units)} units of work, for a run that goes on from here"
        )
    for output in manifest.outputs:
        if output in units:
            continue
        lines.append(f"- `{output.path}`" + " (outside the result hash)" * output.volatile)
        for column in output.columns:
            unit = f" [{column.unit}]" if column.unit else ""
            lines.append(f"  - `{column.name}`{unit}" + f": {column.meaning}" * bool(column.meaning))
    lines += [
        "",
        "## Repeat and check",
        "",
        f"- again, with a verdict on each file: `wristctl runs replay {manifest.id}`",
        "- again as a new run, from the folder above: "
        f"`wristctl {command_of(manifest.kind)} --config {manifest.id}/{CONFIG}`",
        f"- result hash: `{manifest.result_sha256}`",
        f"- unchanged since: `sha256sum -c {SUMS}`",
        f"- code, machine, hashes: `{MANIFEST}`; packages: `{PACKAGES}`"
        + f"; uncommitted changes: `{PATCH}`" * bool(manifest.code.dirty),
    ]
    if foreign := manifest.code.foreign:
        lines.append(f"- code from elsewhere, which you should read before you run it: `{'`, `'.join(foreign)}`")
    return "\n".join(lines) + "\n"


def _taken_over(units: TakenOver) -> str:
    """How much of a run was computed in another one."""
    text = f"\n{units.taken_over} units of work were computed in run {units.run}, which this one goes on from"
    return f"{text}; {units.computed_again} more of its units were computed again here, and gave the same."
