"""Hand-made dialogues with events between the utterances."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, TypeAlias

from dorothie_gym.evaluation.analysis import DialogueView
from dorothie_gym.ontology import (
    ActionValue,
    DialogueAct,
    DialogueMove,
    GoalStatus,
    LandmarkName,
    MentalAction,
    ObjectClass,
    PhysicalAction,
    Role,
    SlotValue,
    StreetName,
)
from dorothie_gym.session.recording import Event, EventType, Session
from dorothie_gym.sim.config import FRAME_RATE
from tests.session.recording.builders import physical, session

M, A, OBJ, S = DialogueMove, ActionValue, ObjectClass, GoalStatus
HUMAN, CAR = Role.PARTICIPANT, Role.CO_WIZARD

KFC, IKEA, COCO, HOUSE = LandmarkName.KFC, LandmarkName.IKEA, LandmarkName.COCO, LandmarkName.HOUSE
FULLER, BAITS = StreetName.FULLER, StreetName.BAITS

Make: TypeAlias = Callable[[], DialogueView]
Span: TypeAlias = tuple[str, DialogueAct]


def act(move: DialogueMove, *values: SlotValue) -> DialogueAct:
    return DialogueAct.of(move, *values)


def said(start: float, speaker: Role, *spans: Span, seconds: float = 1.5, **fields: Any) -> list[Event]:
    """An utterance that begins at `start` [s]."""
    text = " ".join(words for words, _ in spans)
    end = start + seconds
    return [
        Event(
            frame=round(end * FRAME_RATE),
            type=EventType.DIALOGUE_MOVE,
            source=speaker,
            flagged=True,
            data={
                "utterance": round(start * 10),
                "text": text,
                "span": words,
                "move": spoken.move.label,
                "slots": spoken.slot_labels(),
                "exchange": None,
                "start": start,
                "end": end,
                **fields,
            },
        )
        for words, spoken in spans
    ]


def human(start: float, text: str, move: DialogueMove, *values: SlotValue, **fields: Any) -> list[Event]:
    return said(start, HUMAN, (text, act(move, *values)), **fields)


def car(start: float, text: str, move: DialogueMove, *values: SlotValue, **fields: Any) -> list[Event]:
    return said(start, CAR, (text, act(move, *values)), **fields)


def exception(time: float, kind: str, **data: Any) -> list[Event]:
    return [_event(time, EventType.EXCEPTION, Role.AD_WIZARD, {"kind": kind, **data})]


def subgoal(time: float, landmark: str, status: str, number: int = 0, cause: str = "arrival") -> list[Event]:
    data = {"subgoal": number, "landmark": landmark, "status": status, "cause": cause}
    return [_event(time, EventType.SUBGOAL, Role.AGENT, data)]


def did(time: float, action: PhysicalAction, angle: float | None = None, up: bool | None = None) -> list[Event]:
    return [physical(round(time * FRAME_RATE), action, angle, up)]


TURNED = did(5.0, PhysicalAction.J_TURN, angle=80.0)


def believed(time: float, action: MentalAction, **data: Any) -> list[Event]:
    return [_event(time, EventType.BELIEF_UPDATE, Role.CO_WIZARD, {"action": action.label, **data})]


def hazard(time: float) -> list[Event]:
    return [_event(time, EventType.HAZARD_STOP, Role.AGENT, {"reason": "TrafficLight", "distance": 6.0})]


def hazard_over(time: float, reason: str) -> list[Event]:
    return [_event(time, EventType.HAZARD_END, Role.AGENT, {"reason": reason, "seconds": 5.0})]


def drive(*parts: Sequence[Event], seconds: float = 60.0, **header: Any) -> Session:
    """A session of a car that drives east at 6 m/s, in which the parts happen."""
    return session([event for part in parts for event in part], frames=round(seconds * FRAME_RATE), **header)


def talk(*parts: Sequence[Event], seconds: float = 60.0, **header: Any) -> DialogueView:
    return DialogueView(drive(*parts, seconds=seconds, **header))


def _event(time: float, kind: EventType, source: Role, data: dict[str, Any]) -> Event:
    return Event(frame=round(time * FRAME_RATE), type=kind, source=source, data=data)
