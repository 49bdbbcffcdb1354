"""Training a network with torch: on one thread and seeded, so that the same settings give the same bytes."""

import hashlib
import io
import math
import pickle
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from itertools import pairwise
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from wristctl.config.learning import Activation
from wristctl.errors import UserError
from wristctl.learning.dataset import Samples
from wristctl.learning.levenberg_marquardt import LevenbergMarquardt, blocks
from wristctl.learning.network import LEAK, Network, Scaler
from wristctl.learning.training_result import Epoch, Job, TrainingResult
from wristctl.learning.transitions import Transitions
from wristctl.records.files import replacing


def fingerprint(samples: Samples | Transitions, job: Job) -> str:
    """A hash of everything that a training depends on."""
    digest = hashlib.sha256(job.settings.model_dump_json().encode())
    split = job.split
    for array in (samples.inputs, samples.targets, split.train, split.validation, job.seed.generate_state(4)):
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
        checkpoint = torch.load(file, weights_only=True, map_location="cpu")
        training, state = checkpoint["training"], checkpoint["state"]
    except (RuntimeError, OSError, EOFError, KeyError, TypeError, BadZipFile, pickle.UnpicklingError) as error:
        raise UserError("not a readable checkpoint", str(file), "delete it, or train without resume") from error
    if training != mark:
        raise UserError(
            "the checkpoint is of a training with other settings, data or seed",
            str(file),
            "resume with the config.yaml of the run that was stopped",
        )
    return dict(state)


# Doubles take a third longer than singles, and let the frozen network equal the trained one to rounding.
DTYPE = torch.float64

# Time between two checkpoints [s].
SAVE_EVERY = 5.0

LAYERS: dict[Activation, Callable[[], nn.Module]] = {
    "sigmoid": nn.Sigmoid,
    "relu": nn.ReLU,
    "leaky-relu": lambda: nn.LeakyReLU(LEAK),
    "tanh": nn.Tanh,
    "silu": nn.SiLU,
}


def train_one(
    samples: Samples | Transitions,
    job: Job,
    device: str = "cpu",
    checkpoints: Path | None = None,
    report: Callable[[Epoch], None] = lambda epoch: None,
) -> TrainingResult:
    """Train one network; `report` is called after each epoch and may raise KeyboardInterrupt to end it there.

    With a folder of checkpoints the training goes on from its checkpoint there, and leaves one now and then. Raises
    KeyboardInterrupt only before the first epoch's end, UserError where the checkpoint belongs to another training.
    """
    with _one_thread():
        mark = fingerprint(samples, job)
        if isinstance(samples, Samples) and job.settings.inputs == "tip":
            samples = samples.tips_alone()
        problem = _Problem(samples, job, device)
        course = _Course(problem)
        file = checkpoints / f"{job.name}.pt" if checkpoints else None
        if file and file.is_file():
            course.restore(read_checkpoint(file, mark))
            if course.ended:
                report(course.epochs[-1])
        saved, interrupted = time.monotonic(), False
        try:
            while not course.ended:
                course.advance()
                if file and (course.ended or time.monotonic() - saved > SAVE_EVERY):
                    write_checkpoint(file, mark, course.state())
                    saved = time.monotonic()
                report(course.epochs[-1])
        except KeyboardInterrupt:
            if not course.epochs:
                raise
            interrupted = True
        model, loss = course.kept()
        norm = math.nan if interrupted else problem.gradient_norm(model)
        return TrainingResult(job, problem.export(model), tuple(course.epochs), loss, norm, interrupted)


class _Problem:
    """The data as scaled tensors, and what is asked of a model on them."""

    def __init__(self, samples: Samples | Transitions, job: Job, device: str) -> None:
        self.settings, self.samples, self.job, self.device = job.settings, samples, job, device
        inputs, targets = samples.inputs, samples.targets.reshape(len(samples.targets), -1)
        self.planes = targets.shape[1]
        self.input, self.output = Scaler.none(inputs.shape[1]), Scaler.none(self.planes)
        if self.settings.standardise:
            train = job.split.train
            self.input, self.output = Scaler.of(inputs[train]), Scaler.of(targets[train], alike=True)

        def tensors(rows: NDArray[np.int64]) -> tuple[Tensor, Tensor]:
            scaled = self.input.scale(inputs[rows]), self.output.scale(targets[rows])
            x, y = (torch.tensor(values, dtype=DTYPE, device=device) for values in scaled)
            return x, y

        self.train, self.validation = tensors(job.split.train), tensors(job.split.validation)
        self.square_scale = float(self.output.deviation[0] ** 2)

    def model(self, seed: int) -> nn.Sequential:
        """A perceptron with torch's usual random weights."""
        layers: list[nn.Module] = []
        with torch.random.fork_rng(devices=[]):
            torch.manual_seed(seed)
            for inputs, neurons in pairwise((self.train[0].shape[1], *self.settings.hidden)):
                layers += [nn.Linear(inputs, neurons, dtype=DTYPE), LAYERS[self.settings.activation]()]
            last = nn.Linear(self.settings.hidden[-1], self.planes, dtype=DTYPE)
            return nn.Sequential(*layers, last).to(self.device)

    def optimiser(self, model: nn.Sequential) -> torch.optim.Optimizer | LevenbergMarquardt:
        rate, beta1, decay = self.settings.learning_rate, self.settings.beta1, self.settings.weight_decay
        if self.settings.optimiser == "levenberg-marquardt":
            return LevenbergMarquardt(model, decay)
        if self.settings.optimiser == "sgd":
            return torch.optim.SGD(model.parameters(), lr=rate, momentum=beta1, weight_decay=decay)
        kind = torch.optim.AdamW if self.settings.optimiser == "adamw" else torch.optim.Adam
        return kind(model.parameters(), lr=rate, betas=(beta1, 0.999), weight_decay=decay, fused=True)

    def validation_loss(self, model: nn.Sequential) -> float:
        with torch.no_grad():
            squares = sum(float(((model(x) - y) ** 2).sum()) for x, y in blocks(*self.validation))
        return squares / len(self.validation[0]) * self.square_scale

    def gradient_norm(self, model: nn.Sequential) -> float:
        model.zero_grad()
        for x, y in blocks(*self.train):
            loss: Tensor = ((model(x) - y) ** 2).sum() / len(self.train[0])
            loss.backward()  # type: ignore[no-untyped-call]
        return math.sqrt(sum(float((p.grad**2).sum()) for p in model.parameters() if p.grad is not None))

    def export(self, model: nn.Sequential) -> Network:
        linear = [layer for layer in model if isinstance(layer, nn.Linear)]
        return Network(
            tuple(layer.weight.detach().cpu().numpy().astype(np.float64) for layer in linear),
            tuple(layer.bias.detach().cpu().numpy().astype(np.float64) for layer in linear),
            self.settings.activation,
            self.input,
            self.output,
            self.samples.domain,
            self.samples.names,
            self.samples.segments,
        )


