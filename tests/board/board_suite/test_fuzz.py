"""Bad bytes of every kind: the board answers the next PING, does not step, and never enables its drives."""

from __future__ import annotations

import random
from collections.abc import Callable

import pytest

from tests.board.bench import MS, Bench, encode
from wristctl.board.dictionary import STRUCT_CODE, WIRE_RANGE, load
from wristctl.board.layout import BOUND, COMMAND_OF, LAYOUTS, Field
from wristctl.board.messages import ENABLE_KEY, Command, Rate, State

FIELD_BYTES = dict.fromkeys(Command, 0) | {c: LAYOUTS[m].struct.size for m, c in COMMAND_OF.items()}
PAYLOAD_BYTES = {command: size + 2 * (command in BOUND) for command, size in FIELD_BYTES.items()}
COUNT_SPAN = {STRUCT_CODE[kind]: span for kind, span in WIRE_RANGE.items()}


def sound_frame(rng: random.Random, bench: Bench) -> bytes:
    """A frame with a right CRC and random fields, but for ENABLE's key; mostly of our connection."""
    command = rng.choice(list(Command))
    payload = rng.randbytes(FIELD_BYTES[command])
    if command is Command.ENABLE and payload == ENABLE_KEY.to_bytes(4, "little"):
        payload = bytes(4)
    other = rng.randrange(2**16) if rng.random() < 0.2 else None
    return bench.frame(command, rng.randrange(256), payload, other)


def garbage(rng: random.Random, bench: Bench) -> bytes:
    return rng.randbytes(rng.randrange(1, 60))


def truncated(rng: random.Random, bench: Bench) -> bytes:
    frame = sound_frame(rng, bench)
    return frame[: rng.randrange(1, len(frame))]


def bad_crc(rng: random.Random, bench: Bench) -> bytes:
    frame = bytearray(encode(rng.choice(list(Command)), 1, rng.randbytes(4)))
    frame[-2] = frame[-2] % 255 + 1  # never zero, always another value
    return bytes(frame)


def flipped_bit(rng: random.Random, bench: Bench) -> bytes:
    frame = bytearray(sound_frame(rng, bench))
    frame[rng.randrange(len(frame))] ^= 1 << rng.randrange(8)
    return bytes(frame)


def duplicate(rng: random.Random, bench: Bench) -> bytes:
    return sound_frame(rng, bench) * 2


def overlong(rng: random.Random, bench: Bench) -> bytes:
    return b"\0" + bytes(rng.randrange(1, 256) for _ in range(rng.randrange(60, 140))) + b"\0" * rng.randrange(2)


def unknown(rng: random.Random, bench: Bench) -> bytes:
    code = rng.choice([0, *range(max(Command) + 1, 256)])
    return encode(code, rng.randrange(256), rng.randbytes(rng.randrange(40)))


def wrong_length(rng: random.Random, bench: Bench) -> bytes:
    command = rng.choice(list(Command))
    wrong = rng.choice([n for n in range(45) if n != PAYLOAD_BYTES[command]])
    return encode(command, rng.randrange(256), rng.randbytes(wrong))


def delimiters(rng: random.Random, bench: Bench) -> bytes:
    return bytes(rng.randrange(1, 6))


BadInput = Callable[[random.Random, Bench], bytes]
KINDS: tuple[BadInput, ...] = (
    *(garbage, truncated, bad_crc, flipped_bit, duplicate),
    *(overlong, unknown, wrong_length, delimiters),
)


def answered_ping(bench: Bench, seq: int) -> bool:
    until = bench.chip.cycles + 30 * MS
    while bench.chip.cycles < until:
        bench.run_ms(0.4)
        if any(frame[:2] == (Command.PING | 0x80, seq) for frame in bench.frames()):
            return True
    return False


@pytest.mark.slow
def test_each_bad_input_is_followed_by_an_answered_ping_no_step_and_no_enabling(bench: Bench, rounds: int) -> None:
    rng = random.Random(5)
    for i in range(4_000 * rounds):
        kind = rng.choice(KINDS)
        bad = kind(rng, bench)
        bench.chip.write(bad + bench.frame(Command.PING, i % 256))
        assert answered_ping(bench, i % 256), f"input {i}, {kind.__name__}: {bad.hex()}"
    assert sum(drive.steps for drive in bench.drives) == 0
    assert not any(drive.was_on for drive in bench.drives)


def out_of_range_payloads() -> list[tuple[Command, str, bytes]]:
    """Return every value just outside its range, and the extremes of its type, with all other fields in range."""
    commands, found = load()["commands"], []
    for message, command in COMMAND_OF.items():
        fields = LAYOUTS[message].fields
        within = [n for f in fields for n in [max(0, round((f.lowest or 0) * f.scale))] * f.count]
        places = [(f, i) for f in fields for i in range(f.count)]
        assert commands[command.name]["fields"].keys() == {f.name for f in fields}
        for at, (field, index) in enumerate(places):
            for count in _outside(field):
                payload = LAYOUTS[message].struct.pack(*within[:at], count, *within[at + 1 :])
                found.append((command, f"{field.name}[{index}] = {count}", payload))
    return found


def _outside(field: Field) -> set[int]:
    least, past = COUNT_SPAN[field.code]
    lowest, highest = round((field.lowest or 0) * field.scale), round((field.highest or 0) * field.scale)
    return {n for n in (least, lowest - 1, highest + 1, past - 1) if least <= n < past and not lowest <= n <= highest}


@pytest.mark.parametrize("ready", [False, True], ids=["disabled", "ready"])
def test_every_value_out_of_range_is_refused_and_moves_nothing(bench: Bench, ready: bool) -> None:
    if ready:
        bench.get_ready()
    cases = out_of_range_payloads()
    assert len({command for command, _, _ in cases}) == 7  # all with fields but ENABLE, whose key takes all 32 bits
    for i, (command, what, payload) in enumerate(cases):
        bench.chip.write(bench.frame(command, 1, payload) + bench.frame(Command.PING, i % 256))
        until = bench.chip.cycles + 20 * MS
        frames: list[tuple[int, int, bytes]] = []
        while len(frames) < 2 and bench.chip.cycles < until:
            bench.run_ms(0.4)
            frames += bench.frames()
        assert [f[0] for f in frames] == [command | 0x80, Command.PING | 0x80]
        assert frames[0][2][0] != 0, f"{command.name} with {what} was accepted"
    assert sum(drive.steps for drive in bench.drives) == 0
    assert bench.status().state is (State.ENABLED if ready else State.DISABLED)


@pytest.mark.slow
def test_noise_between_commands_does_not_disturb_a_motion(bench: Bench) -> None:
    rng = random.Random(6)
    bench.get_ready()
    rate = Rate((5_000.0, -5_000.0, 5_000.0, -5_000.0))
    for _ in range(60):
        bench.do(rate)
        bench.run_ms(5)
    bench.look()
    for _ in range(100):
        bench.chip.write(rng.choice([garbage, bad_crc, overlong, unknown])(rng, bench))
        bench.do(rate)
    for rises in bench.look():
        assert (rises[-1] - rises[0]) / (len(rises) - 1) == pytest.approx(3_200, abs=1)
    bench.do(Command.STOP)
    assert bench.wait_for_rest().position == tuple(drive.position for drive in bench.drives)
