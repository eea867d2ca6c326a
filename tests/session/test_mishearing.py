"""Sessions with word errors between participant and Co-Wizard."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from dorothie_gym.dialogue import word_error_rate
from dorothie_gym.envs.duo_wizard_v0 import DuoWizardEnv
from dorothie_gym.evaluation.rollout import play_session
from dorothie_gym.ontology import AGENT_ROLES, DialogueAct, DialogueMove, LandmarkName, Role, encode_slots
from dorothie_gym.policies import make_policy
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.session.recording import Session
from dorothie_gym.session.spaces import NO_MOVE, ParticipantAction, Speech, noop
from dorothie_gym.sim.config import WorldConfig
from tests.envs.sessions_played import play_by_script

ALONE = WorldConfig(vehicles=0, pedestrians=0)


def noisy(rate: float, **settings: Any) -> DuoWizardEnv:
    return DuoWizardEnv("brookside", config=EnvConfig(world=ALONE, word_error_rate=rate, **settings))


def talk(env: DuoWizardEnv, seed: int, decisions: int = 160) -> list[tuple[Any, list[dict[str, Any]]]]:
    """Returns the observations of each decision with the acts that ended in it."""
    found = []
    for observations, _, _ in play_by_script(env, seed=seed, decisions=decisions):
        spoken = [{**event.data, "by": event.source} for event in env.last_events if event.type == "DialogueMove"]
        found.append((observations, spoken))
    return found


@pytest.fixture(scope="module")
def heard() -> list[tuple[Any, list[dict[str, Any]]]]:
    return talk(noisy(0.2), seed=3, decisions=300)


def test_listeners_observe_transcript_and_ad_wizard_spoken_words(heard: Any) -> None:
    other = {Role.PARTICIPANT: "co_wizard", Role.CO_WIZARD: "participant"}
    misheard = 0
    for observations, spoken in heard:
        for act in spoken:
            field = f"{act['by']}_text"
            assert observations[other[act["by"]]][field] == act["recognised"]
            assert observations["ad_wizard"][field] == act["text"]
            misheard += act["recognised"] != act["text"]
    assert misheard > 5


def test_intended_act_is_not_observed_with_misheard_words(heard: Any) -> None:
    other = {Role.PARTICIPANT: "co_wizard", Role.CO_WIZARD: "participant"}
    differing = 0
    for observations, spoken in heard:
        for by in other:
            acts = [act for act in spoken if act["by"] is by]
            observed = observations[other[by]][f"{by}_moves"]
            meant = observations["ad_wizard"][f"{by}_moves"]
            assert (observed == NO_MOVE).tolist() == (meant == NO_MOVE).tolist() and len(acts) == (meant < 15).sum()
            if acts and acts[0]["recognised"] == acts[0]["text"]:
                assert observed.tolist() == meant.tolist()
            differing += observed.tolist() != meant.tolist()
    assert differing


def test_observed_act_follows_from_transcript() -> None:
    """Instruct with the slot KFC but words without a place is observed like the words alone."""
    env = noisy(0.9)
    to_kfc = DialogueAct.of(DialogueMove.INSTRUCT, LandmarkName.KFC)
    observations, _ = env.reset(seed=5)
    actions = {agent: noop(Role(agent), env.limits) for agent in env.agents}
    speech = Speech(act=to_kfc, text="we will do as I told you before")
    actions["participant"] = ParticipantAction(speech=speech).encode(env.limits)
    for _ in range(12):
        observations, *_ = env.step(actions)
        actions["participant"] = noop(Role.PARTICIPANT, env.limits)
        if observations["co_wizard"]["participant_text"]:
            break
    assert observations["co_wizard"]["participant_text"] != speech.text
    kfc = encode_slots(to_kfc.slots).index(1)
    assert observations["ad_wizard"]["participant_slots"][0][kfc]
    assert not observations["co_wizard"]["participant_slots"][0][kfc]
    assert observations["ad_wizard"]["participant_moves"][0] == DialogueMove.INSTRUCT


def test_sessions_without_word_errors_have_no_transcripts() -> None:
    for observations, spoken in talk(noisy(0.0), seed=3):
        for act in spoken:
            assert "recognised" not in act
            listener = "co_wizard" if act["by"] is Role.PARTICIPANT else "participant"
            assert observations[listener][f"{act['by']}_text"] == act["text"]


def test_word_errors_use_their_own_random_stream() -> None:
    """With equal actions, only the transcripts differ; generated words and traffic are equal."""
    clear, unclear = (DuoWizardEnv("brookside", config=EnvConfig(word_error_rate=rate)) for rate in (0.0, 0.5))
    for env in (clear, unclear):
        env.reset(seed=8)
    for k in range(40):
        actions = {agent: noop(Role(agent), clear.limits) for agent in clear.agents}
        if k % 5 == 0:
            speech = Speech(act=DialogueAct(DialogueMove.EXPLAIN), text="")
            actions["participant"] = ParticipantAction(speech=speech).encode(clear.limits)
        (seen, *_), (others, *_) = (env.step(actions) for env in (clear, unclear))
        assert seen["ad_wizard"]["participant_text"] == others["ad_wizard"]["participant_text"]
        assert (clear.last_frames == unclear.last_frames).all()
        assert (seen["participant"]["objects"] == others["participant"]["objects"]).all()


def played(env: DuoWizardEnv, seed: int, folder: Path) -> Session:
    policies = {role: make_policy("scripted", role, env.limits) for role in AGENT_ROLES}
    play_session(env, policies, seed=seed, folder=folder)
    return Session.load(folder)


def measured_rate(sessions: list[Session]) -> float:
    utterances = [utterance for session in sessions for utterance in session.utterances()]
    return word_error_rate(
        [utterance.text for utterance in utterances], [str(utterance.moves[0].recognised) for utterance in utterances]
    )


def test_word_error_rate_of_session_equals_setting(tmp_path: Path) -> None:
    sessions = [played(noisy(0.3, max_seconds=200.0), seed, tmp_path / str(seed)) for seed in (2, 3, 4)]
    assert measured_rate(sessions) == pytest.approx(0.3, abs=0.1)


@pytest.mark.slow
@pytest.mark.parametrize("rate", [0.05, 0.15, 0.3])
def test_word_error_rate_of_corpus_equals_setting(tmp_path: Path, rate: float) -> None:
    env = noisy(rate)
    assert measured_rate([played(env, seed, tmp_path / str(seed)) for seed in range(16)]) == pytest.approx(
        rate, rel=0.1
    )


@pytest.mark.parametrize("rate", [-0.1, 1.0, float("nan")])
def test_error_names_rate_out_of_range(rate: float) -> None:
    with pytest.raises(ValueError, match=r"EnvConfig.word_error_rate is .*; it must be at least 0 and below 1"):
        EnvConfig(word_error_rate=rate)
