"""What `wristctl runs show`, `lineage`, `verify`, `tag`, `rm` and `report` print of runs, and leave of them."""

from __future__ import annotations

import errno
import io
import json
import re
import shutil
import sys
from pathlib import Path

import pytest

from tests.cli.conftest import Call
from wristctl.config.study import Study
from wristctl.errors import UserError
from wristctl.records import InputRun, Run, seal, start_run
from wristctl.records.files import sha256_of
from wristctl.records.manifest import OVERVIEW, Code, Overview
from wristctl.records.tags import change_tags

COMMIT, TREE = "0123456789abcdef0123", 64 * "a"


@pytest.fixture
def data(call: Call) -> Run:
    """A run in results/, of a checkout with changes."""
    with start_run("gen-data", Study(seed=5), "a", argv=["wristctl", "gen-data", "a b"]) as live:
        live.file("data/x.txt").write_text("four")
        live.metric("rmse", 0.25, "rad", "lower", 7)
        live._manifest.code = Code(version="9.8", commit=COMMIT, dirty=True, tree_sha256=TREE)
    return Run(live.path)


@pytest.fixture
def network(data: Run) -> Run:
    """A run made from it."""
    with start_run("train", Study(), "b", inputs=[InputRun("data", data)]) as live:
        live._manifest.code = Code(version="9.8", tree_sha256=TREE)
    return Run(live.path)


def test_a_long_command_is_whole_and_no_line_under_the_run_is_longer_than_the_terminal(call: Call) -> None:
    words = ["wristctl", "tune", *(f"--set wrist.x{k}=1" for k in range(30))]
    with start_run("tune", Study(), "a", argv=words) as live:
        live.metric("a_metric_whose_name_is_rather_long_and_stands_alone", 1.0)
    lines = call("runs", "show", live.path.name)[1].splitlines()
    (shown,) = [line for line in lines if line.startswith("command")]
    assert "wrist.x29=1" in shown
    rules = [line for line in lines if line and not line.strip("- ")]
    assert max(map(len, rules)) == 80 and len(rules) == 3


def test_verify_has_the_states_of_runs_below_each_other(call: Call, tmp_path: Path) -> None:
    for kind, label in (("tune", ""), ("gen-data", "with-a-long-label"), ("train", "b")):
        with start_run(kind, Study(), label) as live:
            live.file("x.txt").write_text("whole")
    (live.path / "x.txt").write_text("changed")
    code, out, _ = call("runs", "verify")
    runs = [line for line in out.splitlines() if not line.startswith("  ")]
    assert code == 3 and len({len(line.split("  ")[0]) for line in runs}) > 1
    assert len({line.index("as sealed" if "as sealed" in line else "changed") for line in runs}) == 1


def test_show_tells_each_fact_metric_and_file(call: Call, data: Run, network: Run) -> None:
    code, out, _ = call("runs", "show", data.id)
    lines = [re.split(r"\s{2,}", line.strip()) for line in out.splitlines()]
    assert code == 0 and out.splitlines()[-1] == str(data.path)
    for line in (
        ["run", data.id],
        ["state", "ok"],
        ["command", "wristctl gen-data 'a b'"],
        ["seed", "5"],
        ["started", data.manifest.timing.started],
        ["code", "9.8 0123456789ab with uncommitted changes"],
        ["result hash", data.result_hash],
        ["metric", "value", "unit", "better", "n"],
        ["rmse", "14.32", "deg", "lower", "7"],
        ["path", "bytes", "sha256"],
    ):
        assert line in lines
    (file,) = [each for each in data.manifest.outputs if each.path == "data/x.txt"]
    assert ["data/x.txt", "4", file.sha256[:12]] in lines
    assert "tags" not in out and "error" not in out and out.index("Metrics") < out.index("Files")
    change_tags(Path("results"), network.id, ["b", "a"])
    out = call("runs", "show", network.id)[1]
    assert re.search(r"^code +9\.8$", out, re.MULTILINE) and re.search(r"^tags +a, b$", out, re.MULTILINE)
    assert re.search(rf"^input data +gen-data run {data.id}$", out, re.MULTILINE) and "Metrics" not in out


