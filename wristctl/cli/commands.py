"""The table of commands: where each of them is, its line in the help, and the options that are its own."""

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import NamedTuple

_MAIN, _OWN = "From a wrist to its controller", "Your own controller or robot; motors and camera"
_HARDWARE, _MORE = _OWN, "More"
# The flag of commands that move motors, and its help.
YES = {"yes": "Ask nobody before the motors of real hardware move."}
# The flag of comparisons that search gains first.
TUNE = "tune"


class Entry(NamedTuple):
    """A command: a procedure with its options, or a typer.Typer as it stands."""

    place: str
    """Module and name, `module:NAME`, imported when the command is called."""
    panel: str | None
    line: str
    """Line of the command in the help."""
    shortcuts: Sequence[str] = ()
    """Leaves of its section that are options too, named by the first part of a dotted key."""
    flags: Mapping[str, str] = MappingProxyType({})
    """Switches of a call that are no settings, and their help."""
    examples: Sequence[str] = ()
    argument: str | None = None
    """The leaf that stands first, without an option, in place of study files."""
    advanced: Sequence[str] = ()
    """Inputs and shortcuts that the help shows with `--all` only."""
    hidden: bool = False
    """Whether the help leaves it out: a former name."""
    listing: tuple[str, str] | None = None
    """Module and name of the table that `--list` prints, and its help."""


