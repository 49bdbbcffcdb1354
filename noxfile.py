#!/usr/bin/env -S uv run --script
# /// script
# dependencies = ["nox>=2025.2.9"]
# ///
"""The matrix of versions: `nox` runs all of it, `nox -l` lists it, `nox -s "tests-3.12(newest)" -- tests/wrist` a part.

Every change is tested by `make test`, with the versions of constraints.txt. Here are the other Pythons, each with the
newest dependencies, and the oldest Python with the lowest ones that pyproject.toml allows.
"""

from __future__ import annotations

import nox

nox.needs_version = ">=2025.2.9"

PYTHONS = ("3.11", "3.12", "3.13", "3.14")
THREADS = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")

nox.options.default_venv_backend = "uv|virtualenv"
nox.options.error_on_missing_interpreters = False


@nox.session(python=PYTHONS)
@nox.parametrize("dependencies", [nox.param("newest", id="newest"), nox.param("lowest", id="lowest")])
def tests(session: nox.Session, dependencies: str) -> None:
    """The tests, or those named behind `--`, with the newest or the lowest dependencies."""
    if dependencies == "lowest" and session.python != PYTHONS[0]:
        session.skip("the lowest dependencies go with the oldest Python")
    resolution = ["--resolution", "lowest-direct"] if dependencies == "lowest" else []
    session.install("-e", ".[dev]", *resolution)
    session.run("pytest", "-n", "auto", *session.posargs, env=THREADS)


@nox.session
def package(session: nox.Session) -> None:
    """Wheel and source archive, checked, and the wheel tried in an environment of its own."""
    session.install("build", "twine", "check-wheel-contents")
    session.run("python", "-m", "build", "--outdir", "dist")
    session.run("twine", "check", "--strict", "dist/*")
    session.run("check-wheel-contents", "dist")


@nox.session
def docs(session: nox.Session) -> None:
    """The documentation's site, where a warning is an error."""
    session.install("-e", ".[docs]")
    session.run("python", "docs/build_site.py", env=THREADS)


if __name__ == "__main__":
    nox.main()
