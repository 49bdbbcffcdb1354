"""A package outside wristctl adds a controller, a reference, a disturbance, a metric, an optimiser and a plant."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from wristctl.records import Run

pytestmark = pytest.mark.slow

ROOT, HERE = Path(__file__).parents[2], Path(__file__).parent
STUDY = """\
tune:
  controllers: [lqr]
  optimiser: coordinates
  candidates: 4
  iterations: 2
  horizon: 0.5
  objective: {rmse: 1.0, jerk: 1.0e-6}
  scenarios: [{reference: {kind: sweep, angle_deg: 8, end_frequency: 1.5}}]
compare:
  horizon: 1.0
  controllers: [{controller: lqr, gains: tuned}, {controller: lqr, gains: default}]
  references: [{kind: sweep, angle_deg: 10, end_frequency: 1.5}]
  inverses: [none]
  loops: {shaken: {plant_segments: 1, disturbances: {tremor: 0.5}}, hinged: {plant: {model: hinge}}}
"""


class Elsewhere:
    """`wristctl ...` with the newcomers in its tables, in a folder of its own."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        (folder / "study.yaml").write_text(STUDY)

    def __call__(self, *arguments: str, **environment: str) -> subprocess.CompletedProcess[str]:
        return self.python("-m", "elsewhere", *arguments, **environment)

    def python(self, *arguments: str, **environment: str) -> subprocess.CompletedProcess[str]:
        """Python, where the newcomers' package is found."""
        path = {"PYTHONPATH": os.pathsep.join([str(ROOT), str(HERE)]), "COLUMNS": "80"}
        own = os.environ | path | environment
        return subprocess.run([sys.executable, *arguments], cwd=self.folder, env=own, capture_output=True, text=True)

    def run(self, *arguments: str) -> tuple[Run, str]:
        """The run that a command leaves, and what it printed."""
        done = self(*arguments)
        assert done.returncode == 0, done.stderr
        return Run(self.folder / done.stdout.splitlines()[-1]), done.stdout


@pytest.fixture(scope="module")
def elsewhere(tmp_path_factory: pytest.TempPathFactory) -> Elsewhere:
    return Elsewhere(tmp_path_factory.mktemp("elsewhere"))


@pytest.fixture(scope="module")
def compared(elsewhere: Elsewhere) -> tuple[Run, str]:
    """A comparison of the newcomers, with tuned gains, and what it printed."""
    elsewhere.run("tune", "study.yaml")
    return elsewhere.run("compare", "study.yaml", "--tuned", "latest:tune", "--all")


def test_newcomers_are_tuned_and_compared_like_those_of_the_house(compared: tuple[Run, str]) -> None:
    run, said = compared
    table = run.data("comparison")
    assert set(table["gains"]) == {"tuned", "default"} and set(table["loop"]) == {"shaken", "hinged"}
    assert table["reference"].unique().tolist() == ["chirp 0.5 to 1.5 Hz"]
    assert np.isfinite(table["rmse"]).all() and (table["rmse"] < 0.05).all() and not table["failed"].any()
    assert (table["jerk"] > 0.0).all() and any("RMSE" in line and "jerk" in line for line in said.splitlines())
    (output,) = [each for each in run.manifest.outputs if each.path == "data/comparison.csv"]
    assert {each.name: each.unit for each in output.columns}["jerk"] == "rad/s^3"


def test_a_metric_from_elsewhere_is_what_gains_were_tuned_for(elsewhere: Elsewhere, compared: tuple[Run, str]) -> None:
    """With a weight on jerk alone the objective is that weight times jerk's decades beside feedforward."""
    alone = "objective={rmse: 0, steady_state: 0, oscillation: 0, chattering: 0, worst: 0, swinging: 0, jerk: %s}"
    once, twice = (
        elsewhere.run("tune", "study.yaml", "--set", alone % weight)[0].data("history-lqr")["objective"]
        for weight in ("1.0", "2.0")
    )
    np.testing.assert_allclose(twice, 2.0 * once, rtol=1e-12)
    assert once.abs().min() > 0.0


