"""Tables of what has a name: controllers, references, disturbances, metrics, optimisers, plants, rigs, log formats.

Each is a mapping from the name in a study to what it names, which is imported when it is first asked for: here stand
names and places only. A newcomer in this package is one file and one line here; one from elsewhere is named by its
place, `path/to/file.py:NAME`, by the name of an entry point of an installed package, or puts itself into a table,
`CONTROLLERS["lqr"] = LQR`. The configuration's choices, errors, completion and the page of choices (docs/choices.md)
come from these tables.
"""

from collections.abc import Iterator, Mapping, MutableMapping, Sequence
from importlib import import_module
from typing import Any, Generic, TypeVar

from wristctl.config.foreign import Foreign, is_reference
from wristctl.errors import UserError, meant

T = TypeVar("T")

# The module that loads what is from elsewhere; imported, as every entry is, when a name first asks for it.
_LOADER = "wristctl.plugins.places"


class Choices(MutableMapping[str, T], Generic[T]):
    """Entries by name; those given as "module:attribute" are imported when asked for. Names are cheap to list.

    With a `group`, entry points of that group are entries too, and so is every file.py:NAME: each is loaded when it is
    asked for, and never listed.
    """

    def __init__(
        self, what: str, entries: Mapping[str, str], group: str = "", made: Mapping[str, tuple[str, str]] | None = None,
        calls: Sequence[str] = (),
    ) -> None:  # fmt: skip
        self.what, self.group, self.made = what, group, made or {}
        """Noun for an entry, the group of its entry points, and what a run makes first: what is missing, and how."""
        self.calls = calls
        """Calls that every entry has, by which a name of a file is proposed where another was meant."""
        self._entries: dict[str, Any] = dict(entries)
        self._origins: dict[str, Foreign] = {}

    def __getitem__(self, name: str) -> T:
        if name not in self._entries and self.group and name in self:
            return self.loaded(name)[0]
        entry = self._entries[name]
        if isinstance(entry, str):
            module, _, attribute = entry.partition(":")
            entry = self._entries[name] = getattr(import_module(module), attribute)
        loaded: T = entry
        return loaded

    def __setitem__(self, name: str, entry: T) -> None:
        self._entries[name] = entry

    def __delitem__(self, name: str) -> None:
        del self._entries[name]
        self._origins.pop(name, None)

    def __contains__(self, name: object) -> bool:
        if name in self._entries or not self.group or not isinstance(name, str):
            return name in self._entries
        return is_reference(name) or name in self._installed()

    def __iter__(self) -> Iterator[str]:
        return iter(self._entries)

    def __len__(self) -> int:
        return len(self._entries)

    def named(self, name: str) -> T:
        """The entry of this name; UserError with the nearest name if there is none."""
        if name in self.made and name not in self:
            problem, fix = self.made[name]
            raise UserError(problem, self.what, fix)
        if name not in self:
            fix = f"name it in the file: {name}:NAME" if name.endswith(".py") else meant(name, self.known())
            raise UserError(f"unknown {self.what} '{name}'", self.what, fix)
        return self[name]

    def known(self) -> list[str]:
        """Every name, those of entry points too."""
        return [*self, *(self._installed() if self.group else ())]

    def loaded(self, name: str) -> tuple[T, Foreign]:
        """The object of a file.py:NAME or of an entry point, and where it is from."""
        loader = import_module(_LOADER)
        found = loader.load(name, self.calls) if is_reference(name) else loader.entry_point(self.group, name)
        loaded: tuple[T, Foreign] = found
        return loaded

    def _installed(self) -> Sequence[str]:
        """Names of the entry points of installed packages."""
        names: Sequence[str] = import_module(_LOADER).entry_point_names(self.group)
        return names

    def lend(self, name: str, entry: T, origin: Foreign) -> None:
        """Know what is from elsewhere by its own name, until another is lent under it."""
        self._entries[name], self._origins[name] = entry, origin

    def origin(self, name: str) -> Foreign | None:
        """Origin of an entry. None for built-in entries."""
        return self._origins.get(name)

    def belongs(self, name: str) -> bool:
        """Whether a name is of the table itself, and not lent."""
        return name in self._entries and name not in self._origins


_DYNAMICS = (
    "`wristctl gen-data --source transitions`, then `wristctl train --preset recommended --data latest:gen-data`, "
    "whose run has the controller as RUN/code/learned_mpc.py:LEARNED_MPC"
)

# Table of `wristctl.rig.Rig`: what trials may be run on in place of the board with its cameras.
RIGS: Choices[Any] = Choices(
    "rig",
    {
        "bench": "wristctl.trial.board_rig:BenchRig",
        "servos": "wristctl.servos.servo_bench:ServoBench",
    },
    "wristctl.rigs",
    calls=("connect", "send", "look"),
)

