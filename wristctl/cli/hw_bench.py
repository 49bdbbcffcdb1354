"""`wristctl hw emulate` and `watch`."""

import logging
import shlex
import time
from pathlib import Path
from typing import Annotated, Any

import typer

from wristctl.cli.options import RESULTS, Image, Out, Quiet, set_option
from wristctl.cli.progress import listening, progress
from wristctl.errors import UserError
from wristctl.records import Run, open_run

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
        list[str] | None, set_option("With --wrist: override a setting of hw-run, bench.KEY=VALUE.")
    ] = None,
    quiet: Quiet = False,
) -> None:
    """Serve the emulated board for any serial client, in real time; its port is the first line on stdout.

    With --wrist a second line says where the camera's pictures are, which --camera takes, with planes=2 a third where
    the second's are; press, release (the emergency stop) and directions that the wrist is turned to can be typed.
    """
    with listening(quiet, False) as console:
        with progress(console, "preparing the emulated board (compiled once per version)", quiet):
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

    from wristctl.commands.adoption import with_planes
    from wristctl.commands.inputs import check_wound
    from wristctl.loop_priority import prioritised
    from wristctl.study_files.load import load_study

    study = with_planes(load_study((), override, "hw-run"))
    check_wound(study.wrist, study.hw_run.planes, "hw emulate")
    priority = prioritised(study.hw_run.priority)
    with TemporaryDirectory(prefix="wristctl-bench-") as folder, priority as allowed:
        if allowed:
            log.info(allowed)
        with progress(console, "preparing the wrist (compiled once per version)", quiet):
            from wristctl.bench.emulated_rig import Bystander, EmulatedRig
            from wristctl.bench.real_time_bench import films_of
            from wristctl.bench.server import BenchServer

            asked = study.hw_run
            markers = asked.markers, asked.markers_2 if asked.planes == 2 else None
            cameras, films, pictures = films_of(asked.bench, study.wrist, markers, Path(folder), broadcast=True)
            rig = EmulatedRig(asked.bench, study.wrist, study.seed, markers[0], chip, markers[1])
            bystander = Bystander(rig, sys.stdin.fileno()) if sys.stdin and not sys.stdin.closed else None
            server = BenchServer(rig, line, films, bystander=bystander)
        log.info("serving, with a wrist on axes 0 to 3; its cameras' frames: %s", ", ".join(map(str, pictures)))
        more = f" --set planes=2 --set camera_2={server.cameras[1]}" if asked.planes == 2 else ""
        log.info("try: wristctl hw check --rig --port %s --camera %s%s", line.address, server.cameras[0], more)
        print(line.address, *server.cameras, sep="\n", flush=True)
        try:
            server.run()
        finally:
            for camera in cameras:
                camera.join()


_LOG = "data/log.csv"
Seconds = Annotated[float, typer.Option("--last", help="Seconds to show.", min=0.5)]
Every = Annotated[float, typer.Option("--every", help="Seconds between two pictures.", min=0.1)]


def watch(
    ref: Annotated[str, typer.Argument(metavar="[RUN]", help="A run of hw-run; by default the newest.")] = "",
    file: Annotated[Path, typer.Option("--file", help="The picture (PNG) to write anew each time.")] = Path("live.png"),
    last: Seconds = 10.0,
    every: Every = 0.5,
    out: Out = RESULTS,
) -> None:
    """Draw angle, reference and tensions of the trials that go on, until their run ends."""
    from wristctl.commands.hw_run.live_figure import newest_rows, recent
    from wristctl.records.files import replacing

    run = open_run(ref, out) if ref else _newest(out)
    if run.kind != "hw-run":
        raise UserError("only runs of hw-run go on in time", str(run.path), "name a run of hw-run")
    period = run.config.hw_run.control_period
    going_on, drawn = True, False
    while going_on:
        going_on = run.state == "running"
        picture = None
        if run.has(_LOG):
            with run.reading():
                log = run.file(_LOG)
                if log.stat().st_size:  # empty until the first tick
                    picture = recent(newest_rows(log, last, period))
        if picture is not None:
            drawn = True
            with replacing(file) as temporary:
                picture.savefig(temporary, format="png", dpi=100)
        if going_on:
            time.sleep(every)
    if not drawn:
        shows = f"wristctl runs show {shlex.quote(str(run.path))}"
        raise UserError("the run ended before its first trial", str(run.path), shows)
    print(file)


def _newest(results: Path) -> Run:
    from wristctl.records.index import indexed

    run_ids = [entry.id for entry in indexed(results, renew=False) if entry.kind == "hw-run"]
    if not run_ids:
        raise UserError("there is no run of hw-run", str(results), "start one, or say --out DIR")
    return Run(results / run_ids[-1])
