"""Features of the most recent events."""

import pytest
import torch

from dorothie_gym.baselines.junction_reader.features import DECAYS, RECENT_MOVES, RECENT_SIZE, recent
from dorothie_gym.ontology import LABELS, DialogueMove, PhysicalAction

KINDS = 2 * len(DialogueMove)
AT_SLOTS = RECENT_MOVES * KINDS
AT_ACTIONS = AT_SLOTS + len(LABELS)
AT_AGES = AT_ACTIONS + len(PhysicalAction)


def inputs(moves, actions, now=10.0, room=4):
    """A point after moves (who, which, when, slot) and actions (which, when)."""
    given = {
        "time": torch.tensor([now]),
        "move": torch.zeros(1, room, dtype=torch.long),
        "move_speaker": torch.zeros(1, room, dtype=torch.long),
        "move_time": torch.zeros(1, room),
        "move_slots": torch.zeros(1, room, len(LABELS), dtype=torch.bool),
        "move_mask": torch.zeros(1, room, dtype=torch.bool),
        "action": torch.zeros(1, room, dtype=torch.long),
        "action_time": torch.zeros(1, room),
        "action_mask": torch.zeros(1, room, dtype=torch.bool),
    }
    for i, (who, which, when, slot) in enumerate(moves):
        given["move_speaker"][0, i], given["move"][0, i], given["move_time"][0, i] = who, which, when
        given["move_slots"][0, i, slot] = given["move_mask"][0, i] = True
    for i, (which, when) in enumerate(actions):
        given["action"][0, i], given["action_time"][0, i], given["action_mask"][0, i] = which, when, True
    return given


def test_before_anything_happened_there_is_nothing():
    assert recent(inputs([], [])).tolist() == [[0.0] * RECENT_SIZE]


def test_last_moves_are_encoded_newest_first_with_speaker():
    told = recent(inputs([(0, 3, 1.0, 7), (1, 5, 4.0, 9)], []))[0]
    assert told[:AT_SLOTS].nonzero()[:, 0].tolist() == [5 * 2 + 1, KINDS + 3 * 2]
    assert told[AT_SLOTS:AT_ACTIONS].nonzero()[:, 0].tolist() == [9]


def test_freshness_is_that_of_each_speaker_and_of_the_last_action():
    told = recent(inputs([(0, 3, 6.0, 7), (0, 2, 9.0, 7)], [(4, 2.0), (1, 8.0)]))[0]
    assert told[AT_ACTIONS:AT_AGES].nonzero()[:, 0].tolist() == [1]
    human, car, action = told[AT_AGES:].view(3, len(DECAYS)).tolist()
    assert human == pytest.approx([2.718281828 ** (-1.0 / decay) for decay in DECAYS])
    assert car == [0.0] * len(DECAYS)
    assert action == pytest.approx([2.718281828 ** (-2.0 / decay) for decay in DECAYS])


def test_padding_does_not_change_recent_features():
    happened = [(0, 3, 1.0, 7), (1, 5, 4.0, 9)], [(4, 2.0)]
    assert torch.equal(recent(inputs(*happened, room=4)), recent(inputs(*happened, room=9)))
