from __future__ import annotations

import sys
from pathlib import Path

import pytest

from dorothie_gym.user_cache import CACHE_VARIABLE, cache_folder


@pytest.mark.skipif(sys.platform != "linux", reason="folders of the Linux desktop standard")
@pytest.mark.parametrize(
    ("variables", "expected"),
    [
        ({"XDG_CACHE_HOME": "/elsewhere"}, "/elsewhere/dorothie_gym"),
        ({"XDG_CACHE_HOME": "not/absolute"}, "/home/me/.cache/dorothie_gym"),
        ({}, "/home/me/.cache/dorothie_gym"),
        ({CACHE_VARIABLE: "/mine", "XDG_CACHE_HOME": "/elsewhere"}, "/mine"),
        ({CACHE_VARIABLE: "~/mine"}, "/home/me/mine"),
    ],
)
def test_the_cache_folder_follows_the_variable_and_the_desktop_standard(
    monkeypatch: pytest.MonkeyPatch, variables: dict[str, str], expected: str
) -> None:
    for name in (CACHE_VARIABLE, "XDG_CACHE_HOME"):
        monkeypatch.delenv(name, raising=False)
    for name, value in {"HOME": "/home/me", **variables}.items():
        monkeypatch.setenv(name, value)
    assert cache_folder() == Path(expected)


def test_an_empty_variable_turns_the_cache_off(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(CACHE_VARIABLE, "")
    assert cache_folder() is None
