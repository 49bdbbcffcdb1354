"""The message table (messages.toml): read, hashed, and written out as the C header and the Python module made from it.

Standard library only, so that the firmware builds with nothing but Python and avr-gcc installed:

    python3 wristctl/board/dictionary.py c > messages.h
    python3 wristctl/board/dictionary.py python > wristctl/board/messages.py
"""

import binascii
import hashlib
import json
import sys
import tomllib
from pathlib import Path
from typing import Any

TABLE = Path(__file__).with_name("messages.toml")
PROSE = ("meaning", "fix")
C_TYPE = {"u8": "uint8_t", "u16": "uint16_t", "u32": "uint32_t", "i16": "int16_t", "i32": "int32_t"}
STRUCT_CODE = {"u8": "B", "u16": "H", "u32": "I", "i16": "h", "i32": "i"}
WIRE_RANGE = {"u8": (0, 2**8), "u16": (0, 2**16), "u32": (0, 2**32), "i16": (-(2**15), 2**15), "i32": (-(2**31), 2**31)}
CODES = {"State": "states", "Result": "results", "Command": "commands"}
BITS = {"Fault": "faults", "Flag": "flags", "Reset": "resets"}
_KINDS = {
    "State": "State of the board.",
    "Result": "Result of a command.",
    "Command": "Command of a host.",
    "Fault": "Reasons of a stop, one bit each.",
    "Flag": "Flags of a status, one bit each.",
    "Reset": "Reasons of a reset, one bit each; a boot loader may have hidden it.",
}
MARK = "Made from messages.toml by dictionary.py: change that file, not this one."

MessageTable = dict[str, Any]


def load(path: Path = TABLE) -> MessageTable:
    """Return the message table as plain dictionaries, in the file's order."""
    return tomllib.loads(path.read_text(encoding="utf-8"))


def dictionary_hash(table: MessageTable) -> int:
    """Return 32 bits that change with all that two sides must agree on: names, codes, types, ranges; not the prose."""

    def bare(node: Any) -> Any:
        return {k: bare(v) for k, v in node.items() if k not in PROSE} if isinstance(node, dict) else node

    digest = hashlib.sha256(json.dumps(bare(table), separators=(",", ":")).encode()).digest()
    return int.from_bytes(digest[:4], "little")


def c_header(table: MessageTable) -> str:
    """Return messages.h: constants, codes, packed structures, what each command needs, and who handles it.

    Every command has one handler, `on_name`, and every answer one function that gives it, `answer_name`: declared here
    and called from here alone, so that one that is missing does not link and one of another type does not compile.
    """
    protocol, commands = table["protocol"], table["commands"]
    lines = [f"/* {MARK} */", "#ifndef MESSAGES_H", "#define MESSAGES_H"]
    lines += ["#include <stdbool.h>", "#include <stdint.h>", ""]
    lines += [f"#define PROTOCOL_VERSION {protocol['version']}"]
    lines += [f"#define FIRMWARE_VERSION {{{', '.join(map(str, protocol['firmware']))}}}"]
    lines += [f"#define DICTIONARY_HASH {dictionary_hash(table):#010x}UL"]
    lines += ["#ifndef BAUD", f"#define BAUD {protocol['baud']}UL", "#endif"]
    for prefix, group in (("", "constants"), ("DEFAULT_", "defaults")):
        for name, entry in table[group].items():
            lines += [f"#define {prefix}{name.upper()} {_c_number(entry['value'])} /* {entry['unit']} */"]
    estop = ", ".join(f"{byte:#04x}" for byte in _estop_frame(table))
    lines += [f"#define ESTOP_FRAME {{{estop}}} /* ESTOP with ESTOP_SEQ as it comes over the wire */"]
    for kind, group in (CODES | BITS).items():
        members = (f"{kind.upper()}_{name} = {_number(entry)}" for name, entry in table[group].items())
        lines += ["", f"enum {kind.lower()} {{ {', '.join(members)} }};"]
    for name, entry in commands.items():
        if entry["fields"]:
            lines += ["", *_c_struct(f"{name.lower()}_command", entry)]
    for name, entry in table["answers"].items():
        lines += ["", *_c_struct(f"{name.lower()}_answer", entry)]
    whens = dict.fromkeys(entry["when"] for entry in commands.values())
    named = ", ".join(f"WHEN_{when.upper()}{' = 1' * (k == 0)}" for k, when in enumerate(whens))
    lines += ["", f"enum when {{ {named} }}; /* 0: no command has this code */"]
    lines += [
        "",
        "/* X(name, when it is admitted, length of its fields, whether it is bound, whether it feeds) */",
    ]
    lines += ["#define COMMANDS(X) \\"]
    for name, entry in commands.items():
        length = f"sizeof(struct {name.lower()}_command)" if entry["fields"] else "0"
        bound, feeds = (str(entry[column]).lower() for column in ("bound", "feeds"))
        lines += [f"  X({name}, WHEN_{entry['when'].upper()}, {length}, {bound}, {feeds}) \\"]
    return "\n".join([*lines, "", *_c_handlers(commands), "", *_c_answers(table), "", "#endif", ""])


def _estop_frame(table: MessageTable) -> bytes:
    body = bytes([table["commands"]["ESTOP"]["code"], table["constants"]["ESTOP_SEQ"]["value"]])
    body += binascii.crc_hqx(body, 0xFFFF).to_bytes(2, "big")
    return b"\0" + b"".join(bytes([len(run) + 1]) + run for run in body.split(b"\0")) + b"\0"


