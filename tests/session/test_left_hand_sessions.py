"""Sessions in towns with traffic on the left."""

import re

import pytest

from dorothie_gym import DuoWizardEnv
from dorothie_gym.maps import load_town, mirrored, town_names
from dorothie_gym.testing.playing import Decision, play_scripted

OTHER = {"left": "right", "right": "left"}
SIDE = re.compile(
    r"(?<![Aa]ll )\b(left|right)\b(?!\?| (?:now|away|here|there))"
)  # but "all right", "right now", "right?"


def _words(decision: Decision) -> list[str]:
    return [str(action["utterance"]) for action in decision.actions.values() if action.get("utterance")]


@pytest.mark.long
def test_the_talk_of_a_mirrored_session_names_the_other_side() -> None:
    town = load_town("brookside")
    talks = [
        [
            words
            for decision in play_scripted(DuoWizardEnv(town=one), seed=7, decisions=110)
            for words in _words(decision)
        ]
        for one in (town, mirrored(town))
    ]
    assert any(SIDE.search(words) for words in talks[0])
    assert talks[1] == [SIDE.sub(lambda side: OTHER[side[1]], words) for words in talks[0]]


@pytest.mark.long
@pytest.mark.parametrize(
    "name", ["brookside", *(pytest.param(n, marks=pytest.mark.slow) for n in town_names() if n != "brookside")]
)
def test_sessions_in_a_mirrored_town_succeed(name: str) -> None:
    env = DuoWizardEnv(town=mirrored(load_town(name)))
    *_, last = play_scripted(env, seed=1, decisions=5000)
    assert not env.agents
    terms = last.infos["participant"]["reward_terms"]
    assert terms["success"] > 0.0
    assert sum(last.infos["participant"].get("infractions", {}).values()) == 0