class _Course:
    """One training, epoch by epoch, whose whole state can be put away and taken up again."""

    def __init__(self, problem: _Problem) -> None:
        self.problem, self.settings = problem, problem.settings
        weight_seed, order_seed = (int(word) for word in problem.job.seed.generate_state(2))
        self.model = problem.model(weight_seed)
        self.optimiser = problem.optimiser(self.model)
        self.shuffle = torch.Generator().manual_seed(order_seed)
        self.epochs: list[Epoch] = []
        self.best: dict[str, Tensor] | None = None
        self.best_epoch = 0

    @property
    def ended(self) -> bool:
        """All epochs done, diverged, or out of patience."""
        epochs, patience = len(self.epochs), self.settings.patience
        stale = patience > 0 and epochs - self.best_epoch >= patience
        return epochs > 0 and (
            epochs >= self.settings.epochs or stale or not math.isfinite(self.epochs[-1].validation_loss)
        )

    def advance(self) -> None:
        """One epoch."""
        if isinstance(self.optimiser, LevenbergMarquardt):
            loss = self.optimiser.step(*self.problem.train)
        else:
            loss = self._over_batches(self.optimiser)
        validation, epoch = self.problem.validation_loss(self.model), len(self.epochs) + 1
        self.epochs.append(Epoch(self.problem.job.trial, epoch, loss * self.problem.square_scale, validation))
        least = self.best_epoch == 0 or validation < self.epochs[self.best_epoch - 1].validation_loss
        if self.settings.patience and least:
            self.best = {name: value.clone() for name, value in self.model.state_dict().items()}
            self.best_epoch = epoch

    def _over_batches(self, optimiser: torch.optim.Optimizer) -> float:
        """One step for each batch, in random order; the mean of their losses."""
        x, y = self.problem.train
        settings, total = self.settings, 0.0
        batches = math.ceil(len(x) / settings.batch)
        order = torch.randperm(len(x), generator=self.shuffle).to(x.device)
        for batch in range(batches):
            if settings.schedule == "cosine":
                course = (len(self.epochs) * batches + batch) / (settings.epochs * batches)
                for group in optimiser.param_groups:
                    group["lr"] = settings.learning_rate * 0.5 * (1.0 + math.cos(math.pi * course))
            rows = order[batch * settings.batch : (batch + 1) * settings.batch]
            optimiser.zero_grad()
            loss = nn.functional.mse_loss(self.model(x[rows]), y[rows])
            loss.backward()  # type: ignore[no-untyped-call]
            optimiser.step()
            total += loss.item() * y.shape[1] * len(rows)
        return total / len(x)

    def kept(self) -> tuple[nn.Sequential, float]:
        """The model to keep and its validation loss [rad^2]."""
        if self.best is None:
            return self.model, self.epochs[-1].validation_loss
        self.model.load_state_dict(self.best)
        return self.model, self.epochs[self.best_epoch - 1].validation_loss

    def state(self) -> dict[str, object]:
        """Everything that the epochs to come depend on."""
        return {
            "model": self.model.state_dict(),
            "optimiser": self.optimiser.state_dict(),
            "shuffle": self.shuffle.get_state(),
            "epochs": [(epoch.train_loss, epoch.validation_loss) for epoch in self.epochs],
            "best": self.best,
            "best_epoch": self.best_epoch,
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Take up what `state` gave."""
        self.model.load_state_dict(state["model"])
        self.optimiser.load_state_dict(state["optimiser"])
        self.shuffle.set_state(state["shuffle"])
        trial = self.problem.job.trial
        self.epochs = [Epoch(trial, k, *losses) for k, losses in enumerate(state["epochs"], start=1)]
        self.best, self.best_epoch = state["best"], state["best_epoch"]


@contextmanager
def _one_thread() -> Iterator[None]:
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(threads)
