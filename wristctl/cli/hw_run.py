"""`wristctl hw-run`: the paper's experiment on the whole chain, from marker to motor."""

from __future__ import annotations

from wristctl.cli.command import EarlierRun, Session, Table, study_command
from wristctl.cli.rig_description import rig_described
from wristctl.config.errors import under
from wristctl.config.study import Study
from wristctl.records import Run


def plan(study: Study, inputs: dict[str, Run]) -> str:
    """Check controllers and gains and say what would be done; opens nothing."""
    from wristctl.cli.loops import check_row, tuned_of

    settings, tuned = study.hw_run, tuned_of(inputs)
    for number, row in enumerate(settings.rows):
        with under(f"hw-run.rows.{number}"):
            check_row(row, tuned)
    pushes = settings.without_push + (settings.push.force != 0.0)
    count = len(settings.rows) * len(set(settings.directions)) * settings.repetitions * pushes
    each = settings.horizon + settings.back + settings.rest
    return f"{rig_described(settings)}\n{count} trials, about {count * each:.0f} s of motion after homing"


def hw_run(session: Session) -> list[Table]:
    """Perform the paper's experiment: four directions, with and without a push, on hardware or all emulated."""
    session.console.print(rig_described(session.settings), markup=False, highlight=False, soft_wrap=True)
    from wristctl.cli.hw_tables import reported
    from wristctl.cli.hw_trials import performed
    from wristctl.cli.loops import identified

    known = identified(session, "hw-run")
    return reported(known, performed(known, session.study.wrist))


app = study_command(
    "hw-run",
    work=hw_run,
    plan=plan,
    inputs=(
        EarlierRun("calibration", kind="calibrate-wrist", optional=True),
        EarlierRun("optics", kind="calibrate-camera", optional=True),
        EarlierRun("from_identified", kind="identify", optional=True),
        EarlierRun("tuned", kind="tune", optional=True),
        EarlierRun("network", kind="train", optional=True),
    ),
    shortcuts=("port", "camera", "repetitions", "real_time", "video"),
    flags={"yes": "Ask nobody before the motors of real hardware move."},
    examples=(
        "wristctl hw-run",
        "wristctl hw-run --set 'directions=\\[ulnar]' --set push.force=0",
        "wristctl hw-run --dry-run --port /dev/ttyACM0",
        "wristctl hw-run --port /dev/ttyACM0 --camera 0 --calibration latest:calibrate-wrist",
    ),
)
