from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("sb3_contrib", reason="needs the extra 'baselines'")

from dorothie_gym import DuoWizardEnv
from dorothie_gym.baselines.selfplay.env import SelfPlayEnv
from dorothie_gym.baselines.selfplay.policy import read_policy
from dorothie_gym.baselines.selfplay.training import SelfPlayTraining
from dorothie_gym.ontology import AGENT_ROLES, Role
from dorothie_gym.policies import find_player
from dorothie_gym.rollout.play import play_session
from tests.baselines.selfplay.test_training import settings_for


@pytest.fixture(scope="module", params=[False, True], ids=["independent", "shared"])
def folder(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("run")
    SelfPlayTraining(settings_for(shared=request.param, steps=32), folder).run()
    return folder


def test_learned_roles_play_reproducibly(folder: Path) -> None:
    def play() -> list[object]:
        env = DuoWizardEnv("brookside", max_cycles=40)
        cast = {role: find_player(str(folder / role), role).make(role, env.limits) for role in AGENT_ROLES}
        events: list[object] = []
        summary = play_session(env, cast, seed=3, on_step=lambda env: events.extend(env.last_events))
        assert summary["seconds"] == 20.0
        return events

    first = play()
    assert len(first) > 5 and first == play()


def test_policy_input_equals_that_of_training(folder: Path) -> None:
    env = SelfPlayEnv(traffic="none", max_seconds=10.0)
    row, _ = env.reset(seed=0)
    policies = [read_policy(folder / role, role, env.sessions.duo.limits) for role in AGENT_ROLES]
    states = [policy.initial_state(0, env.sessions.town) for policy in policies]
    for _ in range(10):
        for k, (role, policy) in enumerate(zip(AGENT_ROLES, policies, strict=True)):
            interface, memory = states[k].interface, states[k].memory
            seen = env.sessions.observation(role, 0)
            vector = interface.vector(seen, interface.update(seen, memory))
            np.testing.assert_array_equal(vector, env.layout.vectors(row[None], k, padded=False)[0])
            _, states[k] = policy.step(seen, states[k])
        env.sessions.players[0].memories = [state.memory for state in states]
        row, *_ = env.step(np.zeros(3, dtype=np.int64))


def test_models_of_another_role_or_version_are_refused(folder: Path) -> None:
    with pytest.raises(ValueError, match="plays participant, not co_wizard"):
        read_policy(folder / "participant", Role.CO_WIZARD, DuoWizardEnv().limits)
    description = folder / "ad_wizard" / "model.json"
    description.write_text(
        description.read_text(encoding="utf-8").replace('"size": 484', '"size": 488'), encoding="utf-8"
    )
    with pytest.raises(ValueError, match="takes 488 numbers .* another version"):
        read_policy(folder / "ad_wizard", Role.AD_WIZARD, DuoWizardEnv().limits)
    (folder / "participant" / "model.json").write_text('{"format": 1, "kind": "selfplay"}', encoding="utf-8")
    with pytest.raises(ValueError, match="no model of self-play"):
        read_policy(folder / "participant", Role.PARTICIPANT, DuoWizardEnv().limits)


@pytest.mark.parametrize("co_wizard", ["scripted", "pretrained:co-wizard"])
def test_partners_play_as_in_any_other_session(co_wizard: str) -> None:
    adversary = SelfPlayEnv("midtown", traffic="none", max_seconds=60.0, participant="scripted", co_wizard=co_wizard)
    adversary.reset(seed=5)
    engine, events, over = adversary.sessions.duo.engines[0], list[object](), False
    while not over:
        _, _, _, over, _ = adversary.step(np.zeros(3, dtype=np.int64))  # the Ad-Wizard does nothing
        events.extend(engine.last_events)

    env = DuoWizardEnv("midtown", config=adversary.sessions.duo.config)
    names = {Role.PARTICIPANT: "scripted", Role.CO_WIZARD: co_wizard, Role.AD_WIZARD: "silent"}
    cast = {role: find_player(name, role).make(role, env.limits) for role, name in names.items()}
    played: list[object] = []
    play_session(env, cast, seed=5, on_step=lambda env: played.extend(env.last_events))
    assert len(events) > 5 and events == played
    adversary.close()
