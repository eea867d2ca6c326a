"""Plan of the seats of a session: the roles that people may or must play, and the policies that play them otherwise."""

from __future__ import annotations

import enum
from collections.abc import Mapping
from dataclasses import dataclass

from dorothie_gym.errors import PolicyLoadError, SettingsError, did_you_mean
from dorothie_gym.ontology.roles import AGENT_ROLES, Role
from dorothie_gym.policies.policy_loader import LANGUAGE_MODEL, SCRIPTED, WITH_TRAITS, Player, find_player


class Occupancy(enum.StrEnum):
    """Whether a person sits at a seat."""

    HUMAN = "human"
    """A person must play the role; the session waits."""
    OPEN = "open"
    """A person may play the role; the scripted policy plays while the seat is empty."""
    POLICY = "policy"
    """A policy plays the role; there is no seat."""


@dataclass(frozen=True, kw_only=True)
class SeatPlan:
    """Plan of one seat.

    Attributes:
        occupancy: whether a person sits there.
        player: source of the policy that plays in place of a person.
    """

    occupancy: Occupancy
    player: Player = SCRIPTED

    @property
    def label(self) -> str:
        """Entry of the record: "human", "open", or the name of the policy."""
        return self.player.name if self.occupancy is Occupancy.POLICY else self.occupancy.value


_ROLES = {role.value: role for role in AGENT_ROLES}


def parse_roles(text: str) -> dict[Role, SeatPlan]:
    """Returns the plan of each seat; roles that are not named are open.

    Args:
        text: "co_wizard=human,participant=scripted": for each role "human", "open", or a policy by name, file or class;
            traits of a scripted persona may contain commas.

    Raises:
        SettingsError: a role is unknown or named twice, or has no value.
        PolicyLoadError: there is no such policy, or it cannot play in real time.
    """
    given: dict[Role, str] = {}
    last: Role | None = None
    for part in text.split(",") if text.strip() else ():
        name, equals, value = part.partition("=")
        role = _ROLES.get(name.strip().lower().replace("-", "_"))
        if role is None and last is not None and given[last].startswith(WITH_TRAITS):
            given[last] += f",{part}"  # traits of a persona
            continue
        if role is None or not equals or not value.strip():
            hint = did_you_mean(name.strip(), tuple(_ROLES))
            raise SettingsError(f"--roles: {part!r} is no ROLE=PLAYER; {hint}the roles are {', '.join(_ROLES)}")
        if role in given:
            raise SettingsError(f"--roles: {role.value} is named twice; give it one player")
        given[role], last = value.strip(), role
    return {role: plan_seat(given.get(role, Occupancy.OPEN.value), role) for role in AGENT_ROLES}


def plan_seat(given: str, role: Role) -> SeatPlan:
    """Returns the plan of a seat.

    Args:
        given: "human", "open", or a policy by name, file or class ("module:Class").
        role: role of the seat.

    Raises:
        PolicyLoadError: there is no such policy, or it cannot play in real time.
    """
    if given.startswith(LANGUAGE_MODEL):
        raise PolicyLoadError(
            f"{role.value}: {given} cannot play with people in real time, because each call would hold up "
            "all seats; language models play in `dorothie-gym run` and `rollout`"
        )
    if given in (Occupancy.HUMAN.value, Occupancy.OPEN.value):
        return SeatPlan(occupancy=Occupancy(given))
    return SeatPlan(occupancy=Occupancy.POLICY, player=find_player(given, role))


def plan_labels(plans: Mapping[Role, SeatPlan]) -> dict[str, str]:
    """Returns the labels of the seats by role, for the header of a record."""
    return {role.value: plan.label for role, plan in plans.items()}
