"""Roles of a session, with the information each role receives and the actions it may take."""

from __future__ import annotations

from collections.abc import Mapping
from enum import StrEnum
from types import MappingProxyType


class Role(StrEnum):
    """Source of events; the first three roles are agents, the fourth is the car itself."""

    PARTICIPANT = "participant"
    CO_WIZARD = "co_wizard"
    AD_WIZARD = "ad_wizard"
    AGENT = "agent"

    @property
    def sdn_names(self) -> tuple[str, ...]:
        """Names of the role in SDN files; the first one is used for writing."""
        return _SDN_NAMES[self]

    @property
    def sees(self) -> frozenset[Sight]:
        """Parts of the session state that the role observes."""
        return _SEES[self]

    @property
    def may(self) -> frozenset[Capability]:
        """Kinds of action that the role may take."""
        return _MAY[self]


class Sight(StrEnum):
    """Part of the session state that is visible to some roles."""

    FIRST_PERSON_VIEW = "first_person_view"
    AERIAL_MAP = "aerial_map"
    HIDDEN_LANDMARKS = "hidden_landmarks"
    STORYBOARD = "storyboard"
    AD_WIZARD_MESSAGES = "ad_wizard_messages"
    WAYPOINTS = "waypoints"
    TURN_OPTIONS = "turn_options"
    VEHICLE_STATUS = "vehicle_status"
    DIALOGUE = "dialogue"


class Capability(StrEnum):
    """Kind of action that is available to some roles."""

    TALK = "talk"
    PHYSICAL_ACTION = "physical_action"
    MENTAL_ACTION = "mental_action"
    EXCEPTION = "exception"
    MESSAGE = "message"
    HAZARD_STOP = "hazard_stop"
    ARRIVAL = "arrival"
    PROMPT = "prompt"


AGENT_ROLES: tuple[Role, ...] = (Role.PARTICIPANT, Role.CO_WIZARD, Role.AD_WIZARD)
"""Roles that are played by a policy or a person."""

_SDN_NAMES: Mapping[Role, tuple[str, ...]] = MappingProxyType(
    {
        Role.PARTICIPANT: ("dorothy",),
        Role.CO_WIZARD: ("wizard",),
        Role.AD_WIZARD: ("ad_wizard",),
        Role.AGENT: ("agent", "planner", "system"),
    }
)

_SEES: Mapping[Role, frozenset[Sight]] = MappingProxyType(
    {
        Role.PARTICIPANT: frozenset(
            {
                Sight.FIRST_PERSON_VIEW,
                Sight.AERIAL_MAP,
                Sight.HIDDEN_LANDMARKS,
                Sight.STORYBOARD,
                Sight.AD_WIZARD_MESSAGES,
                Sight.DIALOGUE,
            }
        ),
        Role.CO_WIZARD: frozenset(
            {
                Sight.FIRST_PERSON_VIEW,
                Sight.AERIAL_MAP,
                Sight.WAYPOINTS,
                Sight.TURN_OPTIONS,
                Sight.VEHICLE_STATUS,
                Sight.DIALOGUE,
            }
        ),
        Role.AD_WIZARD: frozenset(Sight),
        Role.AGENT: frozenset(),
    }
)

_MAY: Mapping[Role, frozenset[Capability]] = MappingProxyType(
    {
        Role.PARTICIPANT: frozenset({Capability.TALK}),
        Role.CO_WIZARD: frozenset({Capability.TALK, Capability.PHYSICAL_ACTION, Capability.MENTAL_ACTION}),
        Role.AD_WIZARD: frozenset({Capability.EXCEPTION, Capability.MESSAGE}),
        Role.AGENT: frozenset({Capability.HAZARD_STOP, Capability.ARRIVAL, Capability.PROMPT}),
    }
)
