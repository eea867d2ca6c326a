"""Policies of the other roles, for environments and sessions in which one role is played from outside."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from dorothie_gym.errors import short_repr
from dorothie_gym.ontology.roles import AGENT_ROLES, Role
from dorothie_gym.policies.policy import Policy
from dorothie_gym.policies.policy_loader import make_policy

if TYPE_CHECKING:
    from dorothie_gym.policies.policy import AnyPolicy
    from dorothie_gym.session.spaces.fields import SpaceLimits


def partners_of(role: Role, wanted: Mapping[str, str | AnyPolicy], limits: SpaceLimits) -> dict[Role, AnyPolicy]:
    """Returns the policy of each other role; "scripted" for those that are not named.

    Args:
        role: role that is played from outside.
        wanted: policy of other roles, or its name (`make_policy`), by role.
        limits: sizes of the spaces.

    Raises:
        ValueError: there is no such role or policy, or a policy does not fit the role or the sizes.
    """
    others = [each for each in AGENT_ROLES if each is not role]
    for name in wanted:
        if name not in others:
            raise ValueError(f"partners has {str(name)!r}; the others are {' and '.join(others)}")
    cast: dict[Role, AnyPolicy] = {}
    for other in others:
        policy = wanted.get(other, "scripted")
        if not isinstance(policy, str | Policy):
            raise ValueError(f"partners has {short_repr(policy)} for {other}; it must be a policy or the name of one")
        cast[other] = make_policy(policy, other, limits) if isinstance(policy, str) else policy
        if cast[other].role is not other:
            raise ValueError(f"partners has a policy of {cast[other].role} for {other}")
        if cast[other].limits != limits:
            raise ValueError(f"the policy of {other} has other SpaceLimits than the town's: {limits}")
    return cast
