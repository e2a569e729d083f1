"""Gradient descent of a network through epochs and rounds, and its state between them."""

from collections.abc import Callable
from typing import Any

import numpy as np
import safetensors.torch
import torch
from safetensors import SafetensorError
from torch import Tensor, nn

from orchestrator.signal import Array
from studies.training.learner import Optimisation


class Descent:
    """AdamW with a rate that rises for 50 steps, then falls with the cosine of the progress.

    Order of the samples and whatever the loss draws depend on seed, round and epoch only.

    Args:
        model: whose weights are learned, on its device.
        optimisation: of every round.
        seed: of the training.
    """

    def __init__(self, model: nn.Module, optimisation: Optimisation, seed: int) -> None:
        self._model = model
        self._optimisation = optimisation
        self._seed = seed
        self._epoch = 0
        self.round = 0
        self._optimizer = self._fresh()

    def begin_round(self, number: int) -> None:
        """A fresh optimiser and schedule for the weights that there are."""
        self.round, self._epoch = number, 0
        self._optimizer = self._fresh()

    def epoch(self, samples: int, loss: Callable[[Array, np.random.Generator], Tensor]) -> float:
        """Learn from every sample once.

        Args:
            samples: how many there are.
            loss: the mean loss, shape (), of the samples with these indices, shape (batch,); draws
                from the generator what it needs.

        Returns:
            Mean loss of all steps.
        """
        rng = np.random.default_rng([self._seed, self.round, self._epoch])
        order = rng.permutation(samples)
        size = self._optimisation.batch
        losses = []
        for step, first in enumerate(range(0, samples, size)):
            for group in self._optimizer.param_groups:
                group["lr"] = self._rate(self._epoch + first / samples, step)
            losses.append(self._step(loss(order[first : first + size], rng)))
        self._epoch += 1
        return float(np.mean(losses))

    def state(self) -> bytes:
        """Weights, optimiser and progress."""
        moments = {
            f"optimizer.{k}.{name}": value
            for k, kept in self._optimizer.state_dict()["state"].items()
            for name, value in kept.items()
        }
        weights = {f"model.{name}": value for name, value in self._model.state_dict().items()}
        progress = {"progress": torch.tensor([self.round, self._epoch])}
        return safetensors.torch.save({**weights, **moments, **progress})

    def restore(self, state: bytes) -> None:
        """Undo all since `state`.

        Raises:
            ValueError: it is no state of such a network.
        """
        try:
            tensors = safetensors.torch.load(state)
        except SafetensorError as error:
            raise ValueError(f"this is no state of such a network: {error}") from error
        weights = {
            name.removeprefix("model."): value
            for name, value in tensors.items()
            if name.startswith("model.")
        }
        try:
            self._model.load_state_dict(weights)
            self.round, self._epoch = tensors["progress"].tolist()
        except (RuntimeError, KeyError) as error:
            raise ValueError(f"this is no state of such a network: {error}") from error
        self._optimizer = self._fresh()
        saved: dict[int, dict[str, Any]] = {}
        for name, value in tensors.items():
            if name.startswith("optimizer."):
                _, k, key = name.split(".")
                saved.setdefault(int(k), {})[key] = value
        groups = self._optimizer.state_dict()["param_groups"]
        self._optimizer.load_state_dict({"state": saved, "param_groups": groups})

    def _fresh(self) -> torch.optim.Optimizer:
        return torch.optim.AdamW(
            self._model.parameters(),
            lr=self._optimisation.rate,
            weight_decay=self._optimisation.weight_decay,
        )

    def _rate(self, epoch: float, step: int) -> float:
        """Falls with the cosine of the progress to a hundredth; rises over the first 50 steps."""
        progress = min(epoch / self._optimisation.epochs, 1.0)
        falling = 0.01 + 0.99 * 0.5 * (1.0 + np.cos(np.pi * progress))
        rising = min((step + 1) / 50.0, 1.0) if epoch < 1.0 else 1.0
        return float(self._optimisation.rate * falling * rising)

    def _step(self, loss: Tensor) -> float:
        self._optimizer.zero_grad()
        loss.backward()  # type: ignore[no-untyped-call]
        torch.nn.utils.clip_grad_norm_(self._model.parameters(), 5.0)
        self._optimizer.step()
        return float(loss.detach())
