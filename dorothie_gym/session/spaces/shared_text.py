"""Text space whose values reach `gymnasium.vector.AsyncVectorEnv` through shared memory.

`AsyncVectorEnv` reads its shared memory once, when it is made. Arrays are views on the memory; the texts of
`gymnasium.spaces.Text` are copies of its content at that time, and are never updated (Gymnasium 1.0 to 1.4). The
functions that this module registers for its own class return a tuple that reads the memory whenever it is used.
"""

from __future__ import annotations

import multiprocessing
from collections.abc import Iterator
from multiprocessing.sharedctypes import SynchronizedArray
from types import ModuleType
from typing import Any, SupportsIndex

import numpy as np
from gymnasium import spaces
from gymnasium.vector.utils import (
    batch_differing_spaces,
    create_shared_memory,
    read_from_shared_memory,
    write_to_shared_memory,
)
from numpy.typing import NDArray

from dorothie_gym.errors import short_repr


class SharedText(spaces.Text):
    """`gymnasium.spaces.Text` with values that `AsyncVectorEnv` sees in shared memory; equal to a `Text` of its values.

    A row of the memory has the length of the text, then the code points of its characters.
    """


class SharedTexts(tuple[str, ...]):
    """Texts of several environments in shared memory: a tuple of their present values.

    Like the arrays, it changes with the next step if `AsyncVectorEnv` was made with `copy=False`. Copies are
    plain tuples. The object itself is an empty tuple: code that ignored its methods would fail, not see old texts.
    """

    _rows: NDArray[np.int32]

    def __new__(cls, rows: NDArray[np.int32]) -> SharedTexts:
        """Returns a view on the rows of the memory (environments, 1 + greatest length)."""
        texts = super().__new__(cls)
        texts._rows = rows
        return texts

    def __iter__(self) -> Iterator[str]:
        return iter([_text_of(row) for row in self._rows])

    def __len__(self) -> int:
        return len(self._rows)

    def __getitem__(self, place: SupportsIndex | slice) -> Any:
        return tuple(self)[place]

    def __contains__(self, text: object) -> bool:
        return text in tuple(self)

    def __repr__(self) -> str:
        return repr(tuple(self))

    def __eq__(self, other: object) -> bool:
        return tuple(self) == (tuple(other) if isinstance(other, tuple) else other)

    def __ne__(self, other: object) -> bool:
        return not self == other

    __hash__ = None  # type: ignore[assignment]  # its value changes

    def __lt__(self, other: tuple[str, ...]) -> bool:
        return tuple(self) < tuple(other)

    def __le__(self, other: tuple[str, ...]) -> bool:
        return tuple(self) <= tuple(other)

    def __gt__(self, other: tuple[str, ...]) -> bool:
        return tuple(self) > tuple(other)

    def __ge__(self, other: tuple[str, ...]) -> bool:
        return tuple(self) >= tuple(other)

    def __add__(self, other: tuple[Any, ...]) -> tuple[Any, ...]:
        return tuple(self) + tuple(other)

    def __radd__(self, other: tuple[Any, ...]) -> tuple[Any, ...]:
        return other + tuple(self)

    def __mul__(self, times: SupportsIndex) -> tuple[str, ...]:
        return tuple(self) * times

    __rmul__ = __mul__

    def index(self, text: object, *bounds: SupportsIndex) -> int:
        """Returns the place of a text, as `tuple.index`."""
        return tuple(self).index(text, *bounds)

    def count(self, text: object) -> int:
        """Returns how many environments have a text."""
        return tuple(self).count(text)

    def __deepcopy__(self, memo: dict[int, object]) -> tuple[str, ...]:
        return tuple(self)

    def __reduce__(self) -> tuple[type, tuple[list[str]]]:
        return tuple, ([*self],)


def _text_of(row: NDArray[np.int32]) -> str:
    """Returns the text of a row of the memory."""
    return "".join(map(chr, row[1 : 1 + row[0]].tolist()))


def _rows_of(space: SharedText, memory: SynchronizedArray[int]) -> NDArray[np.int32]:
    """Returns the memory as rows (environments, 1 + greatest length)."""
    buffer: Any = memory.get_obj()  # typeshed does not know that ctypes arrays are buffers
    return np.frombuffer(buffer, dtype=np.int32).reshape(-1, 1 + space.max_length)


@create_shared_memory.register(SharedText)
def _create(space: SharedText, n: int = 1, ctx: ModuleType = multiprocessing) -> SynchronizedArray[int]:
    memory: SynchronizedArray[int] = ctx.Array(np.dtype(np.int32).char, n * (1 + space.max_length))
    return memory


@read_from_shared_memory.register(SharedText)
def _read(space: SharedText, shared_memory: SynchronizedArray[int], n: int = 1) -> SharedTexts:
    return SharedTexts(_rows_of(space, shared_memory))


@write_to_shared_memory.register(SharedText)
def _write(space: SharedText, index: int, value: str, shared_memory: SynchronizedArray[int]) -> None:
    if len(value) > space.max_length:
        raise ValueError(
            f"a text has {len(value)} characters, and its space at most {space.max_length}: {short_repr(value)}"
        )
    row = _rows_of(space, shared_memory)[index]
    row[1 : 1 + len(value)] = [*map(ord, value)]
    row[0] = len(value)


# looked up by the exact type of a space, not by its base classes
batch_differing_spaces.register(SharedText, batch_differing_spaces.dispatch(spaces.Text))
