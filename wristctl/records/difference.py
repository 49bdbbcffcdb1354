"""Differences between two runs."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

from wristctl.plain_files import read_plain
from wristctl.records.manifest import CONFIG, PACKAGES, SOURCES
from wristctl.records.run import Run
from wristctl.study_files.renaming import NewNames, with_keys_of_today
from wristctl.study_files.strict_yaml import parse_yaml

_FACTS = ("python", "os", "machine", "cpu", "cores")


class Change(NamedTuple):
    """A named thing and what it is in the one run and in the other; None where it is absent."""

    name: str
    before: Any
    after: Any


@dataclass(frozen=True)
class Difference:
    """Changes from one run to another, by what changed."""

    config: list[Change]
    metrics: list[Change]
    code: list[Change]
    environment: list[Change]
    inputs: list[Change]


def difference(a: Run, b: Run) -> Difference:
    """Compare configuration leaves, metrics, code (its files too), packages and machine, inputs by their results."""
    inputs = [{record.role: record.result_sha256 for record in run.manifest.inputs} for run in (a, b)]
    roles = {f"{run.kind}.{record.role}" for run in (a, b) for record in run.manifest.inputs}
    config = [change for change in changes(leaves_of(a), leaves_of(b)) if change.name not in roles]
    metrics = changes(*({name: metric["value"] for name, metric in run.metrics.items()} for run in (a, b)))
    return Difference(config, metrics, _code(a, b), _environment(a, b), changes(*inputs))


def changes(before: Mapping[str, Any], after: Mapping[str, Any]) -> list[Change]:
    """Changed entries of two mappings, in their order."""
    names = dict.fromkeys([*before, *after])
    pairs = (Change(name, before.get(name), after.get(name)) for name in names)
    return [
        change for change in pairs if change.before != change.after or type(change.before) is not type(change.after)
    ]


def leaves_of(run: Run) -> dict[str, Any]:
    """The configuration as written, by dotted key path."""
    file = run.file(CONFIG)
    document = with_keys_of_today(parse_yaml(read_plain(file), str(file)), str(file), NewNames())
    return dict(_leaves(document.data, ""))


def _leaves(value: Any, path: str) -> list[tuple[str, Any]]:
    if isinstance(value, dict) and value:
        return [leaf for key, item in value.items() for leaf in _leaves(item, f"{path}.{key}" if path else str(key))]
    if isinstance(value, tuple) and any(isinstance(item, dict) for item in value):
        return [leaf for number, item in enumerate(value) for leaf in _leaves(item, f"{path}[{number}]")]
    return [(path, value)]


def _code(a: Run, b: Run) -> list[Change]:
    foreign = _shortened(changes(a.manifest.code.foreign, b.manifest.code.foreign))
    if a.manifest.code.tree_sha256 == b.manifest.code.tree_sha256:
        return foreign
    facts = []
    for run in (a, b):
        code = run.manifest.code
        commit = f"{code.commit[:12]}{' with changes' if code.dirty else ''}" if code.commit else None
        facts.append({"version": code.version, "commit": commit, "tree": code.tree_sha256[:12]})
    files = changes(*(_listing(run, SOURCES, "  ", 1) for run in (a, b)))
    return [*foreign, *changes(*facts), *_shortened(files)]


def _environment(a: Run, b: Run) -> list[Change]:
    facts = [
        {name: getattr(run.manifest.environment, name) for name in _FACTS} | run.manifest.environment.threads
        for run in (a, b)
    ]
    packages = [run.manifest.environment.packages | _listing(run, PACKAGES, "==", 0) for run in (a, b)]
    return changes(*facts) + changes(*packages)


def _listing(run: Run, name: str, separator: str, key: int) -> dict[str, str]:
    """Lines of two parts as a mapping; empty where an older run has no such file."""
    if not run.has(name):
        return {}
    lines = run.file(name).read_text(encoding="utf-8", errors="replace").splitlines()
    pairs = [line.split(separator, 1) for line in lines if separator in line]
    return {pair[key]: pair[1 - key] for pair in pairs}


def _shortened(hashes: list[Change]) -> list[Change]:
    """Changes of hashes, which twelve letters tell apart."""
    return [Change(name, before and before[:12], after and after[:12]) for name, before, after in hashes]
