"""Intel hex files: the program as avr-objcopy writes it."""

from __future__ import annotations

from pathlib import Path

from wristctl.config.errors import UserError

_DATA, _END, _SEGMENT, _START_SEGMENT, _LINEAR, _START_LINEAR = range(6)


def read_hex(path: Path) -> dict[int, bytes]:
    """The records of a file: byte address -> bytes. UserError for a file that is not one, naming the line."""
    try:
        lines = path.read_text(encoding="ascii").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise UserError(f"cannot read the program: {error}", str(path), "name an Intel hex file") from error
    records: dict[int, bytes] = {}
    base = 0
    for number, line in enumerate(lines, 1):
        where = f"{path}:{number}"
        try:
            record = bytes.fromhex(line.removeprefix(":"))
            if not line.startswith(":") or record[0] != len(record) - 5:
                raise ValueError
        except (ValueError, IndexError) as error:
            raise UserError("not a line of an Intel hex file", where, "build or fetch the file anew") from error
        if sum(record) & 0xFF:
            raise UserError("a wrong check sum", where, "build or fetch the file anew")
        kind, payload = record[3], record[4:-1]
        if kind == _DATA:
            records[base + int.from_bytes(record[1:3], "big")] = payload
        elif kind in (_SEGMENT, _LINEAR):
            base = int.from_bytes(payload, "big") << (4 if kind == _SEGMENT else 16)
        elif kind == _END:
            return records
    raise UserError("the file ends before its end record", str(path), "build or fetch the file anew")
