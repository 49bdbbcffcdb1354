"""A manifest is data: whatever stands in it, a repetition starts what tables know, or refuses in one line."""

from __future__ import annotations

import os
import pty
import select
import shutil
import tty
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any, NamedTuple, NoReturn

import cv2
import pytest
import serial

from tests.cli.conftest import Call, call  # noqa: F401
from tests.doors.carrier import MARK, MARKING, forged
from wristctl.board.flashing import flash
from wristctl.board.messages import BAUD
from wristctl.board.transport import SerialTransport, open_transport
from wristctl.cli.runs.verification import _again
from wristctl.commands.procedure import procedure_of
from wristctl.config.camera import Device
from wristctl.config.study import Study
from wristctl.errors import UserError
from wristctl.records import InputRun, Run, list_runs, start_run
from wristctl.records.manifest import KINDS
from wristctl.records.seal import write_seal
from wristctl.vision.device_camera import DeviceCamera

Change = Callable[[dict[str, Any]], object]


class Hostile(NamedTuple):
    """A change to an honest manifest of this kind, and the configuration beside it."""

    change: Change
    kind: str = "train"
    config: str = ""


def _role(role: Any, kind: str = "train") -> Hostile:
    return Hostile(lambda manifest: manifest["inputs"][0].update(role=role), kind)


def _input(**changed: Any) -> Hostile:
    return Hostile(lambda manifest: manifest["inputs"][0].update(changed))


def _set(**changed: Any) -> Hostile:
    return Hostile(lambda manifest: manifest.update(changed))


def _twice(manifest: dict[str, Any]) -> None:
    manifest["inputs"] *= 2


def _nothing(manifest: dict[str, Any]) -> None:
    """The manifest is honest."""


HOSTILE: dict[str, Hostile] = {
    "a role that is a law": _role("controller=EVIL:MY_LAW #"),
    "a role that is a port": _role('port="/dev/pts/0" #', "hw-run"),
    "a role that is a leaf of its section": _role("port", "hw-run"),
    "a role that is another command's": _role("network"),
    "a role that begins with a section": _role("hw-run.port"),
    "a role of several lines": _role("data\nhw-run:\n  port: /dev/pts/0"),
    "a role that is YAML": _role("data={a: &a [*a]}"),
    "a role that is an option": _role("--trust-code"),
    "a role with escapes": _role("\x1b[2Jdata"),
    "a numbered role where one run is read": _role("data[0]"),
    "a role without its number where several are": _role("runs", "identify"),
    "a number that leaves out one": _role("runs[1]", "identify"),
    "a number that is none": _role("runs[-1]", "identify"),
    "a role twice": Hostile(_twice),
    "no role": _role(""),
    "a role that is a list": _role(["data"]),
    "a role that is a mapping": _role({"data": 1}),
    "a kind that is a path": _set(kind="../../evil"),
    "a kind that is a verb": _set(kind="runs gc"),
    "a kind with options": _set(kind="hw-run --port /dev/pts/0"),
    "a kind that is a command without runs": _set(kind="init"),
    "a kind that is a module": _set(kind="in-python"),
    "a kind that is a number": _set(kind=3),
    "a kind of an input that is a path": _input(kind="../x"),
    "an id that is a path": _set(id="../../x"),
    "an id without its time": _set(id="tags.json"),
    "an id with a command": _set(id="20261124T000000Z-x\n!touch PWN\n%"),
    "an id that is a number": _set(id=20261124),
    "an input that leads out": _input(run="../../outside"),
    "an input without its time": _input(run="tags.json"),
    "an input that is nowhere": _input(run="20261124T000000Z-none-000000", path="/nowhere"),
    "an input at no path": _input(run="20261124T000000Z-none-000000", path="a\0b"),
    "an input at a long path": _input(run="20261124T000000Z-none-000000", path="x" * 5000),
    "an input at a number": _input(path=3),
    "an input with another result": _input(result_sha256="0" * 64),
    "an input with no hash": _input(result_sha256="x"),
    "inputs that are a text": _set(inputs="data"),
    "inputs that are a mapping": _set(inputs={"data": "x"}),
    "inputs that are texts": _set(inputs=["data"]),
    "no inputs": _set(inputs=None),
    "an output elsewhere": _set(outputs=[{"path": "/etc/passwd", "sha256": "0" * 64, "bytes": 1}]),
    "an output above": _set(outputs=[{"path": "data/../../x", "sha256": "0" * 64, "bytes": 1}]),
    "a law elsewhere": Hostile(lambda manifest: manifest["code"].update(foreign={"../evil.py": "0" * 64})),
    "a state that is none": _set(state="OK"),
    "a later schema": _set(schema="wristctl.run/999", kind=["train"]),
    "a port in the configuration": Hostile(_nothing, "hw-run", "hw-run: {port: /dev/pts/0}\n"),
    "a port for a calibration": Hostile(_nothing, "calibrate-wrist", "calibrate-wrist: {port: 'socket://here:1'}\n"),
    "code from elsewhere": Hostile(_nothing, "train", "simulate: {controller: 'EVIL:MY_LAW'}\n"),
    "a configuration from elsewhere": Hostile(_nothing, "train", "include: [/etc/passwd]\n"),
    "a configuration that is none": Hostile(_nothing, "train", "- &a [*a]\n"),
}


