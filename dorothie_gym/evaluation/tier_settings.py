"""Argument `tier` of environments and text sessions."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeVar

from dorothie_gym.evaluation.tiers import find_tier
from dorothie_gym.maps.folds import DEFAULT_TOWN

if TYPE_CHECKING:
    from dorothie_gym.ontology.roles import Role
    from dorothie_gym.session.config import EnvConfig

T = TypeVar("T")
C = TypeVar("C")


def tier_settings(
    tier: str | None, town: T | None, config: C | None, role: Role | None = None
) -> tuple[T | str, C | EnvConfig | None, dict[str, str]]:
    """Returns town, settings and partners of an environment: those of its tier where they are not given.

    Args:
        tier: name of the tier, or None.
        town: town that is given.
        config: settings that are given.
        role: role of the agent; None for an environment of all roles, which has no partners.

    Raises:
        ValueError: there is no such tier.
    """
    if tier is None:
        return DEFAULT_TOWN if town is None else town, config, {}
    found = find_tier(tier)
    partners = {} if role is None else found.partners(str(role))
    return found.town if town is None else town, found.config if config is None else config, partners
