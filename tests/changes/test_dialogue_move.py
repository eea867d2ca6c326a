"""A new dialogue move: what each step asks for, and a session in which it is said, heard and annotated."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.changes.working_copy import Edit, WorkingCopy, follow, listed_files

MOVES = "dorothie_gym/ontology/dialogue_acts.py"
CUES = "dorothie_gym/dialogue/data/cues.yaml"

EDITS = (
    Edit(MOVES, '    REPLY_W = 14, "ReplyW"\n', '    REPLY_W = 14, "ReplyW"\n    THANK = 15, "Thank"\n'),
    Edit(
        MOVES,
        'Answer("it did not", DialogueMove.CONFUSE),\n',
        'Answer("it did not", DialogueMove.CONFUSE), Answer("it was welcome", DialogueMove.THANK),\n',
        r"DECISION_TREE of dorothie_gym/ontology/dialogue_acts\.py .* DialogueMove\.THANK",
    ),
    Edit(
        "dorothie_gym/dialogue/exchanges.py",
        "            {DialogueMove.ACKNOWLEDGE, DialogueMove.CONFIRM, DialogueMove.CLARIFY, DialogueMove.REPLY_Y}\n",
        "            {DialogueMove.ACKNOWLEDGE, DialogueMove.CONFIRM, DialogueMove.CLARIFY, DialogueMove.THANK}\n",
        r"EXPECTATIONS of dorothie_gym/dialogue/exchanges\.py .* DialogueMove\.THANK",
    ),
    Edit(
        "dorothie_gym/dialogue/data/talk/30_responses.talk",
        "== Acknowledge participant\n",
        "== Thank\nmany thanks *2 | many thanks to you\n== Acknowledge participant\n",
        r"dorothie_gym/dialogue/data/talk: Thank has no template .* `== Thank`",
    ),
    Edit(
        CUES,
        "moves:\n  - move: Irrelevant\n",
        "moves:\n  - move: Thank\n    cues: ['\\bmany thanks\\b']\n  - move: Irrelevant\n",
        r"dorothie_gym/dialogue/data/cues\.yaml: moves .* Thank",
    ),
    Edit(
        "dorothie_gym/lab/annotation/vocabulary.py",
        '        DialogueMove.REPLY_W: "v",\n',
        '        DialogueMove.REPLY_W: "v",\n        DialogueMove.THANK: "t",\n',
        r"MOVE_KEYS of dorothie_gym/lab/annotation/vocabulary\.py .* DialogueMove\.THANK",
    ),
)

PROBE = """
from dorothie_gym.ontology.dialogue_acts import DialogueAct, DialogueMove, path_to
from dorothie_gym.ontology.roles import Role
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.session.session_engine import SessionEngine
from dorothie_gym.session.spaces.actions import AdWizardAction, CoWizardAction, ParticipantAction, Speech

assert path_to(DialogueMove.THANK)[-1][1].label == "it was welcome"
engine = SessionEngine("brookside", config=EnvConfig(max_seconds=30.0, word_error_rate=0.0))
engine.reset(seed=1)

def play(participant=None, co_wizard=None):
    spoken = {Role.PARTICIPANT: ParticipantAction(speech=participant), Role.CO_WIZARD: CoWizardAction(speech=co_wizard)}
    events = []
    for _ in range(12):
        actions = {**spoken, Role.AD_WIZARD: AdWizardAction()}
        engine.step({role: action.encode(engine.limits) for role, action in actions.items()})
        events += [event for event in engine.last_events if event.type == "DialogueMove"]
        spoken = {Role.PARTICIPANT: ParticipantAction(), Role.CO_WIZARD: CoWizardAction()}
    return events

play(co_wizard=Speech(act=DialogueAct(DialogueMove.EXPLAIN), text="the road is wet"))
(thanked,) = play(participant=Speech(act=DialogueAct(DialogueMove.THANK)))
assert thanked.data["move"] == "Thank" and "many thanks" in thanked.data["text"].lower(), thanked
from dorothie_gym.dialogue.dialogue_act_classifier import guess_act

assert guess_act(thanked.data["text"]).move is DialogueMove.THANK
assert engine.summary()["exchanges"] == 1, "the move answers the statement"

from dorothie_gym.lab.annotation.vocabulary import vocabulary
assert ["Thank", "t"] in [row[:2] for row in vocabulary()["moves"]]
"""


@pytest.mark.long
def test_following_the_page_adds_a_dialogue_move(tmp_path: Path) -> None:
    follow(WorkingCopy(tmp_path), EDITS, PROBE)


def test_page_lists_at_most_eight_files_for_a_dialogue_move() -> None:
    files = listed_files("A dialogue move")
    assert list(dict.fromkeys(edit.file for edit in EDITS)) == files[:5]
    assert len(files) <= 8


def test_first_error_names_the_decision_tree(tmp_path: Path) -> None:
    copy = WorkingCopy(tmp_path)
    copy.edit(EDITS[0])
    error = copy.first_error("import dorothie_gym.ontology")
    assert "DECISION_TREE of dorothie_gym/ontology/dialogue_acts.py" in error and "DialogueMove.THANK" in error
