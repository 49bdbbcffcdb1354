"""run.json: what was run, on what, by which code, where, and what came out.

What others act on (ids, kinds, roles, hashes, names of files) has one form, and a manifest with another is none.
"""

import json
import re
import shlex
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from itertools import takewhile
from pathlib import Path, PurePosixPath
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict, Field

from wristctl.plain_files import read_json, unreadable

MANIFEST, SUMS, CONFIG, METRICS, REPORT = "run.json", "SHA256SUMS", "config.yaml", "metrics.json", "report.html"
SIGNATURE = "SHA256SUMS.sig"
README, EVENTS, CONSOLE = "README.md", "events.jsonl", "console.log"
SOURCES, PATCH, PACKAGES = "code.txt", "code.patch", "environment.txt"
# Files with the printed tables, for report.html. They may hold wall times, so the result hash leaves them out.
TABLES, OVERVIEW = "tables.json", "overview.json"

# Commands that make runs.
KINDS = (
    "gen-data", "train", "tune", "compare", "study", "recommend", "simulate", "analyse", "audit",
    "hw-run", "identify", "validate", "track", "calibrate-camera", "calibrate-wrist",
)  # fmt: skip
# Options that say where a run lies, and what it was cut short as.
_ONE_MACHINES = {"--out", "--resume"}

EndState = Literal["running", "ok", "failed", "interrupted"]


def _inside(name: str) -> str:
    """A name of a file in the run."""
    if PurePosixPath(name).is_absolute() or ".." in PurePosixPath(name).parts or "\0" in name:
        raise ValueError("leads out of the run")
    return name


# Name of a run directory. It begins with the UTC time of the start of the run.
RunId = Annotated[str, Field(pattern=r"^[0-9]{8}T[0-9]{6}Z-[A-Za-z0-9_.-]{1,200}$")]
_Kind = Annotated[str, Field(pattern=r"^[a-z]{1,20}(-[a-z]{1,20}){0,3}$")]
_Role = Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]{0,40}(\[[0-9]{1,4}\])?$")]
_Digest = Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]
_Inside = Annotated[str, AfterValidator(_inside)]


class ManifestPart(BaseModel):
    """A part of the manifest. What a later version adds is passed over: see docs/runs.md on compatibility."""

    model_config = ConfigDict(extra="ignore", validate_by_alias=True, validate_by_name=True)


class Column(ManifestPart):
    """A column of a table."""

    name: str
    unit: str = ""
    meaning: str = ""


class Output(ManifestPart):
    """A file that the run wrote; volatile ones (wall times, reports) stand outside the result hash."""

    path: _Inside
    sha256: _Digest
    bytes: int
    volatile: bool = False
    columns: list[Column] = []


class Input(ManifestPart):
    """An earlier run that this one read; `result_sha256` says what was in it, and is empty of one that was stopped."""

    role: _Role
    kind: _Kind
    run: RunId
    path: str
    result_sha256: _Digest | Literal[""]


class Code(ManifestPart):
    """The code that ran: version, state of its checkout (null outside one), hash of the package's files.

    `foreign` are the copies of laws from elsewhere and of what they import, by name in the run, with their hashes.
    """

    version: str
    commit: str | None = None
    branch: str | None = None
    dirty: bool | None = None
    patch_sha256: str | None = None
    tree_sha256: str
    foreign: dict[_Inside, _Digest] = {}


class Environment(ManifestPart):
    """The machine and the packages that computed.

    `features` are the processor's vector instructions, `settings` the environment's that choose among ways of computing
    which may differ in the last bit, `threads` its limits on threads.
    """

    python: str
    os: str
    machine: str
    cpu: str
    cores: int
    features: list[str] = []
    settings: dict[str, str] = {}
    threads: dict[str, str]
    packages: dict[str, str]
    packages_sha256: str


class TakenOver(ManifestPart):
    """Units of work of a run that was resumed: how many were taken over, and how many were computed again to check."""

    run: str
    taken_over: int = 0
    computed_again: int = 0


class Timing(ManifestPart):
    """UTC times; wall and processor time [s], largest resident memory [MB]."""

    started: str
    ended: str | None = None
    wall_s: float | None = None
    cpu_s: float | None = None
    max_rss_mb: float | None = None


class Error(ManifestPart):
    """Why a run failed."""

    type: str
    what: str
    where: str = ""
    fix: str = ""


# Schema of written manifests. Its number grows where an older wristctl could not understand a newer run.
SCHEMA = "wristctl.run/1"


class Manifest(ManifestPart):
    """Everything about one run but its results."""

    schema_: str = Field(default=SCHEMA, alias="schema", pattern=f"^{SCHEMA}$")
    id: RunId
    kind: _Kind
    label: str
    state: EndState = "running"
    exit_code: int | None = None
    error: Error | None = None
    about: str = ""
    """what it was about, in a word: controller/gains, laws; of older runs nothing"""
    argv: list[str]
    config_sha256: str
    seed: int
    streams: dict[str, tuple[int, int]] = {}
    code: Code
    environment: Environment
    inputs: list[Input] = []
    outputs: list[Output] = []
    units: TakenOver | None = None
    """None: no run was resumed that keeps units of work"""
    undrawn: dict[str, str] = {}
    """Figures and parts of the page that could not be drawn, with the reason."""
    numerics: dict[str, Any] = {}
    timing: Timing
    result_sha256: str | None = None
    fingerprint: str


@dataclass
class Overview:
    """The answer in words and its figure, the metrics that head the page, and the figures in reading order."""

    answer: list[str] = field(default_factory=list)
    """Lines; empty where a command has no answer but its tables."""
    figure: str = ""
    """The name of the figure that goes with it."""
    cards: list[str] = field(default_factory=list)
    """Names of metrics."""
    captions: dict[str, str] = field(default_factory=dict)
    """Caption of each figure by name, in reading order. It includes figures that were not drawn."""
    marks: list[str] = field(default_factory=list)
    """Why a run that was done is no good, in a word or two each; empty where it is sound."""

    @property
    def sentence(self) -> str:
        """First sentence of the answer; empty without an answer."""
        first = " ".join(takewhile(str.strip, self.answer))
        return re.split(r"(?<=[.!?])\s", first, maxsplit=1)[0]

    def text(self) -> str:
        """As the file holds it."""
        return json.dumps(asdict(self), indent=2, ensure_ascii=False) + "\n"


def read_overview(folder: Path) -> Overview:
    """Overview of a run directory. It is empty where the file is missing or holds none, for it holds no result.

    UserError where it cannot be read.
    """
    file, overview = folder / OVERVIEW, None
    try:
        overview = read_json(file, links=False)
    except OSError as error:
        if not isinstance(error, FileNotFoundError):
            raise unreadable(error, file) from error
    except ValueError:
        pass
    if not isinstance(overview, dict):
        return Overview()
    answer, cards, captions, marks = (overview.get(name) for name in ("answer", "cards", "captions", "marks"))
    return Overview(
        _texts(answer),
        overview["figure"] if isinstance(overview.get("figure"), str) else "",
        _texts(cards),
        {name: text for name, text in captions.items() if isinstance(text, str)} if isinstance(captions, dict) else {},
        _texts(marks),
    )


def _texts(value: Any) -> list[str]:
    return [text for text in value if isinstance(text, str)] if isinstance(value, list) else []


def asked_again(argv: Sequence[str]) -> str:
    """A run's command line as anybody asks for it again: without where the run lies, and what it was cut short as."""
    words = argv[1:]
    kept = [word for word, before in zip(words, ["", *words], strict=False) if not {word, before} & _ONE_MACHINES]
    return shlex.join(["wristctl", *kept])
