"""Who plays, from a command line."""

from __future__ import annotations

from typing import TYPE_CHECKING

from dorothie_gym.cli.output import fail

if TYPE_CHECKING:
    from dorothie_gym.ontology import Role
    from dorothie_gym.policies import Player


def find_cast(participant: str, co_wizard: str, ad_wizard: str) -> dict[Role, Player]:
    """Returns who plays each role; fails where a name or file is none.

    Args:
        participant: name of a policy, or file of a learned one.
        co_wizard: likewise.
        ad_wizard: likewise.
    """
    from dorothie_gym.errors import PolicyLoadError
    from dorothie_gym.ontology import AGENT_ROLES
    from dorothie_gym.policies import find_player, policy_names

    given = dict(zip(AGENT_ROLES, (participant, co_wizard, ad_wizard), strict=True))
    if any(name not in policy_names(role) for role, name in given.items()):
        import dorothie_gym.baselines  # noqa: F401  # what is learned there makes itself known
    try:
        cast = {role: find_player(name, role) for role, name in given.items()}
    except PolicyLoadError as error:
        fail(str(error))
    for role, player in cast.items():
        if player.path is not None:
            _try(player, role)
    return cast


def _try(player: Player, role: Role) -> None:
    """Reads a learned player once, so that a damaged or unfit file is told before the first session, not in each."""
    from dorothie_gym.spaces import SpaceLimits

    try:
        player.make(role, SpaceLimits())
    except ImportError as error:
        fail(f"{role}: {player.name} needs {error.name}; pip install 'dorothie-gym[baselines]' brings it")
    except ValueError as error:
        fail(f"{role}: {error}")