def test_a_tremor_shakes_and_another_plant_moves_otherwise(compared: tuple[Run, str]) -> None:
    run, _ = compared
    table, series = run.data("comparison"), run.array("trajectories")
    chosen = table["gains"] == "default"
    shaken, hinged = (
        series["theta"][np.flatnonzero(chosen & (table["loop"] == loop))[0]] for loop in ("shaken", "hinged")
    )
    wanted = series["theta_ref"][0]
    assert np.abs(shaken - hinged).max() > 1e-3
    spectrum = np.abs(np.fft.rfft((shaken - wanted)[:200] * np.hanning(200)))  # every fifth millisecond of a second
    assert 7 <= int(np.argmax(spectrum[4:])) + 4 <= 9  # Hz


ERRORS: list[tuple[tuple[str, ...], str]] = [
    (("simulate", "--set", "reference.kind=swep"), "did you mean 'sweep'?"),
    (("simulate", "--controller", "lqrr"), "did you mean 'lqr'?"),
    (("tune", "--set", "optimiser=coordinate"), "did you mean 'coordinates'?"),
    (("tune", "--set", "objective.jrk=1"), "did you mean 'jerk'?"),
    (("simulate", "--set", "loop.plant.model=hing"), "did you mean 'hinge'?"),
    (("simulate", "--set", "loop.disturbances.tremors=1"), "did you mean 'tremor'?"),
    (("simulate", "--set", "reference={kind: sweep, end_frequenc: 1}"), "did you mean 'end_frequency'?"),
    (("simulate", "--set", "reference.end_frequency=1"), "unknown key 'end_frequency'"),
    (("simulate", "--set", "reference={kind: sweep, end_frequency: fast}"), "'fast' should be a number"),
    (("tune", "--set", "objective.jerk=-1"), "the weight of jerk is negative"),
]
"""What is typed, and what the error says."""
ONE_BY_ONE = """
import json, sys
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
import elsewhere.tables
from wristctl.cli.app import main
ended = []
for arguments in json.loads(sys.argv[1]):
    sys.argv[1:] = arguments
    with redirect_stdout(StringIO()) as out, redirect_stderr(StringIO()) as err:
        try:
            main()
        except SystemExit as end:
            ended.append((end.code, out.getvalue(), err.getvalue()))
print(json.dumps(ended))
"""


def test_errors_know_the_newcomers(elsewhere: Elsewhere) -> None:
    typed = json.dumps([arguments for arguments, _ in ERRORS])
    done = elsewhere.python("-c", ONE_BY_ONE, typed)
    for (arguments, told), (code, out, err) in zip(ERRORS, json.loads(done.stdout), strict=True):
        assert code == 2 and told in err and not out, arguments


def test_a_dry_run_prints_their_names_units_and_defaults(elsewhere: Elsewhere) -> None:
    said = elsewhere("simulate", "--dry-run", "--all", "--set", "reference={kind: sweep, end_frequency: 3}").stdout
    kind, model = (next(line for line in said.splitlines() if f" {key}:" in line) for key in ("kind", "model"))
    assert kind.endswith(", sweep") and model.endswith(", hinge")
    assert "end_frequency: 3  # [1/s] frequency after `duration`" in said
    tuned = elsewhere("tune", "--dry-run", "--all", "--set", "objective.jerk=0.5").stdout
    assert "jerk: 0.5  # weight of root mean square of the angle's third derivative" in tuned
    listed = "pso, differential-evolution, cma-es, random, coordinates"
    assert f"optimiser: pso  # ask/tell optimiser (or file.py:NAME): {listed}" in tuned


def test_the_shell_completes_them(elsewhere: Elsewhere) -> None:
    typed = {"COMP_WORDS": "wristctl simulate --controller lqr", "COMP_CWORD": "3"}
    done = elsewhere(_WRISTCTL_COMPLETE="complete_bash", **typed)
    assert done.stdout.split() == ["lqr"]
