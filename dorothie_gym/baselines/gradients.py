"""Gradients of losses."""

from __future__ import annotations

from torch import Tensor


def backpropagate(loss: Tensor) -> None:
    """Adds the gradients of a loss to its parameters."""
    loss.backward()  # type: ignore[no-untyped-call]  # torch publishes no types for it
