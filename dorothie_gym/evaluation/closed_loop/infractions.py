"""Infractions of a driven session: their kinds, and time, place and counterpart of each."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Final, NotRequired, TypedDict

from msgspec import Meta

from dorothie_gym.ontology.slots import ObjectClass
from dorothie_gym.session.recording.events import EventType
from dorothie_gym.sim.config import FRAME_RATE

if TYPE_CHECKING:
    from dorothie_gym.session.recording.events import InfractionRecord

HIT_BY_OTHERS: Final = "hit_by_others"
"""Name of the collisions that others caused; they are counted and have no penalty."""

_RULES: Final = {
    EventType.RED_LIGHT: "red_light",
    EventType.STOP_SIGN: "stop_sign",
    EventType.OFF_ROAD: "off_road",
    EventType.WRONG_WAY: "wrong_way",
}
_TOUCHED: Final = {ObjectClass.PEDESTRIAN: "pedestrian", ObjectClass.VEHICLES: "vehicle"}


class InfractionPage(TypedDict):
    """Infraction in JSON types; fields as in `InfractionEvent`."""

    kind: str
    seconds: Annotated[float, Meta(ge=0.0, le=1e12)]
    own_fault: bool
    place: NotRequired[tuple[float, float]]
    counterpart: NotRequired[int]


@dataclass(frozen=True, kw_only=True)
class InfractionEvent:
    """Infraction of a session, which `dorothie-gym replay` and `film` show at its time.

    Attributes:
        kind: kind of the infraction (`infraction_kind`).
        seconds: time in the session [s].
        own_fault: whether the car ran into the counterpart of a collision; True for the other kinds.
        place: position of the car (x, y) [m]; None if it was not recorded.
        counterpart: number of the body, light or sign; None without one.
    """

    kind: str
    seconds: float
    own_fault: bool
    place: tuple[float, float] | None = None
    counterpart: int | None = None

    @classmethod
    def of(cls, infraction: InfractionRecord) -> InfractionEvent:
        """Returns the infraction of a recorded event."""
        x, y = infraction.x, infraction.y
        return cls(
            kind=infraction_kind(infraction),
            seconds=round(infraction.frame / FRAME_RATE, 3),
            own_fault=infraction.own_fault,
            place=None if x is None or y is None else (round(x, 2), round(y, 2)),
            counterpart=infraction.key,
        )

    def to_json(self) -> InfractionPage:
        """Returns the fields in JSON types; those that are None are left out."""
        page: InfractionPage = {"kind": self.kind, "seconds": self.seconds, "own_fault": self.own_fault}
        if self.place is not None:
            page["place"] = self.place
        if self.counterpart is not None:
            page["counterpart"] = self.counterpart
        return page

    @classmethod
    def from_json(cls, page: InfractionPage) -> InfractionEvent:
        """Parses the output of `to_json`."""
        place = page.get("place")
        return cls(
            kind=page["kind"],
            seconds=page["seconds"],
            own_fault=page["own_fault"],
            place=None if place is None else (place[0], place[1]),
            counterpart=page.get("counterpart"),
        )


def infraction_kind(infraction: InfractionRecord) -> str:
    """Returns the kind of an infraction.

    Collisions are classified by the counterpart: "pedestrian", "vehicle", or other ("static"). Collisions that
    others caused (`own_fault` is false: the car stood or was hit from behind) are "hit_by_others".
    """
    if infraction.type is not EventType.COLLISION:
        return _RULES[infraction.type]
    if not infraction.own_fault:
        return HIT_BY_OTHERS
    return "static" if infraction.other is None else _TOUCHED.get(infraction.other, "static")
