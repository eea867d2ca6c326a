"""Messages from browsers: closed set of types with checked fields, tagged by their field `k`."""

from __future__ import annotations

from typing import Annotated, Final, Literal, TypeAlias

import msgspec
from msgspec import Meta, Struct

from dorothie_gym.errors import DorothieGymError
from dorothie_gym.session.spaces.fields import MESSAGE_LENGTH

MAX_BYTES: Final = 8192
"""Largest message [bytes]: a typed turn with its acts takes up to 2 kB."""

MAX_TYPED: Final = 600
"""Longest typed turn [characters]: four spans of 150."""

Number: TypeAlias = Annotated[int, Meta(ge=0, le=2**31)]
"""Number of a message, with which its effect is acknowledged; numbers of a connection rise."""

_Name: TypeAlias = Annotated[str, Meta(max_length=40)]
_Metres: TypeAlias = Annotated[float, Meta(ge=-1e5, le=1e5)]
_Item: TypeAlias = Annotated[int, Meta(ge=0, le=1000)]
_Typed: TypeAlias = Annotated[str, Meta(max_length=MAX_TYPED)]


class MessageError(DorothieGymError, ValueError):
    """A message of a browser is malformed, or requests something that its seat does not offer."""


class _Message(Struct, tag_field="k", tag=str.lower, forbid_unknown_fields=True, frozen=True):
    """Message of a browser."""


class _Command(_Message, frozen=True):
    """Message that is carried out in the session and acknowledged by its number `n`."""

    n: Number


class Join(_Message, frozen=True):
    """First message of a connection: the token of its seat."""

    token: Annotated[str, Meta(max_length=64)]


class Ping(_Message, frozen=True):
    """Request for an answer with the same number, to measure the round trip."""

    c: float


class View(_Message, frozen=True):
    """Requested pictures through the windscreen per second; 0 for none."""

    rate: Literal[0, 1, 2, 5, 10]


class TypedSpan(Struct, forbid_unknown_fields=True, frozen=True):
    """Span of typed text with the act that the speaker has confirmed or corrected: labels of move and slot values."""

    text: _Typed
    move: _Name
    slots: dict[_Name, Annotated[list[_Name], Meta(max_length=12)]] = {}


class Parse(_Message, frozen=True):
    """Request for the acts of text that is being typed."""

    c: float
    text: _Typed


class Say(_Command, frozen=True):
    """Typed or spoken turn; without `spans`, the classifier segments it and finds the acts.

    `audio` is the name of the recording from which its words were recognised.
    """

    text: _Typed
    spans: Annotated[list[TypedSpan], Meta(max_length=12)] | None = None
    audio: _Name | None = None


class Correct(_Message, frozen=True):
    """Correction of the act of a span that the role has spoken: number of the utterance, index of the span."""

    utterance: _Item
    span: Annotated[int, Meta(ge=0, le=63)]
    move: _Name
    slots: dict[_Name, Annotated[list[_Name], Meta(max_length=12)]] = {}


class Drive(_Command, frozen=True):
    """Physical action: label, angle [degrees, positive left], direction of a change of speed or light."""

    action: _Name
    angle: Annotated[int, Meta(ge=-180, le=179)] = 0
    up: bool = True


class Plan(_Command, frozen=True):
    """Planned junctions, as indices of the town's junctions, in order."""

    junctions: Annotated[list[_Item], Meta(max_length=64)]


class Goal(_Command, frozen=True):
    """Landmarks that the Co-Wizard drives to, by label."""

    landmarks: Annotated[list[_Name], Meta(max_length=12)]


class Status(_Command, frozen=True):
    """Believed state of an errand: labels of landmark and status."""

    landmark: _Name
    status: _Name


class Mark(_Command, frozen=True):
    """Marked place of a landmark on the map [m]."""

    landmark: _Name
    x: _Metres
    y: _Metres


class Other(_Command, frozen=True):
    """Other change of the Co-Wizard's beliefs."""


class Weather(_Command, frozen=True):
    """Weather parameter and its new value as a share of its range."""

    parameter: _Name
    share: Annotated[float, Meta(ge=0.0, le=1.0)]


class Prop(_Command, frozen=True):
    """Prop to place at a point of the map [m]."""

    prop: _Name
    x: _Metres
    y: _Metres


class Move(_Command, frozen=True):
    """Prop to move: its row, and the new place [m]."""

    item: _Item
    x: _Metres
    y: _Metres


class Remove(_Command, frozen=True):
    """Prop to remove: its row."""

    item: _Item


class Spawn(_Command, frozen=True):
    """Vehicles or pedestrians to add in a square around a point of the map [m]."""

    what: Literal["vehicles", "pedestrians"]
    x: _Metres
    y: _Metres
    count: Annotated[int, Meta(ge=1, le=16)]
    extent: Annotated[int, Meta(ge=5, le=100)] = 40


class SensorFault(_Command, frozen=True, tag="fault"):
    """Sensor to disturb or to repair."""

    sensor: _Name
    on: bool


class Task(_Command, frozen=True):
    """Change of the task with a message to the participant: subgoal, by row."""

    change: Literal["trigger", "delete", "change"]
    item: _Item
    message: Annotated[str, Meta(max_length=MESSAGE_LENGTH)] = ""


class Message(_Command, frozen=True):
    """Message of the Ad-Wizard to the participant."""

    text: Annotated[str, Meta(min_length=1, max_length=MESSAGE_LENGTH)]


class Control(_Message, frozen=True):
    """Control of the session by the experimenter; after a session, any seat may request a new one."""

    act: Literal["start", "pause", "resume", "end", "again"]


class Announce(_Message, frozen=True):
    """Message of the experimenter to all seats."""

    text: Annotated[str, Meta(min_length=1, max_length=400)]


Incoming: TypeAlias = (
    Join | Ping | View | Parse | Say | Correct | Drive | Plan | Goal | Status | Mark | Other | Weather | Prop | Move
    | Remove | Spawn | SensorFault | Task | Message | Control | Announce
)  # fmt: skip
"""All messages of browsers."""

Command: TypeAlias = (
    Say
    | Drive
    | Plan
    | Goal
    | Status
    | Mark
    | Other
    | Weather
    | Prop
    | Move
    | Remove
    | Spawn
    | SensorFault
    | Task
    | Message
)
"""Messages that are carried out in the session."""

_DECODER: Final = msgspec.json.Decoder(Incoming)


def decode_message(content: str | bytes) -> Incoming:
    """Returns the message of a text in JSON.

    Raises:
        MessageError: it is too large, no JSON, of an unknown type, or a field is missing or out of range.
    """
    if len(content) > MAX_BYTES:
        raise MessageError(f"a message has {len(content)} bytes; at most {MAX_BYTES} are taken")
    try:
        message: Incoming = _DECODER.decode(content)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
        raise MessageError(f"malformed message: {error}") from None
    return message
