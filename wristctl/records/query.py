"""Choose among runs: by kind, label, state, tag, age and metrics."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from fnmatch import fnmatchcase
from operator import eq, ge, gt, le, lt, ne
from pathlib import Path
from typing import Any

from wristctl.config.errors import UserError, meant
from wristctl.config.wording import Argument, Phrase
from wristctl.records.index import RESULTS, IndexEntry, indexed
from wristctl.records.tags import known_tags

_COMPARISONS = {"<=": le, ">=": ge, "!=": ne, "==": eq, "<": lt, ">": gt, "=": eq}
_SECONDS = {"s": 1, "m": 60, "h": 3600, "d": 86400, "w": 604800}


def entries(results: Path = RESULTS) -> list[IndexEntry]:
    """All runs of a results folder, oldest first, with their tags."""
    tags = known_tags(results)
    return [replace(each, tags=tags[each.id]) if each.id in tags else each for each in indexed(results)]


def select(
    found: Iterable[IndexEntry],
    kind: str | None = None,
    label: str | None = None,
    state: str | None = None,
    tag: str | None = None,
    where: Sequence[str] = (),
    newer: str | None = None,
    older: str | None = None,
) -> list[IndexEntry]:
    """The entries that meet every condition: `where` like "rmse<1e-3", ages like 30m, 12h, 2d; kind and label may be
    patterns with *. Raises UserError for a condition that cannot be read, or a metric that no run has."""
    chosen = [
        each
        for each in found
        if fnmatchcase(each.kind, kind or "*")
        and fnmatchcase(each.label, label or "*")
        and state in (None, each.state)
        and (tag is None or tag in each.tags)
    ]
    for text in where:
        name, compare, bound = _condition(text)
        _check_metric(name, chosen, text)
        chosen = [each for each in chosen if _is_number(each.value(name)) and compare(each.value(name), bound)]
    if newer:
        since = _time_ago(newer, "newer")
        chosen = [each for each in chosen if each.started and each.started >= since]
    if older:
        until = _time_ago(older, "older")
        chosen = [each for each in chosen if each.started and each.started < until]
    return chosen


def in_order(found: Sequence[IndexEntry], by: str) -> list[IndexEntry]:
    """Sorted by a field or metric; runs that have none come last."""
    _check_metric(by, found, Argument("sort", by))

    def sort_key(each: IndexEntry) -> tuple[bool, Any]:
        value = each.value(by)
        return (True, "") if value in (None, "") else (False, value)

    return sorted(found, key=sort_key)


def _check_metric(name: str, found: Sequence[IndexEntry], where: Phrase) -> None:
    own = {"id", "kind", "label", "state", "started", "wall_s"}
    names = {metric for each in found for metric in each.metrics} | own
    if found and name not in names:
        raise UserError(f"no run has a metric {name!r}", where, meant(name, sorted(names)))


def _condition(text: str) -> tuple[str, Any, float]:
    found = re.fullmatch(r"(.+?)\s*(<=|>=|!=|==|<|>|=)\s*([^<>=!]+)", text)
    try:
        if found:
            return found[1], _COMPARISONS[found[2]], float(found[3])
    except ValueError:
        pass
    example = Argument("where", "rmse<1e-3", quoted=True)
    raise UserError("not a condition on a metric", Argument("where", text), ("for example ", example))


def _time_ago(age: str, option: str) -> str:
    found = re.fullmatch(r"(\d+(?:\.\d+)?)([smhdw])", age, re.ASCII)
    try:
        if found:
            instant = datetime.now(UTC) - timedelta(seconds=float(found[1]) * _SECONDS[found[2]])
            return instant.isoformat(timespec="microseconds")
    except OverflowError:  # before the calendar begins
        pass
    raise UserError("not an age", Argument(option, age), "a number with s, m, h, d or w: 12h, 2d")


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)
