"""`render_mode="human"` without a display is one clear error."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import gymnasium as gym
import pytest

import dorothie_gym  # noqa: F401  # registers the environments
from dorothie_gym.support.libraries import pygame


@pytest.fixture
def no_display(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    for name in ("SDL_VIDEODRIVER", "DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    pygame.display.quit()
    yield
    pygame.display.quit()


@pytest.mark.usefixtures("no_display")
@pytest.mark.parametrize("name", ["CoWizard-v0", "Navigation-v0", "Town-v0"])
def test_a_window_without_a_display_is_refused_with_the_remedy(name: str) -> None:
    with pytest.raises(RuntimeError, match='no window can be opened .*use render_mode="rgb_array"'):
        shown(name)


def shown(name: str) -> None:
    """Makes an environment with a window, begins a session and draws it; `Town-v0` draws when it is made."""
    env: Any = gym.make(f"dorothie_gym/{name}", town="brookside", render_mode="human")
    env.reset(seed=0)
    env.render()
