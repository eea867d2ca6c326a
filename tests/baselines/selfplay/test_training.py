from __future__ import annotations

import errno
import json
import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("sb3_contrib", reason="needs the extra 'baselines'")

import torch
from safetensors.torch import load_file

from dorothie_gym.baselines.rl.resumption import CHECKPOINT
from dorothie_gym.baselines.rl.settings import SelfPlaySettings, selfplay_settings
from dorothie_gym.baselines.selfplay import training as training_module
from dorothie_gym.baselines.selfplay.env import SelfPlaySessions
from dorothie_gym.baselines.selfplay.training import SelfPlayTraining
from dorothie_gym.errors import ModelFileError, SettingsError
from dorothie_gym.ontology import AGENT_ROLES, Role

SMALL: dict[str, Any] = {
    "steps": 128, "environments": 2, "past_environments": 1, "evaluate_every": 128, "episodes": 1, "network": (8,),
    "traffic": "none", "max_seconds": 10.0, "parameters": {"n_steps": 8, "batch_size": 16, "n_epochs": 1},
}  # fmt: skip


def settings_for(**changes: Any) -> SelfPlaySettings:
    return SelfPlaySettings(**{**SMALL, **changes})


@pytest.fixture(autouse=True)
def _frequent_checkpoints(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(training_module, "ROLLOUTS_PER_CHECKPOINT", 2)


def weights(folder: Path) -> dict[str, torch.Tensor]:
    """Everything that was saved of the three roles."""
    return {
        f"{role}/{name}": value
        for role in AGENT_ROLES
        for name, value in load_file(folder / role / "model.safetensors").items()
    }


def assert_same(one: Path, two: Path) -> None:
    first, second = weights(one), weights(two)
    assert first.keys() == second.keys()
    for name, value in first.items():
        np.testing.assert_array_equal(value.numpy(), second[name].numpy(), err_msg=name)


@pytest.mark.parametrize("shared", [False, True])
def test_networks_learn_and_are_saved(shared: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(training_module, "ROLLOUTS_PER_CHECKPOINT", 16)  # the Ad-Wizard may only wait at first
    play = SelfPlayTraining(settings_for(shared=shared, max_seconds=30.0), tmp_path)
    before = [
        {name: value.clone() for name, value in learner.model.policy.state_dict().items()}
        for learner in play.rollout.learners
    ]
    run = play.run()
    assert run.finished and run.steps == 128 and [row.steps for row in run.rows] == [128]
    assert len(play.rollout.learners) == (1 if shared else 3)
    for learner, old in zip(play.rollout.learners, before, strict=True):
        assert all(not torch.equal(value, old[name]) for name, value in learner.model.policy.state_dict().items())
    assert run.rows[-1].returns["co_wizard"] == run.rows[-1].returns["participant"] is not None
    assert run.rows[-1].returns["ad_wizard"] != run.rows[-1].returns["co_wizard"]
    found = {path.name for path in tmp_path.iterdir()}
    assert {*AGENT_ROLES, "curve.png", "progress.jsonl", CHECKPOINT} <= found
    assert json.loads((tmp_path / "co_wizard" / "model.json").read_text(encoding="utf-8"))["kind"] == "selfplay"
    assert not list(tmp_path.rglob("*.zip")) and not list(tmp_path.rglob("*.pkl"))


@pytest.mark.long
@pytest.mark.parametrize("shared", [False, True])
def test_resumed_run_ends_with_the_same_weights(shared: bool, tmp_path: Path) -> None:
    settings = settings_for(shared=shared, max_seconds=5.0)
    SelfPlayTraining(settings, tmp_path / "whole").run()

    def press_ctrl_c(done: int, total: int, row: Any) -> None:
        if done == 80:
            raise KeyboardInterrupt

    cut = SelfPlayTraining(settings, tmp_path / "cut", press_ctrl_c).run()
    assert not cut.finished and cut.steps == 64
    again = SelfPlayTraining(settings, tmp_path / "cut").run()
    assert again.finished and again.steps == 128
    assert_same(tmp_path / "whole", tmp_path / "cut")
    rows = [json.loads((tmp_path / name / "progress.jsonl").read_text(encoding="utf-8")) for name in ("whole", "cut")]
    assert {**rows[0], "seconds": 0} == {**rows[1], "seconds": 0}


def test_run_killed_between_two_files_of_a_checkpoint_is_resumed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    settings = settings_for(max_seconds=5.0, steps=64)
    SelfPlayTraining(settings, tmp_path / "whole").run()
    for written in (1, 4):  # files before the failure: the roles' are replaced one after another
        with monkeypatch.context() as patched:
            fail_after(written, patched)
            with pytest.raises(OSError, match="No space left"):
                SelfPlayTraining(settings, tmp_path / "cut").run()
    assert SelfPlayTraining(settings, tmp_path / "cut").run().finished
    assert_same(tmp_path / "whole", tmp_path / "cut")


def fail_after(written: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Lets the replacement of files fail after a number of them."""
    replace, left = os.replace, iter(range(written))

    def failing(one: Any, two: Any) -> None:
        if next(left, None) is None:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        replace(one, two)

    monkeypatch.setattr("dorothie_gym.files.os.replace", failing)


@pytest.mark.long
def test_worker_processes_do_not_change_the_weights(tmp_path: Path) -> None:
    more = {"steps": 64, "environments": 4, "coached_environments": 2}
    SelfPlayTraining(settings_for(**more), tmp_path / "here").run()
    SelfPlayTraining(settings_for(**more, workers=2), tmp_path / "there").run()
    assert_same(tmp_path / "here", tmp_path / "there")
    SelfPlayTraining(settings_for(**more, seed=1), tmp_path / "other").run()
    name = "co_wizard/policy/action_net.weight"
    assert not torch.equal(weights(tmp_path / "here")[name], weights(tmp_path / "other")[name])


@pytest.mark.parametrize("shared", [False, True])
def test_coached_roles_learn_beside_scripted_ones(shared: bool, tmp_path: Path) -> None:
    settings = settings_for(environments=4, coached_environments=2, shared=shared)
    rollout = SelfPlayTraining(settings, tmp_path).rollout
    learns = {
        env: {AGENT_ROLES[role] for learner in rollout.learners for k, role in learner.players.tolist() if k == env}
        for env in range(4)
    }
    team = {Role.PARTICIPANT, Role.CO_WIZARD}
    assert learns == {0: {Role.CO_WIZARD}, 1: {Role.PARTICIPANT}, 2: {*AGENT_ROLES}, 3: team}
    assert [set(env.scripted) for env in rollout._vector.envs] == [{*AGENT_ROLES} - learns[k] for k in range(2)] + [
        set()
    ] * 2
    rollout.close()


@pytest.mark.parametrize("shared", [False, True])
def test_only_the_ad_wizard_learns_against_two_partners(shared: bool, tmp_path: Path) -> None:
    settings = settings_for(shared=shared, participant="scripted", co_wizard="lane-follow", max_seconds=30.0)
    play = SelfPlayTraining(settings, tmp_path / "whole")
    (learner,) = play.rollout.learners
    before = {name: value.clone() for name, value in learner.model.policy.state_dict().items()}
    assert play.run().finished
    assert any(not torch.equal(value, before[name]) for name, value in learner.model.policy.state_dict().items())
    assert {path.name for path in (tmp_path / "whole").iterdir() if path.name in AGENT_ROLES} == {"ad_wizard"}

    def press_ctrl_c(done: int, total: int, row: Any) -> None:
        if done == 80:
            raise KeyboardInterrupt

    assert not SelfPlayTraining(settings, tmp_path / "cut", press_ctrl_c).run().finished
    assert SelfPlayTraining(settings, tmp_path / "cut").run().finished
    one, two = (load_file(tmp_path / run / "ad_wizard" / "model.safetensors") for run in ("whole", "cut"))
    assert one.keys() == two.keys() and all(torch.equal(value, two[name]) for name, value in one.items())


def test_role_without_partner_learns_beside_one(tmp_path: Path) -> None:
    rollout = SelfPlayTraining(settings_for(co_wizard="scripted"), tmp_path).rollout
    assert [learner.name for learner in rollout.learners] == ["participant", "ad_wizard"]
    rollout.close()


@pytest.mark.parametrize("shared", [False, True])
def test_masked_actions_are_never_chosen(shared: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    step, seen = SelfPlaySessions.step, []

    def watched(self: SelfPlaySessions, actions: Any) -> Any:
        for number, chosen in enumerate(actions):
            for k, (role, interface) in enumerate(zip(AGENT_ROLES, self.interfaces, strict=True)):
                observation, memory = self.observation(role, number), self.players[number].memories[k]
                masks = self.duo.engines[number].mask(role)
                allowed = interface.mask(observation, memory) & interface.permitted(observation, memory, masks)
                seen.append(bool(allowed[chosen[k]]))
        return step(self, actions)

    monkeypatch.setattr(SelfPlaySessions, "step", watched)
    SelfPlayTraining(settings_for(shared=shared, max_seconds=60.0), tmp_path).run()
    assert len(seen) > 3 * 128 and all(seen)


def test_tensorboard_logs_rewards_losses_and_success(tmp_path: Path) -> None:
    accumulator = pytest.importorskip("tensorboard.backend.event_processing.event_accumulator")
    SelfPlayTraining(settings_for(steps=32, max_seconds=5.0), tmp_path).run()
    tags = set()
    for folder in (tmp_path / "tensorboard").iterdir():
        events = accumulator.EventAccumulator(str(folder))
        events.Reload()
        tags |= {(folder.name, tag) for tag in events.Tags()["scalars"]}
    for role in AGENT_ROLES:
        assert {(role, "train/value_loss"), (role, f"rollout/return_{role}")} <= tags
    assert ("participant", "eval/success_against_scripted") in tags


def test_runs_with_other_settings_and_damaged_runs_are_refused(tmp_path: Path) -> None:
    SelfPlayTraining(settings_for(), tmp_path).run()
    with pytest.raises(SettingsError, match="another shared"):
        SelfPlayTraining(settings_for(shared=True), tmp_path)
    (tmp_path / CHECKPOINT).write_bytes(b"nothing")
    with pytest.raises(ModelFileError, match=r"checkpoint\.safetensors"):
        SelfPlayTraining(settings_for(), tmp_path)


@pytest.mark.parametrize(
    ("given", "named"),
    [
        ({"colour": 1}, "colour"),
        ({"shared": "maybe"}, "shared"),
        ({"past_environments": 99}, "past_environments"),
        ({"past_environments": 4, "coached_environments": 12}, "coached_environments"),
        ({"participant": "scripted", "coached_environments": 2}, "coached_environments"),
        ({"co_wizard": 7}, "co_wizard"),
    ],
)
def test_invalid_settings_are_named(given: dict[str, Any], named: str) -> None:
    with pytest.raises(SettingsError, match=named):
        selfplay_settings(given)


def test_partner_that_cannot_be_found_is_named(tmp_path: Path) -> None:
    with pytest.raises(SettingsError, match=r"nobody.*lane-follow"):
        SelfPlayTraining(settings_for(co_wizard="nobody"), tmp_path)
    with pytest.raises(SettingsError, match="participant"):
        SelfPlayTraining(settings_for(participant="lane-follow"), tmp_path)


def test_numbers_of_partial_environments_scale_with_environments() -> None:
    one, eight = selfplay_settings(environments=1), selfplay_settings(environments=8)
    assert (one.past_environments, one.coached_environments) == (0, 0)
    assert (eight.past_environments, eight.coached_environments) == (2, 4)
    settings = selfplay_settings({"shared": True}, steps=7, episodes=None)
    assert settings.shared and settings.steps == 7
    assert SelfPlaySettings(**json.loads(json.dumps(settings.as_json()))) == settings
