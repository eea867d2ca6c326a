"""History of a session as the Co-Wizard knows it, encoded step by step for a benchmark model."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final, Self

from dorothie_gym.baselines.benchmark_co_wizard.observation_frames import header_of, observed_frame
from dorothie_gym.dialogue.conversation import Span, speech_seconds
from dorothie_gym.evaluation.teacher_forced.features.incremental import IncrementalColumns, ObservedFrame
from dorothie_gym.ontology.actions import NAVIGATION_ACTIONS, ArgumentKind, PhysicalAction
from dorothie_gym.ontology.roles import Role
from dorothie_gym.ontology.slots import Slot
from dorothie_gym.policies.co_wizard.view import CoWizardView
from dorothie_gym.session.recording.events import ActionRecord, MoveRecord, UtteranceRecord
from dorothie_gym.session.spaces.actions import Physical, Speech
from dorothie_gym.sim.config import FRAME_RATE
from dorothie_gym.sim.state.codes import Motion

if TYPE_CHECKING:
    from dorothie_gym.evaluation.teacher_forced.features.batch import HistorySizes
    from dorothie_gym.maps.town import Town
    from dorothie_gym.session.spaces.observations import ObservationMapping

_TAKES_ANGLE = (ArgumentKind.ANGLE, ArgumentKind.SIDE)
_TAKES_UP = (ArgumentKind.SPEED_STEP, ArgumentKind.SWITCH)


@dataclass(frozen=True, eq=False, kw_only=True)
class History:
    """Observations, utterances and actions of a Co-Wizard; every change returns a new object.

    Attributes:
        encoded: the part of them that inputs of a benchmark model may still contain, as columns.
        events: number of dialogue moves and physical actions so far.
        utterances: number of utterances so far.
        landmark: label of the landmark that was named last, by either speaker.
        named_before: the same in utterances that are no longer kept.
    """

    encoded: IncrementalColumns
    events: int = 0
    utterances: int = 0
    landmark: str | None = None
    named_before: str | None = None

    @classmethod
    def begin(cls, observation: ObservationMapping, town: Town, sizes: HistorySizes) -> Self:
        """Returns an empty history.

        Args:
            observation: first observation of the session: it has the streets and landmarks.
            town: the map.
            sizes: extent of the history in the inputs of the model.
        """
        return cls(encoded=IncrementalColumns.begin(header_of(observation, town), town, sizes))

    @property
    def newest(self) -> ObservedFrame | None:
        """The last observation; None before the first."""
        frames = self.encoded.window.frames
        return frames[-1] if frames else None

    @property
    def frame(self) -> int:
        """Frame of the last observation; there must be one."""
        return self.encoded.window.frames[-1].frame

    def seen(self, view: CoWizardView, town: Town) -> Self:
        """Returns the history with an observation."""
        return replace(self, encoded=self.encoded.observed(observed_frame(view, town)))

    def said(self, speaker: Role, spans: Sequence[Span], frame: int) -> Self:
        """Returns the history with an utterance that ended at a frame."""
        text = " ".join(span.text for span in spans)
        record = UtteranceRecord(
            number=self.utterances, speaker=speaker, text=text, start=frame / FRAME_RATE, end=frame / FRAME_RATE,
            moves=tuple(
                MoveRecord(
                    index=self.events + k, frame=frame, speaker=speaker, utterance=self.utterances, text=text,
                    span=span.text, act=span.act, exchange=None, start=frame / FRAME_RATE, end=frame / FRAME_RATE,
                    flagged=True,
                )
                for k, span in enumerate(spans)
            ),
        )  # fmt: skip
        encoded = self.encoded.said(record)
        dropped = (*self.encoded.utterances, record)[: -len(encoded.utterances)]
        return replace(
            self,
            encoded=encoded,
            events=self.events + len(spans),
            utterances=self.utterances + 1,
            landmark=_last_landmark((record,)) or self.landmark,
            named_before=_last_landmark(dropped) or self.named_before,
        )

    def corrected(self, spans: Sequence[Span]) -> Self:
        """Returns the history with other acts for the participant's last utterance, which keeps its words."""
        last = next(each for each in reversed(self.encoded.utterances) if each.speaker is Role.PARTICIPANT)
        moves = tuple(replace(move, span=span.text, act=span.act) for move, span in zip(last.moves, spans, strict=True))
        encoded = self.encoded.corrected(replace(last, moves=moves))
        return replace(self, encoded=encoded, landmark=_last_landmark(encoded.utterances) or self.named_before)

    def done(self, physical: Physical, frame: int) -> Self:
        """Returns the history with a physical action that was carried out at a frame."""
        action = physical.action
        record = ActionRecord(
            index=self.events,
            frame=frame,
            source=Role.CO_WIZARD,
            action=action,
            angle=physical.angle if action.argument in _TAKES_ANGLE else None,
            up=physical.up if action.argument in _TAKES_UP else None,
            flagged=action in NAVIGATION_ACTIONS,
        )
        return replace(self, encoded=self.encoded.acted(record), events=self.events + 1)


