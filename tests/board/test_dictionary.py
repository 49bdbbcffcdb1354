"""One table for both sides: what is made from it is what is in use, and every change that matters changes its hash."""

from __future__ import annotations

import shutil
import struct
import subprocess
from copy import deepcopy
from pathlib import Path
from typing import Any

import pytest

from wristctl.board import messages
from wristctl.board.dictionary import PROSE, c_header, dictionary_hash, load, python_module
from wristctl.board.layout import ANSWER_TO, COMMAND_OF, LAYOUTS
from wristctl.board.messages import Command, Configure, Rate, Status

TABLE = load()


def leaves(node: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    if isinstance(node, dict | list):
        items = node.items() if isinstance(node, dict) else enumerate(node)
        return [leaf for key, value in items for leaf in leaves(value, (*path, key))]
    return [path]


def changed(path: tuple[Any, ...]) -> dict[str, Any]:
    table = deepcopy(TABLE)
    node: Any = table
    for key in path[:-1]:
        node = node[key]
    value = node[path[-1]]
    node[path[-1]] = (
        not value if isinstance(value, bool) else value + 1 if isinstance(value, int | float) else value + "x"
    )
    return table


def test_the_python_side_is_what_the_table_says() -> None:
    assert Path(messages.__file__).read_text() == python_module(TABLE)


@pytest.mark.slow
def test_every_leaf_but_prose_changes_the_hash() -> None:
    for path in leaves(TABLE):
        same = dictionary_hash(changed(path)) == messages.DICTIONARY_HASH
        assert same is (path[-1] in PROSE), path


def test_codes_and_bits_are_unique_and_commands_leave_room_for_the_answer_bit() -> None:
    for group, key in (
        ("states", "code"),
        ("results", "code"),
        ("commands", "code"),
        ("faults", "bit"),
        ("flags", "bit"),
    ):
        numbers = [entry[key] for entry in TABLE[group].values()]
        assert len(set(numbers)) == len(numbers)
    assert min(Command) > 0 and max(Command) < 0x80


def test_messages_fit_the_boards_buffers() -> None:
    assert max(layout.struct.size for layout in LAYOUTS.values()) + 1 <= messages.MAX_PAYLOAD


def test_defaults_are_within_the_ranges_of_configure() -> None:
    payload = LAYOUTS[Configure].pack(Configure())
    assert LAYOUTS[Configure].unpack(Configure, payload) == Configure()


def test_values_come_back_from_the_wire_to_half_a_count() -> None:
    rate = Rate((0.1, -19_999.99999, 20_000.0, 1 / 3))
    back = LAYOUTS[Rate].unpack(Rate, LAYOUTS[Rate].pack(rate))
    assert back.rate == pytest.approx(rate.rate, abs=0.5 / 65_536)


@pytest.mark.parametrize(
    ("message", "named"),
    [
        (Rate((0.0, 0.0, 0.0, 20_000.1)), "rate = 20000.1 steps/s is outside -20000 to 20000"),
        (Rate((float("nan"), 0.0, 0.0, 0.0)), "rate = nan"),
        (Rate((1.0,)), "rate needs 4 values, got 1"),  # type: ignore[arg-type]
        (Configure(watchdog=0.009), "watchdog = 0.009 s is outside 0.01 to 2.0"),
    ],
)
def test_a_value_out_of_range_is_refused_by_name(message: tuple[Any, ...], named: str) -> None:
    with pytest.raises(ValueError, match=named):
        LAYOUTS[type(message)].pack(message)


@pytest.mark.skipif(not shutil.which("gcc"), reason="needs a C compiler")
def test_c_structures_have_the_sizes_python_packs(tmp_path: Path) -> None:
    (tmp_path / "messages.h").write_text(c_header(TABLE))
    tags = {kind: f"{command.name.lower()}_command" for kind, command in COMMAND_OF.items()}
    tags |= {kind: f"{kind.__name__.lower()}_answer" for kind in ANSWER_TO.values()}
    lines = [f'_Static_assert(sizeof(struct {tags[k]}) == {v.struct.size}, "size");' for k, v in LAYOUTS.items()]
    source = tmp_path / "sizes.c"
    source.write_text("\n".join(['#include "messages.h"', *lines]))
    subprocess.run(["gcc", "-Wall", "-Wextra", "-Werror", "-fsyntax-only", source], check=True)


def test_status_says_its_values_in_their_units() -> None:
    payload = struct.pack("<IBBBH4i4hB", 1_500_000, 1, 0, 5, 97, 1, -2, 3, -4, 10, -20, 30, -40, 3)
    status = LAYOUTS[Status].unpack(Status, payload)
    assert (status.time, status.watchdog_left) == (1.5, 0.097)
    assert status.state is messages.State.ENABLED
    assert status.flags == messages.Flag.HOMED | messages.Flag.DRIVES_ON
    assert (status.position, status.rate, status.lapses) == ((1, -2, 3, -4), (10, -20, 30, -40), 3)
