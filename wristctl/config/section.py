"""The base of every configuration section and the way a leaf states its unit and source."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple, Self

from pydantic import BaseModel, ConfigDict, Field, GetCoreSchemaHandler, GetJsonSchemaHandler, model_validator
from pydantic.config import JsonDict
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from wristctl.config.choices import Choices
from wristctl.config.foreign import is_reference, split


class Section(BaseModel):
    """A frozen group of settings: unknown keys, NaN, infinities and silent conversions are errors."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False, strict=True, populate_by_name=True)


def quantity(
    default: Any, unit: str, meaning: str, source: str = "", marks: tuple[str, ...] = (), **constraints: Any
) -> Any:
    """A leaf with its unit, meaning and source ("paper", "assumed", ...), which docs and config.yaml print.

    Its marks are `unsaid`, where config.yaml leaves it out at its default, and `file`, where it names files.
    """
    extra: JsonDict = {"unit": unit, "source": source, **dict.fromkeys(marks, True)}
    return Field(default, description=meaning, json_schema_extra=extra, **constraints)


def choice(default: Any, meaning: str, source: str = "", **constraints: Any) -> Any:
    """A leaf without a unit (a name, a switch, a count)."""
    return quantity(default, "", meaning, source, **constraints)


def seldom(default: Any, unit: str, meaning: str, **constraints: Any) -> Any:
    """A leaf that config.yaml leaves out where it has its default."""
    return quantity(default, unit, meaning, marks=("unsaid",), **constraints)


def kept_settings() -> Any:
    """The leaf beside `from_identified` of a section, to which `commands.identified_wrist` adds."""
    return seldom((), "", "settings given beside from_identified, which stay though its run tells them: wrist.damping")


@dataclass(frozen=True, eq=False)  # a table has no hash, and a union of types asks for one
class OneOf:
    """The type of a leaf that names an entry of a table: `Annotated[str, OneOf(CONTROLLERS)]`."""

    table: Choices[Any]

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        """The string's schema, and then that the table has it; the error is that of a Literal."""
        return core_schema.no_info_after_validator_function(self.checked, handler(source))

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        """The names of the table; a name in a file where it takes some from elsewhere."""
        names: JsonSchemaValue = {"enum": self.table.known()}
        return {"anyOf": [names, {"type": "string", "pattern": r"\.py:[A-Za-z_]\w*$"}]} if self.table.group else names

    def checked(self, name: str) -> str:
        """The name, where the table has it; PydanticCustomError where not."""
        if self.table.group and is_reference(name):
            file, _ = split(name)
            if not file.is_file():
                raise PydanticCustomError(
                    "added_value", "no file {file}", {"file": str(file), "fix": "check the path of FILE.py:NAME"}
                )
        elif self.table.group and name.endswith(".py"):
            context = {"file": name, "what": self.table.what}
            raise PydanticCustomError("added_value", "{file} should name its {what}: {file}:NAME", context)
        elif self.table.group and name not in self.table and (alone := name.partition("/")[0]) in self.table:
            context = {"name": name, "fix": f"the name alone: {alone}"}
            raise PydanticCustomError("added_value", "{name} has gains, and no gains stand here", context)
        elif name in self.table.made and name not in self.table:
            problem, fix = self.table.made[name]
            raise PydanticCustomError("added_value", "{problem}", {"problem": problem, "fix": fix})
        elif name not in self.table:
            *first_names, last = (f"'{name}'" for name in self.table.known())
            expected = f"{', '.join(first_names)} or {last}" if first_names else last
            raise PydanticCustomError("literal_error", "Input should be {expected}", {"expected": expected})
        return name


class Parameter(NamedTuple):
    """A number that an entry of a table adds to a section: its default, unit and meaning.

    `mirrors` is true of what changes its sign where the motion is mirrored.
    """

    default: float
    unit: str
    meaning: str
    mirrors: bool = False


class OpenSection(Section):
    """Settings to which entries of a table add: what is not declared here, such an entry must declare."""

    model_config = ConfigDict(extra="allow")

    def __hash__(self) -> int:
        """Hash that includes added parameters. Pydantic leaves them out, and points of a sweep would collide."""
        return hash((*self.__dict__.values(), frozenset((self.model_extra or {}).items())))

    def added(self) -> Mapping[str, Parameter]:
        """Parameters that entries of the table add to this section, by name."""
        raise NotImplementedError

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        """The declared leaves, and the parameters that may be added, of whichever entries."""
        shown = handler(schema)
        place = handler.resolve_ref_schema(shown)
        place["additionalProperties"] = False
        for name, parameter in cls.addable().items():
            described = {"type": "number", "default": parameter.default, "description": parameter.meaning}
            place["properties"].setdefault(name, described | {"unit": parameter.unit})
        return shown

    @classmethod
    def addable(cls) -> Mapping[str, Parameter]:
        """Parameters that entries of the table may add to some section of this kind, by name."""
        return cls().added()

    def value(self, name: str) -> float:
        """Value of an added parameter, or its default."""
        number: float = (self.model_extra or {}).get(name, self.added()[name].default)
        return number

    @model_validator(mode="after")
    def _nothing_unknown(self) -> Self:
        extra = self.model_extra or {}
        added = self.added() if extra else {}
        for key, entry in extra.items():
            if key not in added:
                fields = {field.alias or name for name, field in type(self).model_fields.items()}
                allowed = sorted({*fields, *added})
                raise PydanticCustomError("extra_forbidden", "unknown key", {"key": key, "known": allowed})
            if isinstance(entry, bool) or not isinstance(entry, int | float):
                context = {"key": key, "given": repr(entry)}
                raise PydanticCustomError("added_value", "{given} should be a number", context)
        return self
