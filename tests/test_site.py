"""The documentation site: it builds without a warning, pages are near its front, search knows the field's words."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
import tomllib
from collections import deque
from pathlib import Path
from urllib.parse import unquote

import pytest
import snowballstemmer

from tests.plotting.browser import Browser
from wristctl.cli.commands import COMMANDS

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The site's HTML, built without the gallery's runs."""
    folder = tmp_path_factory.mktemp("site")
    script = [sys.executable, str(ROOT / "docs" / "build_site.py"), "--without-gallery", "--into", str(folder)]
    built = subprocess.run(script, text=True, capture_output=True, check=False, cwd=ROOT, env=os.environ)
    assert built.returncode == 0, built.stderr  # a warning is an error
    return folder / "html"


def links(page: Path) -> set[Path]:
    """Pages that a page links to."""
    targets = re.findall(r'href="([^"#:]+\.html)[#"]', page.read_text(encoding="utf-8"))
    return {(page.parent / unquote(target)).resolve() for target in targets}


@pytest.mark.slow
def test_every_page_is_within_three_clicks_of_the_front(site: Path) -> None:
    front = (site / "docs" / "index.html").resolve()
    clicks, waiting = {front: 0}, deque([front])
    while waiting:
        page = waiting.popleft()
        for target in links(page) - clicks.keys():
            assert target.is_file(), f"{page.relative_to(site)} links to {target}"
            clicks[target] = clicks[page] + 1
            waiting.append(target)
    pages = {page.resolve() for page in (site / "docs").rglob("*.html")}
    assert {page.name for page in pages if clicks.get(page, 99) > 3} == set()
    assert len(pages) > 60


def test_the_front_page_leads_to_the_gallery_and_platforms_and_shows_results(site: Path) -> None:
    front = site / "docs" / "index.html"
    article = re.search("<article.*</article>", front.read_text(encoding="utf-8"), re.DOTALL)
    assert article is not None
    for name in ("gallery", "platforms"):
        assert f'href="{name}.html"' in article[0]
    pictures = re.findall(r'<img [^>]*src="([^"]+)"', article[0])
    assert {Path(each).name for each in pictures} >= {"motion.gif", "answer.png", "report.png"}
    assert all((front.parent / each).is_file() for each in pictures)


def test_every_command_of_the_help_has_a_page_with_all_its_options(site: Path) -> None:
    for name, entry in COMMANDS.items():
        page = site / "docs" / "reference" / "command-line" / f"{name}.html"
        assert page.is_file() != entry.hidden, name
    text = (site / "docs" / "reference" / "command-line" / "simulate.html").read_text(encoding="utf-8")
    assert "--debug" in text, "advanced options stand there too"
    assert "wristctl runs replay" in (site / "docs" / "reference" / "command-line" / "runs.html").read_text()


@pytest.mark.parametrize(
    ("word", "page"),
    [("hysteresis", "docs/hysteresis"), ("identification", "docs/identify"), ("ATmega2560", "docs/overview"),
     ("replay", "docs/runs"), ("RODAS3", "docs/overview")],
)  # fmt: skip
def test_the_index_of_the_search_knows_words_of_the_field(site: Path, word: str, page: str) -> None:
    text = (site / "searchindex.js").read_text(encoding="utf-8")
    index = json.loads(text.removeprefix("Search.setIndex(").rstrip().rstrip(";").rstrip(")"))
    pages = set()
    for terms in (index["titleterms"], index["terms"]):
        stem = max(
            (key for key in terms if word.lower().startswith(key)), key=len, default=""
        )  # as a stemmer leaves it
        places = terms.get(stem, [])
        pages |= {index["docnames"][place] for place in ([places] if isinstance(places, int) else places)}
    assert page in pages


# Words that a reader of the field may type, and pages that answer them.
SEARCHED = {
    "hysteresis": "docs/hysteresis", "friction": "docs/friction", "convergence": "docs/convergence",
    "chattering": "docs/chattering", "identification": "docs/identify", "phase margin": "docs/analyse",
    "limit cycle": "docs/margins", "camera": "docs/hardware/camera", "wiring": "docs/hardware/wiring",
    "emergency stop": "docs/hardware/stopping", "homing": "docs/hardware/trials", "latency": "docs/hardware/real-time",
    "replay": "docs/runs", "payload": "docs/worlds", "bootstrap": "docs/worlds", "tuning": "docs/tuned",
    "MPC": "docs/your-own-controller", "reinforcement learning": "docs/gym", "Slurm": "docs/cluster",
    "MuJoCo": "docs/models", "neural network": "docs/networks", "CSV": "docs/measured-data",
    "minimum jerk": "docs/motions", "stiffness": "docs/identify", "exit codes": "docs/reference",
    "prosthesis": "docs/overview", "EMG": "docs/overview", "ROS": "docs/overview", "ROS bag": "docs/open-log",
    "DOF": "docs/two-planes", "three tendons": "docs/two-planes", "inverse kinematics": "docs/networks",
    "Simulink": "docs/models", "sample rate": "docs/hardware/real-time", "sampling rate": "docs/hardware/real-time",
    "backlash": "docs/hysteresis", "calibration": "docs/hardware/camera", "rosbag": "docs/open-log",
    "Dynamixel": "docs/servos", "3 tendons": "docs/two-planes", "degrees of freedom": "docs/two-planes",
    "Windows": "docs/platforms", "two planes": "docs/two-planes", "tutorial": "docs/tutorials",
}  # fmt: skip


