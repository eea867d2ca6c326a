"""Recorded actors at any frame: linked from record to record by their keys, and interpolated between records."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.session.recording.surroundings import ACTOR_DTYPE, Rows, SceneTable
from dorothie_gym.sim.config import FRAME_RATE
from dorothie_gym.support import portable_arrays as pn
from dorothie_gym.support.portable_math import wrap_radians


class Moment(NamedTuple):
    """Actors at a frame.

    Attributes:
        rows: (n,) row of each actor in the last record at or before the frame.
        after: (n,) its row in the next record, or the same one if it has none.
        share: elapsed share of the time between the two records; negative before the first record.
        seconds: time since the first of the two; negative before the first record [s].
    """

    rows: NDArray[np.int64]
    after: NDArray[np.int64]
    share: float
    seconds: float


class ActorTracks:
    """Tracks of the actors of a session.

    Attributes:
        table: recorded actors, rows of `ACTOR_DTYPE`.
        before: (m,) row of the same actor in the previous record, -1 for none.
        after: (m,) row of the same actor in the next record, -1 for none.
        times: (m,) time of each row [s].
    """

    def __init__(self, table: SceneTable) -> None:
        self.table = table
        count, sizes = len(table.rows), np.diff(table.offsets)
        record = np.repeat(np.arange(len(table)), sizes)
        self.times = np.repeat(table.frames, sizes) / FRAME_RATE
        self.before = np.full(count, -1, dtype=np.int64)
        self.after = np.full(count, -1, dtype=np.int64)
        order = np.lexsort((record, table.rows["key"]))
        keys, records = table.rows["key"][order], record[order]
        linked = np.flatnonzero((keys[1:] == keys[:-1]) & (records[1:] == records[:-1] + 1))
        self.after[order[linked]], self.before[order[linked + 1]] = order[linked + 1], order[linked]

    def at(self, frame: int) -> Moment:
        """Returns the actors at a frame; before the first record those of the first."""
        table = self.table
        if not len(table):
            nothing = np.zeros(0, dtype=np.int64)
            return Moment(nothing, nothing, 0.0, 0.0)
        k = max(int(np.searchsorted(table.frames, frame, side="right")) - 1, 0)
        rows = np.arange(table.offsets[k], table.offsets[k + 1])
        since, share = frame - int(table.frames[k]), 0.0
        if k + 1 < len(table):
            share = since / int(table.frames[k + 1] - table.frames[k])
        after = self.after[rows]
        return Moment(rows, np.where(after >= 0, after, rows), share, since / FRAME_RATE)

    def actors(self, moment: Moment) -> Rows:
        """Returns the actors at a time (n,), interpolated linearly; before the first record, along their headings.

        Kinds and sizes are those of the earlier record.
        """
        here, there = self.table.rows[moment.rows], self.table.rows[moment.after]
        found = np.array(here, dtype=ACTOR_DTYPE)
        if moment.share < 0.0:
            for name, part in (("x", pn.cos(here["heading"])), ("y", pn.sin(here["heading"]))):
                found[name] += moment.seconds * here["speed"] * part
            return found
        for name in ("x", "y", "speed"):
            found[name] += moment.share * (there[name] - here[name])
        found["heading"] += moment.share * wrap_radians(there["heading"] - here["heading"])
        return found
