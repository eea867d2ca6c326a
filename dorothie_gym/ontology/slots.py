"""Slots of a dialogue act and their possible values; ids as in SDN."""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum
from types import MappingProxyType
from typing import ClassVar, Self, TypeAlias

from dorothie_gym.ontology.labelled_enums import LabelledInt

ARRIVAL_DISTANCE = 2.0
"""Largest distance between the stopped car and the waypoint of a landmark at which a subgoal is reached [m]."""


class Slot(LabelledInt):
    """Parameter of a dialogue act."""

    NULL = 0, "Null"
    ACTION = 1, "Action"
    STREET = 2, "Street"
    LANDMARK = 3, "Landmark"
    STATUS = 4, "Status"
    OBJECT = 5, "Object"


class SlotEnum(Enum):
    """Base class of the five slot value enums. Not an IntEnum: values of different slots are never equal.

    Attributes:
        label: spelling in SDN.
    """

    label: str
    _hash: int
    _slot: ClassVar[Slot]

    # No member uses the default: it lets type checkers accept the look-up by number, `Enum(3)`.
    def __new__(cls, value: int, label: str = "") -> Self:
        """Creates a member from its number and its label."""
        member = object.__new__(cls)
        member._value_ = value
        member.label = label
        return member

    # Enum hashes the name of a member, and Python salts string hashes per process: the order of sets would differ.
    def __hash__(self) -> int:
        """Returns a hash that is equal in all processes."""
        return self._hash

    def __init_subclass__(cls, *, slot: Slot) -> None:
        """Stores the slot of the values of a class."""
        super().__init_subclass__()
        cls._slot = slot
        for member in cls:
            member._hash = 32 * slot.value + int(member.value)

    @property
    def slot(self) -> Slot:
        """Slot of the value."""
        return self._slot


class ActionValue(SlotEnum, slot=Slot.ACTION):
    """Values of Slot.ACTION; ids 1 to 8 are those of `PhysicalAction`."""

    UNKNOWN = 0, "Unknown"
    LANE_FOLLOW = 1, "LaneFollow"
    LANE_SWITCH = 2, "LaneSwitch"
    U_TURN = 3, "UTurn"
    J_TURN = 4, "JTurn"
    STOP = 5, "Stop"
    START = 6, "Start"
    SPEED_CHANGE = 7, "SpeedChange"
    LIGHT_CHANGE = 8, "LightChange"
    QUERIED = 9, "Queried"


class StreetName(SlotEnum, slot=Slot.STREET):
    """Values of Slot.STREET."""

    UNKNOWN = 0, "Unknown"
    BAITS = 1, "Baits"
    BEAL = 2, "Beal"
    BISHOP = 3, "Bishop"
    BONISTEEL = 4, "Bonisteel"
    BROADWAY = 5, "Broadway"
    DIVISION = 6, "Division"
    DRAPER = 7, "Draper"
    DUFFIELD = 8, "Duffield"
    FULLER = 9, "Fuller"
    HAYWARD = 10, "Hayward"
    HUBBARD = 11, "Hubbard"
    MURFIN = 12, "Murfin"
    PLYMOUTH = 13, "Plymouth"
    UPLAND = 14, "Upland"
    QUERIED = 15, "Queried"
    HIGHWAY = 16, "Highway"


class LandmarkName(SlotEnum, slot=Slot.LANDMARK):
    """Values of Slot.LANDMARK."""

    UNKNOWN = 0, "Unknown"
    BURGER_KING = 1, "BurgerKing"
    COCO = 2, "Coco"
    IKEA = 3, "Ikea"
    KFC = 4, "KFC"
    PANERA = 5, "Panera"
    QDOBA = 6, "Qdoba"
    SEVEN_ELEVEN = 7, "SevenEleven"
    SHELL = 8, "Shell"
    HOUSE = 9, "House"
    PERSON = 10, "Person"
    QUERIED = 11, "Queried"


class GoalStatus(SlotEnum, slot=Slot.STATUS):
    """Values of Slot.STATUS: the state of a subgoal."""

    UNKNOWN = 0, "Unknown"
    ONGOING = 1, "Ongoing"
    COMPLETE = 2, "Complete"
    ABANDONED = 3, "Abandoned"
    PENDING = 4, "Pending"
    QUERIED = 5, "Queried"


class ObjectClass(SlotEnum, slot=Slot.OBJECT):
    """Values of Slot.OBJECT: the semantic classes of CARLA's cameras, and Queried."""

    UNLABELED = 0, "Unlabeled"
    BUILDING = 1, "Building"
    FENCE = 2, "Fence"
    OTHER = 3, "Other"
    PEDESTRIAN = 4, "Pedestrian"
    POLE = 5, "Pole"
    ROAD_LINE = 6, "RoadLine"
    ROAD = 7, "Road"
    SIDE_WALK = 8, "SideWalk"
    VEGETATION = 9, "Vegetation"
    VEHICLES = 10, "Vehicles"
    WALL = 11, "Wall"
    TRAFFIC_SIGN = 12, "TrafficSign"
    SKY = 13, "Sky"
    GROUND = 14, "Ground"
    BRIDGE = 15, "Bridge"
    RAIL_TRACK = 16, "RailTrack"
    GUARD_RAIL = 17, "GuardRail"
    TRAFFIC_LIGHT = 18, "TrafficLight"
    STATIC = 19, "Static"
    DYNAMIC = 20, "Dynamic"
    WATER = 21, "Water"
    TERRAIN = 22, "Terrain"
    QUERIED = 23, "Queried"


SlotValue: TypeAlias = ActionValue | StreetName | LandmarkName | GoalStatus | ObjectClass

SLOT_VALUES: Mapping[Slot, tuple[SlotValue, ...]] = MappingProxyType(
    {
        Slot.NULL: (),
        Slot.ACTION: tuple(ActionValue),
        Slot.STREET: tuple(StreetName),
        Slot.LANDMARK: tuple(LandmarkName),
        Slot.STATUS: tuple(GoalStatus),
        Slot.OBJECT: tuple(ObjectClass),
    }
)
"""Values of each slot, by id; Null has none."""
