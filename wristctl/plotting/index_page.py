"""index.html of a results folder: every run with its answer and picture, in one file that needs no network."""

from __future__ import annotations

import base64
import hashlib
import json
import os
from collections import Counter, defaultdict
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from wristctl.plain_files import read_json, read_plain
from wristctl.plotting.page import render
from wristctl.records.index import IndexEntry, write_beside
from wristctl.records.manifest import REPORT
from wristctl.study_files.keys import command_of

# Pictures of the page, which may be deleted at any time.
PICTURES = ".pictures.json"
# Width of a picture [px], more than that of its place; quality of its compression [%].
_WIDTH, _QUALITY = 400, 50

Advance = Callable[[int], object]


def mark_of(listed: Sequence[IndexEntry]) -> str:
    """Digest of what the page of these runs shows: another one where a page would be another."""
    return hashlib.sha256(repr(listed).encode()).hexdigest()[:32]


def index_page(results: Path, listed: Sequence[IndexEntry], advance: Advance = lambda count: None) -> str:
    """The page of a folder's runs, `listed` with their tags, oldest first; the newest are on top.

    `advance` is called with the number of runs whose picture is ready.
    """
    newest = listed[::-1]
    pictures = _pictures(results, newest, advance)
    users = defaultdict(list)
    for entry in newest:
        for name in dict.fromkeys(entry.inputs):
            users[name].append(entry.id)
    there = {entry.id for entry in newest}
    return render(
        "index.html",
        heading=f"Runs in {results.resolve().name}",
        mark=mark_of(listed),
        runs=[_card(results, entry, pictures.get(entry.id, ""), users[entry.id], there) for entry in newest],
        commands=Counter(command_of(entry.kind) for entry in newest).most_common(),
        states=Counter(_state(entry) for entry in newest).most_common(),
    )


def _card(results: Path, entry: IndexEntry, picture: str, users: list[str], there: set[str]) -> dict[str, Any]:
    folder = results / entry.id
    return {
        "id": entry.id,
        "command": command_of(entry.kind),
        "state": _state(entry),
        "badge": ", ".join(entry.marks) if entry.state == "ok" else entry.state,
        "title": " · ".join(text for text in (entry.label, entry.about) if text),
        "started": entry.started[:16].replace("T", " "),
        "seconds": entry.wall_s,
        "answer": entry.answer or entry.note,
        "note": entry.note if entry.answer else "",
        "tags": entry.tags,
        "picture": picture,
        "report": f"{entry.id}/{REPORT}" if not folder.is_symlink() and (folder / REPORT).is_file() else "",
        "inputs": [(name, name in there) for name in dict.fromkeys(entry.inputs)],
        "users": users,
    }


def _state(entry: IndexEntry) -> str:
    """State for people: a run that ended ok and is no good has a fault."""
    return "fault" if entry.state == "ok" and entry.marks else entry.state


def _pictures(results: Path, listed: Sequence[IndexEntry], advance: Advance) -> dict[str, str]:
    """Data URL of a small picture of each run that has a figure, remembered beside the runs."""
    remembered = _remembered(results)
    current: dict[str, Any] = {}
    for count, entry in enumerate(listed, start=1):
        file = results / entry.id / "figures" / f"{entry.figure}.png"
        if entry.figure and (stamp := _stamp(file)):
            old = remembered.get(entry.id)
            known = isinstance(old, list) and len(old) == 2 and old[0] == stamp and isinstance(old[1], str)
            current[entry.id] = old if known else [stamp, _small(file)]
        advance(count)
    if current != remembered:
        write_beside(results, PICTURES, json.dumps(current))
    return {name: picture for name, (_, picture) in current.items()}


def _remembered(results: Path) -> dict[str, Any]:
    try:
        content = read_json(results / PICTURES)
    except (OSError, ValueError):
        return {}
    return content if isinstance(content, dict) else {}


def _stamp(file: Path) -> list[int] | None:
    try:
        status = os.stat(file, follow_symlinks=False)
    except OSError:
        return None
    return [status.st_mtime_ns, status.st_size]


def _small(file: Path) -> str:
    """Data URL of a picture at the width of its place; empty where the file is no picture."""
    import cv2
    import numpy as np

    try:
        large = cv2.imdecode(np.frombuffer(read_plain(file, links=False), np.uint8), cv2.IMREAD_COLOR)
    except (OSError, cv2.error):
        return ""
    if large is None:
        return ""
    high, wide = large.shape[:2]
    size = _WIDTH, max(1, round(high * _WIDTH / wide))
    drawn = cv2.resize(large, size, interpolation=cv2.INTER_AREA) if wide > _WIDTH else large
    _, encoded = cv2.imencode(".webp", drawn, [cv2.IMWRITE_WEBP_QUALITY, _QUALITY])
    return f"data:image/webp;base64,{base64.b64encode(encoded.tobytes()).decode()}"
