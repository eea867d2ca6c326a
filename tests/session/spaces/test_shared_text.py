"""Texts in shared memory: the tuple of their present values behaves as a plain tuple does."""

from __future__ import annotations

import copy
import json
import multiprocessing
import pickle
from typing import Any

import numpy as np
import pytest
from gymnasium import spaces
from gymnasium.vector.utils import batch_space, create_shared_memory, read_from_shared_memory, write_to_shared_memory

from dorothie_gym.session.spaces.fields import SharedText, text


@pytest.fixture
def space() -> SharedText:
    made = text("words", 12, meaning="words").space()
    assert isinstance(made, SharedText)
    return made


def shared(space: SharedText, *texts: str) -> tuple[Any, Any]:
    """Returns memory with texts, and what Gymnasium reads from it before they are written."""
    memory = create_shared_memory(space, n=len(texts), ctx=multiprocessing)
    seen: Any = read_from_shared_memory(space, memory, n=len(texts))
    assert tuple(seen) == ("",) * len(texts)
    for place, each in enumerate(texts):
        write_to_shared_memory(space, place, each, memory)
    return memory, seen


def test_texts_arrive_and_change(space: SharedText) -> None:
    memory, seen = shared(space, "turn left", "", "no, 12 \n")
    assert seen == ("turn left", "", "no, 12 \n")
    write_to_shared_memory(space, 0, "", memory)
    write_to_shared_memory(space, 1, "twelve chars", memory)
    assert seen == ("", "twelve chars", "no, 12 \n")
    assert seen in batch_space(space, 3)


def test_it_is_used_as_a_tuple_of_its_texts(space: SharedText) -> None:
    _, seen = shared(space, "left", "right")
    plain = ("left", "right")
    first, second = seen
    assert (
        (first, second) == plain == seen
        and (seen != plain) is False
        and seen != ("left",)
        and seen != ["left", "right"]
    )
    assert isinstance(seen, tuple) and len(seen) == 2 and seen[1] == "right" and seen[:1] == ("left",) and bool(seen)
    assert list(seen) == [*reversed(tuple(reversed(seen)))] == list(plain) and "left" in seen and "other" not in seen
    assert seen + ("on",) == plain + ("on",) and ("on",) + seen == ("on", *plain) and seen * 2 == 2 * seen == plain * 2
    assert (seen < ("lefu",), seen <= plain, seen > plain, seen >= plain) == (True, True, False, True)
    assert seen.index("right") == 1 and seen.count("left") == 1 and repr(seen) == repr(plain)
    assert "-".join(seen) == "left-right" and json.dumps(seen) == json.dumps(plain)
    assert np.array(seen).tolist() == list(plain) and str.format("{} {}", *seen) == "left right"
    with pytest.raises(TypeError, match="unhashable"):
        hash(seen)


@pytest.mark.parametrize("copied", [copy.deepcopy, copy.copy, lambda each: pickle.loads(pickle.dumps(each)), tuple])
def test_copies_are_plain_tuples(space: SharedText, copied: Any) -> None:
    memory, seen = shared(space, "left", "right")
    kept = copied(seen)
    write_to_shared_memory(space, 0, "back", memory)
    assert type(kept) is tuple and kept == ("left", "right") and seen == ("back", "right")


def test_a_text_that_is_too_long_is_refused(space: SharedText) -> None:
    memory, seen = shared(space, "left", "right")
    with pytest.raises(ValueError, match="has 13 characters, and its space at most 12"):
        write_to_shared_memory(space, 0, "thirteen char", memory)
    assert seen == ("left", "right")


def test_space_equals_and_samples_as_the_plain_one(space: SharedText) -> None:
    plain = spaces.Text(12, min_length=0, charset=space.characters)
    assert space == plain and plain == space and repr(space) == repr(plain)
    assert pickle.loads(pickle.dumps(space)) == space and isinstance(copy.deepcopy(space), SharedText)
