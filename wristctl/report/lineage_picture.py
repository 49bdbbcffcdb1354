"""The runs behind a run as a picture: boxes from left to right, an arrow from each to what was made from it."""

from __future__ import annotations

from html import escape

from wristctl.config.printable import printable
from wristctl.records.lineage import Ancestor

_WIDTH, _HEIGHT, _GAP, _ROW = 192, 44, 44, 60
_WORDS = {"gen-data": "data", "train": "network", "tune": "gains", "compare": "comparison", "hw-run": "trial"}


def lineage_picture(tree: Ancestor) -> str:
    """SVG markup: each run once, as far left as what it was made from allows; empty where there is nothing behind."""
    if not tree.inputs:
        return ""
    nodes: dict[str, Ancestor] = {}
    edges: dict[tuple[str, str], str] = {}
    _collect(tree, nodes, edges)
    columns = {name: _depth(node) for name, node in nodes.items()}
    rows: dict[str, int] = {}
    for name in sorted(nodes, key=lambda name: (columns[name], name)):
        rows[name] = sum(columns[other] == columns[name] for other in rows)
    width = (max(columns.values()) + 1) * (_WIDTH + _GAP) - _GAP + 4
    height = (max(rows.values()) + 1) * _ROW
    place = {name: (2 + columns[name] * (_WIDTH + _GAP), 6 + rows[name] * _ROW) for name in nodes}
    parts = [_arrow(place[start], place[end]) for start, end in edges]
    parts += [_box(node, *place[name], own=name == tree.id) for name, node in nodes.items()]
    return (
        f'<svg class="lineage" viewBox="0 0 {width} {height}" width="{width}" height="{height}" role="img" '
        f'aria-label="lineage">{"".join(parts)}</svg>'
    )


def _collect(node: Ancestor, nodes: dict[str, Ancestor], edges: dict[tuple[str, str], str]) -> None:
    nodes[node.id] = node
    for each in node.inputs:
        edges[each.id, node.id] = each.role
        _collect(each, nodes, edges)


def _depth(node: Ancestor) -> int:
    return 1 + max(map(_depth, node.inputs)) if node.inputs else 0


def _arrow(start: tuple[int, int], end: tuple[int, int]) -> str:
    x, y, to_x, to_y = start[0] + _WIDTH, start[1] + _HEIGHT // 2, end[0], end[1] + _HEIGHT // 2
    middle = to_x - _GAP // 2
    line = f"M{x} {y}C{middle} {y} {middle} {to_y} {to_x - 6} {to_y}"
    return f'<path class="edge" d="{line}"/><path class="head" d="M{to_x} {to_y}l-8 -4v8z"/>'


def _box(node: Ancestor, x: int, y: int, own: bool) -> str:
    kind = escape(_WORDS.get(node.kind, node.kind))
    name = printable(node.id)
    short = escape(name if len(name) <= 26 else f"{name[:16]} … {name[-6:]}")
    mark = ' class="own"' * own + ' class="odd"' * (not own and node.state != "ok")
    state = "" if node.state == "ok" else f" ({escape(node.state)})"
    return (
        f"<g{mark}><title>{escape(name)}</title><rect x='{x}' y='{y}' width='{_WIDTH}' height='{_HEIGHT}' rx='6'/>"
        f"<text x='{x + 10}' y='{y + 18}'>{kind}{state}</text>"
        f"<text class='id' x='{x + 10}' y='{y + 34}'>{short}</text></g>"
    )
