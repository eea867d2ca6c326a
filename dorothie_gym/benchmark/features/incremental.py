"""Columns of a session in progress.

What no batch of a later point can show is dropped, so that the cost of a decision does not grow with the session. Looks
are perceived when columns are requested, each look once. The columns give the same batches as those that `extract`
makes of the whole session (tests/baselines/acting/test_parity.py).
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.benchmark.features.batch import HistorySizes
from dorothie_gym.benchmark.features.building import join
from dorothie_gym.benchmark.features.columns import Columns, TownGraph
from dorothie_gym.benchmark.features.extraction import (
    SessionColumns,
    TextPool,
    action_columns,
    frame_columns,
    goal_columns,
    place_columns,
    poses,
    utterance_columns,
)
from dorothie_gym.maps import Town
from dorothie_gym.ontology import PhysicalAction
from dorothie_gym.recording import (
    TRAJECTORY_DTYPE,
    ActionRecord,
    SceneTable,
    SessionHeader,
    Surroundings,
    Trajectory,
    UtteranceRecord,
)
from dorothie_gym.recording.recorded_perception import perceived
from dorothie_gym.recording.trajectory import FRAMES_PER_TENTH


@dataclass(eq=False)
class _Look:
    """Surroundings that were recorded at a frame.

    Attributes:
        frame: the frame.
        scene: one record in each table.
        row: row of the trajectory at the frame (1,).
        objects: kinds (k,) and values (k, 8) of the perceived objects; None until columns are requested.
    """

    frame: int
    scene: Surroundings
    row: Trajectory
    objects: tuple[NDArray[np.int64], NDArray[np.float64]] | None = None


@dataclass(frozen=True, eq=False, kw_only=True)
class IncrementalColumns:
    """Columns of a session in progress; every change returns a new object.

    Exact are batches of points at the newest tenth of a second or later.

    Attributes:
        header: streets, and the landmarks that the Co-Wizard knows.
        town: the map.
        sizes: how much of the history a batch shows; more is not kept.
        utterances: the last utterances of participant and Co-Wizard.
        actions: the last physical actions.
        trajectory: the last rows, ten a second; their speed is taken as it is.
        looks: the last records of the surroundings.
        switches: frames at which the head lights were switched, and whether on, as far as looks depend on them.
    """

    header: SessionHeader
    town: Town
    sizes: HistorySizes
    utterances: tuple[UtteranceRecord, ...] = ()
    actions: tuple[ActionRecord, ...] = ()
    trajectory: Trajectory
    looks: tuple[_Look, ...] = ()
    switches: tuple[tuple[int, bool], ...] = ()

    @classmethod
    def begin(cls, header: SessionHeader, town: Town, sizes: HistorySizes) -> Self:
        """Returns the columns of a session in which nothing has happened."""
        return cls(header=header, town=town, sizes=sizes, trajectory=np.empty(0, dtype=TRAJECTORY_DTYPE))

    def moved(self, rows: Trajectory, scene: Surroundings | None = None) -> Self:
        """Returns the columns with further rows of the trajectory.

        Args:
            rows: (n,) the next rows, at frames that are whole tenths of a second.
            scene: surroundings that were recorded at the last of these rows, one record in each table; None for none.
        """
        trajectory = np.concatenate((self.trajectory, rows))
        looks = self.looks
        if scene is not None:
            looks = (*looks, _Look(int(rows["frame"][-1]), scene, rows[-1:]))
        # Points are at the newest row at the earliest, which is then not visible itself.
        trajectory = trajectory[-(max(self.sizes.window, 1) * self.sizes.window_step + 1) :]
        if len(trajectory):
            looks = looks[_first_relevant((look.frame for look in looks), int(trajectory["frame"][0])) :]
        switches = self.switches
        if looks:
            switches = switches[_first_relevant((frame for frame, _ in switches), looks[0].frame) :]
        return replace(self, trajectory=trajectory, looks=looks, switches=switches)

    def said(self, utterance: UtteranceRecord) -> Self:
        """Returns the columns with an utterance, which was over no earlier than the last one."""
        return replace(self, utterances=self._visible_utterances((*self.utterances, utterance)))

    def corrected(self, utterance: UtteranceRecord) -> Self:
        """Returns the columns with an utterance in the place of the one of the same number."""
        utterances = (utterance if each.number == utterance.number else each for each in self.utterances)
        return replace(self, utterances=tuple(utterances))

    def acted(self, action: ActionRecord) -> Self:
        """Returns the columns with a physical action, which was no earlier than the last one.

        Head lights that are switched change what was perceived since.
        """
        actions = (*self.actions, action)
        past = [act.frame // FRAMES_PER_TENTH < action.frame // FRAMES_PER_TENTH for act in actions]
        found = replace(self, actions=actions[max(sum(past) - self.sizes.actions, 0) :])
        if action.action is not PhysicalAction.LIGHT_CHANGE:
            return found
        frame = action.frame - action.frame % FRAMES_PER_TENTH
        looks = (_Look(look.frame, look.scene, look.row) if look.frame >= frame else look for look in self.looks)
        return replace(found, switches=(*self.switches, (frame, bool(action.up))), looks=tuple(looks))

    def columns(self, graph: TownGraph) -> Columns:
        """Returns the columns as those of a corpus of one session.

        Args:
            graph: lane graph of the town.
        """
        texts, unlabelled = TextPool(), defaultdict[int, int](int)
        rows = self.trajectory
        self._perceive()
        looks = [(look.frame, *look.objects) for look in self.looks if look.objects is not None]
        arrays = {
            **place_columns(self.header, texts),
            **utterance_columns(self.utterances, texts, unlabelled),
            **action_columns(self.actions, unlabelled),
            **frame_columns(rows, poses(rows), rows["speed"], looks, known=True),
            **goal_columns((), ()),
            "sessions.has_objects": np.array([len(self.looks) > 0]),
        }
        part = SessionColumns(
            arrays=arrays, texts=tuple(texts.numbers), town=self.town.name, seed=-1, unpointed=(), signature="",
        )  # fmt: skip
        return join(part.signature, ["live"], [""], [part], [graph], [])

    def _perceive(self) -> None:
        """Fills in the objects of the looks that have none yet."""
        looks = [look for look in self.looks if look.objects is None]
        if not looks:
            return
        scene = Surroundings(
            actors=_joined([look.scene.actors for look in looks]),
            lights=_joined([look.scene.lights for look in looks]),
            weather=_joined([look.scene.weather for look in looks]),
        )
        rows = np.concatenate([look.row for look in looks])
        found = perceived(scene, poses(rows), rows["frame"], self.switches, self.town)
        for look, (_, kinds, values) in zip(looks, found, strict=True):
            look.objects = kinds, values

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


def _first_relevant(frames: Iterable[int], frame: int) -> int:
    """Returns the place of the last of some rising frames that is at a frame or before it; 0 where there is none."""
    return max(sum(each <= frame for each in frames) - 1, 0)


def _joined(tables: Sequence[SceneTable]) -> SceneTable:
    """Returns a table of the records of some tables (at least one), whose frames rise."""
    sizes = np.concatenate([np.diff(table.offsets) for table in tables])
    return SceneTable(
        frames=np.concatenate([table.frames for table in tables]),
        offsets=np.concatenate(([0], np.cumsum(sizes))),
        rows=np.concatenate([table.rows for table in tables]),
    )
