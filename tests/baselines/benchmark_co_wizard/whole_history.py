"""Reference of the incremental history: everything is kept, and extracted again as a recorded session."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np

from dorothie_gym.baselines.benchmark_co_wizard.observation_frames import header_of, observed_frame
from dorothie_gym.dialogue import Span
from dorothie_gym.evaluation.teacher_forced.features import Columns
from dorothie_gym.evaluation.teacher_forced.features.corpus_columns import join
from dorothie_gym.evaluation.teacher_forced.features.incremental import ObservedFrame
from dorothie_gym.evaluation.teacher_forced.features.session_columns import extract, town_graph
from dorothie_gym.maps import Town
from dorothie_gym.ontology import NAVIGATION_ACTIONS, ArgumentKind, Role
from dorothie_gym.policies.co_wizard.view import CoWizardView
from dorothie_gym.session.recording import (
    ACTOR_DTYPE,
    TRAJECTORY_DTYPE,
    WEATHER_DTYPE,
    Event,
    EventType,
    SceneTable,
    Session,
    SessionHeader,
    Surroundings,
    Trajectory,
)
from dorothie_gym.session.recording.surroundings import LIGHT_DTYPE
from dorothie_gym.session.recording.trajectory import FRAMES_PER_TENTH
from dorothie_gym.session.spaces import Physical
from dorothie_gym.sim.config import FRAME_RATE


@dataclass(frozen=True, eq=False, kw_only=True)
class WholeHistory:
    """History with the interface that `HistoryTracker` uses; nothing is dropped."""

    header: SessionHeader
    events: tuple[Event, ...] = ()
    frames: tuple[ObservedFrame, ...] = ()
    utterances: int = 0

    @classmethod
    def begin(cls, observation: Mapping[str, Any], town: Town) -> Self:
        return cls(header=header_of(observation, town))

    @property
    def newest(self) -> ObservedFrame | None:
        return self.frames[-1] if self.frames else None

    @property
    def frame(self) -> int:
        return self.frames[-1].frame

    def seen(self, view: CoWizardView, town: Town) -> Self:
        return replace(self, frames=(*self.frames, observed_frame(view, town)))

    def said(self, speaker: Role, spans: Sequence[Span], frame: int) -> Self:
        text = " ".join(span.text for span in spans)
        moves = (_move(speaker, self.utterances, text, span, frame) for span in spans)
        return replace(self, events=(*self.events, *moves), utterances=self.utterances + 1)

    def done(self, physical: Physical, frame: int) -> Self:
        return replace(self, events=(*self.events, _action(physical, frame)))

    def session(self) -> Session:
        """Returns the history as a session that was cut off."""
        return Session(
            header=self.header,
            events=self.events,
            trajectory=_trajectory(self.frames),
            complete=False,
            name="live",
            scene=_scene(self.frames),
        )

    def columns(self, town: Town) -> Columns:
        """Returns the features of the whole session; the speed is that of the speedometer."""
        session = self.session()
        part = extract(session, town)
        speeds = session.trajectory["speed"].astype(np.float32)
        part = replace(part, arrays={**part.arrays, "frames.speed": speeds})
        return join(part.signature, [session.name], [""], [part], [town_graph(town.name, town)], [])


def _move(speaker: Role, utterance: int, text: str, span: Span, frame: int) -> Event:
    data = {
        "utterance": utterance,
        "text": text,
        "span": span.text,
        "move": span.act.move.label,
        "slots": {label: list(values) for label, values in span.act.slot_labels().items()},
        "exchange": None,
        "start": frame / FRAME_RATE,
        "end": frame / FRAME_RATE,
    }
    return Event(frame=frame, type=EventType.DIALOGUE_MOVE, source=speaker, flagged=True, data=data)


def _action(physical: Physical, frame: int) -> Event:
    action = physical.action
    takes_angle = action.argument in (ArgumentKind.ANGLE, ArgumentKind.SIDE)
    takes_up = action.argument in (ArgumentKind.SPEED_STEP, ArgumentKind.SWITCH)
    data = {
        "action": action.label,
        "angle": physical.angle if takes_angle else None,
        "up": physical.up if takes_up else None,
    }
    flagged = action in NAVIGATION_ACTIONS
    return Event(frame=frame, type=EventType.PHYSICAL_ACTION, source=Role.CO_WIZARD, flagged=flagged, data=data)


def _trajectory(seen: Sequence[ObservedFrame]) -> Trajectory:
    """Returns rows at tenths of a second, interpolated over all observations at once."""
    frames = np.array([each.frame for each in seen])
    first = max(FRAMES_PER_TENTH, -(-int(frames[0]) // FRAMES_PER_TENTH) * FRAMES_PER_TENTH)
    rows = np.zeros(len(wanted := np.arange(first, frames[-1] + 1, FRAMES_PER_TENTH)), dtype=TRAJECTORY_DTYPE)
    rows["frame"] = wanted
    x, y, heading = np.array([each.pose for each in seen]).T
    columns = {"x": x, "y": y, "heading": np.unwrap(heading), "speed": [each.speed for each in seen]}
    for name, column in columns.items():
        rows[name] = np.interp(wanted, frames, column)
    rows["heading"] = (rows["heading"] + math.pi) % (2.0 * math.pi) - math.pi
    middles = (frames[1:] + frames[:-1]) / 2
    rows["lane"] = np.array([each.lane for each in seen])[np.searchsorted(middles, wanted)]
    return rows


def _scene(seen: Sequence[ObservedFrame]) -> Surroundings:
    """Returns the surroundings at the observations that have a row in the trajectory."""
    kept = [each for each in seen if each.frame >= FRAMES_PER_TENTH and each.frame % FRAMES_PER_TENTH == 0]
    frames = np.array([each.frame for each in kept], dtype=np.int64)

    def table(rows: list[Any], dtype: np.dtype[Any]) -> SceneTable:
        offsets = np.concatenate(([0], np.cumsum([len(part) for part in rows]))).astype(np.int64)
        return SceneTable(frames, offsets, np.concatenate([np.empty(0, dtype=dtype), *rows]))

    return Surroundings(
        actors=table([each.actors for each in kept], ACTOR_DTYPE),
        lights=table([each.lights for each in kept], LIGHT_DTYPE),
        weather=table([each.weather for each in kept], WEATHER_DTYPE),
    )
