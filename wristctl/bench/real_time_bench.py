"""The emulated bench in real time, started in a process of its own and used like the one in virtual time."""

import multiprocessing
import shutil
import signal
import tempfile
from collections.abc import Callable, Sequence
from functools import partial
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from wristctl.bench.bench_wrist import MotorMotion, Truth
from wristctl.bench.emulated_rig import EmulatedRig, planes_seen
from wristctl.bench.frame_process import FrameMemory, start_film
from wristctl.board.board_errors import BoardError
from wristctl.board.messages import BAUD
from wristctl.board.transport import SerialTransport
from wristctl.config.bench import BenchSettings
from wristctl.config.camera import Markers
from wristctl.config.plant import Disturbances
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.processes import safe_path
from wristctl.seeds import Entropy

_END = 5.0


class RealTimeBench:
    """The client's side of a bench in another process; times are of `time.monotonic`.

    Closing it, or leaving it as a context manager, ends that process; a client that dies leaves it to end by itself.
    BoardError where the process has died.
    """

    def __init__(
        self, processes: Sequence[BaseProcess], control: Connection, address: str, pictures: Sequence[Path]
    ) -> None:
        self._processes, self._control = processes, control
        self.transport = SerialTransport(address, BAUD, emulated=True)
        self.cameras = tuple(map(FrameMemory, pictures))

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def face(self, direction: str) -> None:
        """As `Bench.face`."""
        self._ask("face", direction)

    def disturb(self, disturbances: Disturbances, start: float) -> None:
        """As `Bench.disturb`."""
        self._ask("disturb", disturbances, start)

    def begin(self, start: float, disturbances: Disturbances | None = None, noise: Entropy | None = None) -> None:
        """As `Bench.begin`."""
        self._ask("begin", start, disturbances, noise)

    def truth(self, since: float = 0.0) -> Truth:
        """As `Bench.truth`."""
        truth: Truth = self._ask("truth", since)
        return truth

    def motion(self) -> MotorMotion:
        """As `Bench.motion`."""
        motion: MotorMotion = self._ask("motion")
        return motion

    def close(self) -> None:
        """End the bench's process."""
        self.transport.close()
        self._control.close()
        self._processes[0].terminate()
        for process in self._processes:
            process.join(_END)

    def _ask(self, *request: Any) -> Any:
        try:
            self._control.send(request)
            return self._control.recv()
        except (EOFError, OSError) as error:
            raise BoardError("host", "the emulated bench's process has died", fix="start again") from error


def connect(
    settings: BenchSettings, wrist: WristParameters, seed: int, markers: Markers | None = None,
    markers_2: Markers | None = None, record: Path | None = None,
) -> RealTimeBench:  # fmt: skip
    """Start a bench in processes of its own, wrist and cameras. What its board did is left in the file `record`.

    With the markers of a second camera, `markers_2`, the wrist bends in two planes.

    It takes as long to start as its parts take to be compiled, if this is the first time.
    """
    folder = Path(tempfile.mkdtemp(prefix="wristctl-bench-"))
    cameras, films, pictures = films_of(settings, wrist, (markers, markers_2), folder)
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe()
    rig = partial(EmulatedRig, settings, wrist, seed, markers, markers_2=markers_2)
    bench = context.Process(target=_serve, args=(theirs, films, folder, rig, record), daemon=True)
    with safe_path():
        bench.start()
    for end in (theirs, *films):
        end.close()
    try:
        address = ours.recv()
    except EOFError as error:
        fix = "wristctl hw emulate --wrist shows why"
        raise BoardError("host", "the emulated bench did not start", fix=fix) from error
    if isinstance(address, UserError):
        raise address
    return RealTimeBench((bench, *cameras), ours, address, pictures)


def films_of(
    settings: BenchSettings, wrist: WristParameters, markers: tuple[Markers | None, Markers | None], folder: Path,
    broadcast: bool = False,
) -> tuple[list[BaseProcess], list[Connection], list[Path]]:  # fmt: skip
    """The processes of a bench's cameras, the ways to them, and the files of their pictures.

    One camera, or two where the second's markers are given: the wrist then bends in two planes.
    """
    planes = planes_seen(markers[1])
    pictures = [folder / f"frame{'' if not plane else plane + 1}" for plane in planes]
    started = [
        start_film(settings, wrist, markers[plane or 0], file, broadcast, plane)
        for plane, file in zip(planes, pictures, strict=True)
    ]
    return [process for process, _ in started], [film for _, film in started], pictures


def _serve(
    control: Connection, films: Sequence[Connection], folder: Path, make: Callable[[], EmulatedRig],
    record: Path | None,
) -> None:  # fmt: skip
    """The bench's process: Ctrl-C is the client's affair. It takes the cameras' folder with it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    from wristctl.bench.server import BenchServer
    from wristctl.board.emulator.serve import PtyLine

    try:
        line = PtyLine()
        server = BenchServer(make(), line, films, record, control)
        signal.signal(signal.SIGTERM, lambda *_: server.stop())
        control.send(line.address)
        server.run()
    except UserError as error:
        control.send(UserError(error.what, error.where, error.fix, error.exit_code))
    finally:
        shutil.rmtree(folder, ignore_errors=True)
