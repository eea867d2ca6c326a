import numpy as np
import torch

from dorothie_gym.baselines.roles.learned_role.decision import InputBatch, Inputs, kept_utterances
from dorothie_gym.baselines.roles.learned_role.encoding import AWAY, age_scales, distance_scales, one_hot, time_scales
from dorothie_gym.baselines.roles.learned_role.examples import reals
from dorothie_gym.baselines.roles.learned_role.policy import drawn
from dorothie_gym.baselines.roles.learned_role.utterance_inputs import KEPT, word_rows
from tests.baselines.roles.learned_role.test_utterance_inputs import heard


def test_inputs_in_play_are_those_of_an_example():
    inputs = Inputs.of([0.1, 1.0 / 3.0], word_rows("turn left"), [[0.7, 0.2]], (5,), (3, 2))
    state, words, options, count = InputBatch.of([inputs]).tensors()
    assert state.equal(reals([inputs.state]).float()) and options.equal(reals([inputs.options]).float())
    assert options.shape == (1, 3, 2) and not options[0, 1:].any() and count.tolist() == [1]
    assert words.dtype is torch.int64


def test_latest_utterances_are_kept():
    one, two = heard("Turn left."), heard("Stop.")
    assert kept_utterances(None, (one,)) == (one,)
    assert kept_utterances(two, (one,) * KEPT) == (two, *(one,) * (KEPT - 1))


def test_times_and_distances_are_bounded():
    assert time_scales(-1.0) == time_scales(0.0) and time_scales(2.0 * AWAY) == time_scales(AWAY)
    assert age_scales(5.0, -np.inf) == time_scales(AWAY) and age_scales(5.0, 5.0)[0] == 1.0
    assert distance_scales(np.inf, (25.0,)) == distance_scales(1000.0, (25.0,))
    assert one_hot(1, 3) == (0.0, 1.0, 0.0) and not any(one_hot(-1, 3)) and not any(one_hot(3, 3))


def test_numbers_are_drawn_by_their_shares():
    rng = np.random.default_rng(1)
    found = [drawn(np.array([0.0, 3.0, 0.0, 1.0]), rng) for _ in range(400)]
    assert set(found) == {1, 3} and 250 < found.count(1) < 350
    assert drawn(np.zeros(3), rng) == 0
