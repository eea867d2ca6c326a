"""Columns of a session in progress.

Observations are kept as they are and encoded when columns are requested; data that no batch of a later point can
contain are dropped, so that the cost of a decision does not grow with the session. The columns give the same batches as
those that `extract` makes of the whole session (tests/baselines/benchmark_co_wizard/test_parity.py).
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Final, Self

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.archive.recorded_perception import perceived
from dorothie_gym.evaluation.teacher_forced.features.batch import HistorySizes
from dorothie_gym.evaluation.teacher_forced.features.corpus_columns import join
from dorothie_gym.evaluation.teacher_forced.features.session_columns import (
    SessionColumns,
    TextPool,
    action_columns,
    frame_columns,
    goal_columns,
    place_columns,
    poses,
    utterance_columns,
)
from dorothie_gym.maps.town import Town
from dorothie_gym.ontology.actions import PhysicalAction
from dorothie_gym.session.recording.events import ActionRecord, UtteranceRecord
from dorothie_gym.session.recording.header import SessionHeader
from dorothie_gym.session.recording.surroundings import Rows, SceneTable, Surroundings
from dorothie_gym.session.recording.trajectory import FRAMES_PER_TENTH, TRAJECTORY_DTYPE, Trajectory

if TYPE_CHECKING:
    from dorothie_gym.evaluation.teacher_forced.features.columns import Columns, TownGraph

_FULL_TURN: Final = 2.0 * math.pi


@dataclass(frozen=True, eq=False, kw_only=True)
class ObservedFrame:
    """State of the car and its surroundings in one observation.

    Attributes:
        frame: frame of the physics (30 Hz).
        pose: estimated x, y [m] and heading [rad, clockwise].
        speed: measured speed [m/s].
        lane: estimated lane of the car.
        actors: perceived actors, rows of `ACTOR_DTYPE`.
        lights: states of all traffic lights of the town, rows of `LIGHT_DTYPE`; `recorded_perception` selects the
            visible ones.
        weather: row of `WEATHER_DTYPE`.
    """

    frame: int
    pose: tuple[float, float, float]
    speed: float
    lane: int
    actors: Rows
    lights: Rows
    weather: Rows

    @property
    def has_look(self) -> bool:
        """Returns whether a recording has the surroundings at this frame: it is a whole tenth of a second, not 0."""
        return self.frame >= FRAMES_PER_TENTH and self.frame % FRAMES_PER_TENTH == 0


@dataclass(frozen=True, eq=False, kw_only=True)
class FrameWindow:
    """Last observed frames of a session; every change returns a new object.

    Attributes:
        town: the map.
        tenths: length of the window that a batch shows [0.1 s]; older frames are dropped.
        frames: observed frames, oldest first.
        switches: frames at which the headlights were switched, and whether on; only those on which perceptions depend.
    """

    town: Town
    tenths: int
    frames: tuple[ObservedFrame, ...] = ()
    switches: tuple[tuple[int, bool], ...] = ()

    def observed(self, new: ObservedFrame) -> Self:
        """Returns the window with a further frame.

        The first row of a point at the newest tenth shows the last look before it, and is interpolated from the frame
        before that look.
        """
        frames, switches = (*self.frames, new), self.switches
        first = new.frame - new.frame % FRAMES_PER_TENTH - FRAMES_PER_TENTH * self.tenths
        if frames[0].frame < first:
            look = max((k for k, each in enumerate(frames) if each.has_look and each.frame <= first), default=1)
            frames = frames[max(look - 1, 0) :]
        if len(switches) > 1:
            past = sum(frame <= frames[0].frame for frame, _ in switches)
            switches = switches[max(past - 1, 0) :]
        return replace(self, frames=frames, switches=switches)

    def switched(self, frame: int, on: bool) -> Self:
        """Returns the window with headlights that were switched at a frame; all looks since are perceived again."""
        return replace(self, switches=(*self.switches, (frame - frame % FRAMES_PER_TENTH, on)))

    @cached_property
    def arrays(self) -> dict[str, NDArray[np.generic]]:
        """Columns of frames, looks and objects by "group.field"."""
        rows = trajectory_at_tenths(self.frames)
        pose = poses(rows)
        looks = [each for each in self.frames if each.has_look]
        found = tuple(perceived(_surroundings(looks), pose, rows["frame"], self.switches, self.town)) if looks else ()
        return {
            **frame_columns(rows, pose, rows["speed"], found, known=True),
            "sessions.has_objects": np.array([len(looks) > 0]),
        }


@dataclass(frozen=True, eq=False, kw_only=True)
class IncrementalColumns:
    """Columns of a session in progress; every change returns a new object.

    Exact are batches of points at the newest tenth of a second or later.

    Attributes:
        header: streets, and the landmarks that the Co-Wizard knows.
        sizes: extent of the history in a batch; the rest is dropped.
        window: the last observed frames.
        utterances: the last utterances of participant and Co-Wizard.
        actions: the last physical actions.
        places: columns of streets and landmarks, which do not change.
        place_texts: their texts.
    """

    header: SessionHeader
    sizes: HistorySizes
    window: FrameWindow
    utterances: tuple[UtteranceRecord, ...] = ()
    actions: tuple[ActionRecord, ...] = ()
    places: dict[str, NDArray[np.generic]] = field(default_factory=dict)
    place_texts: tuple[str, ...] = ()

    @classmethod
    def begin(cls, header: SessionHeader, town: Town, sizes: HistorySizes) -> Self:
        """Returns the columns of a session in which nothing has happened."""
        texts = TextPool()
        places = place_columns(header, texts)
        window = FrameWindow(town=town, tenths=max(sizes.window, 1) * sizes.window_step)
        return cls(header=header, sizes=sizes, window=window, places=places, place_texts=tuple(texts.numbers))

    def observed(self, frame: ObservedFrame) -> Self:
        """Returns the columns with a further observation."""
        return replace(self, window=self.window.observed(frame))

    def said(self, utterance: UtteranceRecord) -> Self:
        """Returns the columns with an utterance, which ended no earlier than the last one."""
        return replace(self, utterances=self._visible_utterances((*self.utterances, utterance)))

    def corrected(self, utterance: UtteranceRecord) -> Self:
        """Returns the columns with an utterance in the place of the one of the same number."""
        utterances = (utterance if each.number == utterance.number else each for each in self.utterances)
        return replace(self, utterances=tuple(utterances))

    def acted(self, action: ActionRecord) -> Self:
        """Returns the columns with a physical action, which was no earlier than the last one."""
        actions = (*self.actions, action)
        past = [act.frame // FRAMES_PER_TENTH < action.frame // FRAMES_PER_TENTH for act in actions]
        window = self.window
        if action.action is PhysicalAction.LIGHT_CHANGE:
            window = window.switched(action.frame, bool(action.up))
        return replace(self, actions=actions[max(sum(past) - self.sizes.actions, 0) :], window=window)

    def columns(self, graph: TownGraph) -> Columns:
        """Returns the columns as those of a corpus of one session.

        Args:
            graph: lane graph of the town.
        """
        texts, unlabelled = TextPool(self.place_texts), defaultdict[int, int](int)
        arrays = {
            **self.places,
            **utterance_columns(self.utterances, texts, unlabelled),
            **action_columns(self.actions, unlabelled),
            **self.window.arrays,
            **goal_columns((), ()),
        }
        part = SessionColumns(
            arrays=arrays, texts=tuple(texts.numbers), town=self.window.town.name, seed=-1, unpointed=(), signature=""
        )
        return join(part.signature, ["live"], [""], [part], [graph], [])

    def _visible_utterances(self, utterances: tuple[UtteranceRecord, ...]) -> tuple[UtteranceRecord, ...]:
        """Drops utterances that no point at the last one's tenth or later can show."""
        now = utterances[-1].moves[-1].frame // FRAMES_PER_TENTH
        shown = moves = 0
        for k in range(len(utterances) - 1, -1, -1):
            if shown >= self.sizes.utterances and moves >= self.sizes.moves:
                return utterances[k + 1 :]
            if utterances[k].moves[-1].frame // FRAMES_PER_TENTH < now:
                shown, moves = shown + 1, moves + len(utterances[k].moves)
        return utterances


