from __future__ import annotations

import numpy as np
import pytest

from dorothie_gym.envs.duo_wizard_v0 import DuoWizardEnv
from dorothie_gym.maps import load_town
from dorothie_gym.ontology import PropKind, Role
from dorothie_gym.session.actor_table import actors_around
from dorothie_gym.session.recorder import LightStates, compact, expand, idle_actions
from dorothie_gym.session.recording import ActorKind, Decision


@pytest.mark.parametrize("seed", range(5))
def test_compact_actions_expand_to_the_originals(seed: int) -> None:
    env = DuoWizardEnv("brookside")
    for agent in env.possible_agents:
        env.action_space(agent).seed(seed)
    for _ in range(20):
        actions = {agent: env.action_space(agent).sample() for agent in env.possible_agents}
        again = expand(Decision(frame=0, actions=compact(actions, env.limits)), env.limits)
        for agent, action in actions.items():
            assert again[agent].keys() == action.keys()
            assert all(np.array_equal(again[agent][name], value) for name, value in action.items())


def test_idle_actions_are_omitted() -> None:
    limits = DuoWizardEnv("brookside").limits
    assert compact(idle_actions(limits), limits) == {}
    said = {**idle_actions(limits), "participant": {**idle_actions(limits)["participant"], "move": 3}}
    assert compact(said, limits) == {Role.PARTICIPANT: {"move": 3}}


def test_every_actor_is_recorded_once() -> None:
    env = DuoWizardEnv("brookside")
    env.reset(seed=3)
    actors = env.session.world.actors
    actors.add_prop(next(iter(PropKind)), 3, 20.0)
    rows = actors_around(env.session.world)
    expected = {
        (body.key, body.position[0], body.position[1], body.heading, body.speed, body.LENGTH, body.WIDTH)
        for body in (*actors.vehicles, *actors.pedestrians, *actors.props)
    }
    assert len(rows) == len(expected) == len(set(rows["key"].tolist()))
    names = ("key", "x", "y", "heading", "speed", "length", "width")
    assert {tuple(row[name].item() for name in names) for row in rows} == expected
    assert (rows["kind"] == ActorKind.PEDESTRIAN).sum() == len(actors.pedestrians)
    assert (rows["kind"] == ActorKind.PROP).sum() == 1


def test_recorded_lights_equal_programme_at_any_time() -> None:
    town = load_town("midtown")
    lights = LightStates(town)
    signals = {signal for programme in town.programmes for signal in programme.signals}
    assert signals
    for time in [*np.arange(0.0, 200.0, 0.5), 7.0, 1000.0]:
        shown = lights.at(float(time))
        assert shown.keys() == signals
        for programme in town.programmes:
            assert all(shown[signal] is programme.colour(signal, float(time)) for signal in programme.signals)