COMMANDS = {
    "init": Entry(
        "wristctl.cli.your_own:init_app", _MAIN, "Begin a folder for a wrist of your own, with studies to change."
    ),
    "simulate": Entry(
        "wristctl.commands.simulate.command:SIMULATE",
        _MAIN,
        "Simulate one controller on one wrist.",
        shortcuts=("controller", "gains", "reference.kind", "horizon"),
        examples=(
            "wristctl simulate --controller smc --gains exchanged",
            "wristctl simulate --reference dart-thrower --controller ct-dob",
            "wristctl simulate --reference step --set loop.plant_segments=1",
            "wristctl simulate --controller pid-ff --reference live --set reference.rate_deg=90",
            "wristctl simulate --gains tuned --tuned latest:tune",
        ),
    ),
    "gen-data": Entry(
        "wristctl.commands.gen_data.command:GEN_DATA",
        _MAIN,
        "Sample tip positions and bends for a network.",
        shortcuts=("samples", "source", "columns"),
        examples=(
            "wristctl gen-data experiments/paper.yaml",
            "wristctl gen-data --samples 5000 --label large",
            "wristctl gen-data --source plant --set segments=4",
            "wristctl gen-data --source run --run latest:hw-run",
            "wristctl gen-data --source transitions --set loop.plant.stiffness=x0.7",
            "wristctl gen-data --source csv --set 'files=[monday.csv,tuesday.csv]'",
        ),
    ),
    "train": Entry(
        "wristctl.commands.train.command:TRAIN",
        _MAIN,
        "Train the network from tip position to bend.",
        shortcuts=("search", "preset", "epochs", "seeds", "device"),
        examples=(
            "wristctl train experiments/paper.yaml --data latest:gen-data",
            "wristctl train --preset recommended --seeds 5",
            "wristctl train experiments/table1.yaml",
            "wristctl train --search experiments/model_selection.yaml",
        ),
    ),
    "tune": Entry(
        "wristctl.commands.tune.command:TUNE",
        _MAIN,
        "Search the gains of controllers.",
        shortcuts=("candidates", "iterations", "horizon"),
        examples=(
            "wristctl tune experiments/paper.yaml",
            "wristctl tune smc pid --iterations 20",
            "wristctl tune experiments/paper.yaml --from-identified latest:identify",
        ),
    ),
    "compare": Entry(
        "wristctl.commands.compare.command:COMPARE",
        _MAIN,
        "Compare controllers on the same motions.",
        shortcuts=("horizon",),
        flags={TUNE: "Search gains first, at equal budget, for the controllers that are typed by name."},
        examples=(
            "wristctl compare pid-ff adrc/hardware experiments/own_controllers/lqr.py:LQR quick",
            "wristctl compare pid-ff adrc --tune",
            "wristctl compare pid-ff adrc --from-identified latest:identify",
            "wristctl compare experiments/paper.yaml --network latest:train --tuned latest:tune",
        ),
    ),
    "recommend": Entry(
        "wristctl.commands.recommend.command:RECOMMEND",
        _MAIN,
        "Say which controller with which gains to run on a wrist.",
        shortcuts=("horizon", "rig"),
        examples=(
            "wristctl recommend --set wrist.length=0.12 --set wrist.stiffness=2.0",
            "wristctl recommend --rig my_rig.py:RIG",
            "wristctl recommend --from-identified latest:identify",
            "wristctl recommend ct-dob pid-ff --set loop.actuator.tendon_stiffness=2e4",
        ),
    ),
    "identify": Entry(
        "wristctl.commands.identify.command:IDENTIFY",
        _MAIN,
        "Find a real wrist's parameters from measured motions.",
        shortcuts=("model", "columns"),
        argument="runs",
        examples=(
            "wristctl identify latest:hw-run",
            "wristctl identify loop.csv --model hysteresis",
            "wristctl identify my.csv --columns 'time=t [ms], spool_1=m1 [mm], spool_2=m2 [mm], bend_y=imu [deg]'",
            "wristctl identify my.csv --columns 'time=t [ms], current_1=I1 [mA], current_2=I2 [mA], bend_y=imu [deg]'",
            "wristctl identify UPRIGHT_RUN LEVEL_RUN --set fix.friction=0.1",
        ),
    ),
    "hw-run": Entry(
        "wristctl.commands.hw_run.command:HW_RUN",
        _MAIN,
        "Run an experiment on the wrist, or on an emulated one.",
        shortcuts=(
            "controller",
            "gains",
            "reference.kind",
            "horizon",
            "port",
            "camera",
            "rig",
            "repetitions",
            "real_time",
            "video",
            "priority",
        ),
        flags=YES,
        advanced=("horizon", "repetitions", "video", "priority", "from_identified", "network", "tuned"),
        examples=(
            "wristctl hw-run ct-dob pid-ff --set 'directions=[ulnar]' --set push.force=0",
            "wristctl hw-run --reference circumduction --set reference.angle_deg=25",
            "wristctl hw-run --port /dev/ttyACM0 --camera 0 --calibration latest:calibrate-wrist",
            "wristctl hw-run pid-ff --rig my_rig.py:RIG --reference live --set reference.listen=127.0.0.1:5005",
        ),
    ),
    "runs": Entry("wristctl.cli.runs:app", _MAIN, "Find, show, compare, verify and repeat what commands left."),
    "new": Entry(
        "wristctl.cli.your_own:new_app", _OWN, "Write a controller, reference, optimiser or rig to begin from."
    ),
    "check-controller": Entry(
        "wristctl.cli.your_own:check_controller_app", _OWN, "Check a controller of your own before it is used."
    ),
    "check-rig": Entry("wristctl.cli.your_own:check_rig_app", _OWN, "Check a robot of your own before trials on it."),
    "hw": Entry(
        "wristctl.cli.hw:app", _HARDWARE, "The motor board: find, check, flash, emulate, stop, move; calibrate."
    ),
    "track": Entry(
        "wristctl.commands.track.command:TRACK",
        _HARDWARE,
        "Find the wrist's angle in a recorded video.",
        shortcuts=("zero", "annotate"),
        argument="video",
        examples=(
            "wristctl track trial.mp4",
            "wristctl track trial.mp4 --calibration latest:calibrate-camera --annotate",
            "wristctl track pictures/ --set frame_rate=60 --set markers.positive=left",
        ),
    ),
    "study": Entry(
        "wristctl.commands.study.command:FAIR_STUDY",
        _MORE,
        "Tune and compare all controllers at equal budget.",
        shortcuts=("budget",),
        examples=(
            "wristctl study experiments/fair_study.yaml",
            "wristctl study experiments/fair_study.yaml --budget full --executor processes",
            "wristctl study experiments/fair_study.yaml --budget full --resume RUN --executor dask://host:8786",
        ),
    ),
    "analyse": Entry(
        "wristctl.commands.analyse.command:ANALYSE",
        _MORE,
        "Find the stability margins of one loop, or a wrist's hysteresis.",
        shortcuts=("of", "controller", "gains", "over"),
        examples=(
            "wristctl analyse --controller computed-torque --gains default",
            "wristctl analyse --of hysteresis --set hysteresis.drive=tensions --set 'hysteresis.sheaths=[0, 1]'",
            "wristctl analyse --controller pid --set 'gains={Kp: 10.0, Ki: 20.0, Kd: 0.5}' --over Kp",
            "wristctl analyse --controller smc-tracking --gains hardware --set loop.control_period=5e-3 "
            "--set 'loop={actuator: {level: tendon}, sensor: {level: camera}}'",
        ),
    ),
    "validate": Entry(
        "wristctl.commands.validate.command:VALIDATE",
        _MORE,
        "Hold the model against recordings of real robots.",
        shortcuts=("data",),
        examples=(
            "wristctl validate --list",
            "wristctl validate uc3m-soft-neck --data Data-and-Results",
        ),
        argument="robot",
        listing=("wristctl.commands.validate.command:listed", "Say where the recordings of each robot are."),
    ),
    "list": Entry(
        "wristctl.cli.list_choices:app", _MORE, "List controllers, presets, references, conditions or metrics."
    ),
    "schema": Entry("wristctl.cli.your_own:schema_app", _MORE, "Print the JSON schema of study files, for editors."),
    "export-model": Entry(
        "wristctl.cli.exports:model_app", _MORE, "Write the wrist of a run for MuJoCo, MATLAB or as URDF."
    ),
    "export-law": Entry(
        "wristctl.cli.exports:law_app", _MORE, "Write a tuned controller in C and NumPy for your own firmware."
    ),
    "paper": Entry("wristctl.cli.app:paper", _MORE, "Check the paper's claims one by one."),
}

