from __future__ import annotations

import shlex

import pytest

from dorothie_gym.errors import TownError
from dorothie_gym.evaluation.closed_loop import RolloutSettings, parse_towns
from dorothie_gym.evaluation.closed_loop.running import command_of, fold_of_towns
from dorothie_gym.evaluation.rollout import plan_corpus
from dorothie_gym.maps import DEVELOPMENT_TOWNS, FOLD_TOWNS, SEEN_TOWNS, UNSEEN_TOWNS, VALIDATION_TOWNS
from dorothie_gym.ontology import Role
from dorothie_gym.policies import ALL_SCRIPTED, Player
from dorothie_gym.session.config import EnvConfig


def test_seeds_are_the_same_whoever_plays_and_however_many_sessions() -> None:
    scripted = RolloutSettings(towns=("brookside",), sessions=3, seed=4).plans()
    silent = {**ALL_SCRIPTED, Role.CO_WIZARD: Player(name="silent")}
    assert RolloutSettings(cast=silent, towns=("brookside",), sessions=9, seed=4).plans()[:3] == scripted
    assert len({plan.seed for plan in RolloutSettings(sessions=500).plans()}) == 500


def test_no_session_of_a_corpus_is_played_again() -> None:
    corpus = {plan.seed for plan in plan_corpus(183, 0)}
    assert not corpus & {plan.seed for plan in RolloutSettings(sessions=183, seed=0).plans()}


def test_towns_take_turns() -> None:
    plans = RolloutSettings(towns=("midtown", "brookside"), sessions=3).plans()
    assert [plan.town for plan in plans] == ["midtown", "brookside", "midtown"]
    assert plans[1].path == "sessions/0001-brookside"


def test_towns_are_named_one_by_one_or_by_fold() -> None:
    assert parse_towns("seen") == SEEN_TOWNS and parse_towns("unseen") == UNSEEN_TOWNS
    assert parse_towns("development") == DEVELOPMENT_TOWNS and parse_towns("validation") == VALIDATION_TOWNS
    assert parse_towns("all") == (*SEEN_TOWNS, *DEVELOPMENT_TOWNS, *UNSEEN_TOWNS)
    assert parse_towns("brookside, midtown,brookside") == ("brookside", "midtown")
    assert parse_towns("generated:1,size=small,generated") == ("generated:1,size=small", "generated")
    with pytest.raises(TownError, match="atlantis"):
        parse_towns("midtown,atlantis")
    with pytest.raises(ValueError, match="give seen, development, validation, unseen, all"):
        parse_towns(",")


def test_fold_is_that_of_all_towns() -> None:
    assert fold_of_towns(SEEN_TOWNS[:1]) == "seen" and fold_of_towns(UNSEEN_TOWNS) == "unseen"
    assert all(fold_of_towns(towns) == fold for fold, towns in FOLD_TOWNS.items())
    assert fold_of_towns((*SEEN_TOWNS, *UNSEEN_TOWNS)) is None and fold_of_towns(("elsewhere",)) is None


def test_command_plays_the_same_again() -> None:
    settings = RolloutSettings(towns=("midtown", "my town.yaml"), sessions=3, seed=5, config=EnvConfig(max_seconds=40))
    assert shlex.split(command_of(settings.to_json()))[2:] == [
        "--co-wizard", "scripted", "--participant", "scripted", "--ad-wizard", "scripted",
        "--towns", "midtown,my town.yaml", "--sessions", "3", "--seed", "5", "--max-seconds", "40",
    ]  # fmt: skip


@pytest.mark.parametrize("fold", ["seen", "development", "validation", "unseen"])
def test_command_names_the_fold_of_generated_towns(fold: str) -> None:
    words = shlex.split(command_of(RolloutSettings(towns=parse_towns(fold)).to_json()))
    named = words[words.index("--towns") + 1]
    assert parse_towns(named) == parse_towns(fold) and len(named) < 40


def test_towns_for_tests_are_not_those_of_a_rollout_that_names_none() -> None:
    assert RolloutSettings().towns == VALIDATION_TOWNS


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"sessions": 0}, "sessions is 0"),
        ({"seed": -1}, "seed is -1"),
        ({"towns": ()}, "towns is empty"),
        ({"cast": {Role.CO_WIZARD: Player(name="silent")}}, "no player for participant, ad_wizard"),
    ],
)
def test_invalid_settings_are_rejected(wrong: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        RolloutSettings(**wrong)  # type: ignore[arg-type]  # a wrong type on purpose
