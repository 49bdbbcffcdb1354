"""Users read the field's words: none that the glossary avoids is in settings, errors or the pages of newcomers."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from wristctl.config.section import Section
from wristctl.config.study import Study

ROOT = Path(__file__).parents[1]
GLOSSARY = ROOT / "docs" / "glossary.md"

# Pages that are not held to the words: what was once said, the glossary itself, and some that still have former words.
APART = {
    "docs/corrected.md", "docs/glossary.md", "docs/recommend.md", "docs/hardware/camera.md",
    "docs/hardware/faults.md", "docs/hardware/stopping.md", "docs/hardware/trials.md",
}  # fmt: skip
PAGES = sorted(
    str(page.relative_to(ROOT))
    for page in (*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md"))
    if str(page.relative_to(ROOT)) not in APART
)

# Where an avoided word may stand, and why.
EXCEPTIONS = (
    r"`[^`]*`",  # names of keys and files, former ones too
    r"\]\([^)]*\)",  # targets of links
    r"control laws?\b",  # the field's own term for the equation of a controller
    r"(?:group's(?: own)?|paper's) law",  # the equation that a source prints or does not
    r"leaves (?:open|out|an?|at|behind|it|its|the|over|one|no|whole|are|what|where|alone|for)\b|command leaves",
)

# Calls whose text a user reads: what they are named, and what their first arguments say.
SAYING = {"UserError", "Unfitting", "ValueError", "PydanticCustomError", "Option", "Argument", "warning"}
DECLARING = {"choice", "quantity", "given_file", "of_file", "Field", "Parameter"}


def avoided() -> list[str]:
    """Words that the glossary avoids."""
    table = GLOSSARY.read_text(encoding="utf-8").partition("## Words that we avoid")[2]
    cells = [line.split("|")[1] for line in table.splitlines() if line.startswith("|")][2:]
    return [word.strip() for cell in cells for word in cell.split(",")]


def found(text: str) -> list[str]:
    """Avoided words in a text, but for the exceptions."""
    for exception in EXCEPTIONS:
        text = re.sub(exception, " ", text, flags=re.IGNORECASE)
    return [word for word in avoided() if re.search(rf"\b{word}\b", text, re.IGNORECASE)]


def prose(text: str) -> list[str]:
    """Lines of a page, empty where it is code."""
    lines, code = list[str](), False
    for line in text.splitlines():
        fence = line.lstrip().startswith("```")
        lines.append("" if code or fence or line.startswith("    ") else line)
        code ^= fence
    return lines


def said(file: Path) -> Iterator[tuple[str, str]]:
    """Texts of a module that users read, each with its line."""
    for call in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(call, ast.Call):
            name = getattr(call.func, "id", getattr(call.func, "attr", ""))
            if name in SAYING | DECLARING:
                for part in ast.walk(call):
                    if isinstance(part, ast.Constant) and isinstance(part.value, str) and " " in part.value.strip():
                        yield f"{file.relative_to(ROOT)}:{part.lineno}", part.value


def sections(kind: type[Section]) -> Iterator[type[Section]]:
    """A section and all below it."""
    yield kind
    for field in kind.model_fields.values():
        if isinstance(field.annotation, type) and issubclass(field.annotation, Section):
            yield from sections(field.annotation)


@pytest.mark.slow
def test_settings_and_errors_have_the_words_of_the_field() -> None:
    texts = [said_there for file in sorted((ROOT / "wristctl").rglob("*.py")) for said_there in said(file)]
    wrong = {place: (found(text), text) for place, text in texts if found(text)}
    assert len(texts) > 1000 and not wrong


def test_groups_of_settings_have_the_words_of_the_field() -> None:
    texts = {kind.__name__: kind.__doc__ or "" for kind in sections(Study)}
    assert len(texts) > 40 and not {name: text for name, text in texts.items() if found(text)}


@pytest.mark.parametrize("page", PAGES)
def test_pages_have_the_words_of_the_field(page: str) -> None:
    lines = prose((ROOT / page).read_text(encoding="utf-8"))
    assert not {number: (found(line), line) for number, line in enumerate(lines, 1) if found(line)}


def test_an_avoided_word_is_noticed_and_an_exception_is_none() -> None:
    assert found("the law of the leaves") == ["law", "leaves"] and found("it is Judged") == ["judged"]
    assert not found("a control law, [read](laws.md) of `laws`; flaw, lawn, cloverleaf")


def test_the_glossary_is_alphabetical_and_short() -> None:
    entries = re.findall(r"^- \*\*([\w-]+)", GLOSSARY.read_text(encoding="utf-8"), re.MULTILINE)
    assert len(entries) > 15 and entries == sorted(entries)