@pytest.fixture
def begun(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """What a repetition would have begun."""
    found: list[Any] = []

    def run(command: list[str], **given: Any) -> SimpleNamespace:
        found.append(command)
        return SimpleNamespace(returncode=0)

    monkeypatch.setattr("wristctl.cli.runs.verification.subprocess", SimpleNamespace(run=run, DEVNULL=-3))
    return found


def _made(folder: Path, kind: str) -> Run:
    """An honest run with an input, where its kind has one."""
    with start_run("gen-data", Study(), "", folder / "results") as data:
        pass
    role = {"train": "data", "identify": "runs[0]", "hw-run": "tuned"}.get(kind, "optics")
    with start_run(kind, Study(), "", folder / "results", inputs=[InputRun(role, Run(data.path))]) as live:
        live.file("data/a.json").write_text("{}")
    return Run(live.path)


@pytest.fixture(scope="module")
def honest(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str, Path], Run]:
    """Puts an honest run of a kind, and its input, into a folder; each is made once."""
    made: dict[str, Run] = {}

    def put(kind: str, folder: Path) -> Run:
        if kind not in made:
            made[kind] = _made(tmp_path_factory.mktemp(kind), kind)
        shutil.copytree(made[kind].path.parent, folder / "results")
        return Run(folder / "results" / made[kind].id)

    return put


@pytest.mark.parametrize("what", HOSTILE)
def test_a_hostile_manifest_gets_one_line(
    tmp_path: Path, call: Call, honest: Callable[[str, Path], Run], begun: list[Any], what: str  # noqa: F811
) -> None:  # fmt: skip
    hostile, evil = HOSTILE[what], tmp_path / "evil.py"
    evil.write_text(MARKING.format(mark=str(tmp_path / MARK)))
    run = honest(hostile.kind, tmp_path)
    forged(run, hostile.change, hostile.config.replace("EVIL", str(evil)))
    manifest = run.path / "run.json"
    manifest.write_text(manifest.read_text().replace("EVIL", str(evil)))
    write_seal(run.path, {})
    before = _below(tmp_path)
    code, out, err = call("runs", "replay", run.id)
    assert code in (2, 3) and len(err.splitlines()) == 1 and err.startswith("error: "), (code, out, err)
    for verb in ("show", "lineage", "verify"):
        code, out, said = call("runs", verb, run.id)
        assert code in (0, 2, 3) and "Traceback" not in said, (verb, said)
        assert "bug in wristctl" not in err + said and "\x1b" not in out + err + said
    assert begun == [] and _below(tmp_path) == before and not (tmp_path / MARK).exists()


def _below(folder: Path) -> list[Path]:
    return sorted(each for each in folder.rglob("*") if each.name != ".index.json")


def test_an_honest_one_is_repeated(
    tmp_path: Path, call: Call, honest: Callable[[str, Path], Run], begun: list[Any]  # noqa: F811
) -> None:  # fmt: skip
    run = honest("train", tmp_path)
    forged(run, _nothing)
    call("runs", "replay", run.id)
    assert len(begun) == 1


def test_every_kind_of_run_has_its_procedure(tmp_path: Path) -> None:
    for kind in KINDS:
        with start_run(kind, Study(), "", tmp_path):
            pass
    assert {procedure_of(run).kind for run in list_runs(tmp_path)} == set(KINDS)


@pytest.fixture
def terminal() -> Iterator[tuple[str, int]]:
    """A port and its other end."""
    ours, theirs = pty.openpty()
    tty.setraw(theirs)
    yield os.ttyname(theirs), ours
    os.close(ours)
    os.close(theirs)


def _heard(descriptor: int) -> bool:
    return bool(select.select([descriptor], [], [], 0.0)[0])


@pytest.mark.parametrize("kind", ["hw-run", "calibrate-camera"])
@pytest.mark.slow
def test_the_repetition_itself_opens_no_device(
    tmp_path: Path, terminal: tuple[str, int], kind: str, capfd: pytest.CaptureFixture[str]
) -> None:
    """Whatever it is told to open: here by whoever begins it, as if nothing had been looked at before."""
    run = _made(tmp_path, kind)
    setting = f"port={terminal[0]}" if kind == "hw-run" else "camera=/dev/null"
    assert _again(run, tmp_path / "scratch", [setting]) == 3
    assert f"opens no {'board' if kind == 'hw-run' else 'camera'}" in capfd.readouterr().err
    assert not _heard(terminal[1])


def test_nothing_opens_a_device_where_none_may_be(monkeypatch: pytest.MonkeyPatch) -> None:
    def opened(*given: Any, **more: Any) -> NoReturn:
        raise AssertionError(given)

    monkeypatch.setattr(serial, "serial_for_url", opened)
    monkeypatch.setattr(cv2, "VideoCapture", opened)
    monkeypatch.setattr("subprocess.Popen", opened)
    monkeypatch.setenv("WRISTCTL_NO_HARDWARE", "yes")
    openers: list[Callable[[], object]] = [lambda: flash("/dev/ttyACM0")]
    openers += [lambda source=each: DeviceCamera(source, Device()) for each in ("0", "/dev/video0", "rtsp://here/")]  # type: ignore[misc]
    for port in ("/dev/ttyACM0", "socket://here:1"):
        openers += [lambda port=port: SerialTransport(port, BAUD), lambda port=port: open_transport(port, BAUD)]  # type: ignore[misc]
    for opener in openers:
        with pytest.raises(UserError) as refused:
            opener()
        assert refused.value.exit_code == 3
    assert open_transport("emulated", BAUD).name == "emulated"


def test_the_emulated_rig_in_its_own_process_is_no_device(
    monkeypatch: pytest.MonkeyPatch, terminal: tuple[str, int]
) -> None:
    monkeypatch.setenv("WRISTCTL_NO_HARDWARE", "yes")
    wire = SerialTransport(terminal[0], BAUD, emulated=True)
    wire.write(b"here")
    assert os.read(terminal[1], 10) == b"here"
    wire.close()
