"""`wristctl runs report` and `serve`: where pages go, and what the server does until Ctrl-C."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import urllib.request
from pathlib import Path

import pytest

from tests.cli.conftest import ROOT, Call
from tests.plotting.many_runs import many_runs, run_name


def test_a_page_of_all_runs_stands_beside_them_or_where_it_is_asked_for(call: Call, tmp_path: Path) -> None:
    many_runs(tmp_path / "results", 3)
    assert call("runs", "report", "--all")[:2] == (0, "results/index.html\n")
    page = (tmp_path / "results" / "index.html").read_text()
    assert all(run_name(number) in page for number in range(3))
    assert call("runs", "report", "--all", "--to", "own.html")[:2] == (0, "own.html\n")
    assert (tmp_path / "own.html").read_text() == page
    assert call("runs", "ls")[1].count("-abcdef") == 3, "no page is a run"


def test_a_folder_without_runs_has_a_page_that_says_so(call: Call, tmp_path: Path) -> None:
    (tmp_path / "results").mkdir()
    assert call("runs", "report", "--all")[0] == 0
    assert "No run is here yet" in (tmp_path / "results" / "index.html").read_text()


@pytest.mark.parametrize("arguments", [(), ("latest:tune", "--all")])
def test_it_is_told_which_runs_a_page_is_of(call: Call, arguments: tuple[str, ...]) -> None:
    code, out, error = call("runs", "report", *arguments)
    assert code == 2 and not out and "latest:compare" in error and "--all" in error


def test_a_port_that_is_taken_is_named(call: Call) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = str(taken.getsockname()[1])
        code, _, error = call("runs", "serve", "--port", port)
    assert code == 2 and f"--port {port}" in error and "--port 0" in error


@pytest.mark.slow
def test_the_server_answers_until_ctrl_c(tmp_path: Path) -> None:
    many_runs(tmp_path / "results", 2)
    command = [sys.executable, "-m", "wristctl", "runs", "serve", "--port", "0"]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    with subprocess.Popen(
        command, cwd=tmp_path, env=environment, text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE
    ) as server:
        try:
            assert server.stdout is not None and server.stderr is not None
            address = server.stdout.readline().split()[0]
            with urllib.request.urlopen(address, timeout=60) as answer:
                assert run_name(1) in answer.read().decode()
            server.send_signal(signal.SIGINT)
            assert server.wait(60) == 130
            assert server.stderr.read() == ""
        finally:
            server.kill()
