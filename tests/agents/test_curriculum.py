"""Tasks of the curriculum: stages, splits, and the scores that are stored with them."""

from __future__ import annotations

import pytest

from dorothie_gym.agents import AgentTask, CurriculumStage, Split, TextSession, tasks
from dorothie_gym.agents.curriculum import STAGES
from dorothie_gym.maps.folds import TownFold, fold_of
from tests.agents.players import Idler, play, reader_of, score
from tests.agents.reference_scores import COUNTS, TOWNS, suits


def test_each_split_has_all_stages_in_order_and_names_are_distinct() -> None:
    for number, split in enumerate(Split):
        found = tasks(split)
        assert list(dict.fromkeys(task.stage for task in found)) == list(CurriculumStage)
        for stage in CurriculumStage:
            assert len(tasks(split, stage)) == COUNTS[stage][number]
    names = [task.name for split in Split for task in tasks(split)]
    assert len(set(names)) == len(names)


def test_training_and_test_share_neither_towns_nor_seeds() -> None:
    train, test = tasks("train"), tasks("test")
    assert not {task.seed for task in train} & {task.seed for task in test}
    assert {fold_of(task.town) for task in train} == {TownFold.SEEN}
    assert {fold_of(task.town) for task in test} == {TownFold.UNSEEN}
    assert {split: {task.town for task in tasks(split)} for split in Split} == {
        split: set(towns) for split, towns in TOWNS.items()
    }


def test_references_are_scores_and_the_first_stages_can_be_done() -> None:
    for task in (*tasks("train"), *tasks("test")):
        assert 0.0 <= task.reference <= 1.0
        assert task.reference >= {CurriculumStage.STREET: 0.4, CurriculumStage.PAIR: 1.0}.get(task.stage, 0.0)


@pytest.mark.parametrize("split", Split)
def test_reference_is_the_score_of_the_rule_program_and_doing_nothing_has_less(split: Split) -> None:
    task = tasks(split, "street")[0]
    assert suits(task)
    outcome = play(task.session(), reader_of("co_wizard"), task.seed)
    assert outcome.score == pytest.approx(task.reference, abs=1e-4)
    assert outcome.reached >= 1 and outcome.seconds <= 60.0
    assert score(task.session(), Idler(), task.seed).score < task.reference


def test_session_of_a_task_has_the_conditions_of_its_stage() -> None:
    for stage, settings in STAGES.items():
        session = AgentTask(stage=stage, town="brookside", seed=1).session(pages="changes", max_turns=9)
        assert (session.pages, session.max_turns, session.engine.town.name) == ("changes", 9, "brookside")
        same = TextSession(
            town="brookside", config=settings.config, partners=settings.partners, tier=settings.tier, pages="changes"
        )
        assert session.engine.config == same.engine.config


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("dev",), "split is 'dev'; it must be one of train, test"),
        ((None,), "split is None"),
        (("train", "town"), "stage is 'town'; it must be one of street, pair"),
    ],
)
def test_wrong_arguments_are_refused(arguments: tuple[str, ...], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        tasks(*arguments)


@pytest.mark.parametrize("name", ["role", "town", "config", "partners", "tier"])
def test_settings_that_a_task_gives_cannot_be_changed(name: str) -> None:
    with pytest.raises(ValueError, match=f"{name} is given by the task"):
        AgentTask(stage=CurriculumStage.STREET, town="brookside", seed=1).session(**{name: None})
