"""Every command of the message table has one handler in the firmware, and every answer one function that gives it."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.board.bench import Bench, encode
from wristctl.board.dictionary import TABLE, c_header, load
from wristctl.board.emulator import Atmega2560
from wristctl.board.layout import LAYOUTS
from wristctl.board.messages import Command, Rate, Result, Status

BOARD = TABLE.parent
CONTRIBUTING = BOARD.parents[1] / "CONTRIBUTING.md"
HANDLERS = [f"on_{name.lower()}" for name in load()["commands"]]
ANSWERS = [f"answer_{name.lower()}" for name in load()["answers"]]
BRAKE = max(Command) + 1
"""The code of the message that CONTRIBUTING.md adds."""
TIMERS = "extern volatile unsigned char TIMSK1, TIMSK3, TIMSK4, TIMSK5;\n"
"""What commands.c needs of avr-libc to be compiled for another computer."""
ONLY_THERE = ("-Wno-address-of-packed-member",)
"""Warnings that an AVR, whose data need no alignment, gives no reason for."""

needs_avr = pytest.mark.skipif(not shutil.which("avr-gcc"), reason="needs gcc-avr, binutils-avr, avr-libc")
needs_gcc = pytest.mark.skipif(not (shutil.which("gcc") and sys.platform == "linux"), reason="needs GNU's C compiler")


def run(*command: str | Path) -> subprocess.CompletedProcess[str]:
    """What a compiler does, and says in plain English."""
    return subprocess.run(command, capture_output=True, text=True, env={**os.environ, "LC_ALL": "C"})


def without(function: str, source: str) -> str:
    """The source without this function's definition."""
    left, count = re.subn(rf"^\w+ {function}\((?:[^\n]*\}}|.*?^\}})\n", "", source, flags=re.MULTILINE | re.DOTALL)
    assert count == 1
    return left


class Sources:
    """A copy of what the firmware is built from, to be changed."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.commands_c = folder, folder / "firmware" / "commands.c"
        shutil.copytree(BOARD / "firmware", folder / "firmware")
        for name in ("dictionary.py", "messages.toml"):
            shutil.copy(BOARD / name, folder)

    @property
    def commands(self) -> str:
        """commands.c, where the handlers are."""
        return self.commands_c.read_text()

    @commands.setter
    def commands(self, source: str) -> None:
        assert source != self.commands
        self.commands_c.write_text(source)

    def build(self) -> tuple[Path | None, str]:
        """The image, if there is one, and what was said."""
        build = self.folder / "build"
        made = run("make", "-C", self.folder / "firmware", f"BUILD={build}")
        return build / "wrist.hex" if made.returncode == 0 else None, made.stdout + made.stderr

    def host_build(self) -> str:
        """What this computer's compiler and linker say of commands.c alone."""
        (self.folder / "avr").mkdir(exist_ok=True)
        (self.folder / "avr" / "io.h").write_text(TIMERS)
        (self.folder / "messages.h").write_text(c_header(load(self.folder / "messages.toml")))
        options = ("-std=gnu11", "-Wall", "-Wextra", "-Wmissing-prototypes", "-Werror", *ONLY_THERE)
        return run("gcc", *options, f"-I{self.folder}", self.commands_c, "-o", self.folder / "commands").stderr


@pytest.fixture
def sources(tmp_path: Path) -> Sources:
    return Sources(tmp_path / "board")


def unhandled(said: str) -> set[str]:
    """The handlers and answers that a linker misses; what compiled did so without a word."""
    assert not re.search(r"\.c:\d+:\d+: error:", said)
    return set(re.findall(r"undefined reference to [`'](on_\w+|answer_\w+)'", said))


@needs_gcc
@pytest.mark.slow
def test_a_handler_or_answer_that_is_missing_is_named_by_the_linker(sources: Sources) -> None:
    assert unhandled(sources.host_build()) == set()
    whole = sources.commands
    for function in HANDLERS + ANSWERS:
        sources.commands = without(function, whole)
        assert unhandled(sources.host_build()) == {function}


