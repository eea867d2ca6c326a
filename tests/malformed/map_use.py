"""Use of a map as every command uses it: description, check, picture, written file, and the beginning of a session."""

from __future__ import annotations

from pathlib import Path
from random import Random

SECONDS = 30.0
"""Time that is played [s]."""


def use_map(path: Path, random: Random) -> None:
    """Reads and checks a map; at times it is drawn, written and read back, or played in.

    Raises:
        DorothieGymError: the map is refused, or has too few places for a session.
    """
    from dorothie_gym.maps import check_town, describe, load_town
    from dorothie_gym.maps.catalogue import import_report
    from dorothie_gym.sim.network.network import TownNetwork
    from dorothie_gym.sim.state.town_arrays import town_arrays

    town = load_town(path)
    describe(town)
    check_town(town)
    import_report(path)
    town_arrays(TownNetwork(town))
    choice = random.random()
    if choice < 0.05:
        _draw(path)
    elif choice < 0.1:
        _write(path)
    elif choice < 0.4:
        _play(path, random.randrange(1000))


def _draw(path: Path) -> None:
    from dorothie_gym.maps import load_town
    from dorothie_gym.pictures import town_picture

    town_picture(load_town(path), path.with_suffix(".png"))


def _write(path: Path) -> None:
    from dorothie_gym.maps import load_town, write_opendrive
    from dorothie_gym.maps.opendrive import import_opendrive

    out = path.with_suffix(".written.xodr")
    write_opendrive(load_town(path), out)
    import_opendrive(out)


def _play(path: Path, seed: int) -> None:
    from dorothie_gym.maps import load_town
    from dorothie_gym.ontology.roles import AGENT_ROLES
    from dorothie_gym.policies.policy import policy_inputs
    from dorothie_gym.policies.policy_loader import make_policy
    from dorothie_gym.session.session_engine import SessionEngine

    engine = SessionEngine(load_town(path))
    engine.reset(seed=seed)
    policies = {role: make_policy("scripted", role, engine.limits) for role in AGENT_ROLES}
    states = {role: policy.initial_state(seed, engine.town) for role, policy in policies.items()}
    while not engine.over and engine.session.world.time < SECONDS:
        inputs, actions = policy_inputs(engine, policies), {}
        for role, policy in policies.items():
            actions[str(role)], states[role] = policy.step(inputs[role], states[role])
        engine.step(actions)
