"""Argument `tier` of environments and text sessions."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from dorothie_gym.evaluation.tiers import find_tier
from dorothie_gym.maps.folds import DEFAULT_TOWN
from dorothie_gym.session.config import EnvConfig

if TYPE_CHECKING:
    from dorothie_gym.ontology.roles import Role


class TierSettings(NamedTuple):
    """Arguments of an environment that are not given: its town, its settings, and policies of the other roles."""

    town: str
    config: EnvConfig | None
    partners: dict[str, str]


def tier_settings(tier: str | None, role: Role | None = None) -> TierSettings:
    """Returns the arguments that a tier gives; without one, the usual ones.

    Args:
        tier: name of the tier, or None.
        role: role of the agent; None for an environment of all roles, which has no partners.

    Raises:
        ValueError: there is no such tier.
    """
    if tier is None:
        return TierSettings(DEFAULT_TOWN, None, {})
    found = find_tier(tier)
    return TierSettings(found.town, found.config, {} if role is None else found.partners(str(role)))
