"""What happens in a session, one event at a time."""

from __future__ import annotations

import enum
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from dorothie_gym.ontology import Role
from dorothie_gym.world.config import FRAME_RATE


class EventType(enum.StrEnum):
    """Kinds of events and what their `data` holds (JSON types only)."""

    DIALOGUE_MOVE = "DialogueMove"
    """One act: utterance (number), text (of the whole utterance), span (this act's words), move, slots
    ({slot label: [value labels]}), exchange (number or null), start and end [s]; where they are known, transaction
    (number) and recognised (what a speech recogniser heard of the whole utterance)."""
    PHYSICAL_ACTION = "PhysicalAction"
    """Of the Co-Wizard, that changed something: action (label), angle (degrees, positive left, or null), up (or
    null)."""
    BELIEF_UPDATE = "BeliefUpdate"
    """Mental action: action (label) and its arguments (junctions, landmarks, landmark, status, x, y)."""
    EXCEPTION = "Exception"
    """Of the Ad-Wizard, that took effect: kind (lower-case name) and its arguments; of a task exception the subgoal and
    its landmark, by label and by row of the header's landmarks (row)."""
    MESSAGE = "Message"
    """From the Ad-Wizard to the participant: text."""
    REFUSAL = "Refusal"
    """A well-formed action that was not carried out: action, reason."""
    HAZARD_STOP = "HazardStop"
    """The car begins to brake for something ahead: reason (object class label), distance [m]."""
    HAZARD_END = "HazardEnd"
    """The car goes on: reason, seconds."""
    SUBGOAL = "Subgoal"
    """A subgoal changes: subgoal (number), landmark (label), status (label), and cause (arrival, trigger, ...)."""
    COLLISION = "Collision"
    """The car touches something: other (class label), key (number of what is touched; a thing keeps it while it is
    there), lane, station [m], x, y [m] (where the car is), own_fault (bool), speed [m/s]. Older recordings lack place
    and key."""
    RED_LIGHT = "RedLight"
    """The car passes a red light: lane (that it leaves), station, x, y [m], key (id of the signal), other (class label
    of the signal)."""
    STOP_SIGN = "StopSign"
    """The car passes a stop sign without standing before it: as RED_LIGHT."""
    OFF_ROAD = "OffRoad"
    """The car leaves the road: lane (the nearest), station, x, y [m]; key and other are null."""
    WRONG_WAY = "WrongWay"
    """The car drives against the traffic: lane (that it is on), station, x, y [m]; key and other are null."""
    END = "End"
    """The session is over: success (bool), reason."""
    OTHER = "Other"
    """Of a type that this version has no name for: the type's name is in `Event.extra`, the data is kept as it is."""


INFRACTIONS = (
    EventType.COLLISION, EventType.RED_LIGHT, EventType.STOP_SIGN, EventType.OFF_ROAD, EventType.WRONG_WAY,
)  # fmt: skip
"""Events that tell of a breach of the rules of the road."""


@dataclass(frozen=True, kw_only=True)
class Event:
    """Something that happened.

    Attributes:
        frame: physics frame at 30 Hz at which it happened (a dialogue move: at which its utterance was over).
        type: kind of event.
        source: who did it; the car itself is `Role.AGENT`.
        flagged: whether it is a point of the benchmark (dialogue moves of the participant and the Co-Wizard,
            navigation actions of the Co-Wizard).
        data: JSON-able details, see `EventType`.
        extra: further fields of the event, kept as they are (JSON types).
    """

    frame: int
    type: EventType
    source: Role
    flagged: bool = False
    data: Mapping[str, Any] = field(default_factory=dict)
    extra: Mapping[str, Any] = field(default_factory=dict)

    @property
    def type_name(self) -> str:
        """Name of the type in a file; of an event of another version or corpus, the name that it has there."""
        return str(self.extra.get("type", self.type.value)) if self.type is EventType.OTHER else self.type.value

    @property
    def time(self) -> float:
        """Seconds since the start of the session."""
        return self.frame / FRAME_RATE
