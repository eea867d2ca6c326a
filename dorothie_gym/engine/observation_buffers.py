"""Sets of arrays that are handed out anew in every decision, most of them with what they held in the last one."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Self, TypeAlias

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

Shape: TypeAlias = tuple[int, ...]


class Sheet:
    """Arrays of fixed types and shapes in one block of memory.

    What is written into `form` is on every copy that is handed out from then on. A copy of the block costs what a copy
    of one array costs, and is its taker's own: nothing on it changes later.

    Attributes:
        form: the arrays that copies are made of, by name.
    """

    def __init__(self, fields: Mapping[str, tuple[Any, Shape]]) -> None:
        """Lays out arrays of zeros.

        Args:
            fields: type and shape of each array, by name.
        """
        self._layout = np.dtype([(name, kind, shape) for name, (kind, shape) in fields.items()], align=True)
        self._block: NDArray[np.uint8] = np.zeros(self._layout.itemsize, dtype=np.uint8)
        self._names = tuple(fields)
        self.form: dict[str, NDArray[Any]] = self._arrays(self._block)

    @classmethod
    def of_space(cls, space: spaces.Dict) -> Self:
        """One for all fields of a space that are arrays."""
        arrays = spaces.Box | spaces.MultiDiscrete | spaces.MultiBinary
        return cls({name: (f.dtype, f.shape) for name, f in space.spaces.items() if isinstance(f, arrays)})

    def copy(self) -> dict[str, Any]:
        """The arrays, by name: new ones that hold what the form holds."""
        return self._arrays(self._block.copy())

    def _arrays(self, block: NDArray[np.uint8]) -> dict[str, NDArray[Any]]:
        record = np.ndarray((), self._layout, block)
        return {name: record[name] for name in self._names}
