"""The C++ sources of c/ as libraries, compiled for this machine."""

from __future__ import annotations

import ctypes
import hashlib
import subprocess
from collections.abc import Sequence
from pathlib import Path

SOURCES = Path(__file__).resolve().parent / "c"
FLAGS = ("-O3", "-march=native", "-ffp-contract=fast", "-shared", "-fPIC", "-pthread")


def compiled(name: str, cache: Path, options: Sequence[str] = ()) -> ctypes.CDLL:
    """The library of one source; from the cache folder where it was compiled from the same sources and options."""
    text = "".join(path.read_text() for path in sorted(SOURCES.iterdir())) + " ".join((name, *FLAGS, *options))
    built = cache / "c" / f"{Path(name).stem}-{hashlib.sha256(text.encode()).hexdigest()[:16]}.so"
    if not built.exists():
        built.parent.mkdir(parents=True, exist_ok=True)
        part = built.with_suffix(".part")  # what a killed compiler leaves must not pass for the library
        subprocess.run(["g++", *FLAGS, *options, str(SOURCES / name), "-o", str(part)], check=True)
        part.replace(built)
    return ctypes.CDLL(str(built))
