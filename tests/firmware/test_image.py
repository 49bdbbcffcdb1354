"""The packaged image is what its sources and the message table give."""

from __future__ import annotations

import hashlib
import shutil
import subprocess
from pathlib import Path

import pytest

BOARD = Path(__file__).parents[2] / "wristctl" / "board"
IMAGE = BOARD / "firmware" / "wrist.hex"

needs_compiler = pytest.mark.skipif(not shutil.which("avr-gcc"), reason="needs gcc-avr, binutils-avr, avr-libc")


def test_image_has_the_hash_written_beside_it() -> None:
    written, name = IMAGE.with_suffix(".hex.sha256").read_text().split()
    assert (written, name) == (hashlib.sha256(IMAGE.read_bytes()).hexdigest(), "wrist.hex")


@needs_compiler
@pytest.mark.slow
def test_sources_alone_in_another_place_build_the_same_bytes(tmp_path: Path) -> None:
    elsewhere = tmp_path / "another" / "place"
    shutil.copytree(BOARD / "firmware", elsewhere / "firmware")
    for name in ("dictionary.py", "messages.toml"):
        shutil.copy(BOARD / name, elsewhere)
    command: list[str | Path] = ["make", "-C", elsewhere / "firmware", "check", f"BUILD={tmp_path}/build"]
    run = subprocess.run(command, capture_output=True, text=True)
    assert run.returncode == 0, run.stdout + run.stderr
    assert "warning" not in run.stderr


@needs_compiler
def test_another_compiler_is_refused(tmp_path: Path) -> None:
    other = tmp_path / "avr-gcc"
    other.write_text("#!/bin/sh\necho 7.3.0\n")
    other.chmod(0o755)
    command: list[str | Path] = ["make", "-C", BOARD / "firmware", f"BUILD={tmp_path}/build"]
    run = subprocess.run(command, capture_output=True, text=True, env={"PATH": f"{tmp_path}:/usr/bin:/bin"})
    assert run.returncode != 0
    assert "avr-gcc 5.4.0 is needed" in run.stdout
