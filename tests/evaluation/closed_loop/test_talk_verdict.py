"""Talk tasks are judged by the session alone: demonstrations of both outcomes of each kind."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import pytest

from dorothie_gym.agents.text_session import TextSession
from dorothie_gym.errors import RolloutError
from dorothie_gym.evaluation.closed_loop.session_record import SessionRecord, measure
from dorothie_gym.evaluation.closed_loop.talk_verdict import TalkVerdict, verdict_of
from dorothie_gym.evaluation.rollout.play import play_session
from dorothie_gym.evaluation.tiers import TIERS
from dorothie_gym.maps import load_town
from dorothie_gym.ontology import Role
from dorothie_gym.policies import make_policy
from dorothie_gym.session.recording.events import EventType
from dorothie_gym.session.recording.session import Session
from dorothie_gym.session.scenario import draw_scenario
from dorothie_gym.session.session_engine import SessionEngine
from dorothie_gym.session.spaces.actions import AdWizardAction
from dorothie_gym.session.talk_kinds import KINDS, draw_talk_task
from dorothie_gym.session.talk_tasks import Reaction
from dorothie_gym.tasks.briefs import TalkFamily

TOWN = "brookside"
ACTS = (Reaction.GO_TO, Reaction.AGREE, Reaction.ANSWER)


@cache
def engine(family: TalkFamily) -> SessionEngine:
    return SessionEngine(TOWN, config=replace(TIERS[family].config, max_seconds=45.0))


def seed_of(family: TalkFamily, kind: str, *, acts: bool) -> int:
    """A seed whose session is of a kind, and can (or cannot) be done as it is."""
    town = load_town(TOWN)
    for seed in range(2000):
        names = draw_scenario(town, None, seed, None, family).street_names
        task = draw_talk_task(town, names, family, seed)
        if task.kind == kind and (task.reaction in ACTS) is acts:
            return seed
    raise AssertionError(kind)


def play(family: TalkFamily, seed: int, co_wizard: str, folder: Path) -> tuple[Session, TalkVerdict]:
    players = {Role.PARTICIPANT: "client", Role.CO_WIZARD: co_wizard, Role.AD_WIZARD: "street-closer"}
    host = engine(family)
    policies = {role: make_policy(name, role, host.limits) for role, name in players.items()}
    play_session(host, policies, seed=seed, folder=folder)
    session = Session.load(folder)
    verdict = verdict_of(session, host.town)
    assert verdict is not None
    return session, verdict


@pytest.mark.parametrize(("family", "kind"), [(family, kind) for family in TalkFamily for kind in KINDS[family]])
def test_each_kind_can_be_done_and_failed(family: TalkFamily, kind: str, tmp_path: Path) -> None:
    seed = seed_of(family, kind, acts=False)
    right = play(family, seed, "talk-oracle", tmp_path / "right")[1]
    assert right.passed and right.kind == kind and right.unnecessary == 0, right
    wrong = play(family, seed, "says-yes", tmp_path / "wrong")[1]
    assert not wrong.passed and wrong.cause, wrong


def test_a_digit_in_the_name_of_a_place_is_no_number_of_a_place(tmp_path: Path) -> None:
    session, verdict = play(TalkFamily.ASK_FIRST, 20120, "talk-oracle", tmp_path / "seven")
    assert any("To 7-Eleven, please." in utterance.text for utterance in session.utterances())
    assert verdict.passed, verdict


def test_a_street_is_closed_beside_a_vehicle_that_stands_in_the_way() -> None:
    host = engine(TalkFamily.ADMIT_IT)
    host.reset(seed=seed_of(TalkFamily.ADMIT_IT, "street_closed", acts=False))
    seen = host.observations.of()["ad_wizard"]
    closer = make_policy("street-closer", Role.AD_WIZARD, host.limits)
    state, places = closer.initial_state(0, host.town), []
    for _ in range(3):
        action, state = closer.step(seen, state)  # nothing was placed: the prop is not in the observation
        places.append(AdWizardAction.decode(action, host.limits).place)
    assert len({place.lane for place in places}) == 1
    assert [place.metres - places[0].metres for place in places] == [0, 7, -7]


def test_a_question_without_need_fails_and_a_plain_request_is_done(tmp_path: Path) -> None:
    seed = seed_of(TalkFamily.ASK_FIRST, "two_houses", acts=True)
    asked = play(TalkFamily.ASK_FIRST, seed, "always-asks", tmp_path / "asks")[1]
    assert (asked.passed, asked.unnecessary, asked.cause) == (False, 1, "an unnecessary question")
    session, done = play(TalkFamily.ASK_FIRST, seed, "never-asks", tmp_path / "acts")
    assert done.passed
    record = measure(session, load_town(TOWN))
    assert record.talk_task == done and SessionRecord.from_json(record.to_json()) == record


def test_a_session_without_the_request_says_so_and_one_of_another_storyboard_has_no_task(tmp_path: Path) -> None:
    host = SessionEngine(TOWN, config=replace(TIERS["ask-first"].config, max_seconds=5.0))
    silent = {role: make_policy("silent", role, host.limits) for role in (Role.PARTICIPANT, Role.CO_WIZARD)}
    policies = {**silent, Role.AD_WIZARD: make_policy("silent", Role.AD_WIZARD, host.limits)}
    play_session(host, policies, seed=0, folder=tmp_path / "silent")
    session = Session.load(tmp_path / "silent")
    verdict = verdict_of(session, host.town)
    assert verdict is not None and verdict.cause == "the request was never said"
    other = replace(session, header=replace(session.header, storyboard="errands"))
    assert verdict_of(other, host.town) is None
    unknown = replace(session, header=replace(session.header, config={**session.header.config, "talk": "shout"}))
    with pytest.raises(RolloutError, match=r"config\.talk"):
        verdict_of(unknown, host.town)


def test_a_street_without_a_barrier_is_open_whatever_else_happens(tmp_path: Path) -> None:
    seed = seed_of(TalkFamily.ADMIT_IT, "street_closed", acts=False)
    session, verdict = play(TalkFamily.ADMIT_IT, seed, "talk-oracle", tmp_path / "closed")
    assert verdict.reaction == "admit"
    events = tuple(
        replace(event, data={"kind": "Weather"}) if event.type is EventType.EXCEPTION else event
        for event in session.events
    )
    opened = verdict_of(replace(session, events=events), engine(TalkFamily.ADMIT_IT).town)
    assert opened is not None and opened.reaction == "agree" and not opened.passed


def test_a_person_may_type_the_request_without_capitals_and_full_stop(tmp_path: Path) -> None:
    seed = seed_of(TalkFamily.ASK_FIRST, "two_houses", acts=True)
    session, verdict = play(TalkFamily.ASK_FIRST, seed, "never-asks", tmp_path / "acts")
    events = tuple(
        replace(event, data={**event.data, "text": str(event.data["text"]).lower().rstrip(".")})
        if "text" in event.data
        else event
        for event in session.events
    )
    assert verdict_of(replace(session, events=events), engine(TalkFamily.ASK_FIRST).town) == verdict


def test_all_trials_of_a_talk_task_are_passed_by_right_reactions(tmp_path: Path) -> None:
    seed = seed_of(TalkFamily.ASK_FIRST, "two_houses", acts=True)
    session, _ = play(TalkFamily.ASK_FIRST, seed, "never-asks", tmp_path / "acts")
    record = measure(session, load_town(TOWN))
    assert not record.success and record.passed
    assert not replace(record, talk_task=None).passed


def test_a_text_session_of_the_tier_has_the_client(tmp_path: Path) -> None:
    seed = seed_of(TalkFamily.ASK_FIRST, "two_houses", acts=False)
    session = TextSession(tier="ask-first", town=TOWN)
    turn = session.reset(seed=seed)
    while "take me to the house" not in turn.page and not turn.done:
        turn = session.answer({"say": ""})
    assert "take me to the house" in turn.page
