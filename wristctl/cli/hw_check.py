"""`wristctl hw check`: is the board well, and can the rig run the configured loop?"""

from __future__ import annotations

import math
import textwrap
from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated, Any

import typer

from wristctl.cli.json_output import print_json
from wristctl.cli.operator import typed_line
from wristctl.cli.options import BAUD, Baud, Json, Port, Quiet, facts_of, set_option
from wristctl.cli.progress import listening, progress
from wristctl.commands.inputs import check_wound
from wristctl.commands.printed_table import Table
from wristctl.errors import UserError
from wristctl.study_files.load import load_study

if TYPE_CHECKING:
    from wristctl.config.hw_run import HwRunSettings
    from wristctl.trial.rig_facts import CameraFacts, RigFacts, Trouble


def check(
    port: Port = None,
    baud: Baud = BAUD,
    rounds: Annotated[int, typer.Option("--rounds", min=1, help="Commands to time.")] = 200,
    wiring: Annotated[
        int | None, typer.Option("--wiring", metavar="AXIS", min=0, max=3, help="Move this axis a little, after a yes.")
    ] = None,
    rig: Annotated[
        bool, typer.Option("--rig", help="Camera and computer too: can the loop of hw-run run here?")
    ] = False,
    camera: Annotated[str | None, typer.Option("--camera", help="With --rig: number, path or address.")] = None,
    optics: Annotated[
        str | None, typer.Option("--optics", metavar="RUN", help="With --rig: calibrate-camera run of the camera.")
    ] = None,
    optics_2: Annotated[
        str | None, typer.Option("--optics-2", metavar="RUN", help="With --rig: that of the second camera.")
    ] = None,
    axis: Annotated[int, typer.Option("--axis", min=0, max=3, help="With --rig: axis that is to be moved.")] = 2,
    override: Annotated[list[str] | None, set_option("With --rig: a setting of hw-run.")] = None,
    yes: Annotated[bool, typer.Option("--yes", help="Ask nobody before a motor moves.")] = False,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Ask the board who it is and how it is, time its answers, and try one drive's wiring; --rig: the whole rig."""
    if rig:
        named = {"camera": camera, "optics": optics, "optics_2": optics_2}
        chosen = {name: value for name, value in named.items() if value is not None}
        return check_rig(port, baud, chosen, override or [], axis, yes, as_json, quiet)
    from wristctl.board.check import WIRING_STEPS, adapter_of, move_a_little, moved_a_little, round_trips
    from wristctl.board.driver import Board
    from wristctl.board.messages import Command
    from wristctl.board.transport import EMULATED, open_transport

    with listening(quiet, False) as console:
        if port == EMULATED:
            with progress(console, "preparing the emulated board", quiet):
                transport = open_transport(port, baud)
        else:
            transport = open_transport(port, baud)
        with Board(transport) as board:
            assert board.hello is not None
            if wiring is not None:
                if not yes:
                    _ask_before_moving(wiring)
                move_a_little(board, wiring)
            times = [round_trips(board, command, rounds) for command in (Command.PING, Command.STATUS)]
            status, counters = board.read(), board.counters()
    adapter = adapter_of(transport.name)
    facts = facts_of({**board.hello._asdict(), **status._asdict()})
    counted = {**asdict(board.traffic), "bad_frames_here": board.bad_frames, **counters._asdict()}
    if as_json:
        timed = [timing._asdict() for timing in times]
        shown = {
            "schema": "wristctl.board/1",
            "port": transport.name,
            "adapter": adapter._asdict(),
            **facts,
            "round_trips_s": timed,
            "counters": counted,
        }
        if wiring is not None:
            shown["wiring"] = {"axis": wiring, "steps": WIRING_STEPS}
        return print_json(shown)
    if wiring is not None:
        print(textwrap.fill(moved_a_little(wiring), 100), end="\n\n")
    units = _units()
    columns = ("command", "times", "median [ms]", "p99 [ms]", "worst [ms]")
    rows = [(timing.command, timing.rounds, *(1e3 * value for value in timing[2:])) for timing in times]
    for table in (
        Table(
            "Board",
            ("port", transport.name),
            [
                (name, f"{value} {units.get(name, '')}".rstrip())
                for name, value in {"USB adapter": adapter, **facts}.items()
            ],
        ),
        Table("Round trips", columns, rows),
        Table("On the wire", ("what", "count"), list(counted.items())),
    ):
        print(table.text(), end="\n\n")


def _units() -> dict[str, str]:
    """Units of what a board says of itself, by name; none of a number or a name."""
    from wristctl.board.layout import LAYOUTS
    from wristctl.board.messages import Hello, Status

    fields = (field for message in (Hello, Status) for field in LAYOUTS[message].fields)
    return {field.name: field.unit for field in fields if field.unit != "1" and field.kind is None}


def _ask_before_moving(axis: int) -> None:
    typer.echo(f"Axis {axis} will creep a twentieth of a turn forward and back. Keep clear of the tendons.", err=True)
    if typer.prompt("Type yes to move it", default="no", show_default=False, err=True) != "yes":
        raise UserError("nothing was moved", fix="type yes, or leave out --wiring", exit_code=3)


# Exit code of a rig that cannot run the loop.
UNFIT = 3


def check_rig(
    port: str | None, baud: int, chosen: dict[str, str], override: list[str], axis: int, yes: bool, as_json: bool,
    quiet: bool,
) -> None:  # fmt: skip
    """Measure, and print the answer first. Exits with 3 where the loop cannot run. `chosen` are settings by name."""
    from wristctl.board.driver import Board
    from wristctl.board.transport import EMULATED, only_board
    from wristctl.commands.adoption import with_planes
    from wristctl.commands.rig_description import unread_of_device
    from wristctl.loop_priority import prioritised
    from wristctl.records import require
    from wristctl.trial.rig_facts import Pictures, measure, troubles
    from wristctl.trial.supervised_wait import Patience
    from wristctl.trial.testbeds import open_testbed
    from wristctl.vision.view import View

    study = with_planes(load_study((), override, "hw-run"))
    overrides: dict[str, Any] = {"baud": baud, "port": None if port == EMULATED else port or only_board()}
    settings = study.hw_run.model_copy(update=overrides | chosen)
    check_wound(study.wrist, settings.planes, "hw check")
    runs = (require(run, "calibrate-camera") if run else None for run in (settings.optics, settings.optics_2))
    view, view_2 = map(View.of, runs)
    pictures = Pictures()
    with listening(quiet, False) as console, prioritised(settings.priority) as priority:
        for said in [priority] * bool(priority) + unread_of_device(settings):
            typer.echo(said, err=True)
        with progress(console, f"opening board and camera{'s' * (settings.planes == 2)}", quiet):
            testbed = open_testbed(settings, study.wrist, study.seed, view, lambda *_: None, pictures, view_2)
        try:
            with Board(testbed.transport) as board:
                moved = yes or _agreed(axis, Patience(board).pulse)
                with progress(console, "measuring", quiet, None, "strokes") as advance:
                    facts = measure(testbed, board, pictures, settings, study.wrist, axis if moved else None, advance)
        finally:
            testbed.close()
    faults = troubles(facts, settings, testbed.transport.name)
    if as_json:
        print_json(_plain(facts, faults))
    else:
        _print(facts, faults, settings)
    if any(trouble.grave for trouble in faults):
        raise typer.Exit(UNFIT)


def _agreed(axis: int, meanwhile: Any) -> bool:
    question = (
        f"To see how old pictures are, axis {axis} will take its tendon up until the wrist bends by 3 deg\n"
        "and bend it to 6 deg, 24 to 96 times. All other tendons slack, emergency stop within reach."
    )
    typer.echo(question, err=True)
    typer.echo("Type yes to let it move, anything else to measure without: ", nl=False, err=True)
    return typed_line(meanwhile) == "yes"


def _print(facts: RigFacts, faults: list[Trouble], settings: HwRunSettings) -> None:
    loop = f"the loop of {1e3 * settings.control_period:g} ms{' in two planes' * (settings.planes == 2)}"
    grave = any(trouble.grave for trouble in faults)
    print(f"This rig can{'not' if grave else ''} run {loop}{'.' if grave or not faults else ', and could be better.'}")
    for trouble in faults:
        print(f"- {trouble.what}\n  {trouble.fix}")
    print()
    runs = settings.optics, settings.optics_2
    first, *others = (_camera_rows(camera, run) for camera, run in zip(facts.cameras, runs, strict=False))
    if not others:
        print(Table("Measured", ("what", "value"), [*_rows(facts), *first]).text())
        return
    names = [camera.pace.name for camera in facts.cameras]
    by_camera = [(what, value, *(rows[k][1] for rows in others)) for k, (what, value) in enumerate(first)]
    print(Table("Measured", ("what", "value"), [*_rows(facts), _direction_row(facts)]).text(), end="\n\n")
    print(Table("Cameras", ("what", *names), by_camera).text())


def _rows(facts: RigFacts) -> list[tuple[str, str]]:
    import numpy as np

    trips = facts.trips
    median, most = (1e3 * float(np.quantile(facts.woken, share)) for share in (0.5, 0.99))
    return [
        ("round trip of STATUS", f"{1e3 * trips.median:.2f} ms, p99 {1e3 * trips.p99:.2f} ms"),
        ("USB adapter", str(facts.adapter)),
        ("computer wakes late by", f"{median:.2f} ms, p99 {most:.2f} ms"),
    ]


def _direction_row(facts: RigFacts) -> tuple[str, str]:
    direction = facts.direction
    if direction is None:
        return ("direction in which an axis bends the wrist", _UNKNOWN)
    bend, place = (f"{math.degrees(angle) % 360.0:.0f} deg" for angle in (direction.bend, direction.place))
    return (f"axis {direction.axis} bends the wrist toward", f"{bend}, its tendon toward {place}")


# What is printed where nothing was measured.
_UNKNOWN = "not measured"


def _camera_rows(camera: CameraFacts, optics: str | None) -> list[tuple[str, str]]:
    pace, quality, latency, pose = camera.pace, camera.quality, camera.latency, camera.pose
    rate = f"{pace.rate:.1f} per second, uneven by {1e3 * pace.jitter:.1f} ms" if pace.verdicts else "none"
    hidden = _UNKNOWN if latency is None else f"{1e3 * latency.delay:.1f} ms (+- {2e3 * latency.sd:.1f} ms)"
    marker = grey = noise = "not seen"
    off = "calibrated" if optics else "not seen"
    if quality is not None:
        marker = f"{quality.side:.0f} px, blurred by {quality.blur:.1f} px"
        grey = f"{quality.black:.0f} to {quality.white:.0f} of 255"
    if math.isfinite(camera.noise):
        noise = f"{math.degrees(camera.noise):.3f} deg"
    if pose is not None:
        tilt, pan = (f"{math.degrees(angle):+.1f}" for angle in (pose.tilt, pose.pan))
        off = f"{math.degrees(pose.oblique):.1f} deg (tilt {tilt}, pan {pan})"
    return [
        ("pictures", rate),
        ("their age, by their stamps", f"{1e3 * pace.latency:.1f} ms" if pace.verdicts else _UNKNOWN),
        ("their age beyond that, by strokes", hidden),
        ("their age in all", _UNKNOWN if latency is None else f"{1e3 * (pace.latency + latency.delay):.1f} ms"),
        ("tip's marker", marker),
        ("grey of its print and rim", grey),
        ("scatter of the resting angle", noise),
        ("camera off square, by its markers", off),
    ]


def _plain(facts: RigFacts, faults: list[Trouble]) -> dict[str, Any]:
    """For JSON; seconds, radians, pixels."""
    import numpy as np

    from wristctl.records.journal import jsonable

    direction = facts.direction
    median, most = (float(np.quantile(facts.woken, share)) for share in (0.5, 0.99))
    plain: dict[str, Any] = jsonable(
        {
            "schema": "wristctl.rig/2",
            "fit": not any(trouble.grave for trouble in faults),
            "troubles": [trouble._asdict() for trouble in faults],
            "round_trip": facts.trips._asdict(),
            "adapter": facts.adapter._asdict(),
            "woken_late": {"median": median, "p99": most},
            "cameras": [_plain_camera(camera) for camera in facts.cameras],
            "direction": direction and {name: getattr(direction, name) for name in ("axis", "bend", "place")},
        }
    )
    return plain


def _plain_camera(camera: CameraFacts) -> dict[str, Any]:
    pace = camera.pace
    return {
        "pictures": {"rate": pace.rate, "jitter": pace.jitter, "stamped_age": pace.latency},
        "latency": camera.latency and camera.latency._asdict(),
        "marker": camera.quality and camera.quality._asdict(),
        "noise": camera.noise,
        "pose": camera.pose and camera.pose.plain(),
    }