WRONG = {
    "of another command": ("on_rate(const struct rate_command *c)", "on_rate(const struct target_command *c)"),
    "without its fields": ("on_jog(const struct jog_command *c)", "on_jog(void)"),
    "with fields that there are none of": ("on_stop(void)", "on_stop(const struct rate_command *c)"),
    "that says nothing": ("uint8_t on_clear(", "void on_clear("),
    "that nobody calls": ("uint8_t on_stop(", "uint8_t on_rest("),
    "hidden from the table": ("uint8_t on_home(", "static uint8_t on_home("),
    "of another answer": ("answer_hello(struct hello_answer *a)", "answer_hello(struct status_answer *a)"),
}


@needs_gcc
@pytest.mark.parametrize("wrong", WRONG)
def test_a_handler_of_the_wrong_type_does_not_compile(sources: Sources, wrong: str) -> None:
    sources.commands = sources.commands.replace(*WRONG[wrong])
    said = sources.host_build()
    name = re.search(r"(on|answer)_\w+", WRONG[wrong][1])
    assert name and re.search(rf"commands\.c:\d+:\d+: error: .*'{name[0]}'", said)


@needs_avr
@pytest.mark.parametrize("handler", ["on_ping", "on_rate", "on_stop", "answer_counters"])
@pytest.mark.slow
def test_no_image_is_linked_without_a_handler(sources: Sources, handler: str) -> None:
    sources.commands = without(handler, sources.commands)
    image, said = sources.build()
    assert image is None and unhandled(said) == {handler}


@needs_avr
def test_no_image_is_compiled_with_a_handler_of_another_type(sources: Sources) -> None:
    sources.commands = sources.commands.replace(*WRONG["of another command"])
    image, said = sources.build()
    assert image is None and "conflicting types for 'on_rate'" in said


def contributed() -> dict[str, str]:
    """What CONTRIBUTING.md adds for a firmware message, by file."""
    section = CONTRIBUTING.read_text().split("## A firmware message\n")[1].split("\n## ")[0]
    found = re.findall(r"^\+\+\+ wristctl/board/(\S+)\n((?:\+(?!\+\+).*\n)+)", section, flags=re.MULTILINE)
    return {path: "".join(line[1:] for line in added.splitlines(keepends=True)) for path, added in found}


@needs_avr
@pytest.mark.slow
def test_the_message_that_contributing_adds_is_obeyed(sources: Sources) -> None:
    for path, added in contributed().items():
        with (sources.folder / path).open("a") as file:
            file.write(added)
    image, said = sources.build()
    assert image is not None, said
    bench = Bench(Atmega2560(image))
    bench.get_ready()
    for _ in range(10):
        bench.do(Rate((500.0, 500.0, 500.0, 500.0)))
        bench.run_ms(20)
    bench.do(Rate((500.0, 500.0, 500.0, 500.0), 0.2))
    for axis, expected in ((2, Result.OK), (4, Result.RANGE)):
        bench.chip.write(encode(BRAKE, 1, bench.connection.to_bytes(2, "little") + bytes([axis])))
        bench.run_ms(50)
        ((code, _seq, payload),) = bench.frames()
        assert (code, payload[0]) == (BRAKE | 0x80, expected)
        status = LAYOUTS[Status].unpack(Status, payload[1:])
    assert status.rate == (500, 500, 0, 500)


@needs_avr
@pytest.mark.slow
def test_a_command_that_is_taken_out_of_the_table_is_unknown(sources: Sources) -> None:
    """Also one whose code lies among those of others."""
    sources.commands = without("on_stop", sources.commands)
    table = sources.folder / "messages.toml"
    table.write_text(re.sub(r"\[commands\.STOP\]\n(.+\n)+", "", table.read_text()))
    image, said = sources.build()
    assert image is not None, said
    bench = Bench(Atmega2560(image))
    for payload in (b"", b"x"):
        bench.chip.write(encode(Command.STOP, 1, payload))
        bench.run_ms(5)
        assert bench.frames() == [(Command.STOP | 0x80, 1, bytes([Result.UNKNOWN]))]
