"""Tuples of arrays that compiled functions take by address."""

from typing import NamedTuple

import numba
import numpy as np
import pytest
from numpy.typing import NDArray

from dorothie_gym.support.compilation import compiled
from dorothie_gym.support.compilation.records import by_reference, gives_row


@by_reference
class Shelf(NamedTuple):
    books: NDArray[np.int64]
    prices: NDArray[np.float64]
    open: bool
    height: float


@compiled
def change(shelf: Shelf, k: int) -> float:
    shelf.books[k] += 1
    total = 0.0
    for row in range(shelf.prices.shape[0]):
        for column in range(shelf.prices.shape[1]):
            total += shelf.prices[row, column]
    return total * shelf.height if shelf.open else -1.0


@compiled
def change_twice(shelf: Shelf, k: int) -> float:
    return change(shelf, k) + change(shelf, k)


def shelf(books=4, *, opened=True):
    return Shelf(np.arange(books), np.arange(6.0).reshape(2, 3), opened, 0.5)


def test_compiled_code_reads_and_writes_the_arrays():
    mine = shelf()
    assert change_twice(mine, 2) == 15.0
    assert mine.books.tolist() == [0, 1, 4, 3]
    assert change(shelf(opened=False), 0) == -1.0


def test_arrays_may_have_other_lengths_in_the_next_call():
    for books in (1, 7, 3):
        mine = shelf(books)
        change(mine, books - 1)
        assert mine.books[-1] == books


def test_array_that_is_not_contiguous_is_refused():
    with pytest.raises(TypeError, match=r"Shelf\.books"):
        change(Shelf(np.arange(8)[::2], np.zeros((2, 3)), True, 1.0), 0)


@by_reference
class Row(NamedTuple):
    values: NDArray[np.float64]


@gives_row
def row_of(rows: Row, number: int) -> Row:
    return Row(rows.values[number])


@compiled
def add_to_rows(rows: Row) -> None:
    for number in range(len(rows.values)):
        row = row_of(rows, number)
        for k in range(len(row.values)):
            row.values[k] += 10.0 * number


def test_rows_of_stacked_arrays_are_views():
    stacked = Row(np.zeros((3, 2)))
    add_to_rows(stacked)
    assert stacked.values.tolist() == [[0.0, 0.0], [10.0, 10.0], [20.0, 20.0]]


@numba.njit
def change_by_numba(shelf: Shelf, k: int) -> float:
    return max(change_twice(shelf, k), 0.0)


def test_function_that_numba_compiles_itself_may_call_compiled_ones():
    mine = shelf()
    assert change_by_numba(mine, 2) == 15.0
    assert mine.books.tolist() == [0, 1, 4, 3]