def test_show_tells_why_a_run_failed(call: Call) -> None:
    with pytest.raises(UserError), start_run("tune", Study()) as live:
        raise UserError("the wrist buckles")
    out = call("runs", "show", live.id)[1]
    assert re.search(r"^error +the wrist buckles$", out, re.MULTILINE) and re.search(r"^state +failed$", out, re.M)


def test_lineage_is_a_tree_and_its_users_as_lines_or_as_an_object(call: Call, data: Run, network: Run) -> None:
    tree = [f"{network.id} (ok)", f"└─ data: {data.id} (ok)"]
    assert call("runs", "lineage", network.id)[1].splitlines() == tree
    assert call("runs", "lineage", data.id)[1].splitlines() == [f"{data.id} (ok)", f"used by {network.id}"]
    told = json.loads(call("runs", "lineage", network.id, "--json")[1])
    first, second = told["lineage"]
    assert first["id"] == network.id and first["inputs"] == [{"role": "data", "id": data.id}]
    assert (second["id"], second["inputs"], told["dependents"]) == (data.id, [], [])


def test_verify_tells_of_each_run_whether_it_is_as_sealed(call: Call, data: Run, network: Run) -> None:
    with start_run("tune", Study(), "c") as live:
        ids = (data.id, network.id, live.id)
        wide = max(map(len, ids))
        out = "".join(f"{each:{wide}}  {'is running' if each == live.id else 'as sealed'}\n" for each in ids)
        code, said, _ = call("runs", "verify")
        assert code == 0 and sorted(said.splitlines()) == sorted(out.splitlines()), "one that goes on is not wrong"
        told = json.loads(call("runs", "verify", "--json")[1])["runs"]
        assert told[data.id] == [] and told[live.id], "nor is it as sealed"
        assert call("runs", "verify", live.id, "--signed")[0] == 3
    (data.path / "data" / "x.txt").write_text("five")
    (network.path / "SHA256SUMS").unlink()
    code, out, err = call("runs", "verify", data.id, network.id)
    assert code == 3 and "2 of 2 runs are not as they were sealed" in err
    wide = max(len(data.id), len(network.id))
    assert out.splitlines() == [
        f"{data.id:{wide}}  changed",
        "  data/x.txt: hash does not match what was sealed",
        f"{network.id:{wide}}  changed",
        "  SHA256SUMS: missing: the run is crashed",
    ]
    code, out, err = call("runs", "verify", "--json")
    told = json.loads(out)["runs"]
    assert code == 3 and "2 of 3" in err and told[live.id] == []
    assert told[data.id] == [{"file": "data/x.txt", "problem": "hash does not match what was sealed"}]


def test_a_run_that_was_broken_off_has_nothing_to_restore(call: Call, data: Run, network: Run) -> None:
    """Nothing of it was ever sealed, and a run that was changed beside it is told of as before."""
    manifest = network.path / "run.json"
    manifest.write_text(manifest.read_text().replace('"state": "ok"', '"state": "running"'))
    (network.path / "SHA256SUMS").unlink()
    code, out, err = call("runs", "verify")
    assert (
        code == 3 and re.search(rf"{network.id} +did not end, and was never sealed\n", out) and "SHA256SUMS" not in out
    )
    assert "1 of 2 runs did not end" in err and "restore" not in err and "not as they were sealed" not in err
    (told,) = json.loads(call("runs", "verify", network.id, "--json")[1])["runs"][network.id]
    assert told["file"] == "SHA256SUMS" and "did not end" in told["problem"]
    (data.path / "data" / "x.txt").write_text("five")
    err = call("runs", "verify")[2]
    assert "1 of 2 runs are not as they were sealed" in err and "1 of 2 runs did not end" in err and "restore" in err


