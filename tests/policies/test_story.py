"""The scripted participant tells what its errands are for, as the storyboard does, and nothing else."""

from __future__ import annotations

from pathlib import Path

import pytest

from dorothie_gym.dialogue import Predicate
from dorothie_gym.evaluation.analysis.truth_checks.checks import mentions_story
from dorothie_gym.ontology import DialogueMove, Role
from dorothie_gym.session.recording import Session
from dorothie_gym.tasks.purposes import read_purpose
from tests.evaluation.analysis.builders import M, drive, human
from tests.evaluation.teacher_forced.features.played import play


@pytest.fixture(scope="module")
def sessions(tmp_path_factory: pytest.TempPathFactory) -> list[Session]:
    folder: Path = tmp_path_factory.mktemp("played")
    return [play(folder / str(seed), seed=seed, seconds=100.0) for seed in range(4)]


def test_purposes_are_those_of_the_list(sessions):
    told = 0
    for session in sessions:
        lines = [str(row["description"]) for row in session.header.subgoals]
        lines += [str(row["change"]) for row in session.header.subgoals if row["change"]]
        purposes = [read_purpose(line) for line in lines]
        actions = {purpose.action for purpose in purposes}
        for move in session.moves(Role.PARTICIPANT):
            for said in move.meaning:
                if said.predicate is not Predicate.PURPOSE:
                    continue
                told += 1
                assert move.act.move is DialogueMove.EXPLAIN
                text = said.get("purpose") or said.get("reason")
                assert isinstance(text, str) and text.split()[-1].casefold() in move.span.casefold()
                if said.get("purpose") is not None:
                    assert said.get("purpose") in actions
    assert told > 0


def test_story_is_mentioned_if_somebody_or_something_of_it_is_named():
    story = {"story": "Fetch Priya from the station.", "subgoals": []}
    assert mentions_story(drive(human(2.0, "Priya is waiting.", M.EXPLAIN), **story)) is True
    assert mentions_story(drive(human(2.0, "Somebody is waiting.", M.EXPLAIN), **story)) is False
    assert mentions_story(drive(human(2.0, "Go.", M.INSTRUCT), story="Drive on.", subgoals=[])) is None
