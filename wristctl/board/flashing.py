"""Writing the firmware into a Mega 2560 through its boot loader, with avrdude."""

import hashlib
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

from wristctl.board.board_errors import BoardError
from wristctl.plain_files import read_plain, read_text, unreadable
from wristctl.processes import check_hardware_allowed

IMAGE = Path(__file__).with_name("firmware") / "wrist.hex"
_BOOT_LOADER_BAUD = 115_200


def flash(port: str, image: Path = IMAGE, say: Callable[[str], None] = lambda line: None) -> None:
    """Write `image` and read it back. `say` gets avrdude's lines. Raises BoardError."""
    check_hardware_allowed("board", port)
    _see_whole(image)
    avrdude = shutil.which("avrdude")
    if avrdude is None:
        raise BoardError("host", "avrdude is not installed", fix="install it: sudo apt-get install avrdude")
    place = port.replace("socket://", "net:")
    command = [avrdude, "-c", "wiring", "-p", "atmega2560", "-P", place, "-b", str(_BOOT_LOADER_BAUD), "-D"]
    with subprocess.Popen(
        [*command, "-U", f"flash:w:{image}:i"], stderr=subprocess.STDOUT, stdout=subprocess.PIPE, text=True
    ) as writing:
        assert writing.stdout is not None
        lines = [line.strip() for line in writing.stdout if line.strip()]
    for line in lines:
        say(line)
    if writing.returncode:
        why = next((line for line in reversed(lines) if "error" in line.lower()), "avrdude failed")
        raise BoardError("cable", why, port, "close other programs on this port, press reset on the board, try again")


def _see_whole(image: Path) -> None:
    beside = image.with_name(image.name + ".sha256")
    if not image.exists():
        raise BoardError("host", "there is no such firmware", str(image), "name an Intel hex file", exit_code=2)
    try:
        content, stated = read_plain(image), read_text(beside) if beside.exists() else ""
    except OSError as error:
        raise BoardError(
            "host", unreadable(error, image).what, str(image), "name an Intel hex file", exit_code=2
        ) from None
    if stated and stated.split()[0] != hashlib.sha256(content).hexdigest():
        raise BoardError("host", "the firmware is not what its check sum says", str(image), "install wristctl anew")
