"""Sessions that are played at the same time equal those that are played one by one, to the byte."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

from dorothie_gym.evaluation.closed_loop.running import RolloutSettings, roll_out
from dorothie_gym.evaluation.rollout import runner
from dorothie_gym.evaluation.rollout.play import SessionCast, play_session, play_together
from dorothie_gym.ontology.roles import AGENT_ROLES, Role
from dorothie_gym.policies.policy_loader import SCRIPTED, find_player, make_policy
from dorothie_gym.policies.trivial import LaneFollowPolicy
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.session.session_engine import SessionEngine

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
    assert [summary["decisions"] for summary in summaries] == [50, 80, 80]


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
    """Follows its lane, and fails in sessions of one town."""

    def act(self, observation: Mapping[str, Any], state: None) -> Any:
        if len(observation["street_names"]) and float(observation["time"]) > 2.0 and self.fails:
            raise RuntimeError("no more")
        return super().act(observation, state)

    fails = False


def test_session_that_fails_does_not_take_the_others_of_its_batch_along(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made: list[FailingPolicy] = []

    def make(self: object, role: Role, limits: Any) -> Any:
        if role is not Role.CO_WIZARD:
            return make_policy("silent", role, limits)
        made.append(FailingPolicy(limits))
        made[-1].fails = limits == towns["millbrook"].limits
        return made[-1]

    towns = {town: SessionEngine(town) for town in ("brookside", "millbrook")}
    monkeypatch.setattr(type(SCRIPTED), "make", make)
    monkeypatch.setattr(type(SCRIPTED), "trained", property(lambda self: True))
    cast = dict.fromkeys(AGENT_ROLES, SCRIPTED)
    settings = RolloutSettings(
        cast=cast, towns=("brookside", "millbrook"), sessions=4, config=EnvConfig(max_seconds=5.0)
    )
    rows = roll_out(settings, tmp_path / "rollout").rows
    assert [row.error for row in rows] == [None, "RuntimeError: no more"] * 2
    assert [row.record is not None for row in rows] == [True, False] * 2
