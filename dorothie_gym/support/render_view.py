"""Views of a session in pictures and videos."""

from __future__ import annotations

from enum import StrEnum


class RenderView(StrEnum):
    """View of a session."""

    MAP = "map"
    """Map around the car, with tasks and talk (800, 1280, 3)."""
    CAMERA = "camera"
    """Picture of the camera behind the windscreen (720, 1280, 3)."""
    BOTH = "both"
    """Windscreen, subtitles, map and tasks (720, 1280, 3)."""


def checked_view(name: str) -> RenderView:
    """Returns the view of a name.

    Raises:
        ValueError: there is no such view; lists them.
    """
    if name not in [view.value for view in RenderView]:
        raise ValueError(f"render_view is {name!r}; it must be one of {', '.join(RenderView)}")
    return RenderView(name)