def _number(entry: MessageTable) -> int:
    return int(entry["code"]) if "code" in entry else 1 << int(entry["bit"])


def _c_number(value: int) -> str:
    return f"{value}L" if value < 2**31 else f"{value}UL"


def _c_struct(tag: str, entry: MessageTable) -> list[str]:
    lines = [f"struct {tag} {{ /* {entry['meaning']} */"]
    for name, (kind, count, *_) in entry["fields"].items():
        lines += [f"  {C_TYPE[kind]} {name}{f'[{count}]' if count > 1 else ''};"]
    return [*lines, "} __attribute__((packed));"]


def _c_handlers(commands: MessageTable) -> list[str]:
    declared, cases = [], []
    for name, entry in commands.items():
        structure = f"const struct {name.lower()}_command *"
        checks = _c_checks(entry)
        declared += [f"uint8_t on_{name.lower()}({f'{structure}c' if entry['fields'] else 'void'});"]
        if checks:
            cases += [f"  case COMMAND_{name}: {{", f"    {structure}c = payload;"]
            cases += [*checks, f"    return on_{name.lower()}(c);", "  }"]
        else:
            cases += [f"  case COMMAND_{name}: return on_{name.lower()}({'payload' * bool(entry['fields'])});"]
    return [
        *("/* Handlers: what a command is to do; the result says whether it was done. */", *declared, ""),
        "/* Have an admitted command of the right length done by its handler, if its values are in range. */",
        "static inline uint8_t command_carry_out(uint8_t command, const void *payload) {",
        *("  switch (command) {", *cases, "  }", "  return RESULT_UNKNOWN;", "}"),
    ]


def _c_answers(table: MessageTable) -> list[str]:
    declared, cases = [], []
    for answer in map(str.lower, table["answers"]):
        asking = [name for name, entry in table["commands"].items() if entry.get("answer", "").lower() == answer]
        declared += [f"void answer_{answer}(struct {answer}_answer *a);"]
        cases += [*(f"  case COMMAND_{name}:" for name in asking), f"    answer_{answer}(body);"]
        cases += [f"    return sizeof(struct {answer}_answer);"]
    return [
        *("/* What the board answers behind the result. */", *declared, ""),
        "/* Write what a command is answered behind its result, done or not; the number of bytes. */",
        "static inline uint8_t command_answer(uint8_t command, void *body) {",
        *("  switch (command) {", *cases, "  }", "  return 0;", "}"),
    ]


def _c_checks(entry: MessageTable) -> list[str]:
    lines = []
    for name, (kind, count, scale, _unit, lowest, highest) in entry["fields"].items():
        least, past = WIRE_RANGE[kind]
        first, last = round(lowest * scale), round(highest * scale)
        value = f"c->{name}[i]" if count > 1 else f"c->{name}"
        outside = [f"{value} < {_c_number(first)}"] * (first > least)
        outside += [f"{value} > {_c_number(last)}"] * (last < past - 1)
        if outside:
            loop = f"for (uint8_t i = 0; i < {count}; i++) " if count > 1 else ""
            lines += [f"    {loop}if ({' || '.join(outside)}) return RESULT_RANGE;"]
    return lines


def python_module(table: MessageTable) -> str:
    """Return messages.py: constants, codes, and one named tuple per message."""
    protocol, commands = table["protocol"], table["commands"]
    out = [f'"""Messages between host and board. {MARK}"""', "", "from __future__ import annotations", ""]
    out += ["from enum import IntEnum, IntFlag", "from typing import NamedTuple", ""]
    out += [f"PROTOCOL_VERSION = {protocol['version']}", f"FIRMWARE_VERSION = {tuple(protocol['firmware'])}"]
    out += [f"DICTIONARY_HASH = {dictionary_hash(table):#010X}".replace("0X", "0x"), f"BAUD = {protocol['baud']}"]
    for name, entry in table["constants"].items():
        out += [f"{name} = {entry['value']}  # {entry['unit']}: {entry['meaning']}"]
    for kind, group in (CODES | BITS).items():
        out += ["", "", f"class {kind}({'IntEnum' if kind in CODES else 'IntFlag'}):", f'    """{_KINDS[kind]}"""', ""]
        out += [f"    {name} = {_number(entry)}  # {entry['meaning']}" for name, entry in table[group].items()]
    named = {name.title(): entry for name, entry in commands.items() if entry["fields"]}
    for name, entry in (named | table["answers"]).items():
        out += _named_tuple(name, entry, table["defaults"] if name in named else {})
    return "\n".join([*out, ""])


def _named_tuple(name: str, entry: MessageTable, defaults: MessageTable) -> list[str]:
    out = ["", "", f"class {name}(NamedTuple):", f'    """{entry["meaning"][0].upper()}{entry["meaning"][1:]}."""', ""]
    for field, (_kind, count, scale, unit, *span) in entry["fields"].items():
        scalar = unit if unit in CODES | BITS else "float" if scale > 1 else "int"
        default = ""
        if field in defaults:
            value = defaults[field]["value"] / scale if scale > 1 else defaults[field]["value"]
            default = f" = ({value},) * {count}" if count > 1 else f" = {value}"
        range_note = f", {span[0]} to {span[1]}" if span else ""
        typed = f"tuple[{', '.join([scalar] * count)}]" if count > 1 else scalar
        out += [f"    {field}: {typed}{default}  # {unit}{range_note}"]
    return out


if __name__ == "__main__":
    render = {"c": c_header, "python": python_module}[sys.argv[1]]
    sys.stdout.write(render(load()))
