"""Recorded actors that the pictures of the car's camera show."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from dorothie_gym.pictures.camera.recorded_pictures import RecordedPictures
from dorothie_gym.pictures.camera.visibility import PERCEPTION_CAMERA, is_body_seen
from dorothie_gym.session.recording.surroundings import SceneTable
from dorothie_gym.support import portable_math as pm

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town
    from dorothie_gym.session.recording.session import Session


def pictured_actors(session: Session, town: Town) -> SceneTable:
    """Returns the recorded actors that are seen in the pictures of `PERCEPTION_CAMERA`, which are drawn again.

    Records before the first frame of the car and after the last one keep no actors.

    Args:
        session: recorded session.
        town: its town.

    Raises:
        SessionError: the session has no frames of the car, or no surroundings.
    """
    pictures, table = RecordedPictures(session, town, PERCEPTION_CAMERA), session.scene.actors
    kept = np.zeros(len(table.rows), dtype=np.bool_)
    for k, frame in enumerate(table.frames.tolist()):
        rows = slice(int(table.offsets[k]), int(table.offsets[k + 1]))
        if pictures.first_frame <= frame <= pictures.last_frame and rows.start < rows.stop:
            kept[rows] = _are_seen(pictures, frame, rows)
    before = np.concatenate(([0], np.cumsum(kept)))
    return SceneTable(table.frames, before[table.offsets].astype(np.int64), table.rows[kept])


def _are_seen(pictures: RecordedPictures, frame: int, rows: slice) -> list[bool]:
    """Returns whether each actor of a record is seen."""
    boxes, pose, visibility = pictures.picture(frame).bodies, pictures.pose(frame), pictures.visibility(frame)
    pixels = dict(zip(boxes.keys.tolist(), boxes.pixels.tolist(), strict=True))
    actors = pictures.actors[rows]
    return [
        is_body_seen(pixels.get(key, 0), visibility.gain(pm.hypot(x - pose.x, y - pose.y)))
        for key, x, y in zip(pictures.keys[rows].tolist(), actors["x"].tolist(), actors["y"].tolist(), strict=True)
    ]
