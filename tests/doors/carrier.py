"""Runs that carry a law which must not be imported: it leaves a mark when it is."""

from __future__ import annotations

import hashlib
import json
import shutil
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from tests.doors.conftest import HELPER, LAW, elsewhere
from wristctl.commands.adoption import with_places
from wristctl.config.foreign import Foreign
from wristctl.records import Run, start_run
from wristctl.records.manifest import Manifest
from wristctl.records.seal import result_hash, write_seal
from wristctl.study_files.load import load_study

LAW_FILE, MARK = "code/strange/strange.py", "was here"
CARRIED = f"{LAW_FILE}:STRANGE"
MARKING = "open({mark!r}, 'a').close()\n"


def carrier(folder: Path, kind: str, section: Mapping[str, Any]) -> Run:
    """Somebody else's sealed run of this kind in folder/results, whose code says folder/MARK once it is imported."""
    with elsewhere(folder):
        return made(folder, kind, section)


def made(folder: Path, kind: str, section: Mapping[str, Any], found: str = "") -> Run:
    """Such a run, made by this user here; `found` is a folder of it for a copy of the law that it never ran."""
    sources = folder / "sources"
    sources.mkdir(exist_ok=True)
    for name, text in (("strange.py", LAW), ("helper.py", HELPER)):
        (sources / name).write_text(MARKING.format(mark=str(folder / MARK)) + text)
    hashes = {file: hashlib.sha256(file.read_bytes()).hexdigest() for file in sorted(sources.iterdir())}
    foreign = Foreign(sources / "strange.py", "STRANGE", hashes, sources)
    document = sources / "study.yaml"
    document.write_text(json.dumps({kind: section}).replace(CARRIED, foreign.reference))
    study = with_places(load_study([document]), {foreign.reference: CARRIED})
    with start_run(kind, study, "", folder / "results", ["wristctl", kind], foreign=[foreign]) as live:
        live.file("data/gains.json").write_text('{"strange": {"Kp": 4.0, "Kd": 0.2}}')
        live.metric("rmse", 0.1)
        if found:
            shutil.copytree(sources, live.path / found)
    return Run(live.path)


def forged(run: Run, change: Callable[[dict[str, Any]], object], config: str = "") -> None:
    """Change the manifest (and the configuration) of a run, and seal it anew so that nothing of it is wrong."""
    if config:
        (run.path / "config.yaml").write_text(config)
    manifest = json.loads((run.path / "run.json").read_text())
    manifest["result_sha256"] = result_hash(Manifest.model_validate(manifest))
    change(manifest)
    (run.path / "run.json").write_text(json.dumps(manifest))
    write_seal(run.path, {})