def test_copies_of_a_run_and_one_that_cannot_be_read_are_each_verified(
    call: Call, data: Run, network: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    copy = tmp_path / "copy" / data.id
    shutil.copytree(data.path, copy)
    (copy / "data" / "x.txt").write_text("five")
    code, out, _ = call("runs", "verify", data.id, str(copy))
    assert code == 3 and out.splitlines()[:2] == [f"{data.id}  as sealed", f"{copy}  changed"]

    honest = sha256_of

    def refuse(path: Path, largest: int) -> str:
        if path == data.path / "config.yaml":
            raise PermissionError(errno.EACCES, "Permission denied", str(path))
        return honest(path, largest)

    monkeypatch.setattr(seal, "sha256_of", refuse)
    code, out, _ = call("runs", "verify", data.id, network.id)
    wide = max(len(data.id), len(network.id))
    assert code == 3 and out.splitlines() == [
        f"{data.id:{wide}}  could not be checked",
        "  config.yaml: cannot be read: Permission denied",
        f"{network.id:{wide}}  as sealed",
    ]


def test_tag_says_what_tags_there_are_now(call: Call, data: Run) -> None:
    assert call("runs", "tag", data.id, "b", "a")[1] == f"{data.id}  a, b\n"
    assert call("runs", "tag", data.id)[1] == f"{data.id}  a, b\n"
    assert call("runs", "tag", data.id, "--remove", "a", "--remove", "b")[1] == f"{data.id}  no tags\n"


@pytest.mark.parametrize(("typed", "code"), [("y\n", 0), ("n\n", 2), ("", 130)])
def test_rm_lists_the_runs_and_deletes_them_after_a_y(
    call: Call, data: Run, network: Run, monkeypatch: pytest.MonkeyPatch, typed: str, code: int
) -> None:
    monkeypatch.setattr(sys, "stdin", io.StringIO(typed))
    ended, out, err = call("runs", "rm", data.id, network.id, data.id)
    assert ended == code and err.startswith("Delete 2 runs? [y/N]:")
    assert out.split() == [str(data.path), str(network.path)]
    assert ("nothing was deleted" in err) == (code == 2)
    assert data.path.exists() == network.path.exists() == (code != 0)


def test_rm_with_force_breaks_a_lineage(call: Call, data: Run, network: Run) -> None:
    assert call("runs", "rm", data.id, "--force", "-y")[:2] == (0, f"{data.path}\n")
    assert not data.path.exists() and network.path.exists()


def test_a_report_stands_beside_the_first_run_under_a_name_of_those_it_shows(
    call: Call, data: Run, network: Run, tmp_path: Path
) -> None:
    assert call("runs", "report", data.id)[1] == f"{data.path.parent / f'report-{data.id}.html'}\n"
    with start_run("tune", Study(), "c", Path("elsewhere")) as live:
        pass
    pages = [
        Path(call("runs", "report", *refs)[1].strip())
        for refs in ((str(live.path), network.id), (str(live.path), network.id), (network.id, str(live.path)))
    ]
    assert pages[0] == pages[1] != pages[2]
    assert [page.parent.name for page in pages] == ["elsewhere", "elsewhere", "results"]
    assert all(re.fullmatch(r"report-[0-9a-f]{6}\.html", page.name) for page in pages)
    assert live.id in pages[2].read_text() and network.id in pages[2].read_text()
    assert data.id in Path(f"results/report-{data.id}.html").read_text()


def test_show_begins_with_the_answer_and_has_metrics_when_asked(call: Call) -> None:
    with start_run("tune", Study()) as live:
        live.metric("rmse", 0.25, "rad")
        live.file(OVERVIEW).write_text(Overview(answer=["It works.", "", "Why."]).text())
    lines = call("runs", "show", live.id)[1].splitlines()
    assert lines[:4] == ["It works.", "", "Why.", ""] and not any(line.startswith("rmse") for line in lines)
    assert any("--metrics" in line for line in lines)
    asked = call("runs", "show", live.id, "--metrics")[1].splitlines()
    assert asked[0] == "It works." and any(line.startswith("rmse") for line in asked)


def test_a_label_after_a_dash_and_a_csv_are_no_runs_and_what_is_meant_is_said(call: Call, data: Run) -> None:
    with start_run("compare", Study(), "quick") as live:
        pass
    code, _, err = call("runs", "show", "latest:compare-quick")
    assert code == 2 and "latest:compare:quick" in err
    assert call("runs", "show", "latest:compare:quick")[1].rstrip().endswith(str(live.id))
    Path("my.csv").write_text("t [s]\n0\n")
    for command in (("train", "--data", "my.csv"), ("runs", "show", "my.csv")):
        code, _, err = call(*command)
        assert code == 2 and "gen-data --source csv" in err and "--model hysteresis" in err, command
