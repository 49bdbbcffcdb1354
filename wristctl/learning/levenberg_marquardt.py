"""Least squares by Levenberg and Marquardt: for small networks, errors a hundred times below those of Adam.

A fit without noise ends in a long flat valley. First-order methods crawl along it; J^T J knows its shape.
"""

from collections.abc import Iterator

import torch
from torch import Tensor, nn
from torch.func import functional_call, grad, vmap

# Samples evaluated at once where no gradient step is taken batch by batch.
BLOCK = 4096

FIRST_DAMPING, LEAST_DAMPING = 1e-2, 1e-16
# Factors of the damping after a step that lowered the objective, and after one that did not.
ACCEPTED, REJECTED = 1.0 / 3.0, 4.0

# Rejected steps in a row after which the weights stay as they are.
TRIES = 20


class LevenbergMarquardt:
    """Minimises mean(|model(x) - y|^2) + decay / 2 |w|^2 over the weights w of a model with P outputs.

    Marquardt, J. SIAM 11 (1963) 431, with Levenberg's damping by the identity. All samples at once, nothing random.
    """

    def __init__(self, model: nn.Module, weight_decay: float = 0.0) -> None:
        self.model, self.weight_decay, self.damping = model, weight_decay, FIRST_DAMPING

    def step(self, x: Tensor, y: Tensor) -> float:
        """One step on samples x (N, D) and y (N, P); the mean squared error before it."""
        weights = nn.utils.parameters_to_vector(self.model.parameters()).detach()
        curvature, slope = self._normal_equations(weights, x, y)
        before = self._error(x, y)
        objective = before + 0.5 * self.weight_decay * float(weights @ weights)
        for _ in range(TRIES):
            damped = curvature.clone()
            damped.diagonal().add_(self.damping)
            factor, failed = torch.linalg.cholesky_ex(damped)
            if not failed:
                new = weights - torch.cholesky_solve(slope[:, None], factor)[:, 0]
                nn.utils.vector_to_parameters(new, self.model.parameters())
                if self._error(x, y) + 0.5 * self.weight_decay * float(new @ new) < objective:
                    self.damping = max(LEAST_DAMPING, ACCEPTED * self.damping)
                    return before
            self.damping *= REJECTED
        nn.utils.vector_to_parameters(weights, self.model.parameters())
        return before

    def state_dict(self) -> dict[str, float]:
        """State of the optimiser beside the weights."""
        return {"damping": self.damping}

    def load_state_dict(self, state: dict[str, float]) -> None:
        """Take up what `state_dict` gave."""
        self.damping = state["damping"]

    def _normal_equations(self, weights: Tensor, x: Tensor, y: Tensor) -> tuple[Tensor, Tensor]:
        """Gauss and Newton's second derivatives (W, W) of the objective and its gradient (W,)."""
        named = {name: value.detach() for name, value in self.model.named_parameters()}

        def output(values: dict[str, Tensor], row: Tensor, plane: int) -> Tensor:
            output: Tensor = functional_call(self.model, values, (row,))
            return output[plane]

        gradients = vmap(grad(output), in_dims=(None, 0, None))
        curvature = self.weight_decay * torch.eye(len(weights), dtype=x.dtype, device=x.device)
        slope = self.weight_decay * weights
        for some, wanted in blocks(x, y):
            with torch.no_grad():
                residual = self.model(some) - wanted
            for plane in range(y.shape[1]):
                of_weights = gradients(named, some, plane).values()
                jacobian = torch.cat([gradient.flatten(1) for gradient in of_weights], dim=1)
                curvature += 2.0 / len(x) * (jacobian.T @ jacobian)
                slope = slope + 2.0 / len(x) * (jacobian.T @ residual[:, plane : plane + 1])[:, 0]
        return curvature, slope

    def _error(self, x: Tensor, y: Tensor) -> float:
        with torch.no_grad():
            return sum(float(((self.model(some) - wanted) ** 2).sum()) for some, wanted in blocks(x, y)) / len(x)


def blocks(x: Tensor, y: Tensor) -> Iterator[tuple[Tensor, Tensor]]:
    """Samples x (N, D) and y (N, P) in parts of at most BLOCK."""
    for start in range(0, len(x), BLOCK):
        yield x[start : start + BLOCK], y[start : start + BLOCK]
