"""Policies of users: by reference, as classes and as objects, in every place that takes a policy."""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import gymnasium as gym
import pytest
from typer.testing import CliRunner

import dorothie_gym
from dorothie_gym.cli.app import app
from dorothie_gym.errors import ActionError, PolicyLoadError
from dorothie_gym.evaluation.closed_loop import RolloutSettings, roll_out
from dorothie_gym.evaluation.closed_loop.cross_play import CrossPlaySettings
from dorothie_gym.evaluation.closed_loop.leaderboard_plan import LeaderboardPlan
from dorothie_gym.evaluation.rollout import play_session
from dorothie_gym.lab.console.seating import parse_roles
from dorothie_gym.ontology import AGENT_ROLES, Role
from dorothie_gym.policies import SilentPolicy, find_player, make_policy, player_of
from dorothie_gym.policies.policy import Policy
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.session.session_engine import SessionEngine
from dorothie_gym.session.spaces import SpaceLimits

SOURCE = """
from dorothie_gym import Policy


class Stops(Policy):
    def initial_state(self, seed, town):
        return 0

    def step(self, observation, state):
        return {"physical": 5}, state + 1


class WithoutState(Stops):
    def step(self, observation, state):
        return {"physical": 5}


class Misspelt(Stops):
    def step(self, observation, state):
        return {"physicl": 4}, state


class Unfinished(Policy):
    def initial_state(self, seed, town):
        return 0


class Weighted(Stops):
    def __init__(self, weights, limits=None):
        super().__init__("co_wizard", limits)


class Plain:
    pass


number = 4
"""
SHORT = EnvConfig(max_seconds=4.0)


class Stops(Policy[int]):
    """Co-Wizard that stops."""

    def initial_state(self, seed: int, town: object) -> int:
        return 0

    def step(self, observation: Mapping[str, Any], state: int) -> tuple[dict[str, Any], int]:
        return {"physical": 5}, state + 1


class Numbers(Stops):
    """Policy whose action is no dict."""

    def step(self, observation: Mapping[str, Any], state: int) -> tuple[Any, int]:
        return [4], state