def test_a_search_for_words_of_the_field_gives_the_right_page_first(site: Path) -> None:
    node = shutil.which("node")
    if node is None:
        pytest.skip("without Node.js nothing here runs the site's search")
    script = [node, str(ROOT / "tests" / "data" / "search.js"), str(site), json.dumps(list(SEARCHED))]
    answer = subprocess.run(script, text=True, capture_output=True, check=True)
    first = {word: pages[0] if pages else "" for word, pages in json.loads(answer.stdout).items()}
    assert {word: page for word, page in first.items() if page != SEARCHED[word]} == {}


# Pages that are looked at: the front, tutorials, what is looked up and what is widest.
SEEN = (
    "index", "five-minutes", "your-own-wrist", "two-planes", "commands", "choices", "models", "study", "recommend",
    "runs", "your-own-rig", "servos", "reference/command-line/simulate", "tutorials", "tutorials/wrist-to-controller",
    "tutorials/my-controller", "tutorials/log-to-controller", "data-flow",
)  # fmt: skip
CLIPPED = (Path(__file__).parent / "data" / "clipped.js").read_text(encoding="utf-8")


@pytest.mark.slow
@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
@pytest.mark.parametrize("width", [1280, 400])
@pytest.mark.parametrize("page", SEEN)
def test_nothing_of_a_page_is_out_of_sight(site: Path, browser: Browser, page: str, width: int, dark: bool) -> None:
    browser.open(site / "docs" / f"{page}.html", width, dark)
    assert browser.run(CLIPPED) == []
    assert browser.errors() == []


WIDE = {
    "<table><tr>" + "<td>column</td>" * 40 + "</tr></table>": "TABLE",
    "<div style='overflow-x: auto'><table><tr>" + "<td>column</td>" * 40 + "</tr></table></div>": "",
    f"<pre style='overflow: auto'>{'word ' * 60}</pre>": "PRE",
    f"<pre style='white-space: pre-wrap'>{'word ' * 60}</pre>": "",
    f"<div style='overflow: hidden; white-space: nowrap'>{'word ' * 60}</div>": "DIV",
    "<p>left<span style='position: absolute; left: -20px'>of it</span></p>": "SPAN",
    "<img src='none.png' alt=''>": "IMG",
    "<p>narrow</p>": "",
}


@pytest.mark.parametrize("content", WIDE)
def test_what_is_out_of_sight_is_seen(browser: Browser, tmp_path: Path, content: str) -> None:
    page = tmp_path / "page.html"
    article = f"<div style='overflow: auto'><article>{content}</article></div>"  # as the theme has it
    page.write_text(f"<!doctype html><meta name=viewport content='width=device-width'>{article}")
    for width in (1280, 400):
        browser.open(page, width, dark=False)
        found = {each.split()[0] for each in browser.run(CLIPPED)}
        assert WIDE[content] in found if WIDE[content] else not found, (width, found)


def test_a_word_of_the_index_names_one_page(site: Path) -> None:
    words = tomllib.loads((ROOT / "docs" / "index_words.toml").read_text(encoding="utf-8"))
    every = [word.casefold() for of_page in words.values() for word in of_page]
    assert len(every) == len(set(every)) > 150
    written = {page.relative_to(ROOT / "docs").with_suffix("").as_posix() for page in (ROOT / "docs").rglob("*.md")}
    assert words.keys() <= written


def stems(text: str) -> set[str]:
    """Words of a text as the search compares them."""
    return set(snowballstemmer.stemmer("english").stemWords(re.findall(r"[a-z0-9]+", text.casefold())))


def lacking(words: dict[str, list[str]], texts: dict[str, str]) -> list[str]:
    """Entries of the index that no paragraph, item or row of their page has whole."""
    said = {page: [stems(part) for part in re.split(r"\n\s*\n|\n(?=[-#|])", texts[page])] for page in words}
    wanted = [(page, entry) for page, entries in words.items() for entry in entries]
    return [f"{page}: {entry}" for page, entry in wanted if not any(stems(entry) <= part for part in said[page])]


def test_a_page_says_each_word_that_the_index_leads_to_it_from() -> None:
    words = tomllib.loads((ROOT / "docs" / "index_words.toml").read_text(encoding="utf-8"))
    texts = {page: (ROOT / "docs" / f"{page}.md").read_text(encoding="utf-8") for page in words}
    assert lacking(words, texts) == []


def test_a_word_within_another_or_in_two_places_is_not_said() -> None:
    page = {"a": "Forces across the wrist.\n\n| minimum | jerks |\n| maximum | jerk |\n\nA gain margin of 3."}
    assert lacking({"a": ["ROS", "minimum jerk", "gain margins", "maximum margin"]}, page) == [
        "a: ROS",
        "a: maximum margin",
    ]
