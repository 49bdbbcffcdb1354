"""What an error tells people to give or to call: each part knows its words on the command line and in Python."""

from __future__ import annotations

from dataclasses import dataclass

_FUNCTIONS = {
    "gen-data": "gen_data", "train": "train", "tune": "tune", "compare": "compare", "simulate": "simulate",
    "analyse": "analyse", "hysteresis": "hysteresis", "identify": "identify", "audit": "audit", "runs ls": "runs",
}  # fmt: skip
"""The function of each command that Python has; the others are called at the shell from there too."""


@dataclass(frozen=True)
class Argument:
    """What a command is given by name: `--network RUN` or `--newer 2d`, in Python `network=...` or `newer='2d'`."""

    name: str
    value: str | None = None
    """None: any"""
    metavar: str = "RUN"
    """what the command line writes where any value may stand; empty: nothing"""
    positional: bool = False
    """whether the command line takes it without its name"""
    quoted: bool = False
    """whether a shell needs quotes about the value"""

    @property
    def typed(self) -> str:
        """On the command line."""
        option = "" if self.positional else f"--{self.name.replace('_', '-')}"
        value = self.metavar if self.value is None else f"'{self.value}'" if self.quoted else self.value
        return " ".join(part for part in (option, value) if part)

    @property
    def in_python(self) -> str:
        """As an argument of the function."""
        return f"{self.name}=..." if self.value is None else f"{self.name}={self.value!r}"


@dataclass(frozen=True)
class Setting:
    """A leaf set beside the study's files: `--set fix.friction=0.1`, or an override of `load_study`."""

    text: str
    """key=value, as it was typed or would be"""
    section: str = ""
    """the command whose section the key is looked for in; load_study wants it in front"""
    option: bool = False
    """whether the command has an option of this name: `--source run`"""

    @property
    def typed(self) -> str:
        """On the command line."""
        return f"--{self.text.replace('=', ' ', 1)}" if self.option else f"--set {self.text}"

    @property
    def in_python(self) -> str:
        """As an override of load_study."""
        return f"load_study(..., {'.'.join(part for part in (self.section, self.text) if part)!r})"


@dataclass(frozen=True)
class Call:
    """A command with what it is given: `wristctl gen-data --run latest:simulate`, or the function of that name."""

    command: str
    """its words: train, runs ls, hw calibrate camera"""
    file: str = ""
    """a study file"""
    arguments: tuple[Argument, ...] = ()

    @property
    def typed(self) -> str:
        """On the command line."""
        words = ("wristctl", self.command, self.file, *(each.typed for each in self.arguments))
        return " ".join(word for word in words if word)

    @property
    def in_python(self) -> str:
        """As a call; a command without a function as it is typed."""
        name = _FUNCTIONS.get(self.command)
        if name is None:
            return self.typed
        study = f"load_study({self.file!r})" if self.file else "study"
        given = [study] if name != "runs" else []
        return f"wristctl.{name}({', '.join([*given, *(each.in_python for each in self.arguments)])})"


OUT = Argument("out", metavar="")
"""The folder of run directories, whichever it may be."""
FILE, TO = Argument("file", metavar=""), Argument("to", metavar="")
"""Where a command writes to that makes no run."""

Phrase = str | Argument | Setting | Call | tuple["Phrase", ...]
"""Text with such parts in it: `("give ", Argument("table1"))`."""


def worded(phrase: Phrase, in_python: bool = False) -> str:
    """A phrase as text, in the words of the command line or in Python's."""
    if isinstance(phrase, tuple):
        return "".join(worded(part, in_python) for part in phrase)
    if isinstance(phrase, str):
        return phrase
    return phrase.in_python if in_python else phrase.typed
