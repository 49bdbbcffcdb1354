"""Pages of the project: the README is one screen long, links lead somewhere, and one version is said everywhere."""

from __future__ import annotations

import ast
import importlib
import re
import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest
import yaml
from PIL import Image

from wristctl.config.choices import CONTROLLERS
from wristctl.version import __version__

ROOT = Path(__file__).parents[1]
PAGES = sorted([*ROOT.glob("*.md"), ROOT / "results" / "README.md", *(ROOT / "docs").rglob("*.md")])


def anchors(page: Path) -> set[str]:
    """Anchors of a page's headings, and those that it sets itself."""
    text = page.read_text(encoding="utf-8")
    heads = re.findall(r"^#+ (.*)", text, re.MULTILINE)
    slugs = {re.sub(r"[^\w\- ]", "", head.lower()).replace(" ", "-") for head in heads}
    return slugs | set(re.findall(r'<a (?:id|name)="([^"]+)"', text))


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_every_link_of_a_page_leads_somewhere(page: Path) -> None:
    text = re.sub(r"```.*?```", "", page.read_text(encoding="utf-8"), flags=re.DOTALL)
    for target in re.findall(r"\]\(([^)\s]+)\)", text):
        if "://" in target or target.startswith("mailto:"):
            continue
        name, _, anchor = target.partition("#")
        file = (page.parent / name).resolve() if name else page
        assert file.exists(), target
        assert not anchor or file.suffix != ".md" or anchor in anchors(file), target


def test_every_picture_says_what_it_shows_to_who_cannot_see_it() -> None:
    shown = [(page.name, text) for page in PAGES for text in re.findall(r"!\[([^\]]*)\]\(", page.read_text("utf-8"))]
    assert len(shown) > 10 and not [picture for picture in shown if len(picture[1]) < 25]


def test_the_readme_is_short_before_it_folds_and_names_every_controller() -> None:
    shown, _, folded = (ROOT / "README.md").read_text(encoding="utf-8").partition("<details>")
    assert len(shown.splitlines()) <= 100
    rows = [line.split("|")[1] for line in folded.splitlines() if line.startswith("| `")]
    assert {name for row in rows for name in re.findall(r"`([^`]+)`", row)} == set(CONTROLLERS)


def test_the_readme_says_how_to_set_up_run_and_test_in_one_block() -> None:
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    blocks = re.findall(r"^```bash\n(.*?)^```", text, re.DOTALL | re.MULTILINE)
    (block,) = [each.splitlines() for each in blocks if "git clone" in each]
    assert block == ["git clone <address of this page>", "cd wristctl", "make run", "make test"]


def test_the_readme_names_the_paper_before_it_speaks_of_it_and_cites_it_as_the_citation_file_does() -> None:
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    (paper,) = citation["references"]
    whole = " ".join(text.split())
    assert whole.index(paper["title"]) < whole.index("the paper")
    bibtex = "".join(re.findall(r"^```bibtex\n(.*?)^```", text, re.DOTALL | re.MULTILINE))
    families = " and ".join(author["family-names"] for author in paper["authors"])
    assert f"title = {{{paper['title']}}}" in bibtex and f"author = {{{families}}}" in bibtex
    assert f"version = {{{citation['version']}}}" in bibtex and citation["authors"][0]["name"] in bibtex


def test_what_the_examples_of_pages_import_is_there() -> None:
    """Names too, of this package and of its tests: most examples are run by no test."""
    found = set[tuple[str, str]]()
    for page in PAGES:
        for block in re.findall(r"^```python\n(.*?)^```", page.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE):
            for node in ast.walk(ast.parse(block)):
                if isinstance(node, ast.Import):
                    found |= {(alias.name, "") for alias in node.names}
                elif isinstance(node, ast.ImportFrom) and node.module:
                    found |= {(node.module, alias.name) for alias in node.names}
                elif (
                    isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id == "wristctl"
                ):
                    found.add(("wristctl", node.attr))
    own = sorted(each for each in found if each[0].partition(".")[0] in ("wristctl", "tests"))
    assert len(own) > 20
    missing = []
    for module, name in own:
        try:
            there = importlib.import_module(module)
            if name and not hasattr(there, name):
                importlib.import_module(f"{module}.{name}")
        except ImportError as error:
            missing.append(f"{module} {name}: {error}")
    assert not missing


NUMBERS = {"eighteen": 18, "nineteen": 19, "twenty": 20, "twenty-one": 21, "twenty-two": 22, "twenty-three": 23}