def _last_landmark(utterances: Sequence[UtteranceRecord]) -> str | None:
    """Returns the label of the landmark that was last named in utterances, None if there is none."""
    moves = (move for utterance in reversed(utterances) for move in reversed(utterance.moves))
    named = (move.act.slot_labels().get(Slot.LANDMARK.label) for move in moves)
    return next((labels[-1] for labels in named if labels), None)


# --- Effects of the Co-Wizard's own utterances and actions, inferred from its observations ---------------------------

_PERIOD_TOLERANCE: Final = 1e-6
"""Rounding tolerance of sums of decision periods [periods]."""


@dataclass(frozen=True, eq=False, kw_only=True)
class HistoryTracker:
    """History with the pending utterance and action; every change returns a new object.

    Attributes:
        history: completed utterances and actions.
        air: spans of the Co-Wizard's utterance in progress.
        began: start of that utterance [s].
        tried: physical action of the last decision, None if there is none.
        before: observation of the last decision; None at first.
    """

    history: History
    air: tuple[Span, ...] = ()
    began: float = 0.0
    tried: Physical | None = None
    before: CoWizardView | None = None

    def acted(self, speech: Speech | None, physical: Physical | None, view: CoWizardView, most_spans: int) -> Self:
        """Returns the tracker with a decision.

        Args:
            speech: the utterance, with its words.
            physical: the physical action.
            view: observation on which the decision was based.
            most_spans: maximum number of acts in an utterance; further ones are refused.
        """
        air, began = self.air, self.began
        if speech is not None and len(air) < most_spans:
            began = began if air else view.time
            air = (*air, Span(speech.text, speech.act))
        return replace(self, air=air, began=began, tried=physical, before=view)

    def observed(self, view: CoWizardView, town: Town, heard: tuple[Span, ...]) -> Self:
        """Returns the tracker with the next observation.

        Args:
            view: the observation.
            town: the map.
            heard: spans of the participant's utterance that has ended, empty if there is none.
        """
        history = self.history
        if self.tried is not None and self.before is not None and carried_out(self.tried, self.before, view):
            history = history.done(self.tried, history.frame)
        period = view.time - history.frame / FRAME_RATE if history.newest else 1.0
        history = history.seen(view, town)
        over = self.air if self.air and view.speaking == 0.0 else ()
        spoken = [(_start(heard, view.time, period), Role.PARTICIPANT, heard), (self.began, Role.CO_WIZARD, over)]
        for _, speaker, spans in sorted(spoken, key=lambda each: each[0]):
            if spans:
                history = history.said(speaker, spans, history.frame)
        return replace(self, history=history, air=() if over else self.air, tried=None, before=None)


def carried_out(tried: Physical, before: CoWizardView, after: CoWizardView) -> bool:
    """Returns whether an action appears to have been carried out.

    Args:
        tried: the action.
        before: observation for which the action was chosen.
        after: observation one decision later.
    """
    action = tried.action
    held, holds = before.motion is Motion.STOPPED, after.motion is Motion.STOPPED
    match action:
        case PhysicalAction.STOP:
            return not held
        case PhysicalAction.START:
            return held
        case PhysicalAction.SPEED_CHANGE:
            return (after.cruise > before.cruise) if tried.up else (after.cruise < before.cruise)
        case PhysicalAction.LIGHT_CHANGE:
            return before.lights is not tried.up
    if held:
        return not holds  # an executed action ends the stop, a refused one does not
    if action is PhysicalAction.LANE_FOLLOW:
        return before.manoeuvre is not None and after.manoeuvre is None
    same = before.manoeuvre is action and before.angle == after.angle
    return after.manoeuvre is action and not (same and action is PhysicalAction.J_TURN)


def _start(spans: tuple[Span, ...], end: float, period: float) -> float:
    """Returns the time of the decision at which an utterance began, at the usual rate of speech [s].

    Args:
        spans: spans of the utterance.
        end: time at which it ends [s].
        period: time between decisions [s].
    """
    seconds = sum(speech_seconds(span.text) for span in spans)
    return period * math.floor((end - seconds) / period + _PERIOD_TOLERANCE)
