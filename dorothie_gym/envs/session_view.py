"""`render()` of the environments: the aerial view of a session as an array or in a window."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.engine.session_engine import LiveSession

if TYPE_CHECKING:
    from dorothie_gym.engine.session_scene import SessionRenderer

RENDER_MODES: Final[tuple[str, ...]] = ("human", "rgb_array")
"""Render modes of the environments that play sessions."""

METADATA: Final[dict[str, object]] = {"render_modes": list(RENDER_MODES), "render_fps": 2}
"""Metadata of these environments for Gymnasium."""


class SessionView:
    """Draws sessions in one render mode; the renderer is created with the first frame.

    Args:
        render_mode: None, "human" or "rgb_array".
    """

    def __init__(self, render_mode: str | None) -> None:
        if render_mode not in (None, *RENDER_MODES):
            raise ValueError(f"render_mode is {render_mode!r}; it must be None or one of {', '.join(RENDER_MODES)}")
        self._mode = render_mode
        self._renderer: SessionRenderer | None = None

    def render(self, session: LiveSession) -> NDArray[np.uint8] | None:
        """Draws the aerial view: an array (800, 1280, 3), or in a window in human mode (then returns None)."""
        if self._mode is None:
            raise RuntimeError("render() needs render_mode='rgb_array' or 'human' when the environment is made")
        if self._renderer is None:
            # Imported here: pygame's fonts and surfaces are slow to import, and most sessions are never drawn.
            from dorothie_gym.engine.session_scene import SessionRenderer

            self._renderer = SessionRenderer(human=self._mode == "human")
        return self._renderer.draw(session)

    def close(self) -> None:
        """Closes the window, if there is one."""
        if self._renderer is not None:
            self._renderer.close()
            self._renderer = None
