"""`wristctl hw jog`, `home`, `limits`, `slacken`, `tension` and `clear`: the motors by a person's word.

The drives hold while the person thinks, and are released at the end: a board keeps no zero without them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing, contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from wristctl.cli.hw_limits import tell_limits
from wristctl.cli.operator import idle, typed_line
from wristctl.cli.options import BAUD, RESULTS, Baud, Json, Out, Port, set_option
from wristctl.errors import UserError
from wristctl.study_files.load import load_study

if TYPE_CHECKING:
    from wristctl.board.driver import Board
    from wristctl.config.study import Study
    from wristctl.trial.by_hand import ByHand

Override = Annotated[list[str] | None, set_option("Override a setting of calibrate-wrist: safety.travel=0.01")]
Calibration = Annotated[
    str | None, typer.Option("--calibration", help="calibrate-wrist run that knows the senses; without one + reels in.")
]
Dry = Annotated[bool, typer.Option("--dry-run", help="Say what would be done; open nothing.")]
Yes = Annotated[bool, typer.Option("--yes", help="Ask nobody before the motors move.")]
Axis = Annotated[int, typer.Option("--axis", min=0, max=3, help="Axis, 0 to 3, of tendons 1, 2, 4, 5.")]
_TENDONS = "Emergency stop within reach, nobody's hands in the tendons?"


def jog(
    axis: Axis, mm: Annotated[float, typer.Option("--mm", help="Tendon to reel in; negative: to pay out.")],
    port: Port = None, baud: Baud = BAUD, override: Override = None, calibration: Calibration = None,
    out: Out = RESULTS, dry_run: Dry = False, yes: Yes = False,
) -> None:  # fmt: skip
    """Reel a tendon in, or pay it out, slowly and by little; then by as much more as is typed."""
    plan = f"axis {axis} {_reels(mm)}, at 400 steps/s; then the drives hold"
    with _session(plan, port, baud, override, calibration, out, dry_run, yes) as hand:
        if hand is None:
            return

        def more(typed: str) -> None:
            length = _length(typed)
            steps = hand.jog([length * (k == axis) for k in range(4)])
            print(f"axis {axis}: {steps[axis]:+d} steps")

        more(str(mm))
        _converse(hand, f"Millimetres for axis {axis}, or Enter to release the drives: ", more)


def home(
    port: Port = None, baud: Baud = BAUD, override: Override = None, calibration: Calibration = None,
    out: Out = RESULTS, dry_run: Dry = False, yes: Yes = False,
) -> None:  # fmt: skip
    """Call the place where the motors stand zero, and go from there within soft limits as is typed."""
    plan = "the drives are switched on where they stand, and that is zero; nothing moves until you say so"
    with _session(plan, port, baud, override, calibration, out, dry_run, yes) as hand:
        if hand is None:
            return
        hand.home()
        print("zero is here until the drives are released")

        def go(typed: str) -> None:
            axis, _, length = typed.partition(" ")
            if axis not in ("0", "1", "2", "3"):
                raise UserError(f"{typed!r} is no axis and length", fix="for instance 2 0.5")
            print(f"positions {hand.go(int(axis), _length(length))} steps")

        _converse(hand, "Axis and millimetres from zero, or Enter to release the drives: ", go)


def limits(
    port: Port = None, baud: Baud = BAUD, override: Override = None,
    from_runs: Annotated[
        list[str] | None,
        typer.Option("--from", metavar="RUN", help="Instead: an hw-run run's residuals beside its limits; repeatable."),
    ] = None,
    figure: Annotated[Path | None, typer.Option("--figure", help="With --from: the picture to write.")] = None,
    out: Out = RESULTS, as_json: Json = False,
    dry_run: Dry = False, yes: Yes = False,
) -> None:  # fmt: skip
    """Set the soft limits of safety.travel, and see that the board keeps them; nothing moves.

    With --from: how near a run came to each limit of safety, what stopped it, and limits that its rig would bear.
    """
    if from_runs:
        tell_limits(from_runs, out, figure, as_json)
        return
    plan = "soft limits are set, the drives switched on, and targets beyond the limits sent, which are to be refused"
    with _session(plan, port, baud, override, None, RESULTS, dry_run, yes) as hand:
        if hand is not None:
            hand.home()
            print(f"a step beyond +-{hand.limits_hold()} steps is refused, on all axes and to both sides")


def slacken(
    mm: Annotated[float, typer.Option("--mm", min=0.0, help="Tendon to pay out.")] = 0.6,
    port: Port = None, baud: Baud = BAUD, override: Override = None, calibration: Calibration = None,
    out: Out = RESULTS, dry_run: Dry = False, yes: Yes = False,
) -> None:  # fmt: skip
    """Pay out all four tendons together, then release the drives: unloads a wrist that has been stopped."""
    plan = f"each of the four axes {_reels(-mm)}, all together; then the drives are released"
    with _session(plan, port, baud, override, calibration, out, dry_run, yes) as hand:
        if hand is not None:
            print(f"paid out: {hand.jog([-_length(str(mm))] * 4)} steps")


def tension(
    axis: Annotated[
        int | None,
        typer.Option("--axis", min=0, max=3, help="This axis alone, 0 to 3, of tendons 1, 2, 4, 5; without it all."),
    ] = None,
    mm: Annotated[float, typer.Option("--mm", min=0.02, max=1.0, help="Tendon to reel in by one move.")] = 0.1,
    camera: Annotated[
        str | None, typer.Option("--camera", help="Camera that sees a tendon bend the wrist; without it you say so.")
    ] = None,
    port: Port = None, baud: Baud = BAUD, override: Override = None, calibration: Calibration = None,
    out: Out = RESULTS, dry_run: Dry = False, yes: Yes = False,
) -> None:  # fmt: skip
    """Take up each tendon's slack: reel it in until it is taut, by your word or the camera's, then pay out a little.

    Tendons hang slack after a stop that released the drives, and after one was changed.
    """
    axes, who = range(4) if axis is None else (axis,), "you say so" if camera is None else "the wrist bends"
    which = "each axis in turn" if axis is None else f"axis {axis}"
    plan = f"{which} reels in {1e3 * _length(str(mm)):g} mm at a time until {who}, then pays out by homing.pull"
    with _connected(plan, port, baud, override, calibration, out, dry_run, yes) as connected, ExitStack() as opened:
        if connected is None:
            return
        from wristctl.trial.by_hand import bent_by_tendon, take_up
        from wristctl.trial.tracking import ThreadedTracking
        from wristctl.vision.device_camera import DeviceCamera
        from wristctl.vision.marker import Tracker
        from wristctl.vision.view import View

        board, study, signs = connected
        settings = study.calibrate_wrist
        if camera is not None:
            eye = opened.enter_context(closing(DeviceCamera(camera, settings.device)))
            tracking = opened.enter_context(
                closing(ThreadedTracking(eye, Tracker(settings.markers, View(), settings.gates)))
            )
        for one in axes:
            try:
                taut: Callable[[float], bool] = partial(_says_taut, board, one)
                if camera is not None:
                    taut = bent_by_tendon(board, tracking, settings, study.wrist, settings.plane)
                length = take_up(board, settings, signs, one, _length(str(mm)), taut)
            except KeyboardInterrupt:
                again = f"wristctl hw tension --axis {one}"
                typer.echo(f"\ninterrupted: axis {one} is not done, and its drive lets go; go on: {again}", err=True)
                raise
            print(f"axis {one}: taut after {1e3 * length:.2f} mm, and paid out by {1e3 * settings.homing.pull:g} mm")


def _says_taut(board: Board, axis: int, reeled: float) -> bool:
    """Whether the person says that a tendon is taut which has been reeled in so far [m]; UserError without a person."""
    from wristctl.trial.supervised_wait import Patience

    answer, ended = "m and Enter for more, Enter where it is taut", "\x04"
    while True:
        typer.echo(f"axis {axis}: {1e3 * reeled:.2f} mm reeled in. {answer}: ", nl=False, err=True)
        typed = typed_line(Patience(board).pulse, ended).strip()
        if typed == ended:
            raise UserError("nobody says whether the tendon is taut", f"axis {axis}", f"{answer}; or --camera", 3)
        if typed in ("", "m"):
            return not typed


def clear(port: Port = None, baud: Baud = BAUD, dry_run: Dry = False, yes: Yes = False) -> None:
    """Clear a latched fault once its cause is mended; drives that hold let go."""
    from wristctl.board.driver import Board
    from wristctl.board.layout import FAULT_MEANING
    from wristctl.board.messages import Fault, State
    from wristctl.board.transport import open_transport

    plan = "a fault that is latched is cleared: drives that hold tendons let go"
    if dry_run:
        print(plan)
        return
    with Board(open_transport(port, baud)) as board:
        status = board.read()
        if status.state != State.FAULT:
            print(f"no fault is latched; the board is {status.state.name}")
            return
        print("; ".join(FAULT_MEANING[fault] for fault in Fault if fault in status.faults))
        _agree(plan, yes, idle)
        print(f"cleared; the board is {board.clear().state.name}")


@contextmanager
def _session(*asked: Any) -> Iterator[ByHand | None]:
    """The drives on, after a yes, until the block ends (at once where that goes wrong); None in a dry run.

    Its arguments are those of `_connected`.
    """
    with _connected(*asked) as connected:
        if connected is None:
            yield None
            return
        from wristctl.trial.by_hand import ByHand

        board, study, signs = connected
        yield ByHand(board, study.calibrate_wrist, signs)


@contextmanager
def _connected(
    plan: str, port: str | None, baud: int, override: list[str] | None, calibration: str | None, out: Path,
    dry_run: bool, yes: bool,
) -> Iterator[tuple[Board, Study, tuple[int, ...]] | None]:  # fmt: skip
    """A board after a yes, the study of its rig and the senses of its motors; None in a dry run."""
    study = load_study((), override or (), "calibrate-wrist")
    settings = study.calibrate_wrist.within(study.wrist)
    if dry_run:
        print(plan)
        yield None
        return
    from wristctl.board.driver import Board
    from wristctl.board.transport import open_transport
    from wristctl.commands.calibrate.wrist import CALIBRATION
    from wristctl.records import require
    from wristctl.trial.calibration import WristCalibration
    from wristctl.trial.supervised_wait import Patience
    from wristctl.trial.tendon_pulls import tendon_pulls_of

    signs: tuple[int, ...] = (1, 1, 1, 1)
    if calibration:
        signs = WristCalibration.load(require(calibration, "calibrate-wrist", out, CALIBRATION)).zero.signs
    with Board(open_transport(port, baud)) as board:
        board.cells = tendon_pulls_of(settings)
        _agree(f"{plan}. {_TENDONS}", yes, Patience(board).pulse)
        yield board, study.model_copy(update={"calibrate_wrist": settings}), signs


def _agree(plan: str, yes: bool, meanwhile: Callable[[], None]) -> None:
    typer.echo(plan, err=True)
    if yes:
        return
    typer.echo("Type yes to go on: ", nl=False, err=True)
    if typed_line(meanwhile) != "yes":
        raise UserError("nothing was moved", fix="type yes, or --yes for scripted use", exit_code=3)


def _converse(hand: ByHand, question: str, answer: Callable[[str], None]) -> None:
    """Do what is typed until nothing is; what cannot be done is said, and asked for anew."""
    while True:
        typer.echo(question, nl=False, err=True)
        if not (typed := typed_line(hand.patience().pulse).strip()):
            return
        try:
            answer(typed)
        except UserError as error:
            if error.exit_code != 2:
                raise
            typer.echo(str(error), err=True)


def _length(typed: str) -> float:
    """Millimetres as typed, in metres. Raises UserError."""
    from wristctl.trial.by_hand import MOST

    try:
        length = 1e-3 * float(typed)
    except ValueError:
        length = float("nan")
    if not abs(length) <= MOST:
        raise UserError(f"{typed!r} is no length of at most {1e3 * MOST:g} mm", fix="for instance 0.5 or -0.5")
    return length


def _reels(mm: float) -> str:
    length = 1e3 * _length(str(mm))
    return f"reels in {length:g} mm of tendon" if length >= 0.0 else f"pays out {-length:g} mm of tendon"