@pytest.mark.parametrize("page", ["README.md", "CHANGELOG.md", "paper/paper.md", "CITATION.cff", "docs/overview.md"])
def test_a_page_that_counts_controllers_counts_those_there_are(page: str) -> None:
    words = re.findall(r"([\w-]+)\s+controllers\b", (ROOT / page).read_text(encoding="utf-8"))
    counts = [int(word) if word.isdigit() else NUMBERS[word] for word in words if word.isdigit() or word in NUMBERS]
    assert set(counts) <= {len(CONTROLLERS)} and (counts or page not in ("CHANGELOG.md", "paper/paper.md"))


def _said(source: str) -> Iterator[str]:
    """Texts in a module that a user may be shown: no docstrings."""
    tree = ast.parse(source)
    docstrings = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in docstrings:
            yield node.value


def test_a_hint_names_a_page_by_its_title_which_an_installed_package_can_be_read_by_too() -> None:
    """A wheel has no docs folder."""
    heads = [page.read_text(encoding="utf-8").partition("\n")[0].removeprefix("# ") for page in PAGES]
    titles = {re.split("[:,]", head)[0] for head in heads}
    texts = [text for file in (ROOT / "wristctl").rglob("*.py") for text in _said(file.read_text(encoding="utf-8"))]
    texts += [file.read_text(encoding="utf-8") for file in (ROOT / "wristctl" / "cli" / "templates").iterdir()]
    assert not [text for text in texts if re.search(r"(?<!README)\.md\b", text)]
    named = [title for text in texts for title in re.findall(r"documentation: ([A-Z][\w ]*\w)", " ".join(text.split()))]
    assert len(named) > 20 and set(named) <= titles


def test_the_wrist_in_motion_is_a_small_animation() -> None:
    file = ROOT / "docs" / "images" / "motion.gif"
    assert file.stat().st_size < 600e3
    with Image.open(file) as animation:
        assert getattr(animation, "n_frames", 1) >= 20


def test_one_version_is_said_everywhere() -> None:
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    assert citation["version"] == __version__ and citation["license"] == "MIT"
    changes = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    assert ("\n## Unreleased\n" if "dev" in __version__ else f"\n## {__version__} - ") in changes
    assert f"version = {{{__version__}}}" in (ROOT / "README.md").read_text(encoding="utf-8")
    assert 'dynamic = ["version"]' in (ROOT / "pyproject.toml").read_text(encoding="utf-8")


def test_pages_install_the_pytorch_that_the_constraints_pin_from_the_index_that_make_asks() -> None:
    (pinned,) = re.findall(r"^torch==.+$", (ROOT / "constraints.txt").read_text(encoding="utf-8"), re.MULTILINE)
    (index,) = re.findall(r"^TORCH_INDEX \?= (.+)$", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE)
    call = r"pip install torch\b[^`#\n]*"
    said = {page: [line.strip() for line in re.findall(call, page.read_text(encoding="utf-8"))] for page in PAGES}
    assert said[ROOT / "docs" / "index.md"] and said[ROOT / "docs" / "five-minutes.md"]
    assert {line for lines in said.values() for line in lines} == {f"pip install {pinned} --index-url {index}"}


def test_the_draft_paper_has_what_a_journal_of_software_asks_and_cites_what_it_lists() -> None:
    text = (ROOT / "paper" / "paper.md").read_text(encoding="utf-8")
    heads = re.findall(r"^# (.*)", text, re.MULTILINE)
    assert heads == [
        "Summary", "Statement of need", "State of the field", "Software design", "Research impact statement",
        "AI usage disclosure", "Acknowledgements", "References",
    ]  # fmt: skip
    assert 750 <= len(text.partition("# Summary")[2].split()) <= 1750
    listed = re.findall(r"^@\w+\{(\w+),", (ROOT / "paper" / "paper.bib").read_text(encoding="utf-8"), re.MULTILINE)
    assert set(re.findall(r"@(\w+\d{4})", text)) == set(listed) and len(listed) == len(set(listed))


def test_every_check_of_the_repository_that_is_left_out_has_its_reason() -> None:
    ignored = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["repo-review"]["ignore"]
    rows = re.findall(
        r"^\| ((?:[A-Z]+\d+(?:, )?)+) \| \w+", (ROOT / "CONTRIBUTING.md").read_text("utf-8"), re.MULTILINE
    )
    assert sorted(check for row in rows for check in row.split(", ")) == sorted(ignored)


def test_every_reference_of_the_draft_paper_has_a_doi() -> None:
    entries = re.split(r"^@", (ROOT / "paper" / "paper.bib").read_text(encoding="utf-8"), flags=re.MULTILINE)[1:]
    assert entries and not [entry for entry in entries if not re.search(r"^  doi = \{10\.\d{4,}/\S+\},$", entry, re.M)]
