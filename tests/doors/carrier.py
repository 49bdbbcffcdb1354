"""Runs that carry a law which must not be imported: it leaves a mark when it is."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from tests.doors.conftest import HELPER, LAW
from wristctl.config.foreign import Foreign
from wristctl.records import Run, start_run
from wristctl.records.manifest import Manifest
from wristctl.records.seal import result_hash, write_seal
from wristctl.study_files.load import load_study

LAW_FILE, MARK = "code/strange/strange.py", "was here"
CARRIED = f"{LAW_FILE}:STRANGE"
MARKING = "open({mark!r}, 'a').close()\n"


def carrier(folder: Path, kind: str, section: Mapping[str, Any]) -> Run:
    """A sealed run of this kind in folder/results whose code says folder/MARK once it is imported."""
    sources = folder / "sources"
    sources.mkdir(exist_ok=True)
    for name, text in (("strange.py", LAW), ("helper.py", HELPER)):
        (sources / name).write_text(MARKING.format(mark=str(folder / MARK)) + text)
    hashes = {file: hashlib.sha256(file.read_bytes()).hexdigest() for file in sorted(sources.iterdir())}
    foreign = Foreign(sources / "strange.py", "STRANGE", hashes, sources)
    agreed = os.environ.get("WRISTCTL_TRUSTED_CODE")
    document = sources / "study.yaml"
    document.write_text(json.dumps({kind: section}).replace(CARRIED, foreign.reference))
    study = load_study([document])
    with start_run(kind, study, "", folder / "results", ["wristctl", kind], foreign=[foreign]) as live:
        live.file("data/gains.json").write_text('{"strange": {"Kp": 4.0, "Kd": 0.2}}')
        live.metric("rmse", 0.1)
    if agreed is None:
        os.environ.pop("WRISTCTL_TRUSTED_CODE")
    config = live.path / "config.yaml"
    config.write_text(config.read_text().replace(foreign.reference, CARRIED))
    write_seal(live.path, {})
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
