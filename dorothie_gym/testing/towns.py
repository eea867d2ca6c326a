"""Check that a town can be driven, talked about and played in."""

from __future__ import annotations

from pathlib import Path

from dorothie_gym.engine.config import EnvConfig
from dorothie_gym.envs.duo_wizard_v0 import DuoWizardEnv
from dorothie_gym.maps import Town, load_town
from dorothie_gym.maps.lint import check_town as town_faults
from dorothie_gym.testing.playing import play_scripted


def check_town(town: str | Path | Town, *, sessions: int = 3, decisions: int = 40, seed: int = 0) -> None:
    """Checks that a town has no fault that a driver would meet, and that sessions can be played in it.

    Args:
        town: name, file (YAML or OpenDRIVE) or `Town`.
        sessions: scenarios drawn and played with the scripted policies.
        decisions: decisions played in each session.
        seed: of the first session.

    Raises:
        AssertionError: the linter found faults (ten are listed), or the lane graph does not match the lanes.
        TownError: the file cannot be read.
        StoryboardError: no storyboard fits, for example for want of sites.
    """
    if not isinstance(town, Town):
        town = load_town(town)
    faults = town_faults(town)
    listed = "\n".join(
        f"  {fault.kind} at ({fault.position[0]:.1f}, {fault.position[1]:.1f}): {fault.message}"
        for fault in faults[:10]
    )
    assert not faults, f"{town.name}: {len(faults)} faults\n{listed}"
    graph = town.to_graph()
    assert len(graph.features) == len(town.lanes), f"{town.name}: the lane graph must have a node for each lane"
    env = DuoWizardEnv(town, config=EnvConfig())
    for k in range(sessions):
        played = list(play_scripted(env, seed=seed + k, decisions=decisions))
        assert len(played) > 1, f"{town.name}, seed {seed + k}: the session ended at its first decision"