# Table of `wristctl.records.recorded_table.LogFormat`: what other programs write, known by how it begins.
LOG_FORMATS: Choices[Any] = Choices(
    "log format",
    {
        "motive": "wristctl.records.motion_capture:MOTIVE",
        "vicon": "wristctl.records.motion_capture:VICON",
        "qualisys": "wristctl.records.motion_capture:QUALISYS",
    },
)

# Table of `wristctl.control.law.Controller`.
CONTROLLERS: Choices[Any] = Choices(
    "controller",
    {
        "smc": "wristctl.control.smc:SMC",
        "pid": "wristctl.control.pid:PID",
        "pid-angle": "wristctl.control.pid_angle:PID_ANGLE",
        "mrac": "wristctl.control.mrac:MRAC",
        "gvsc": "wristctl.control.gvsc:GVSC",
        "nc": "wristctl.control.nc:NC",
        "smc-tracking": "wristctl.control.smc_tracking:SMC_TRACKING",
        "super-twisting": "wristctl.control.super_twisting:SUPER_TWISTING",
        "computed-torque": "wristctl.control.computed_torque:COMPUTED_TORQUE",
        "ct-dob": "wristctl.control.ct_dob:CT_DOB",
        "adrc": "wristctl.control.adrc:ADRC",
        "lqi": "wristctl.control.lqi:LQI",
        "mpc": "wristctl.control.mpc:MPC",
        "clf-qp": "wristctl.control.clf_qp:CLF_QP",
        "nn-mrac": "wristctl.control.nn_mrac:NN_MRAC",
        "impedance": "wristctl.control.impedance:IMPEDANCE",
        "fopi": "wristctl.control.fopi:FOPI",
        "ilc": "wristctl.control.ilc:ILC",
        "feedforward": "wristctl.control.feedforward:FEEDFORWARD",
        "pd-ff": "wristctl.control.pd_ff:PD_FF",
        "pid-ff": "wristctl.control.pid_ff:PID_FF",
        "pid-dob": "wristctl.control.pid_dob:PID_DOB",
        "smc-dob": "wristctl.control.smc_dob:SMC_DOB",
    },
    "wristctl.controllers",
    {"learned-mpc": ("learned-mpc needs a network of the wrist's dynamics", _DYNAMICS)},
)

# Table of `wristctl.simulation.reference.ReferenceKind`.
REFERENCES: Choices[Any] = Choices(
    "reference",
    {
        "step": "wristctl.simulation.references:STEP",
        "minimum-jerk": "wristctl.simulation.references:MINIMUM_JERK",
        "sine": "wristctl.simulation.references:SINE",
        "multi-step": "wristctl.simulation.references:MULTI_STEP",
        "tip-path": "wristctl.simulation.references:TIP_PATH",
        "two-sided-sine": "wristctl.simulation.excitations:TWO_SIDED_SINE",
        "chirp": "wristctl.simulation.excitations:CHIRP",
        "square": "wristctl.simulation.excitations:SQUARE",
        "limited-square": "wristctl.simulation.excitations:LIMITED_SQUARE",
        "ramp": "wristctl.simulation.excitations:RAMP",
        "random-steps": "wristctl.simulation.excitations:RANDOM_STEPS",
        "recording": "wristctl.simulation.recording:RECORDING",
        "live": "wristctl.simulation.live_reference:LIVE_REFERENCE",
        "circle": "wristctl.simulation.spatial_references:CIRCLE",
        "figure-of-8": "wristctl.simulation.spatial_references:FIGURE_OF_8",
        "circumduction": "wristctl.simulation.spatial_references:CIRCUMDUCTION",
        "dart-thrower": "wristctl.simulation.spatial_references:DART_THROWER",
        "ellipse": "wristctl.simulation.spatial_references:ELLIPSE",
        "diagonal": "wristctl.simulation.spatial_references:DIAGONAL",
        "diagonal-ramp": "wristctl.simulation.spatial_references:DIAGONAL_RAMP",
        "diagonal-square": "wristctl.simulation.spatial_references:DIAGONAL_SQUARE",
        "adl:personal-care": "wristctl.simulation.daily_living:PERSONAL_CARE",
        "adl:eating": "wristctl.simulation.daily_living:EATING",
        "adl:stirring": "wristctl.simulation.daily_living:STIRRING",
        "adl:combing": "wristctl.simulation.daily_living:COMBING",
        "adl:jar": "wristctl.simulation.daily_living:JAR",
        "adl:phone": "wristctl.simulation.daily_living:PHONE",
        "adl:mean-flexion": "wristctl.simulation.daily_living:MEAN_FLEXION",
        "adl:mean-deviation": "wristctl.simulation.daily_living:MEAN_DEVIATION",
        "adl:mean": "wristctl.simulation.daily_living:MEAN",
        "adl:all": "wristctl.simulation.daily_living:ALL",
        "adl:most-flexion": "wristctl.simulation.daily_living:MOST_FLEXION",
        "adl:all-flexion": "wristctl.simulation.daily_living:ALL_FLEXION",
        "adl:all-deviation": "wristctl.simulation.daily_living:ALL_DEVIATION",
    },
    "wristctl.references",
)

