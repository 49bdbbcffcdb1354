"""What a fingerprint and the other hashes of a run are made of."""

from __future__ import annotations

import hashlib
import platform
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from wristctl.config.study import Study
from wristctl.records import Run, list_runs, provenance, start_run, stream
from wristctl.records.files import sha256_of_list
from wristctl.records.manifest import Code, Environment
from wristctl.records.start import fingerprint

CODE = Code(
    version="1",
    commit="c",
    branch="main",
    dirty=False,
    tree_sha256="t",
    foreign={"code/pd.py": "f" * 64, "code/gains.py": "b" * 64},
)
ENVIRONMENT = Environment(
    python="3.11.7", os="Linux-6.1", machine="x86_64", cpu="cpu", cores=2, threads={"OMP_NUM_THREADS": "1"},
    features=["avx2", "fma"], settings={"NUMBA_CPU_NAME": "generic"},
    packages={"numpy": "2.0", "scipy": "1.15"}, packages_sha256="p",
)  # fmt: skip
INPUTS = {"network": "n", "tuned": "g"}


def _fingerprint(
    config: str = "config", code: Code = CODE, environment: Environment = ENVIRONMENT, inputs: Any = INPUTS
) -> str:
    return fingerprint(config, code, environment, inputs)


@pytest.mark.parametrize(
    "changed",
    [
        {"config": "other"},
        {"code": CODE.model_copy(update={"tree_sha256": "other"})},
        {"inputs": {}},
        {"inputs": {"network": "n", "tuned": "other"}},
        {"inputs": {"network": "g", "tuned": "n"}},
        {"inputs": {"network": "n", "data": "g"}},
        {"environment": ENVIRONMENT.model_copy(update={"python": "3.12.0"})},
        {"environment": ENVIRONMENT.model_copy(update={"machine": "arm64"})},
        {"environment": ENVIRONMENT.model_copy(update={"cpu": "another"})},
        {"environment": ENVIRONMENT.model_copy(update={"features": ["avx2"]})},
        {"environment": ENVIRONMENT.model_copy(update={"features": []})},
        {"environment": ENVIRONMENT.model_copy(update={"settings": {"NUMBA_CPU_NAME": "skylake"}})},
        {"environment": ENVIRONMENT.model_copy(update={"settings": {"OPENBLAS_CORETYPE": "generic"}})},
        {"environment": ENVIRONMENT.model_copy(update={"settings": {}})},
        {"code": CODE.model_copy(update={"foreign": CODE.foreign | {"code/gains.py": "other"}})},
        {"code": CODE.model_copy(update={"foreign": {"code/pd.py": "f" * 64}})},
        {"code": CODE.model_copy(update={"foreign": {}})},
        {"environment": ENVIRONMENT.model_copy(update={"threads": {"OMP_NUM_THREADS": "2"}})},
        {"environment": ENVIRONMENT.model_copy(update={"packages": {"numpy": "2.1", "scipy": "1.15"}})},
    ],
    ids=lambda changed: str(next(iter(changed))),
)
def test_what_decides_a_result_changes_the_fingerprint(changed: dict[str, Any]) -> None:
    assert _fingerprint(**changed) != _fingerprint()


@pytest.mark.parametrize(
    "changed",
    [
        {"code": CODE.model_copy(update={"version": "2", "commit": None, "branch": "other", "dirty": True})},
        {"environment": ENVIRONMENT.model_copy(update={"os": "Linux-6.2", "cores": 64, "packages_sha256": "other"})},
        {"environment": ENVIRONMENT.model_copy(update={"packages": {"scipy": "1.15", "numpy": "2.0"}})},
        {"inputs": {"tuned": "g", "network": "n"}},
    ],
    ids=["name of the code", "other packages", "order of packages", "order of inputs"],
)
def test_what_decides_no_result_leaves_the_fingerprint(changed: dict[str, Any]) -> None:
    assert _fingerprint(**changed) == _fingerprint()


def test_the_hashes_of_earlier_runs_are_made_of_the_same(earlier: Path) -> None:
    for run in list_runs(earlier):
        manifest = run.manifest
        results = [(each.path, each.sha256) for each in manifest.outputs if not each.volatile]
        assert sha256_of_list(results[::-1]) == run.result_hash
        sources = [line.split("  ")[::-1] for line in run.file("code.txt").read_text().splitlines()]
        assert sha256_of_list([(name, digest) for name, digest in sources]) == manifest.code.tree_sha256
        packages = run.file("environment.txt").read_bytes()
        assert hashlib.sha256(packages).hexdigest() == manifest.environment.packages_sha256
        inputs = {each.role: each.result_sha256 for each in manifest.inputs}
        again = fingerprint(manifest.config_sha256, manifest.code, manifest.environment, inputs)
        assert again == manifest.fingerprint
        assert manifest.streams == {name: stream(manifest.seed, name) for name in manifest.streams}


