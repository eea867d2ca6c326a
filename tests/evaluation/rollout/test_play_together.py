"""Sessions that are played at the same time equal those that are played one by one, to the byte."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pytest

from dorothie_gym.evaluation.closed_loop.running import RolloutPlan, RolloutSettings, roll_out
from dorothie_gym.evaluation.rollout import runner
from dorothie_gym.evaluation.rollout.play import SessionCast, play_as_they_end, play_session, play_together
from dorothie_gym.evaluation.rollout.runner import SessionJob, run_sessions
from dorothie_gym.maps import Town
from dorothie_gym.ontology.roles import AGENT_ROLES, Role
from dorothie_gym.policies.observation_parser import scalar
from dorothie_gym.policies.policy import AnyPolicy, BatchPolicy
from dorothie_gym.policies.policy_loader import ALL_SCRIPTED, SCRIPTED, Player, find_player, make_policy, player_of
from dorothie_gym.policies.trivial import LaneFollowPolicy
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.session.recording.files import SessionState
from dorothie_gym.session.recording.session import Session, session_state
from dorothie_gym.session.session_engine import SessionEngine
from dorothie_gym.session.spaces import CoWizardAction, SpaceLimits

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


def test_session_is_complete_when_it_ends_though_others_go_on(tmp_path: Path) -> None:
    engines = [engine(seconds, True) for seconds in (12.0, 6.0)]
    policies = {role: make_policy("silent", role, engines[0].limits) for role in AGENT_ROLES}
    casts = [
        SessionCast(host=own, policies=policies, seed=number, folder=tmp_path / str(number))
        for number, own in enumerate(engines)
    ]
    ended = play_as_they_end(casts)
    number, summary = next(ended)
    assert (number, summary["seconds"]) == (1, 6.0)
    assert [session_state(tmp_path / str(each)) for each in (0, 1)] == [
        SessionState.PARTIAL,
        SessionState.FINISHED,
    ]
    assert [number for number, _ in ended] == [0]


def test_run_that_is_left_early_keeps_the_sessions_that_have_ended(tmp_path: Path) -> None:
    cast = {**ALL_SCRIPTED, Role.CO_WIZARD: find_player("pretrained:co-wizard", Role.CO_WIZARD)}
    job = SessionJob(
        settings_file="settings.json",
        settings={},
        config=EnvConfig(max_seconds=4.0),
        cast=cast,
        evaluate=lambda played: played.session.header.seed,
    )
    plans = [RolloutPlan(number=seed, town="brookside", seed=seed) for seed in range(3)]
    reports: list[tuple[int, int]] = []

    def note(finished: int, planned: int) -> None:
        reports.append((finished, planned))

    with run_sessions(job, plans, tmp_path, on_session=note) as outcomes:
        first = next(outcomes)
        second = next(outcomes)
    assert [first.success, second.success] == [first.plan.seed, second.plan.seed]
    kept = [session_state(tmp_path / plan.path) is SessionState.FINISHED for plan in plans]
    assert kept == [plan in (first.plan, second.plan) for plan in plans]
    assert reports == [(0, 3), (1, 3)]
    with run_sessions(job, plans, tmp_path) as outcomes:
        assert sorted((each.plan.seed, each.played) for each in outcomes) == [
            (plan.seed, plan not in (first.plan, second.plan)) for plan in plans
        ]


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
    monkeypatch.setattr(Player, "may_batch", True)
    config = EnvConfig(max_seconds=5.0)
    settings = RolloutSettings(
        cast=dict.fromkeys(AGENT_ROLES, SCRIPTED), towns=("brookside", "millbrook"), sessions=4, config=config
    )
    rows = roll_out(settings, tmp_path / "rollout").rows
    assert [row.error for row in rows] == [None, "RuntimeError: no more"] * 2
    assert [row.record is not None for row in rows] == [True, False] * 2


class CountingDriver(LaneFollowPolicy):
    """Starts the car, and keeps in itself, not in its state, that it has."""

    def __init__(self, limits: SpaceLimits | None = None) -> None:
        super().__init__(limits)
        self.count = 0

    def act(self, observation: Mapping[str, Any], state: Any) -> Any:
        self.count += 1
        action, state = super().act(observation, state)
        return action if self.count == 1 else CoWizardAction(), state


def test_class_of_the_user_has_an_object_for_each_session(tmp_path: Path) -> None:
    participant = find_player("pretrained:participant", Role.PARTICIPANT)
    cast = {**ALL_SCRIPTED, Role.PARTICIPANT: participant, Role.CO_WIZARD: player_of(CountingDriver, Role.CO_WIZARD)}
    config = EnvConfig(max_seconds=12.0)
    settings = RolloutSettings(cast=cast, towns=("brookside",), sessions=3, config=config)
    roll_out(settings, tmp_path / "rollout")
    for number, folder in enumerate(sorted((tmp_path / "rollout" / "sessions").iterdir())):
        policies = {role: settings.cast[role].make(role, SpaceLimits()) for role in AGENT_ROLES}
        seed = Session.load(folder).header.seed
        play_session(engine(12.0, True), policies, seed=seed, folder=tmp_path / "alone" / folder.name)
        assert files_of(folder) == files_of(tmp_path / "alone" / folder.name), number


class BatchDriver(BatchPolicy[None]):
    """Decides for several sessions, without doing anything."""

    def __init__(self, limits: SpaceLimits | None = None) -> None:
        super().__init__(Role.CO_WIZARD, limits)

    def initial_state(self, seed: int, town: Town) -> None:
        return None

    def act_all(self, observations: Sequence[Any], states: Sequence[None]) -> list[tuple[CoWizardAction, None]]:
        return [(CoWizardAction(), None) for _ in observations]


LEARNED_PARTICIPANT = find_player("pretrained:participant", Role.PARTICIPANT)


@pytest.mark.parametrize(
    ("co_wizard", "participant", "sizes"),
    [
        ("scripted", SCRIPTED, [1] * 5),
        ("scripted", LEARNED_PARTICIPANT, [2, 2, 1]),
        (CountingDriver, SCRIPTED, [1] * 5),
        (f"{__name__}:CountingDriver", SCRIPTED, [1] * 5),
        (BatchDriver, SCRIPTED, [2, 2, 1]),
        (f"{__name__}:BatchDriver", SCRIPTED, [2, 2, 1]),
        ("llm:some-model", LEARNED_PARTICIPANT, [1] * 5),  # its calls cost money: an error loses one session
    ],
)
def test_sessions_are_played_together_where_a_policy_may_decide_for_all(
    monkeypatch: pytest.MonkeyPatch, co_wizard: Any, participant: Player, sizes: list[int]
) -> None:
    monkeypatch.setenv("OPENAI_BASE_URL", "http://127.0.0.1:9/v1")  # never called
    cast = {**ALL_SCRIPTED, Role.PARTICIPANT: participant, Role.CO_WIZARD: player_of(co_wizard, Role.CO_WIZARD)}
    job = SessionJob(settings_file="s", settings={}, config=EnvConfig(), cast=cast, evaluate=str)
    plans = RolloutSettings(cast=cast, towns=("brookside",), sessions=5).plans()
    assert [len(batch) for batch in job.batches(plans, workers=2)] == sizes
