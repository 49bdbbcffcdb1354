"""`wristctl hw emulate`."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import Annotated, Any

import typer

from wristctl.cli.hw_options import Image
from wristctl.cli.options import Debug, Quiet
from wristctl.cli.progress import listening, progress
from wristctl.studies.counting import no_event

log = logging.getLogger(__name__)


def emulate(
    tcp: Annotated[
        int | None, typer.Option("--tcp", help="Serve this TCP port (0: any), not a pseudo-terminal.")
    ] = None,
    image: Image = None,
    boot_loader: Annotated[
        Path | None, typer.Option("--boot-loader", help="Start this boot loader (Intel hex).")
    ] = None,
    wrist: Annotated[
        bool, typer.Option("--wrist", help="Hang a simulated wrist on it, before a rendered camera.")
    ] = False,
    quiet: Quiet = False,
    debug: Debug = False,
) -> None:
    """Serve the emulated board for any serial client, in real time; its port is the only line on stdout."""
    with listening(quiet, False) as console:
        with progress(console, no_event, "preparing the emulated board (compiled once per version)", None, "", quiet):
            from wristctl.board.emulator.atmega2560 import FIRMWARE, Atmega2560
            from wristctl.board.emulator.serve import PtyLine, TcpLine, serve

            chip = Atmega2560(image or FIRMWARE, boot_loader=boot_loader)
        line = PtyLine() if tcp is None else TcpLine(tcp)
        if wrist:
            _serve_with_wrist(chip, line, console, quiet)
            return
        log.info("serving; try: wristctl hw check --port %s", line.address)
        print(line.address, flush=True)
        try:
            serve(chip, line)
        finally:
            line.close()


def _serve_with_wrist(chip: Any, line: Any, console: Any, quiet: bool) -> None:
    from tempfile import TemporaryDirectory

    with TemporaryDirectory(prefix="wristctl-bench-") as folder:
        pictures = Path(folder) / "frame"
        with progress(console, no_event, "preparing the wrist (compiled once per version)", None, "", quiet):
            from wristctl.bench.film import start_film
            from wristctl.bench.rig import Rig
            from wristctl.bench.server import BenchServer
            from wristctl.config.bench import BenchSettings
            from wristctl.config.wrist import WristParameters

            settings, its = BenchSettings(), WristParameters()
            camera, film = start_film(settings, its, None, pictures)
            server = BenchServer(Rig(settings, its, 0, chip=chip), line, film)
        log.info("serving, with a wrist of the default settings on axes 0 to 3; its camera's frames: %s", pictures)
        log.info("try: wristctl hw check --port %s --wiring 3", line.address)
        print(line.address, flush=True)
        try:
            server.run()
        finally:
            camera.join()
