"""What a Co-Wizard has seen, heard, said and done so far, as a session that the benchmark's features are read from.

Everything comes from its observations and its own actions: nothing that it must not know gets in.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final, Self

from dorothie_gym.baselines.acting.glimpses import Glimpse, header_of, scene_of, way_of
from dorothie_gym.dialogue import Span
from dorothie_gym.maps import Town
from dorothie_gym.ontology import NAVIGATION_ACTIONS, ArgumentKind, Role, Slot
from dorothie_gym.policies.co_wizard.view import CoWizardView
from dorothie_gym.recording import FRAME_RATE, Event, EventType, Session, SessionHeader
from dorothie_gym.spaces import Physical

KEPT: Final = 12.0
"""So much of the way, and of what was around it, is kept [s]: more than any window shows (10 s)."""

_TAKES_ANGLE: Final = (ArgumentKind.ANGLE, ArgumentKind.SIDE)
_TAKES_UP: Final = (ArgumentKind.SPEED_STEP, ArgumentKind.SWITCH)


@dataclass(frozen=True, eq=False, kw_only=True)
class History:
    """A session as the Co-Wizard has it; every change gives a new one.

    Attributes:
        header: town, streets, and the landmarks that it knows.
        events: dialogue moves of both speakers and its own physical actions, flagged as points where a recording has
            them flagged.
        glimpses: where it was and what it perceived, the last at the end.
        utterances: how many there were.
        kept: how long glimpses are kept [s].
    """

    header: SessionHeader
    events: tuple[Event, ...] = ()
    glimpses: tuple[Glimpse, ...] = ()
    utterances: int = 0
    kept: float = KEPT

    @classmethod
    def begin(cls, observation: Mapping[str, Any], town: Town, kept: float = KEPT) -> Self:
        """Returns a history in which nothing has happened yet.

        Args:
            observation: the first of the session: it tells streets and landmarks.
            town: the map.
            kept: how long glimpses are kept [s].
        """
        return cls(header=header_of(observation, town), kept=kept)

    @property
    def frame(self) -> int:
        """Frame of the last glimpse."""
        return self.glimpses[-1].frame

    @property
    def landmark(self) -> str | None:
        """Label of the landmark that was named last, by whomever."""
        moves = (event.data["slots"] for event in reversed(self.events) if event.type is EventType.DIALOGUE_MOVE)
        return next((slots[Slot.LANDMARK.label][-1] for slots in moves if Slot.LANDMARK.label in slots), None)

    def seen(self, view: CoWizardView, town: Town) -> Self:
        """Returns the history with what an observation shows."""
        new = Glimpse.of(view, town)
        since = new.frame - self.kept * FRAME_RATE
        return replace(self, glimpses=(*(one for one in self.glimpses if one.frame >= since), new))

    def said(self, speaker: Role, spans: Sequence[Span], frame: int) -> Self:
        """Returns the history with an utterance that was over at a frame."""
        text = " ".join(span.text for span in spans)
        moves = (_move(speaker, self.utterances, text, span, frame) for span in spans)
        return replace(self, events=(*self.events, *moves), utterances=self.utterances + 1)

    def corrected(self, spans: Sequence[Span]) -> Self:
        """Returns the history with other acts for the last utterance, whose words stay."""
        last = self.events[-len(spans) :]
        text, number = last[0].data["text"], last[0].data["utterance"]
        moves = (_move(event.source, number, text, span, event.frame) for event, span in zip(last, spans, strict=True))
        return replace(self, events=(*self.events[: -len(spans)], *moves))

    def done(self, physical: Physical, frame: int) -> Self:
        """Returns the history with a physical action that was carried out at a frame."""
        return replace(self, events=(*self.events, _deed(physical, frame)))

    def session(self) -> Session:
        """Returns the history as a session that was cut off."""
        return Session(
            header=self.header,
            events=self.events,
            trajectory=way_of(self.glimpses),
            complete=False,
            name="live",
            scene=scene_of(self.glimpses),
        )


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


def _deed(physical: Physical, frame: int) -> Event:
    action = physical.action
    data = {
        "action": action.label,
        "angle": physical.angle if action.argument in _TAKES_ANGLE else None,
        "up": physical.up if action.argument in _TAKES_UP else None,
    }
    flagged = action in NAVIGATION_ACTIONS
    return Event(frame=frame, type=EventType.PHYSICAL_ACTION, source=Role.CO_WIZARD, flagged=flagged, data=data)