# Table of `wristctl.simulation.disturbances.Disturbance`.
DISTURBANCES: Choices[Any] = Choices(
    "disturbance",
    {
        "push": "wristctl.simulation.disturbances:PUSH",
        "load": "wristctl.simulation.disturbances:LOAD",
        "drift": "wristctl.simulation.disturbances:DRIFT",
        "grasp": "wristctl.simulation.disturbances:GRASP",
    },
)

# Table of `wristctl.simulation.metrics.Metric`.
METRICS: Choices[Any] = Choices(
    "metric",
    {
        "rmse": "wristctl.simulation.metrics:RMSE",
        "rmse_move": "wristctl.simulation.metrics:RMSE_MOVE",
        "rmse_settled": "wristctl.simulation.metrics:RMSE_SETTLED",
        "settling": "wristctl.simulation.metrics:SETTLING",
        "settling_5": "wristctl.simulation.metrics:SETTLING_5",
        "settling_after": "wristctl.simulation.metrics:SETTLING_AFTER",
        "steady_state": "wristctl.simulation.metrics:STEADY_STATE",
        "missing": "wristctl.simulation.metrics:MISSING",
        "overshoot": "wristctl.simulation.metrics:OVERSHOOT",
        "iae": "wristctl.simulation.metrics:IAE",
        "peak_tension": "wristctl.simulation.metrics:PEAK_TENSION",
        "rms_tension": "wristctl.simulation.metrics:RMS_TENSION",
        "chattering": "wristctl.simulation.metrics:CHATTERING",
        "saturation": "wristctl.simulation.metrics:SATURATION",
        "slack": "wristctl.simulation.metrics:SLACK",
        "energy": "wristctl.simulation.metrics:ENERGY",
        "rmse_desired": "wristctl.simulation.metrics:RMSE_DESIRED",
        "tip_rmse_mm": "wristctl.simulation.metrics:TIP_RMSE",
        "tip_steady_mm": "wristctl.simulation.metrics:TIP_STEADY",
        "oscillation": "wristctl.simulation.metrics:OSCILLATION",
        "hunting": "wristctl.simulation.metrics:HUNTING",
        "substeps": "wristctl.simulation.metrics:SUBSTEPS",
        "drift": "wristctl.simulation.metrics:DRIFT",
        "observer_consistency": "wristctl.simulation.metrics:OBSERVER",
        "outside_domain": "wristctl.simulation.metrics:OUTSIDE_DOMAIN",
        "range_untracked": "wristctl.simulation.metrics:RANGE_UNTRACKED",
        "plateau": "wristctl.simulation.metrics:PLATEAU",
        "jump": "wristctl.simulation.metrics:JUMP",
        "motor_limited": "wristctl.simulation.metrics:MOTOR_LIMITED",
    },
)

# Table of subclasses of `wristctl.tuning.optimisers.base.Optimiser`.
OPTIMISERS: Choices[Any] = Choices(
    "optimiser",
    {
        "pso": "wristctl.tuning.optimisers.pso:ParticleSwarm",
        "differential-evolution": "wristctl.tuning.optimisers.differential_evolution:DifferentialEvolution",
        "cma-es": "wristctl.tuning.optimisers.cma_es:CMAES",
        "random": "wristctl.tuning.optimisers.random_search:RandomSearch",
    },
    "wristctl.optimisers",
)

# Table of `wristctl.identification.real_robots.RealRobot`.
ROBOTS: Choices[Any] = Choices(
    "real robot",
    {
        "uc3m-soft-neck": "wristctl.identification.real_robots:SOFT_NECK",
        "opencr-v4": "wristctl.identification.real_robots:OPENCR_V4",
        "opencr-v6": "wristctl.identification.real_robots:OPENCR_V6",
        "deepc-arm": "wristctl.identification.real_robots:DEEPC_ARM",
        "tee-probe": "wristctl.identification.real_robots:TEE_PROBE",
    },
)

# Table of `wristctl.wrist.plant.PlantModel`.
PLANTS: Choices[Any] = Choices(
    "plant",
    {
        "pcc": "wristctl.wrist.pcc:PCC",
        "hinges": "wristctl.wrist.hinges:HINGES",
    },
)

# Plants of the same names that bend in two planes.
PLANTS_IN_SPACE: Choices[Any] = Choices(
    "plant in two planes",
    {
        "pcc": "wristctl.wrist.spatial.pcc_in_space:PCC_IN_SPACE",
        "hinges": "wristctl.wrist.spatial.hinges_in_space:HINGES_IN_SPACE",
    },
)
