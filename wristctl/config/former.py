"""Keys that studies once had: read from files with a warning, so that the config.yaml of an old run still reads."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from typing import Any

from wristctl.config.strict_yaml import KeyPath
from wristctl.config.wording import Phrase, worded

log = logging.getLogger(__name__)

FORMER = {
    ("sensor", "seed"): "a camera's noise now comes from `seed`, the root of every random stream (--seed)",
    ("claims", "exact"): "each loop has a verdict of its own now, and `sense` says how a value is meant",
}
"""The end of a key path, and what has come in its place."""


def leave_out_former(data: dict[str, Any], origins: Mapping[KeyPath, Phrase]) -> None:
    """Take former keys out of what files say; a warning names each kind of them once, with its first place."""
    found: dict[tuple[str, str], KeyPath] = {}
    _take_out(data, (), found)
    for former, path in found.items():
        where = f"{worded(origins[path])}: " if path in origins else ""
        log.warning("%s%s is no longer a setting: %s", where, ".".join(map(str, path)), FORMER[former])


def _take_out(node: Any, path: KeyPath, found: dict[tuple[str, str], KeyPath]) -> None:
    if isinstance(node, dict):
        for key in list(node):
            former = (next((each for each in reversed(path) if isinstance(each, str)), ""), str(key))
            if former in FORMER:
                del node[key]
                found.setdefault(former, (*path, key))
            else:
                _take_out(node[key], (*path, key), found)
    elif isinstance(node, list | tuple):
        for at, each in enumerate(node):
            _take_out(each, (*path, at), found)
