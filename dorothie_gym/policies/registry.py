"""Policies by name."""

from __future__ import annotations

from typing import Any

from dorothie_gym.ontology import Role
from dorothie_gym.policies.ad_wizard import ScriptedAdWizard
from dorothie_gym.policies.co_wizard import ScriptedCoWizard
from dorothie_gym.policies.lane_follow import LaneFollowPolicy
from dorothie_gym.policies.participant import ScriptedParticipant
from dorothie_gym.policies.policy import Policy, RandomPolicy, SilentPolicy
from dorothie_gym.spaces import SpaceLimits

POLICY_NAMES = ("scripted", "silent", "random")
"""Names that `make_policy` knows for every role."""

LANE_FOLLOW = "lane-follow"
"""Name of the policy that drives and never talks, which the Co-Wizard has."""


def policy_names(role: Role) -> tuple[str, ...]:
    """Returns the names that `make_policy` knows for a role."""
    return (*POLICY_NAMES, LANE_FOLLOW) if role is Role.CO_WIZARD else POLICY_NAMES


def make_policy(name: str, role: Role, limits: SpaceLimits | None = None) -> Policy[Any]:
    """Makes a policy.

    Args:
        name: "scripted", "silent" (does nothing) or "random" (samples the action space); for the Co-Wizard
            "lane-follow", too (drives on, never talks).
        role: whom it acts for.
        limits: sizes of the spaces it acts in.

    Raises:
        ValueError: if there is no policy of that name, or the role takes no actions.
    """
    if role not in (Role.PARTICIPANT, Role.CO_WIZARD, Role.AD_WIZARD):
        raise ValueError(f"role is {role}; policies act for participant, co_wizard and ad_wizard")
    if name == "silent":
        return SilentPolicy(role, limits)
    if name == "random":
        return RandomPolicy(role, limits)
    if name not in policy_names(role):
        raise ValueError(f"there is no policy {name!r}; the policies are {', '.join(policy_names(role))}")
    if name == LANE_FOLLOW:
        return LaneFollowPolicy(limits)
    if role is Role.PARTICIPANT:
        return ScriptedParticipant(limits)
    return ScriptedCoWizard(limits) if role is Role.CO_WIZARD else ScriptedAdWizard(limits)
