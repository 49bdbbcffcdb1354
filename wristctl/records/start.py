"""Begin a run and see to its end, whichever way it ends."""

import hashlib
import json
import re
import shutil
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from wristctl.config.foreign import Foreign
from wristctl.config.study import Study
from wristctl.errors import OUT, Argument, UserError, error_of_the_system
from wristctl.interrupt import deferred, interrupts, undisturbed
from wristctl.records.copied_inputs import copy_code, sealed_files, sealed_references, write_files
from wristctl.records.files import sha256_of, sync, write_bytes, write_text
from wristctl.records.journal import now
from wristctl.records.lock import RunLock
from wristctl.records.manifest import (
    CONFIG,
    PACKAGES,
    PATCH,
    SOURCES,
    Code,
    Environment,
    Error,
    Input,
    Manifest,
    Timing,
)
from wristctl.records.provenance import code_state, environment_state
from wristctl.records.run import Run
from wristctl.records.run_writer import LiveRun, Page
from wristctl.study_files.resolved import config_hash, resolved_yaml


@dataclass(frozen=True)
class InputRun:
    """An earlier run and the part it plays in this one."""

    role: str
    run: Run


@contextmanager
def start_run(
    kind: str,
    study: Study,
    label: str = "",
    out: Path = Path("results"),
    argv: Sequence[str] = (),
    inputs: Sequence[InputRun] = (),
    page: Page | None = None,
    foreign: Sequence[Foreign] = (),
    about: str = "",
) -> Iterator[LiveRun]:
    """A new run directory under `out`, locked while the block runs and sealed at its end.

    The block's end decides the state: ok; interrupted by KeyboardInterrupt or SIGTERM; failed by any other
    exception, which is raised again. What was written is kept. `page` makes report.html of the ended run, `about` tells
    it from others of its kind, and copies of `foreign` code are part of it. Raises UserError where the directory cannot
    be created, the disk is full, or such code has changed since it was loaded.
    """
    files = sealed_files(study, kind)
    digest = config_hash(files.study, kind)

    def begun(path: Path) -> LiveRun:
        code, patch, sources = code_state()
        code.foreign = dict(copy_code(path, foreign))
        environment, packages = environment_state()
        write_text(path / CONFIG, resolved_yaml(files.study, kind))
        write_files(path, files.contents)
        write_text(path / PACKAGES, packages)
        write_text(path / SOURCES, sources)
        if patch:
            write_bytes(path / PATCH, patch)
            code.patch_sha256 = sha256_of(path / PATCH)
        records = [
            Input(
                role=source.role,
                kind=source.run.kind,
                run=source.run.manifest.id,
                path=str(source.run.path),
                result_sha256=source.run.result_hash,
            )
            for source in inputs
        ]
        manifest = Manifest(
            id=path.name,
            kind=kind,
            label=label,
            about=about,
            argv=list(argv or sys.argv),
            config_sha256=digest,
            seed=files.study.seed,
            code=code,
            environment=environment,
            inputs=records,
            timing=Timing(started=now()),
            fingerprint=fingerprint(digest, code, environment, {each.role: each.result_sha256 for each in records}),
        )
        return LiveRun(path, manifest, page, files.names, sealed_references(foreign))

    path, lock = None, None
    with interrupts() as interrupt:
        try:
            with deferred():
                if interrupt.asked:  # and swallowed by a library
                    raise KeyboardInterrupt
                path = _new_directory(out, kind, label, digest)
                while lock is None:
                    try:
                        lock = RunLock(path)
                    except FileNotFoundError:  # `runs gc` saw an empty folder, and took it away
                        path = _new_directory(out, kind, label, digest)
            run = begun(path)
        except BaseException as error:
            with undisturbed():  # no manifest yet: nothing that could be read
                if path is not None:
                    shutil.rmtree(path, ignore_errors=True)
                if lock is not None:
                    lock.release()
            if path is None:
                raise
            raise _refused(error, path) from error
        try:
            yield run
            with undisturbed():
                run.end("ok", run.exit_code)
        except BaseException as error:
            outcome = KeyboardInterrupt() if interrupt.asked else _refused(error, path)
            with undisturbed():
                _end_failed(run, outcome)
            if outcome is not error:
                raise outcome from error
            raise
        finally:
            run.close()
            lock.release()


def _new_directory(out: Path, kind: str, label: str, digest: str) -> Path:
    if not re.fullmatch(r"[A-Za-z0-9_.-]{0,60}", label):
        problem = "a label holds letters, digits, dots, dashes and underscores"
        raise UserError(problem, Argument("label", label), "shorten or respell it")
    stamp = datetime.now(UTC).strftime("%Y%m%dT%H%M%SZ")
    name = "-".join(part for part in (stamp, kind, label, digest[:6]) if part)
    attempt = 1
    while True:
        path = out / (name if attempt == 1 else f"{name}-{attempt}")
        try:
            path.mkdir(parents=True)
            try:
                sync(path.parent)
            except OSError:  # the disk refuses: there is no new folder then
                path.rmdir()
                raise
            return path
        except FileExistsError:
            if not path.is_dir():
                raise UserError(
                    "cannot create a run directory: a file is in the way", str(path), ("choose another ", OUT)
                ) from None
            attempt += 1
        except OSError as error:
            problem = f"cannot create a run directory: {error.strerror}"
            raise UserError(problem, str(out), ("choose a folder you can write to with ", OUT)) from error


def fingerprint(config: str, code: Code, environment: Environment, inputs: Mapping[str, str]) -> str:
    """One hash over what decides a result: configuration, code, inputs by their results, machine and packages."""
    machine = [environment.python, environment.machine, environment.cpu, environment.threads, environment.packages]
    if environment.features or environment.settings:  # of version 0.1.0 neither is known
        machine += [environment.features, environment.settings]
    if code.foreign:
        machine.append(code.foreign)
    decisive = (config, code.tree_sha256, sorted(inputs.items()), machine)
    return hashlib.sha256(json.dumps(decisive, sort_keys=True).encode()).hexdigest()


def _refused(error: BaseException, path: Path) -> BaseException:
    """The user's error behind one of the disk or the system, wherever it was met; any other error as it is."""
    if not isinstance(error, Exception | KeyboardInterrupt):  # SystemExit above all, which would end in silence
        return RuntimeError(f"{type(error).__name__} was raised: {error}".rstrip(": "))
    reported = None if isinstance(error, FileNotFoundError) else error_of_the_system(error, path)
    return reported or error


def _end_failed(run: LiveRun, error: BaseException) -> None:
    if isinstance(error, KeyboardInterrupt):
        with suppress(UserError):  # the folder is gone, or the disk full: the user wants an end all the same
            run.end("interrupted", 130)
    elif isinstance(error, UserError):
        run.end(
            "failed",
            error.exit_code,
            Error(type="UserError", what=error.what, where=str(error.where), fix=str(error.fix)),
        )
    else:
        run.end("failed", 1, Error(type=type(error).__name__, what=str(error)))
