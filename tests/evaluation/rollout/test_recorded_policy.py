"""Roles that take their recorded actions, while the others are played again."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import pytest

from dorothie_gym.archive import first_difference
from dorothie_gym.errors import SessionError
from dorothie_gym.evaluation.rollout import play_session
from dorothie_gym.evaluation.rollout.recorded_policy import RecordedPolicy, recorded_persona
from dorothie_gym.ontology import AGENT_ROLES, Role
from dorothie_gym.policies import Policy, make_policy
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.session.recording import Decision, Session
from dorothie_gym.session.session_engine import SessionEngine

CONFIG = EnvConfig(max_seconds=40.0)


@pytest.fixture(scope="module")
def engine() -> SessionEngine:
    return SessionEngine("brookside", config=CONFIG)


@pytest.fixture(scope="module")
def recorded(engine: SessionEngine, tmp_path_factory: pytest.TempPathFactory) -> Session:
    policies = {role: make_policy("scripted", role, engine.limits) for role in AGENT_ROLES}
    folder = tmp_path_factory.mktemp("recorded") / "one"
    play_session(engine, policies, seed=3, folder=folder)
    return Session.load(folder)


def again(session: Session, engine: SessionEngine, folder: Path, *roles: Role) -> Session:
    """The session with recorded actions of some roles, and scripted ones of the others."""
    policies: dict[Role, Policy[int]] = {
        role: RecordedPolicy(session, role, frames=CONFIG.frames, limits=engine.limits)
        if role in roles
        else make_policy("scripted", role, engine.limits)
        for role in AGENT_ROLES
    }
    play_session(engine, policies, seed=3, folder=folder)
    return Session.load(folder)


@pytest.mark.parametrize("roles", [(Role.CO_WIZARD,), (Role.PARTICIPANT, Role.AD_WIZARD), tuple(AGENT_ROLES)])
def test_session_is_the_same_whoever_is_played_again(
    roles: tuple[Role, ...], recorded: Session, engine: SessionEngine, tmp_path: Path
) -> None:
    found = again(recorded, engine, tmp_path / "again", *roles)
    assert first_difference(recorded, found, strict=True) is None and found.digest == recorded.digest


def test_partners_react_to_other_actions_than_the_recorded_ones(
    recorded: Session, engine: SessionEngine, tmp_path: Path
) -> None:
    """Without the words of the Co-Wizard, the participant decides otherwise."""
    quiet = tuple(
        Decision(frame=decision.frame, actions={r: a for r, a in decision.actions.items() if r is not Role.CO_WIZARD})
        for decision in recorded.decisions or ()
    )
    silent = dataclasses.replace(recorded, decisions=tuple(decision for decision in quiet if decision.actions))
    found = again(silent, engine, tmp_path / "again", Role.CO_WIZARD)
    said = [
        [decision.actions.get(Role.PARTICIPANT) for decision in session.decisions or ()]
        for session in (recorded, found)
    ]
    assert said[0] != said[1]
    assert not any(Role.CO_WIZARD in decision.actions for decision in found.decisions or ())


def test_session_without_decisions_or_with_malformed_ones_is_refused(
    recorded: Session, engine: SessionEngine, tmp_path: Path
) -> None:
    with pytest.raises(SessionError, match="was not recorded"):
        RecordedPolicy(dataclasses.replace(recorded, decisions=None), Role.CO_WIZARD, frames=15)
    wrong = dataclasses.replace(recorded, decisions=(Decision(frame=0, actions={Role.CO_WIZARD: {"fly": 1}}),))
    with pytest.raises(SessionError, match="'fly' is none of"):
        again(wrong, engine, tmp_path / "again", Role.CO_WIZARD)


def test_persona_with_other_things_than_traits_is_none(recorded: Session) -> None:
    assert recorded_persona(recorded, Role.PARTICIPANT) == recorded.header.extra["personas"]["participant"]  # type: ignore[index]
    personas = {"participant": {"patience": [1.0]}, "co_wizard": "patient"}
    header = dataclasses.replace(recorded.header, extra={"personas": personas})
    other = dataclasses.replace(recorded, header=header)
    assert [recorded_persona(other, role) for role in AGENT_ROLES] == [None] * 3
