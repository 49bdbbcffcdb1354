"""Draw changes from a seed: `python -m tests.mutants.draw SEED [COUNT]` prints them as they stand in known.yaml.

Two of each package at least, then any; within a package every kind of change is as likely as any other.
"""

from __future__ import annotations

import random
import sys
from collections import defaultdict
from pathlib import Path
from typing import Any

import yaml

from tests.mutants.operators import Change, changes

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "wristctl"
COUNT, EACH = 40, 2


def everything() -> dict[str, list[Change]]:
    """All changes there are, by package."""
    found: dict[str, list[Change]] = defaultdict(list)
    for file in sorted(PACKAGE.rglob("*.py")):
        parts = file.relative_to(PACKAGE).parts
        found[parts[0] if len(parts) > 1 else "top"] += changes(PACKAGE, file)
    return {package: each for package, each in sorted(found.items()) if each}


def drawn(seed: int, count: int = COUNT) -> list[Change]:
    """So many changes, no two of one line."""
    rng, found = random.Random(seed), everything()
    packages = [package for package in found if package != "top"]
    order = packages * EACH + rng.choices(packages, [len(found[each]) for each in packages], k=count)
    chosen: dict[tuple[str, int], Change] = {}
    for package in order:
        while len(chosen) < count:
            by_kind = defaultdict(list)
            for change in found[package]:
                by_kind[change.kind].append(change)
            change = rng.choice(by_kind[rng.choice(sorted(by_kind))])
            if (change.file, change.line) not in chosen:
                chosen[change.file, change.line] = change
                break
    return list(chosen.values())


def entry(change: Change, name: str) -> dict[str, Any]:
    """The change as known.yaml has it: whole lines, and from which line on they are meant if they stand there twice."""
    source = (PACKAGE / change.file).read_text(encoding="utf-8")
    begin, end = source.rfind("\n", 0, change.start) + 1, source.find("\n", change.end)
    old, changed = source[begin:end], change.apply(source)
    new = changed[begin : end + len(changed) - len(source)]
    near: dict[str, str | int] = {"near": change.line} if source.count(old) > 1 else {}
    return {"name": f"{name} {change.kind}", "file": change.file, "old": old, "new": new, **near}


if __name__ == "__main__":
    seed, count = int(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else COUNT
    listed = [entry(each, f"{seed}-{number:02}") for number, each in enumerate(drawn(seed, count), start=1)]
    print(yaml.safe_dump(listed, sort_keys=False, allow_unicode=True, width=200), end="")
