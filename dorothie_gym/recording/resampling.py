"""Recordings as a file of 10 Hz has them: what is found in them does not depend on the layout then."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from dorothie_gym.recording.sdn.trajectory import scene_at
from dorothie_gym.recording.session import Session
from dorothie_gym.recording.surroundings import Scene
from dorothie_gym.sim.config import FRAME_RATE

EACH: Final = FRAME_RATE // 10
"""Frames of a recording in a tenth of a second, the benchmark's frame."""


def at_tenths(session: Session) -> Session:
    """Returns a session as a recording at 10 Hz has it: events of a tenth stand at its beginning, frames between go."""
    trajectory = session.trajectory[session.trajectory["frame"] % EACH == 0]
    return replace(
        session,
        events=tuple(replace(event, frame=event.frame - event.frame % EACH) for event in session.events),
        trajectory=trajectory,
        scene=scene_at(session.scene, trajectory) if len(trajectory) else Scene(),
    )
