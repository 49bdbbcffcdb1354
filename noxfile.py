#!/usr/bin/env -S uv run --script
# /// script
# dependencies = ["nox[uv]>=2025.2.9"]
# ///
"""The matrix of versions: `nox` runs all of it, `nox -l` lists it, `nox -s "tests-3.12(newest)" -- tests/wrist` a part.

Every change is tested by `make test`, with the versions of constraints.txt. Here are the other Pythons, each with the
newest dependencies, and the oldest Python with the lowest ones that pyproject.toml allows. A Python that is not there
is a failure.
"""

from __future__ import annotations

import nox

nox.needs_version = ">=2025.2.9"

PYTHONS = ("3.11", "3.12", "3.13", "3.14")
# PyTorch without CUDA, which nothing here uses.
TORCH_INDEX = "https://download.pytorch.org/whl/cpu"
SOON = {"PIP_TIMEOUT": "5", "PIP_RETRIES": "0", "UV_HTTP_TIMEOUT": "5", "UV_HTTP_RETRIES": "0"}
THREADS = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")

nox.options.default_venv_backend = "uv"  # pip knows no lowest versions
nox.options.error_on_missing_interpreters = True  # what has not run has not passed


def install(session: nox.Session, extra: str, *resolution: str) -> None:
    """Install wristctl with an extra, and before it PyTorch from its own index, where that answers."""
    needs = nox.project.load_toml("pyproject.toml")["project"]["dependencies"]
    (torch,) = [need for need in needs if need.startswith("torch>")]
    session.install("--no-deps", "--index-url", TORCH_INDEX, *resolution, torch, env=SOON, success_codes=range(256))
    session.install("-e", f".[{extra}]", *resolution)


@nox.session(python=PYTHONS)
@nox.parametrize("dependencies", [nox.param("newest", id="newest"), nox.param("lowest", id="lowest")])
def tests(session: nox.Session, dependencies: str) -> None:
    """The tests, or those named behind `--`, with the newest or the lowest dependencies."""
    if dependencies == "lowest" and session.python != PYTHONS[0]:
        session.skip("the lowest dependencies go with the oldest Python")
    resolution = ["--resolution", "lowest-direct"] if dependencies == "lowest" else []
    install(session, "dev", *resolution)
    session.run("pytest", "-n", "auto", *session.posargs, env=THREADS)


if __name__ == "__main__":
    nox.main()