# Commands of `wristctl paper`.
PAPER = {
    "audit": Entry(
        "wristctl.commands.audit.command:AUDIT",
        None,
        "Judge the paper's claims one by one.",
        shortcuts=("horizon",),
        examples=(
            "wristctl paper audit experiments/claims.yaml",
            "wristctl paper audit experiments/claims.yaml --table1 RUN --selection RUN",
        ),
    ),
}

# Former names.
COMMANDS |= {
    "audit": PAPER["audit"]._replace(hidden=True),
    "hysteresis": Entry(
        "wristctl.cli.former_hysteresis:hysteresis_app", None, "Now a mode of analyse and identify.", hidden=True
    ),
    "check-law": COMMANDS["check-controller"]._replace(hidden=True),
}

# Commands of `wristctl hw calibrate`.
CALIBRATIONS = {
    "board-pdf": Entry(
        "wristctl.cli.hw_sheets:board_pdf_app",
        None,
        "Write the board and the markers as a PDF, to print at true scale.",
    ),
    "camera": Entry(
        "wristctl.commands.calibrate.camera:CALIBRATE_CAMERA",
        None,
        "Find lens and bending plane from views of the board.",
        shortcuts=("camera", "views"),
        examples=(
            "wristctl hw calibrate camera",
            "wristctl hw calibrate camera --camera 0",
            "wristctl hw calibrate camera --camera pictures/ --set board.square=0.0248",
            "wristctl track trial.mp4 --calibration latest:calibrate-camera",
        ),
    ),
    "wrist": Entry(
        "wristctl.commands.calibrate.wrist:CALIBRATE_WRIST",
        None,
        "Find zero, senses of turning and steps per radian.",
        shortcuts=("port", "camera", "plane", "axis", "max_deg", "real_time", "priority"),
        flags=YES,
        advanced=("plane", "max_deg", "priority"),
        examples=(
            "wristctl hw calibrate wrist",
            "wristctl hw calibrate wrist --port /dev/ttyACM0 --camera 0 --optics latest:calibrate-camera",
            "wristctl hw calibrate wrist --port /dev/ttyACM0 --camera 0 --axis 0 --max-deg 2",
            "wristctl hw-run --port /dev/ttyACM0 --calibration latest:calibrate-wrist",
        ),
    ),
}
