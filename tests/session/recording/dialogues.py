"""A short talk that has every kind of point."""

from __future__ import annotations

from dorothie_gym.ontology import (
    ActionValue,
    DialogueAct,
    DialogueMove,
    GoalStatus,
    LandmarkName,
    PhysicalAction,
    Role,
    StreetName,
)
from dorothie_gym.session.recording import Event, EventType
from tests.session.recording.builders import physical, utterance

TO_KFC = DialogueAct.of(DialogueMove.INSTRUCT, LandmarkName.KFC)
OKAY = DialogueAct.of(DialogueMove.ACKNOWLEDGE)
TURNING = DialogueAct.of(DialogueMove.EXPLAIN, ActionValue.J_TURN)
YES = DialogueAct.of(DialogueMove.REPLY_Y)
STREET = DialogueAct.of(DialogueMove.INSTRUCT, StreetName.FULLER, ActionValue.J_TURN)
DONE = DialogueAct.of(DialogueMove.EXPLAIN, GoalStatus.COMPLETE)


def talk() -> list[Event]:
    """Three flagged utterances of the participant (4 moves), two of the Co-Wizard (3), five navigation actions."""
    return [
        Event(frame=0, type=EventType.SUBGOAL, source=Role.AGENT, data={"subgoal": 0, "status": "Ongoing"}),
        *utterance(30, Role.PARTICIPANT, 0, ("To the KFC please.", TO_KFC)),
        physical(45, PhysicalAction.START),
        *utterance(60, Role.CO_WIZARD, 1, ("Okay,", OKAY), ("turning left.", TURNING)),
        physical(60, PhysicalAction.J_TURN, angle=88.0),
        physical(75, PhysicalAction.SPEED_CHANGE, up=True, flagged=False),
        *utterance(120, Role.PARTICIPANT, 2, ("Yes,", YES), ("left on Fuller.", STREET)),
        physical(130, PhysicalAction.U_TURN),
        physical(150, PhysicalAction.J_TURN, angle=-179.0),
        Event(frame=155, type=EventType.HAZARD_STOP, source=Role.AGENT, data={"reason": "Vehicles", "distance": 4.5}),
        *utterance(200, Role.CO_WIZARD, 3, ("Okay.", OKAY)),
        *utterance(240, Role.PARTICIPANT, 4, ("Great.", DONE)),
        physical(250, PhysicalAction.STOP),
        Event(frame=299, type=EventType.END, source=Role.AGENT, data={"success": True, "reason": "arrived"}),
    ]
