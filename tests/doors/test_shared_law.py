"""C that export-law wrote comes back as a shared library, and moves the wrist as the controller it was made from."""

from __future__ import annotations

import hashlib
import shutil
import subprocess
from pathlib import Path

import pytest

import wristctl as face
from tests.doors.conftest import elsewhere
from wristctl.commands.export.law import export_law
from wristctl.control.shared_law import shared_law
from wristctl.control.vetting import vet
from wristctl.errors import UserError
from wristctl.records import Run

MINE = """
from wristctl.control.shared_law import shared_law
from wristctl.plugins.import_hook import data_file

MINE = shared_law(data_file(__file__, "{0}.so"), "{0}")
"""
PLANES = {
    "one plane": (),
    "two planes, three tendons": ("loop.planes=2", "wrist.tendons=three"),
}


def compiled(source: Path, library: Path) -> Path:
    compiler = shutil.which("gcc")
    assert compiler is not None, "these tests compile C"
    flags = ["-std=c99", "-O1", "-Wall", "-Wextra", "-pedantic", "-Werror", "-shared", "-fPIC"]
    subprocess.run([compiler, *flags, source, "-lm", "-o", library], check=True)
    return library


def rmse(controller: str, *overrides: str) -> float:
    chosen = (
        f"simulate.controller={controller}",
        "simulate.gains=default",
        "simulate.horizon=0.8",
        "simulate.reference.duration=0.5",
    )
    found = face.simulate(face.load_study(None, *chosen, *overrides)).metrics["rmse"]
    assert isinstance(found, float)
    return found


@pytest.mark.slow
@pytest.mark.parametrize("name", ["pid-ff", "ct-dob"])
@pytest.mark.parametrize("planes", PLANES)
def test_an_exported_controller_comes_back_with_the_same_error(tmp_path: Path, name: str, planes: str) -> None:
    loop = ["loop.control_period=0.005", *PLANES[planes], "reference.angle_deg=25"]
    export_law([f"{name}/default"], [*loop, "reference.duration=0.5", "horizon=0.8"], tmp_path / "c", tmp_path)
    stem = f"{name.replace('-', '_')}_law"
    compiled(tmp_path / "c" / f"{stem}.c", tmp_path / f"{stem}.so")
    (tmp_path / "mine.py").write_text(MINE.format(stem))
    own = [f"simulate.{key}" if not key.startswith("wrist") else key for key in loop]
    ours, theirs = rmse(f"{tmp_path}/mine.py:MINE", *own), rmse(name, *own)
    assert ours == pytest.approx(theirs, rel=1e-9, abs=0.0) and ours > 1e-6


C = """
#include <string.h>
void spring_shape(int shape[3], double *period) {{ shape[0] = {0}; shape[1] = {1}; shape[2] = 8; *period = 0.005; }}
void spring_wanted(void *state, const double *bend, const double *rate, const double *reference, double *torque)
{{
    double count;
    memcpy(&count, state, sizeof count);
    count += 1.0;
    memcpy(state, &count, sizeof count);
    for (int p = 0; p < {0}; ++p) {{
        const double *r = reference + 3 * (1 + {1}) * p;
        torque[p] = 3.0 * (r[3 * {1}] - bend[p]) - 0.1 * (rate[p] - r[1]) + 0.0 * count;
    }}
}}
"""


def spring(folder: Path, planes: int, preview: int) -> Path:
    source = folder / "spring.c"
    source.write_text(C.format(planes, preview))
    return compiled(source, folder / f"spring_{planes}_{preview}.so")


@pytest.mark.parametrize("planes", [1, 2])
@pytest.mark.parametrize("preview", [0, 2])
def test_c_of_ones_own_sees_bend_rate_and_the_reference_to_come(tmp_path: Path, planes: int, preview: int) -> None:
    """Its torque at random states is the formula's, of which one term is the reference at the end of the preview."""
    controller = shared_law(spring(tmp_path, planes, preview), "spring")
    assert (controller.planes, controller.preview, controller.name) == (planes, preview, "spring-c(py)")
    tried = vet(controller, "a test")
    theta, rate, reference, reference_rate = tried.signals[:, :4].T
    if preview:
        reference = tried.signals[:, -3]
    expected = 3.0 * (reference - theta) - 0.1 * (rate - reference_rate)
    assert tried.torques == pytest.approx(expected, rel=1e-12)
    assert "5 ms" in controller.source


@pytest.mark.slow
def test_the_library_is_sealed_into_the_run_by_its_hash_and_replays_from_there(tmp_path: Path) -> None:
    library = spring(tmp_path, 1, 0).rename(tmp_path / "spring.so")
    (tmp_path / "mine.py").write_text(MINE.format("spring"))
    digest = hashlib.sha256(library.read_bytes()).hexdigest()
    (tmp_path / "study.yaml").write_text("simulate: {controller: mine.py:MINE, gains: default, horizon: 0.3}\n")
    with elsewhere(tmp_path):
        done = face.simulate(face.load_study(tmp_path / "study.yaml"), out=tmp_path / "results")
    assert done.run is not None
    run = Run(done.run.path)
    assert digest in run.manifest.code.foreign.values() and run.problems() == []
    for name in ("spring.so", "mine.py"):
        (tmp_path / name).unlink()
    again = face.simulate(face.load_study(run.path / "config.yaml", trust_code=True))
    assert again.metrics["rmse"] == done.metrics["rmse"]


@pytest.mark.parametrize(("period", "warned"), [(0.005, False), (0.01, True)])
def test_a_loop_with_another_period_than_the_librarys_is_warned_of(
    tmp_path: Path, period: float, warned: bool, caplog: pytest.LogCaptureFixture
) -> None:
    spring(tmp_path, 1, 0).rename(tmp_path / "spring.so")
    (tmp_path / "mine.py").write_text(MINE.format("spring"))
    with elsewhere(tmp_path):
        face.simulate(controller=f"{tmp_path}/mine.py:MINE", horizon=0.1, loop={"control_period": period})
    assert ("written for control periods of 5 ms, and runs every 10 ms" in caplog.text) == warned


def test_what_is_no_such_library_is_refused_by_its_name(tmp_path: Path) -> None:
    library = spring(tmp_path, 1, 0)
    with pytest.raises(UserError, match="no controller other in the library"):
        shared_law(library, "other")
    (tmp_path / "text.so").write_text("no library")
    with pytest.raises(UserError, match="no controller spring in the library"):
        shared_law(tmp_path / "text.so", "spring")
    with pytest.raises(UserError, match="3 planes, 0 periods of preview"):
        shared_law(spring(tmp_path, 3, 0), "spring")