@pytest.fixture
def module(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    name = f"policies_of_{tmp_path.name}".replace("-", "_")
    (tmp_path / f"{name}.py").write_text(SOURCE)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", list(sys.path))
    return name


def invoke(*arguments: object) -> Any:
    return CliRunner().invoke(app, list(map(str, arguments)))


def test_class_of_the_working_folder_plays_a_run_and_a_rollout(module: str, tmp_path: Path) -> None:
    ran = invoke("run", "--co-wizard", f"{module}:Stops", "--max-seconds", 4, "--json")
    assert ran.exit_code == 0, ran.output
    assert json.loads(ran.stdout)["seconds"] == 4.0
    rolled = invoke(
        "rollout", "--co-wizard", f"{module}:Stops", "--towns", "brookside", "--sessions", 2, "--max-seconds", 4,
        "--workers", 2, "--out", tmp_path / "kept", "--json",
    )  # fmt: skip
    assert rolled.exit_code == 0, rolled.output
    page = json.loads(rolled.stdout)
    assert page["errored"] == 0
    settings = json.loads((tmp_path / "kept" / "settings.json").read_text())
    assert settings["co_wizard"] == f"{module}:Stops"
    assert settings["sha256"]["co_wizard"] == find_player(f"{module}:Stops", Role.CO_WIZARD).sha256


def test_class_plays_cross_play_leaderboard_console_and_environment(module: str) -> None:
    name = f"{module}:Stops"
    crossed = invoke(
        "cross-play", "--co-wizard", name, "--participant", "silent", "--towns", "brookside", "--sessions", 1,
        "--max-seconds", 4, "--workers", 1, "--json",
    )  # fmt: skip
    assert crossed.exit_code == 0, crossed.output
    assert json.loads(crossed.stdout)["co_wizards"] == [name]
    assert LeaderboardPlan(co_wizards=[name]).players[0].name == name
    assert parse_roles(f"co_wizard={name},participant=silent")[Role.CO_WIZARD].player.name == name
    env = gym.make("dorothie_gym/Participant-v0", town="brookside", partners={"co_wizard": name}, config=SHORT)
    env.reset(seed=1)
    env.step({})


@pytest.mark.parametrize(
    ("reference", "message"),
    [
        ("no_such_module:Stops", "there is no module 'no_such_module' in"),
        ("MODULE:Stop", "has no 'Stop'; did you mean 'Stops'"),
        ("MODULE.py:Stops", "name the module, not the file: MODULE:Stops"),
        ("MODULE:Plain", "MODULE:Plain is no policy; derive it from dorothie_gym.Policy"),
        ("MODULE:number", "MODULE:number is no class"),
        ("MODULE:Unfinished", "MODULE:Unfinished has no step; derive it"),
        ("MODULE:Weighted", "MODULE:Weighted needs the arguments weights"),
    ],
)
def test_mistakes_in_a_reference_are_one_line_on_the_command_line(module: str, reference: str, message: str) -> None:
    done = invoke("run", "--co-wizard", reference.replace("MODULE", module), "--max-seconds", 4)
    assert done.exit_code == 2
    assert message.replace("MODULE", module) in done.output and done.output.count("\n") == 1


def test_module_that_fails_to_import_is_reported_with_its_error(module: str, tmp_path: Path) -> None:
    (tmp_path / f"{module}_broken.py").write_text("1 / 0")
    (tmp_path / f"{module}_needy.py").write_text("import no_such_library")
    with pytest.raises(PolicyLoadError, match="fails: ZeroDivisionError: division by zero"):
        make_policy(f"{module}_broken:A", Role.CO_WIZARD)
    with pytest.raises(PolicyLoadError, match="imports no_such_library, which is not installed"):
        make_policy(f"{module}_needy:A", Role.CO_WIZARD)


@pytest.mark.parametrize(
    ("policy", "message"),
    [
        ("WithoutState", "the policy of co_wizard returned a dict; step must return the pair (action, state)"),
        ("Misspelt", "action of co_wizard: field 'physicl' is unknown; did you mean 'physical'?"),
    ],
)
def test_wrong_results_of_step_are_named(module: str, policy: str, message: str) -> None:
    done = invoke("run", "--co-wizard", f"{module}:{policy}", "--max-seconds", 4, "--no-picture")
    assert done.exit_code == 2 and message in done.output.replace("\n", " ")


def test_wrong_type_of_action_names_role_and_value() -> None:
    engine = SessionEngine("brookside", config=SHORT)
    policies = {role: make_policy("silent", role, engine.limits) for role in AGENT_ROLES}
    with pytest.raises(ActionError, match="expected a dict of fields or a CoWizardAction, got list"):
        play_session(engine, {**policies, Role.CO_WIZARD: Numbers(Role.CO_WIZARD, engine.limits)}, seed=1)


@pytest.mark.parametrize("given", [Stops, Stops(Role.CO_WIZARD)], ids=["class", "object"])
def test_rollout_takes_classes_and_objects(given: Any, tmp_path: Path) -> None:
    cast = {Role.CO_WIZARD: given, Role.PARTICIPANT: "scripted", Role.AD_WIZARD: "silent"}
    settings = RolloutSettings(cast=cast, towns=("brookside",), sessions=1, config=SHORT)
    result = roll_out(settings, tmp_path)
    assert not result.errored and result.settings["co_wizard"] == f"{__name__}:Stops"
    assert CrossPlaySettings(co_wizards=[given], participants=["silent"], towns=("brookside",)).rows[0].policy is given


def test_policy_of_another_role_or_of_other_sizes_is_refused() -> None:
    with pytest.raises(PolicyLoadError, match="acts for participant, not for co_wizard"):
        player_of(SilentPolicy(Role.PARTICIPANT), Role.CO_WIZARD)
    limits = SpaceLimits(lanes=2000)
    with pytest.raises(PolicyLoadError, match="has other SpaceLimits than the town; pass its class"):
        player_of(Stops(Role.CO_WIZARD), Role.CO_WIZARD).make(Role.CO_WIZARD, limits)
    assert player_of(Stops, Role.CO_WIZARD).make(Role.CO_WIZARD, limits).limits == limits


def test_policy_is_public() -> None:
    assert issubclass(Stops, dorothie_gym.Policy)
