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
    override: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="KEY=VALUE", help="With --wrist: override a setting of hw-run, bench.KEY=VALUE."),
    ] = None,
    quiet: Quiet = False,
    debug: Debug = False,
) -> None:
    """Serve the emulated board for any serial client, in real time; its port is the only line on stdout.

    With --wrist a second line says where the camera's pictures are, which --camera takes; press, release (the
    emergency stop) and directions that the wrist is turned to can be typed.
    """
    with listening(quiet, False) as console:
        with progress(console, no_event, "preparing the emulated board (compiled once per version)", None, "", quiet):
            from wristctl.board.emulator.atmega2560 import FIRMWARE, Atmega2560
            from wristctl.board.emulator.serve import PtyLine, TcpLine, serve

            chip = Atmega2560(image or FIRMWARE, boot_loader=boot_loader)
        line = PtyLine() if tcp is None else TcpLine(tcp)
        if wrist:
            _serve_with_wrist(chip, line, override or [], console, quiet)
            return
        log.info("serving; try: wristctl hw check --port %s", line.address)
        print(line.address, flush=True)
        try:
            serve(chip, line)
        finally:
            line.close()


def _serve_with_wrist(chip: Any, line: Any, override: list[str], console: Any, quiet: bool) -> None:
    import sys
    from tempfile import TemporaryDirectory

    from wristctl.config.load import load_study
    from wristctl.loop_priority import prioritised

    study = load_study((), override, "hw-run")
    priority = prioritised(study.hw_run.priority)
    with TemporaryDirectory(prefix="wristctl-bench-") as folder, priority as allowed:
        if allowed:
            log.info(allowed)
        pictures = Path(folder) / "frame"
        with progress(console, no_event, "preparing the wrist (compiled once per version)", None, "", quiet):
            from wristctl.bench.bystander import Bystander
            from wristctl.bench.film import start_film
            from wristctl.bench.rig import Rig
            from wristctl.bench.server import BenchServer

            settings, markers = study.hw_run.bench, study.hw_run.markers
            camera, film = start_film(settings, study.wrist, markers, pictures, broadcast=True)
            rig = Rig(settings, study.wrist, study.seed, markers, chip)
            bystander = Bystander(rig, sys.stdin.fileno()) if sys.stdin and not sys.stdin.closed else None
            server = BenchServer(rig, line, film, bystander=bystander)
        log.info("serving, with a wrist on axes 0 to 3; its camera's frames: %s", pictures)
        log.info("try: wristctl hw check --rig --port %s --camera %s", line.address, server.camera)
        print(line.address, server.camera, sep="\n", flush=True)
        try:
            server.run()
        finally:
            camera.join()
