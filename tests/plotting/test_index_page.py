"""The page of all runs of a folder, in a browser and from the server that keeps it fresh."""

from __future__ import annotations

import base64
import http.client
import os
import re
import shutil
import socket
import threading
import time
from collections.abc import Iterator
from html import unescape
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from tests.plotting.many_runs import KINDS, many_runs, run_name
from wristctl.cli.runs.page_server import PageServer
from wristctl.plotting.index_page import PICTURES, index_page
from wristctl.records.find import entries
from wristctl.records.index import INDEX, indexed
from wristctl.records.tags import change_tags

KEPT = Path(__file__).parents[2] / "build" / "screenshots"
COUNT = 12
SHOWN = "return [...document.querySelectorAll('#runs > li')].filter(run => !run.hidden).map(run => run.id)"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Twelve runs; not to be written to."""
    results = tmp_path_factory.mktemp("index") / "results"
    many_runs(results, COUNT)
    return results


@pytest.fixture
def results(folder: Path, tmp_path: Path) -> Path:
    """The same, to be changed."""
    return Path(shutil.copytree(folder, tmp_path / "results"))


def written(results: Path) -> Path:
    page = results / "index.html"
    page.write_text(index_page(results, entries(results)))
    return page


def cards(text: str) -> list[str]:
    """Text of each run of a page."""
    return [" ".join(unescape(re.sub("<[^>]*>", " ", card)).split()) for card in text.split('<li id="')[1:]]


def test_each_run_stands_with_its_first_sentence_newest_first(folder: Path) -> None:
    shown = cards(index_page(folder, entries(folder)))
    assert [re.match(r"\S+?Z-[a-z-]+-n(\d+)", card)[1] for card in shown] == [str(k) for k in range(COUNT)][::-1]  # type: ignore[index]
    for number, card in zip(range(COUNT)[::-1], shown, strict=True):
        kind = KINDS[number % len(KINDS)]
        assert f"Run {number} of {kind} has an error of {number} deg [0.1, 0.2]. 2026" in card, "and no second sentence"
        made_from = re.search(r"made from (\S+)", card)
        assert (made_from and made_from[1]) == (run_name(number - 1) if number else None)
        used_by = re.search(r"used by (\S+)", card)
        assert (used_by and used_by[1]) == (run_name(number + 1) if number + 1 < COUNT else None)


def test_a_run_without_an_answer_says_what_went_wrong_and_a_damaged_one_costs_no_other(results: Path) -> None:
    (results / run_name(3) / "run.json").write_text("{}")
    (results / run_name(4) / "figures" / "answer.png").write_text("no picture")
    shown = cards(index_page(results, entries(results)))
    assert len(shown) == COUNT
    (broken,) = (card for card in shown if card.startswith(run_name(3)))
    assert "broken" in broken and "hash does not match what was sealed" in broken


def test_pictures_are_drawn_once_and_again_where_a_figure_is_another(results: Path) -> None:
    first = index_page(results, entries(results))
    assert first.count('src="data:image/webp') == COUNT
    kept = (results / PICTURES).read_text()
    assert index_page(results, entries(results)) == first and (results / PICTURES).read_text() == kept
    wide = np.full((500, 800, 3), 200, np.uint8)
    cv2.imwrite(str(results / run_name(0) / "figures" / "answer.png"), wide)
    again = index_page(results, entries(results))
    *others, oldest = re.findall(r'src="data:image/webp;base64,([^"]*)"', again)
    assert again != first and others == [others[0]] * (COUNT - 1)
    small = cv2.imdecode(np.frombuffer(base64.b64decode(oldest), np.uint8), cv2.IMREAD_COLOR)
    assert small is not None and small.shape == (250, 400, 3) and abs(int(small[100, 100, 0]) - 200) < 4
    assert len(indexed(results)) == COUNT, "what is remembered is no run"


def test_what_runs_say_is_text_and_no_markup(results: Path) -> None:
    text = (results / run_name(2) / "overview.json").read_text()
    (results / run_name(2) / "overview.json").write_text(text.replace("Run 2", "<script>alert(1)</script>"))
    (results / INDEX).unlink()
    page = index_page(results, entries(results))
    assert "&lt;script&gt;alert(1)" in page and "<script>alert" not in page


@pytest.mark.parametrize("width", [400, 1280])
@pytest.mark.parametrize("dark", [False, True])
def test_a_browser_shows_it_without_a_request_or_anything_beyond_its_edge(
    browser: Any, results: Path, width: int, dark: bool
) -> None:
    page = written(results)
    browser.open(page, width, dark)
    browser.screenshot(KEPT / f"index-{width}-{'dark' if dark else 'light'}.png")
    assert browser.console() == [] and set(browser.requests()) == {page.as_uri()}
    assert browser.run("return document.documentElement.scrollWidth") <= width
    cut = "[...document.querySelectorAll('#runs p')].filter(p => p.scrollWidth > p.clientWidth)"
    assert browser.run(f"return {cut}.map(p => p.outerHTML)") == []


def test_it_is_filtered_by_words_command_and_state_and_a_link_leads_to_a_hidden_run(
    browser: Any, results: Path
) -> None:
    change_tags(results, run_name(6), ["paper"])
    browser.open(written(results), 1280, False)
    assert browser.run(SHOWN) == [run_name(k) for k in range(COUNT)][::-1]

    def give(field: str, value: str) -> list[str]:
        typed = (
            f"const f = document.getElementById('{field}'); f.value = '{value}'; f.dispatchEvent(new Event('input'));"
        )
        shown: list[str] = browser.run(typed + SHOWN)
        return shown

    assert give("search", "PAPER error") == [run_name(6)]
    assert browser.run("return document.getElementById('count').textContent") == f"1 of {COUNT} runs, newest first"
    assert give("search", "no such word") == []
    assert browser.run("return document.getElementById('nothing').hidden") is False
    give("search", "")
    assert give("command", "tune") == [run_name(k) for k in (7, 2)], "the options have the name without its count"
    browser.run(f"location.hash = '{run_name(0)}'")
    deadline = time.monotonic() + 10.0
    while len(browser.run(SHOWN)) < COUNT and time.monotonic() < deadline:
        time.sleep(0.05)
    assert len(browser.run(SHOWN)) == COUNT
    top = f"return document.getElementById('{run_name(0)}').getBoundingClientRect().top"
    assert 0 <= browser.run(top) < 800


@pytest.fixture
def server(results: Path) -> Iterator[PageServer]:
    with PageServer(results, 0) as made:
        thread = threading.Thread(target=made.serve_forever, kwargs={"poll_interval": 0.01})
        thread.start()
        yield made
        made.shutdown()
        thread.join()


def ask(server: PageServer, path: str, method: str = "GET", **headers: str) -> tuple[int, dict[str, str], bytes]:
    """Status, headers and body of an answer; the path goes as it is."""
    connection = http.client.HTTPConnection("127.0.0.1", server.server_port, timeout=30)
    connection.putrequest(method, path, skip_host=True, skip_accept_encoding=True)
    for name, value in ({"Host": f"127.0.0.1:{server.server_port}"} | headers).items():
        connection.putheader(name.replace("_", "-"), value)
    connection.endheaders()
    answer = connection.getresponse()
    found = answer.status, {name.lower(): value for name, value in answer.getheaders()}, answer.read()
    connection.close()
    return found


def test_the_server_listens_on_the_loopback_interface_alone(server: PageServer) -> None:
    assert server.server_address[0] == "127.0.0.1" and server.socket.family is socket.AF_INET
    outside = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    with outside:
        try:
            outside.connect(("192.0.2.1", 9))  # sends nothing: it asks which address would be ours
            own = outside.getsockname()[0]
        except OSError:
            pytest.skip("this computer has no other address")
    with pytest.raises(OSError):
        socket.create_connection((own, server.server_port), timeout=2).close()


def test_the_page_comes_once_and_again_when_a_run_has_come(server: PageServer, results: Path) -> None:
    status, headers, body = ask(server, "/")
    assert status == 200 and body.decode().count("<li id=") == COUNT
    assert ask(server, "/", If_None_Match=headers["etag"])[::2] == (304, b"")
    assert ask(server, "/", "HEAD")[2] == b""
    shutil.rmtree(results / run_name(5))
    status, later, body = ask(server, "/", If_None_Match=headers["etag"])
    assert status == 200 and later["etag"] != headers["etag"] and body.decode().count("<li id=") == COUNT - 1


def test_files_of_runs_come_apart_from_all_else_and_only_to_be_read(server: PageServer, results: Path) -> None:
    report = f"/{run_name(1)}/report.html"
    status, headers, body = ask(server, report)
    assert status == 200 and body == (results / report[1:]).read_bytes()
    assert headers["content-type"] == "text/html; charset=utf-8" and headers["x-content-type-options"] == "nosniff"
    assert (
        "sandbox" in headers["content-security-policy"] and "default-src 'none'" in headers["content-security-policy"]
    )
    assert "allow-same-origin" not in headers["content-security-policy"]
    picture = ask(server, f"/{run_name(1)}/figures/answer.png")
    assert picture[1]["content-type"] == "image/png" and picture[2].startswith(b"\x89PNG")
    assert ask(server, f"/{run_name(1)}/run.json")[1]["content-type"].startswith("text/plain")
    for method in ("POST", "PUT", "DELETE", "PATCH", "OPTIONS"):
        assert ask(server, report, method)[0] == 501
    assert (results / report[1:]).exists()


@pytest.mark.parametrize(
    "host", ["example.org", "127.0.0.1", "127.0.0.1:1", "example.org:{port}", "127.0.0.1.example.org:{port}", ""]
)
def test_a_foreign_host_is_refused(server: PageServer, host: str) -> None:
    """A name of somebody else that leads to this computer is how a page elsewhere would read what is here."""
    for path in ("/", f"/{run_name(1)}/run.json"):
        status, _, body = ask(server, path, Host=host.format(port=server.server_port))
        assert status == 421 and b"sha256" not in body and b"<li" not in body
    assert ask(server, "/", Host=f"localhost:{server.server_port}")[0] == 200


@pytest.mark.parametrize(
    "path",
    [
        "/../secret.txt", "/%2e%2e/secret.txt", "/{run}/../../secret.txt", "/{run}/%2e%2e/%2e%2e/secret.txt",
        "/{run}/..%2f..%2fsecret.txt", "/{run}/..\\..\\secret.txt", "//secret.txt", "/{run}//etc/passwd",
        "/{run}/%2fetc%2fpasswd", "/{run}/link.txt", "/{run}/folder/secret.txt", "/linked/run.json", "/{run}/.hidden",
        "/.index.json", "/.pictures.json", "/tags.json", "/{run}", "/{run}/", "/{run}/figures", "/{run}/none",
        "/{run}/run.json%00.txt", "/{run}/pipe", "http://elsewhere/secret.txt", "/{run}/%ff",
    ],
)  # fmt: skip
def test_no_path_leads_out_of_the_runs(server: PageServer, results: Path, path: str) -> None:
    run = results / run_name(2)
    (results.parent / "secret.txt").write_text("secret")
    (run / "link.txt").symlink_to(results.parent / "secret.txt")
    (run / "folder").symlink_to(results.parent)
    (results / "linked").symlink_to(run)
    (run / ".hidden").write_text("secret")
    os.mkfifo(run / "pipe")
    indexed(results)
    assert ask(server, f"/{run.name}/run.json")[0] == 200
    status, _, body = ask(server, path.format(run=run.name))
    assert status == 404 and b"secret\n" not in body and body != b"secret"


def test_a_page_that_is_looked_at_takes_up_new_runs_and_keeps_the_search(
    browser: Any, server: PageServer, results: Path, tmp_path: Path
) -> None:
    away = tmp_path / "away"
    (results / run_name(7)).rename(away)
    browser.visit(server.url, 1280, False)
    give = "const f = document.getElementById('search'); f.value = 'tune'; f.dispatchEvent(new Event('input'));"
    assert browser.run(give + SHOWN) == [run_name(2)]
    away.rename(results / run_name(7))
    deadline = time.monotonic() + 30.0
    while browser.run(SHOWN) == [run_name(2)] and time.monotonic() < deadline:
        time.sleep(0.2)
    assert browser.run(SHOWN) == [run_name(7), run_name(2)] and browser.console() == []
    browser.run(f"document.querySelector('a[href^=\"{run_name(2)}\"]').click()")
    while "report of" not in (text := browser.run("return document.body.textContent")) and time.monotonic() < deadline:
        time.sleep(0.2)
    assert "report of 2" in text
