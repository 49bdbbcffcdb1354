"""Checkpoints of a training, so that one that was stopped goes on to the very bytes it would have had."""

from __future__ import annotations

import hashlib
import io
import pickle
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np
import torch

from wristctl.config.errors import UserError
from wristctl.learning.dataset import Samples
from wristctl.learning.training_result import Job
from wristctl.records.files import replacing


def fingerprint(samples: Samples, job: Job) -> str:
    """A hash of everything that a training depends on."""
    digest = hashlib.sha256(job.settings.model_dump_json().encode())
    split = job.split
    for array in (samples.inputs, samples.theta, split.train, split.validation, job.seed.generate_state(4)):
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()


def write_checkpoint(file: Path, mark: str, state: dict[str, object]) -> None:
    """Put away the state of the training with this fingerprint, in one piece."""
    file.parent.mkdir(parents=True, exist_ok=True)
    content = io.BytesIO()
    torch.save({"training": mark, "state": state}, content)
    with replacing(file) as temporary:  # by Python: where the disk refuses, torch says RuntimeError and no errno
        temporary.write_bytes(content.getvalue())


def read_checkpoint(file: Path, mark: str) -> dict[str, Any]:
    """The state of the training with this fingerprint; UserError where it is another's or cannot be read."""
    try:
        found = torch.load(file, weights_only=True, map_location="cpu")
        training, state = found["training"], found["state"]
    except (RuntimeError, OSError, EOFError, KeyError, TypeError, BadZipFile, pickle.UnpicklingError) as error:
        raise UserError("not a readable checkpoint", str(file), "delete it, or train without resume") from error
    if training != mark:
        raise UserError(
            "the checkpoint is of a training with other settings, data or seed",
            str(file),
            "resume with the config.yaml of the run that was stopped",
        )
    return dict(state)
