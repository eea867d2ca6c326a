"""Sessions that are played at the same time equal those that are played one by one, to the byte."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

from dorothie_gym.evaluation.closed_loop.running import RolloutSettings, roll_out
from dorothie_gym.evaluation.rollout import runner
from dorothie_gym.evaluation.rollout.play import SessionCast, play_session, play_together
from dorothie_gym.maps import Town
from dorothie_gym.ontology.roles import AGENT_ROLES, Role
from dorothie_gym.policies.observation_parser import scalar
from dorothie_gym.policies.policy import AnyPolicy
from dorothie_gym.policies.policy_loader import SCRIPTED, Player, find_player, make_policy
from dorothie_gym.policies.trivial import LaneFollowPolicy
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.session.session_engine import SessionEngine
from dorothie_gym.session.spaces import SpaceLimits

LEARNED = {Role.PARTICIPANT: "pretrained:participant", Role.CO_WIZARD: "pretrained:co-wizard"}


def engine(seconds: float, observe_acts: bool) -> SessionEngine:
    return SessionEngine("brookside", config=EnvConfig(max_seconds=seconds, observe_acts=observe_acts))


def files_of(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}


@pytest.mark.parametrize("observe_acts", [True, False])
def test_sessions_of_learned_roles_equal_those_played_alone(tmp_path: Path, observe_acts: bool) -> None:
    engines = [engine(seconds, observe_acts) for seconds in (25.0, 40.0, 40.0)]
    policies = {role: make_policy(LEARNED.get(role, "scripted"), role, engines[0].limits) for role in AGENT_ROLES}
    for number, own in enumerate(engines):
        play_session(own, policies, seed=60 + number, folder=tmp_path / "alone" / str(number))
    casts = [
        SessionCast(host=own, policies=policies, seed=60 + number, folder=tmp_path / "together" / str(number))
        for number, own in enumerate(engines)
    ]
    summaries = play_together(casts)
    assert files_of(tmp_path / "together") == files_of(tmp_path / "alone")
    assert [summary["seconds"] for summary in summaries] == [25.0, 40.0, 40.0]


def test_rollout_of_a_learned_role_does_not_depend_on_the_number_at_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    cast = {role: SCRIPTED for role in AGENT_ROLES}
    cast[Role.CO_WIZARD] = find_player("pretrained:co-wizard", Role.CO_WIZARD)
    settings = RolloutSettings(
        cast=cast, towns=("brookside", "millbrook"), sessions=4, config=EnvConfig(max_seconds=15.0)
    )
    together = roll_out(settings, tmp_path / "together")
    monkeypatch.setattr(runner, "AT_ONCE", 1)
    alone = roll_out(settings, tmp_path / "alone")
    assert together == alone
    assert files_of(tmp_path / "together" / "sessions") == files_of(tmp_path / "alone" / "sessions")


class FailingPolicy(LaneFollowPolicy):
    """Follows its lane, and fails in one town."""

    def initial_state(self, seed: int, town: Town) -> Any:
        return town.name

    def act(self, observation: Mapping[str, Any], state: Any) -> Any:
        if state == "millbrook" and scalar(observation, "time") > 2.0:
            raise RuntimeError("no more")
        return super().act(observation, None)[0], state


def test_session_that_fails_does_not_take_the_others_of_its_batch_along(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def make(self: object, role: Role, limits: SpaceLimits) -> AnyPolicy:
        return FailingPolicy(limits) if role is Role.CO_WIZARD else make_policy("silent", role, limits)

    monkeypatch.setattr(Player, "make", make)
    monkeypatch.setattr(Player, "trained", True)
    config = EnvConfig(max_seconds=5.0)
    settings = RolloutSettings(
        cast=dict.fromkeys(AGENT_ROLES, SCRIPTED), towns=("brookside", "millbrook"), sessions=4, config=config
    )
    rows = roll_out(settings, tmp_path / "rollout").rows
    assert [row.error for row in rows] == [None, "RuntimeError: no more"] * 2
    assert [row.record is not None for row in rows] == [True, False] * 2
