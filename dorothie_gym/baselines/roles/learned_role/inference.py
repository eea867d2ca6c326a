"""Forward passes of the networks of learned roles in play (compiled): each session's result is that of it alone.

torch's matrix products choose their routines by the number of rows and by the processor, and round differently. Here
every output is a sum in the order of the inputs, in single precision, so that it depends neither on the other rows of a
batch nor on the processor. Inputs that are 0 are left out: seven of eight are.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.support import portable_arrays as pn
from dorothie_gym.support.compilation import compiled, fixed

if TYPE_CHECKING:
    from collections.abc import Sequence

    from torch import nn

    from dorothie_gym.baselines.roles.learned_role.decision import InputBatch
    from dorothie_gym.baselines.roles.learned_role.network import RoleNetwork

Floats = NDArray[np.float32]
Integers = NDArray[np.int64]

TILE = 8
"""Number of rows that are summed together, so that their outputs stay in the cache beside the weights."""

MISSING = np.float32(-1e9)
"""Score of an option that is only filled in."""


@compiled
def write_dense(inputs: Floats, weights: Floats, bias: Floats, rectified: bool, outputs: Floats) -> None:
    """Writes the outputs of a layer.

    Args:
        inputs: (b, n).
        weights: (n, m).
        bias: (m,).
        rectified: whether negative outputs become 0.
        outputs: (b, m), written.
    """
    for first in range(0, len(inputs), TILE):
        end = min(first + TILE, len(inputs))
        for row in range(first, end):
            for column in range(len(bias)):
                outputs[row, column] = bias[column]
        for number in range(inputs.shape[1]):
            part = weights[number]
            for row in range(first, end):
                value = inputs[row, number]
                if value != 0.0:
                    output = outputs[row]
                    for column in range(len(bias)):
                        output[column] += value * part[column]
        if rectified:
            for row in range(first, end):
                for column in range(len(bias)):
                    outputs[row, column] = max(outputs[row, column], np.float32(0.0))


@compiled
def write_means(rows: Integers, table: Floats, outputs: Floats) -> None:
    """Writes the mean of rows of a table, 0 if there are none.

    Args:
        rows: (b, w) numbers of the rows; 0 stands for none.
        table: (r, m).
        outputs: (b, m), written.
    """
    for row in range(len(rows)):
        output = outputs[row]
        output[:] = 0.0
        count = 0
        for place in range(rows.shape[1]):
            number = rows[row, place]
            if number > 0:
                count += 1
                for column in range(len(output)):
                    output[column] += table[number, column]
        if count > 1:
            for column in range(len(output)):
                output[column] = output[column] / np.float32(count)


@compiled
def write_scores(
    hidden: Floats,
    options: Floats,
    counts: Integers,
    weights: Floats,
    last: Floats,
    bias: np.float32,
    scores: Floats,
    layer: Floats,
) -> None:
    """Writes the scores of options: two layers over a hidden layer and an option, the first one a sum of two.

    Args:
        hidden: (b, h) part of the first layer that does not depend on the option.
        options: (b, k, n).
        counts: number of options (b,).
        weights: (n, h) of the other part.
        last: (h,) weights of the second layer.
        bias: its bias.
        scores: (b, k), written where there is an option.
        layer: (h,) room for the first layer of an option.
    """
    for row in range(len(hidden)):
        for option in range(counts[row]):
            for column in range(len(layer)):
                layer[column] = hidden[row, column]
            for number in range(len(weights)):
                value = options[row, option, number]
                if value != 0.0:
                    for column in range(len(layer)):
                        layer[column] += value * weights[number, column]
            total = bias
            for column in range(len(layer)):
                if layer[column] > 0.0:
                    total += layer[column] * last[column]
            scores[row, option] = total


_write_dense, _write_means, _write_scores = fixed(write_dense), fixed(write_means), fixed(write_scores)


class Dense:
    """A linear layer, with or without rectification of its outputs."""

    def __init__(self, layer: Any, *, rectified: bool = False) -> None:
        """Copies the parameters of a layer of torch."""
        self.weights = numbers_of(layer.weight.T)
        self.bias = np.zeros(self.weights.shape[1], np.float32) if layer.bias is None else numbers_of(layer.bias)
        self._rectified = rectified

    @classmethod
    def of_part(cls, layer: Any, first: int, end: int) -> Dense:
        """Copies the parameters of some of the inputs; the bias is that of the part with the first input."""
        part = cls(layer)
        part.weights = part.weights[first:end].copy()
        if first:
            part.bias = np.zeros_like(part.bias)
        return part

    def __call__(self, inputs: Floats) -> Floats:
        """Returns the outputs (b, m) for inputs (b, n)."""
        outputs = np.empty((len(inputs), len(self.bias)), dtype=np.float32)
        _write_dense(np.ascontiguousarray(inputs), self.weights, self.bias, self._rectified, outputs)
        return outputs


class Scorer:
    """Scores of options by two layers over a hidden layer and each option."""

    def __init__(self, hidden: Dense, option: Dense, last: Any) -> None:
        """Prepares the layers.

        Args:
            hidden: part of the first layer over the hidden layer, with the bias.
            option: part over the option, without.
            last: second layer of torch, with one output.
        """
        self._hidden, self._option = hidden, option
        self._last, self._bias = numbers_of(last.weight[0]), np.float32(last.bias[0].item())

    def __call__(self, hidden: Floats, options: Floats, counts: Integers) -> Floats:
        """Returns the scores (b, k) of options (b, k, n), of which there are (b,); `MISSING` for others."""
        scores = np.full(options.shape[:2], MISSING, dtype=np.float32)
        if counts.any():
            own, layer = self._hidden(hidden), np.empty_like(self._last)
            _write_scores(own, options, counts, self._option.weights, self._last, self._bias, scores, layer)
        return scores


class HiddenLayers:
    """Two hidden layers over a state and the words of the latest utterance."""

    def __init__(self, network: RoleNetwork, layers: nn.Sequential) -> None:
        """Copies the parameters of `hidden_layers` and of the embedded words."""
        self._words = numbers_of(network.words.weight)
        self._layers = [Dense(layer, rectified=True) for layer in layers if hasattr(layer, "weight")]

    def __call__(self, batch: InputBatch) -> Floats:
        """Returns the hidden layer (b, h)."""
        first = self._layers[0]
        inputs = np.empty((len(batch.state), len(first.weights)), dtype=np.float32)
        width = batch.state.shape[1]
        inputs[:, :width] = batch.state
        words = np.empty((len(batch.words), self._words.shape[1]), dtype=np.float32)
        _write_means(batch.words, self._words, words)
        inputs[:, width:] = words
        for layer in self._layers:
            inputs = layer(inputs)
        return inputs


class FollowingRemark:
    """Scores of the remark after another one."""

    def __init__(self, remarks: nn.Embedding, layers: nn.Sequential) -> None:
        """Copies the parameters of `following_remark` and of the embedded remarks."""
        self._remarks = numbers_of(remarks.weight)
        self._layers = Dense(layers[0], rectified=True), Dense(layers[2])

    def __call__(self, hidden: Floats, before: Sequence[int]) -> Floats:
        """Returns the logits (b, r) for hidden layers (b, h) and remarks before (b,)."""
        inputs = np.concatenate([hidden, self._remarks[list(before)]], axis=1)
        for layer in self._layers:
            inputs = layer(inputs)
        return inputs


def numbers_of(parameters: Any) -> Floats:
    """Returns a copy of parameters of torch in single precision."""
    return np.array(parameters.detach().numpy(), dtype=np.float32, order="C")


def shares_of(scores: Floats, temperature: float) -> NDArray[np.float64]:
    """Returns the probabilities of remarks (..., r) at a temperature, from logits (..., r)."""
    logits = scores.astype(np.float64) / temperature
    weights: NDArray[np.float64] = pn.exp(logits - logits.max(axis=-1, keepdims=True))
    shares: NDArray[np.float64] = weights / weights.sum(axis=-1, keepdims=True)
    return shares
