"""History of a session as the Co-Wizard knows it, encoded step by step for a benchmark model.

All content comes from the Co-Wizard's own observations and actions, so that nothing hidden from it gets in.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

from dorothie_gym.baselines.acting.observation_frames import header_of, observed_frame
from dorothie_gym.benchmark.features import HistorySizes
from dorothie_gym.benchmark.features.incremental import IncrementalColumns, ObservedFrame
from dorothie_gym.dialogue import Span
from dorothie_gym.maps import Town
from dorothie_gym.ontology import NAVIGATION_ACTIONS, ArgumentKind, Role, Slot
from dorothie_gym.policies.co_wizard.view import CoWizardView
from dorothie_gym.recording import FRAME_RATE, ActionRecord, MoveRecord, UtteranceRecord
from dorothie_gym.spaces import ObservationMapping, Physical

_TAKES_ANGLE = (ArgumentKind.ANGLE, ArgumentKind.SIDE)
_TAKES_UP = (ArgumentKind.SPEED_STEP, ArgumentKind.SWITCH)


@dataclass(frozen=True, eq=False, kw_only=True)
class History:
    """Observations, utterances and own actions of a Co-Wizard; every change returns a new object.

    Attributes:
        encoded: what a benchmark model can still be shown of them, as columns.
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
            sizes: how much of the history the model is shown.
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
        """Returns the history with an utterance that was over at a frame."""
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
            self, encoded=encoded, events=self.events + len(spans), utterances=self.utterances + 1,
            landmark=_last_landmark((record,)) or self.landmark,
            named_before=_last_landmark(dropped) or self.named_before,
        )  # fmt: skip

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
    """Returns the label of the landmark that was named last in utterances, None for none."""
    moves = (move for utterance in reversed(utterances) for move in reversed(utterance.moves))
    named = (move.act.slot_labels().get(Slot.LANDMARK.label) for move in moves)
    return next((labels[-1] for labels in named if labels), None)
