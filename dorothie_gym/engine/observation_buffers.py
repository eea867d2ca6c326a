"""Buffers of arrays that are handed out as a fresh copy at every decision."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Self, TypeAlias

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

Shape: TypeAlias = tuple[int, ...]


class ObservationBuffer:
    """Arrays of fixed types and shapes in one block of memory.

    A copy of the block costs as much as the copy of one array. The caller owns the copy; later changes of the template
    do not reach it.

    Attributes:
        template: arrays that the next copies are made of, by name.
    """

    def __init__(self, fields: Mapping[str, tuple[Any, Shape]]) -> None:
        """Allocates arrays of zeros.

        Args:
            fields: type and shape of each array, by name.
        """
        self._layout = np.dtype([(name, kind, shape) for name, (kind, shape) in fields.items()], align=True)
        self._block: NDArray[np.uint8] = np.zeros(self._layout.itemsize, dtype=np.uint8)
        self._names = tuple(fields)
        self.template: dict[str, NDArray[Any]] = self._arrays(self._block)

    @classmethod
    def of_space(cls, space: spaces.Dict) -> Self:
        """Returns a buffer for all fields of a space that are arrays."""
        arrays = spaces.Box | spaces.MultiDiscrete | spaces.MultiBinary
        return cls({name: (f.dtype, f.shape) for name, f in space.spaces.items() if isinstance(f, arrays)})

    def copy(self) -> dict[str, Any]:
        """Returns a copy of the template: arrays by name."""
        return self._arrays(self._block.copy())

    def _arrays(self, block: NDArray[np.uint8]) -> dict[str, NDArray[Any]]:
        record = np.ndarray((), self._layout, block)
        return {name: record[name] for name in self._names}
