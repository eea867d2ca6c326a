"""Players of the three roles from the options of a command line."""

from __future__ import annotations

from typing import TYPE_CHECKING

from dorothie_gym.cli.output import fail

if TYPE_CHECKING:
    from dorothie_gym.ontology import Role
    from dorothie_gym.policies import Player


def find_cast(participant: str, co_wizard: str, ad_wizard: str) -> dict[Role, Player]:
    """Returns the player of each role; exits if a name or file is unknown.

    Args:
        participant: name of a policy, or file of a learned policy.
        co_wizard: as for the participant.
        ad_wizard: as for the participant.
    """
    from dorothie_gym.errors import PolicyLoadError
    from dorothie_gym.ontology import AGENT_ROLES
    from dorothie_gym.policies import find_player

    given = dict(zip(AGENT_ROLES, (participant, co_wizard, ad_wizard), strict=True))
    try:
        cast = {role: find_player(name, role) for role, name in given.items()}
    except PolicyLoadError as error:
        fail(str(error))
    for role, player in cast.items():
        if player.path is not None:
            _check_loads(player, role)
    return cast


def _check_loads(player: Player, role: Role) -> None:
    """Loads a learned policy once, so that a damaged file is reported before the first session."""
    from dorothie_gym.spaces import SpaceLimits

    try:
        player.make(role, SpaceLimits())
    except ImportError as error:
        fail(f"{role}: {player.name} needs {error.name}; run: pip install 'dorothie-gym[baselines]'")
    except ValueError as error:
        fail(f"{role}: {error}")