def trajectory_at_tenths(frames: Sequence[ObservedFrame]) -> Trajectory:
    """Returns the rows of the trajectory between the first and the last of the given frames, ten a second.

    Positions and speeds are interpolated; the lane is that of the nearer frame. As in a recording, nothing precedes the
    first tenth of a second.
    """
    if not frames:
        return np.empty(0, dtype=TRAJECTORY_DTYPE)
    known = np.array([each.frame for each in frames])
    first = max(FRAMES_PER_TENTH, -(-int(known[0]) // FRAMES_PER_TENTH) * FRAMES_PER_TENTH)
    rows = np.zeros(len(wanted := np.arange(first, known[-1] + 1, FRAMES_PER_TENTH)), dtype=TRAJECTORY_DTYPE)
    rows["frame"] = wanted
    x, y, heading = np.array([each.pose for each in frames]).T
    for name, column in (("x", x), ("y", y), ("speed", [each.speed for each in frames])):
        rows[name] = np.interp(wanted, known, column)
    rows["heading"] = (_headings(wanted, known, heading) + math.pi) % _FULL_TURN - math.pi
    middles = (known[1:] + known[:-1]) / 2
    rows["lane"] = np.array([each.lane for each in frames])[np.searchsorted(middles, wanted)]
    return rows


def _headings(wanted: NDArray[np.int64], known: NDArray[np.int64], heading: NDArray[np.float64]) -> NDArray[np.float64]:
    """Interpolates headings on the circle, each from the two frames around it alone (m,) [rad].

    Unwrapping the whole window would make the last digits depend on the frames that are still kept.
    """
    if len(known) == 1:
        return np.full(len(wanted), heading[0])
    turned = np.unwrap(np.stack((heading[:-1], heading[1:])), axis=0)  # (2, n - 1)
    segment = np.maximum(np.searchsorted(known, wanted) - 1, 0)
    before, after = turned[:, segment]
    slope = (after - before) / (known[segment + 1] - known[segment])
    found: NDArray[np.float64] = slope * (wanted - known[segment]) + before
    return np.where(wanted == known[segment + 1], after, found)


def _surroundings(looks: Sequence[ObservedFrame]) -> Surroundings:
    """Returns the surroundings at the given frames (at least one) as they are recorded."""
    frames = np.array([each.frame for each in looks], dtype=np.int64)

    def table(rows: Sequence[Rows]) -> SceneTable:
        offsets = np.concatenate(([0], np.cumsum([len(part) for part in rows]))).astype(np.int64)
        # much faster than np.concatenate, which compares the fields of every two parts
        joined = np.frombuffer(b"".join([part.tobytes() for part in rows]), dtype=rows[0].dtype)
        return SceneTable(frames, offsets, joined)

    return Surroundings(
        actors=table([each.actors for each in looks]),
        lights=table([each.lights for each in looks]),
        weather=table([each.weather for each in looks]),
    )
