"""Messages of errors: one printable line, whatever a file has put into them."""

from __future__ import annotations

import pickle

import pytest

from dorothie_gym import errors
from dorothie_gym.errors import DorothieGymError, InputFileError, StoryboardError, TownError

STRANGE = "a\nb\r\nc\x1b[31m \udc80 \u2028 ü"

ARGUMENTS: dict[type[DorothieGymError], int] = {InputFileError: 2, StoryboardError: 3, TownError: 3}
"""Number of arguments, where it is not one."""

KINDS = [kind for kind in vars(errors).values() if isinstance(kind, type) and issubclass(kind, DorothieGymError)]


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
def test_message_is_one_printable_line(kind: type[DorothieGymError]) -> None:
    error = kind(*[STRANGE] * ARGUMENTS.get(kind, 1))
    assert str(error).isprintable() and "\\x1b[31m \\udc80" in str(error) and "ü" in str(error)
    assert str(error).split()[:3] in (["a", "b", "c\\x1b[31m"], ["storyboard", "a", "b"])


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
def test_message_survives_the_way_to_another_process(kind: type[DorothieGymError]) -> None:
    error = kind(*[STRANGE] * ARGUMENTS.get(kind, 1))
    copied = pickle.loads(pickle.dumps(error))
    assert type(copied) is kind and str(copied) == str(error)
