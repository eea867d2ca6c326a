"""`render()` of the environments: a session from above or through the windscreen, as an array or in a window."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, ClassVar, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from dorothie_gym import pictures  # lazy: most sessions are never drawn
from dorothie_gym.ontology.roles import Role
from dorothie_gym.session.config import RenderView, checked_view
from dorothie_gym.support.copying import CachedViews

if TYPE_CHECKING:
    from dorothie_gym.session.live_session import LiveSession
    from dorothie_gym.session.spaces.observations import Observation

RENDER_MODES: Final[tuple[str, ...]] = ("human", "rgb_array")
"""Render modes of the environments that play sessions."""

VIEWS: Final[tuple[str, ...]] = ("role", "session")
"""Views of the environments of one role: what the role observes, or the whole session."""


def metadata_at(decision_frequency: float) -> dict[str, object]:
    """Returns the metadata of these environments for Gymnasium; they render one frame per decision [Hz]."""
    rate = int(decision_frequency) if decision_frequency == int(decision_frequency) else decision_frequency
    return {"render_modes": list(RENDER_MODES), "render_fps": rate}


Notes: TypeAlias = tuple["pictures.RoleView | None", "list[pictures.SpokenLine]"]
"""Notes on a session for its pictures: what the role has seen, and what was said."""

METADATA: Final[dict[str, object]] = metadata_at(2.0)
"""Metadata of the environments with two decisions per second."""


class SessionView(CachedViews):
    """Draws sessions in one render mode; the renderer is created with the first frame.

    Args:
        render_mode: None, "human" or "rgb_array".
        frames_per_second: highest frame rate of the window [1/s].
        role: role whose observations are drawn; None draws the whole session.
        render_view: "map", "camera" or "both": see `RenderView`.

    Raises:
        ValueError: the render mode or view is unknown.
    """

    CACHED_VIEWS: ClassVar[Sequence[str]] = ("_renderer", "_camera", "_window")

    _renderer: pictures.SessionRenderer | None = None
    _camera: tuple[LiveSession, pictures.SessionCamera] | None = None
    _window: pictures.HumanWindow | None = None

    def __init__(
        self,
        render_mode: str | None,
        *,
        frames_per_second: float,
        role: Role | None = None,
        render_view: str = RenderView.MAP,
    ) -> None:
        if render_mode not in (None, *RENDER_MODES):
            raise ValueError(f"render_mode is {render_mode!r}; it must be None or one of {', '.join(RENDER_MODES)}")
        self._view = checked_view(render_view)
        self._mode, self._rate, self._role = render_mode, frames_per_second, role
        self._seen: pictures.RoleView | None = None
        self._heard: list[pictures.SpokenLine] = []

    @classmethod
    def of_role(
        cls, role: Role, view: str, render_mode: str | None, frames_per_second: float, render_view: str = RenderView.MAP
    ) -> SessionView:
        """Returns the view of an environment of one role; raises `ValueError` if `view` is not one of `VIEWS`."""
        if view not in VIEWS:
            raise ValueError(f"view is {view!r}; it must be one of {', '.join(VIEWS)}")
        seen = role if view == "role" else None
        return cls(render_mode, frames_per_second=frames_per_second, role=seen, render_view=render_view)

    def begin(self, session: LiveSession) -> None:
        """Begins a session; the notes of the previous one are dropped."""
        self._heard = []
        if self._mode is not None and self._role is not None:
            self._seen = pictures.RoleView(self._role, session.world.town)

    @property
    def notes(self) -> Notes:
        """Notes on the session, for a state of the environment."""
        return self._seen, self._heard

    def apply_values(self, notes: Notes, session: LiveSession) -> None:
        """Applies the notes of a state; a view that draws starts empty if the state has no notes for pictures."""
        self.begin(session)
        seen, heard = notes
        if self._seen is not None and seen is not None:
            self._seen = seen
        self._heard = heard

    def note(self, seen: Observation) -> None:
        """Records the role's observation at a decision."""
        if self._seen is not None:
            self._seen.note(seen)

    def note_instruction(self, time: float, text: str, acts: str) -> None:
        """Records an instruction of the participant that is not an utterance of the session; its time is in seconds."""
        if self._mode is None:
            return
        self._heard.append(pictures.SpokenLine(time=time, speaker=Role.PARTICIPANT, text=text, acts=acts))

    def render(self, session: LiveSession) -> NDArray[np.uint8] | None:
        """Draws the view: an array (800, 1280, 3), with a windscreen (720, 1280, 3); None in human mode."""
        if self._mode is None:
            raise RuntimeError("render() needs render_mode='rgb_array' or 'human' when the environment is made")
        if self._renderer is None:
            self._renderer = pictures.SessionRenderer(self._view)
        size = self._renderer.windscreen
        frame = self._renderer.draw(self._scene(session), None if size is None else self._windscreen(session, size))
        if self._mode != "human":
            return frame
        if self._window is None:
            height, width, _ = frame.shape
            self._window = pictures.HumanWindow((width, height), "dorothie_gym")
        self._window.show(frame, self._rate)
        return None

    def _windscreen(self, session: LiveSession, size: tuple[int, int]) -> NDArray[np.uint8] | None:
        """Returns the picture of a camera like the session's, but of this width and height [px]."""
        if self._camera is None or self._camera[0] is not session:
            self._camera = (
                session,
                pictures.windscreen_camera(session.world.town, session.scenario, session.config, size),
            )
        return self._camera[1].render(session.world).rgb

    def _scene(self, session: LiveSession) -> pictures.Scene:
        if self._seen is None:
            return pictures.scene_of(session, heard=self._heard)
        own = [line for line in pictures.utterances_of(session) if line.speaker is self._role]
        return self._seen.scene([*self._heard, *own])

    def close(self) -> None:
        """Closes the window, if there is one."""
        if self._window is not None:
            self._window.close()
            self._window = None
        self._renderer = self._camera = None