def test_the_result_hash_covers_results_and_metrics_and_no_other_file(results: Path) -> None:
    names = {
        "data/samples.csv": False, "data/wall.csv": True, "models/network.safetensors": False, "figures/a.svg": False,
        "tables.json": True, "timing.json": True, "checkpoints/0.pt": True,
    }  # fmt: skip

    def sealed(changed: str = "", metric: float = 1.0) -> Run:
        with start_run("train", Study(), "", results) as run:
            for name in names:
                run.file(name).write_text("changed" if name == changed else "as ever")
            run.volatile("data/wall.csv")
            run.metric("rmse", metric)
        return Run(run.path)

    first = sealed()
    flags = {each.path: each.volatile for each in first.manifest.outputs}
    assert flags == {**names, "metrics.json": False}
    for name, volatile in names.items():
        assert (sealed(name).result_hash == first.result_hash) == volatile, name
    assert sealed(metric=2.0).result_hash != first.result_hash
    readme = first.file("README.md").read_text().splitlines()
    for name, volatile in flags.items():
        assert f"- `{name}`" + " (outside the result hash)" * volatile in readme


def test_streams_of_other_names_and_seeds_are_others() -> None:
    drawn = [np.random.default_rng(stream(*each)).random() for each in ((0, "a"), (0, "b"), (1, "a"))]
    assert len(set(drawn)) == 3
    assert drawn[0] == np.random.default_rng(stream(0, "a")).random()


@pytest.mark.parametrize(
    ("told", "cpu", "features"),
    [
        (
            "processor\t: 0\nmodel name\t: Some CPU: 2 GHz\nflags\t\t: fpu sse2 sse4_2 fma avx2 avx512f\n\n"
            "processor\t: 1\nmodel name\t: Another\nflags\t\t: fpu\n",
            "Some CPU: 2 GHz",
            ["avx2", "avx512f", "fma", "sse4_2"],
        ),
        ("processor\t: 0\nFeatures\t: fp asimd sve crc32\n", "as Python says", ["asimd", "sve"]),
        ("processor\t: 0\n", "as Python says", []),
        (None, "as Python says", []),
    ],
    ids=["of Intel's kind", "of ARM's kind", "silent", "on another system"],
)
def test_a_processor_is_known_by_its_name_and_its_vector_instructions(
    told: str | None, cpu: str, features: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "cpuinfo"
    if told is not None:
        file.write_text(told)
    monkeypatch.setattr(provenance, "Path", lambda name: file if name == "/proc/cpuinfo" else Path(name))
    monkeypatch.setattr("platform.processor", lambda: "as Python says")
    found, _ = provenance.environment_state()
    assert (found.cpu, found.features) == (cpu, features)


THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
CODE_PATHS = (
    "OPENBLAS_CORETYPE", "MKL_CBWR", "NUMBA_CPU_NAME", "NUMBA_CPU_FEATURES", "NUMBA_OPT", "NPY_DISABLE_CPU_FEATURES",
    "NPY_ENABLE_CPU_FEATURES", "ATEN_CPU_CAPABILITY", "ONEDNN_MAX_CPU_ISA",
)  # fmt: skip


def test_settings_by_which_libraries_compute_otherwise_are_noted_each_by_its_name(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    for name in (*THREADS, *CODE_PATHS, "WRISTCTL_OF_NO_MATTER"):
        monkeypatch.delenv(name, raising=False)
    bare, _ = provenance.environment_state()
    assert bare.threads == bare.settings == {}
    for number, name in enumerate((*THREADS, *CODE_PATHS, "WRISTCTL_OF_NO_MATTER"), start=1):
        monkeypatch.setenv(name, str(number))
    found, listing = provenance.environment_state()
    assert found.threads == {name: str(number) for number, name in enumerate(THREADS, start=1)}
    assert found.settings == {name: str(number) for number, name in enumerate(CODE_PATHS, start=5)}
    assert found.packages["numpy"] == np.__version__ and {"scipy", "numba", "pandas"} <= set(found.packages)
    names = [line.partition("==")[0] for line in listing.splitlines()]
    assert f"numpy=={np.__version__}\n" in listing and names == sorted(set(names))
    assert found.packages_sha256 == hashlib.sha256(listing.encode()).hexdigest()
    assert (found.python, found.machine) == (platform.python_version(), platform.machine())
