"""Forward passes in play: those of torch up to rounding, and equal to the bit in batches of any size."""

from __future__ import annotations

import numpy as np
import torch

from dorothie_gym.baselines.roles.co_wizard.network import SIZES, CoWizardInference, CoWizardLayout, CoWizardNetwork
from dorothie_gym.baselines.roles.learned_role.decision import InputBatch, Inputs
from dorothie_gym.baselines.roles.learned_role.inference import shares_of
from dorothie_gym.baselines.roles.participant.network import ParticipantInference, ParticipantLayout, ParticipantNetwork

SESSIONS = 33


def inputs_of(rng: np.random.Generator, size: int, options: int, length: int) -> Inputs:
    state = rng.normal(size=size) * (rng.random(size) < 0.2)
    words = np.where(np.arange(32) < rng.integers(0, 12), rng.integers(1, 4096, size=32), 0)
    count = int(rng.integers(0, options + 1))
    vectors = rng.normal(size=(count, length)).tolist()
    return Inputs.of(state.tolist(), words, vectors, tuple(range(count)), (options, length))


def test_co_wizard_passes_equal_those_of_torch_and_of_single_sessions() -> None:
    torch.manual_seed(3)
    layout, rng = CoWizardLayout.of(40), np.random.default_rng(3)
    network = CoWizardNetwork(layout).eval()
    inference = CoWizardInference(network)
    places = [inputs_of(rng, layout.state, 24, layout.place) for _ in range(SESSIONS)]
    commands = [inputs_of(rng, layout.state, 20, layout.command) for _ in range(SESSIONS)]
    before = np.stack([[rng.integers(size) for size in SIZES] for _ in range(SESSIONS)])
    heard, acted = inference.listen(InputBatch.of(places), before), inference.act(InputBatch.of(commands))
    first = rng.integers(1, 40, size=SESSIONS).tolist()
    then = inference.then(acted[2], first)
    with torch.inference_mode():
        wanted = network.listen(*InputBatch.of(places).tensors(), torch.from_numpy(before))
        scores = network.act(*InputBatch.of(commands).tensors())
        following = network.then(scores[2], torch.tensor(first))
    pairs = [(heard.values, torch.cat(wanted.values, dim=1)), (heard.fresh, wanted.fresh), (heard.goal, wanted.goal)]
    pairs += [(heard.status, wanted.status), *zip(acted, scores, strict=True), (then, following)]
    for found, reference in pairs:
        assert np.allclose(found, reference.numpy(), atol=1e-4)
    for k in range(SESSIONS):
        alone = inference.listen(InputBatch.of(places[k : k + 1]), before[k : k + 1])
        assert all(np.array_equal(one[0], all_[k]) for one, all_ in zip(alone, heard, strict=True))
        alone_acted = inference.act(InputBatch.of(commands[k : k + 1]))
        assert all(np.array_equal(one[0], all_[k]) for one, all_ in zip(alone_acted, acted, strict=True))
        assert np.array_equal(inference.then(alone_acted[2], first[k : k + 1])[0], then[k])


def test_participant_passes_equal_those_of_torch_and_of_single_sessions() -> None:
    torch.manual_seed(4)
    layout, rng = ParticipantLayout.of(30), np.random.default_rng(4)
    network = ParticipantNetwork(layout).eval()
    inference = ParticipantInference(network)
    errands = [inputs_of(rng, layout.state, 8, layout.errand) for _ in range(SESSIONS)]
    guides = (rng.random(SESSIONS) < 0.5).tolist()
    chosen, spoken = inference.choose(InputBatch.of(errands), guides), inference.speak(InputBatch.of(errands))
    with torch.inference_mode():
        state, words, options, counts = InputBatch.of(errands).tensors()
        wanted = network.choose(state, words, options, counts, torch.tensor(guides, dtype=torch.float32))
        scores = network.speak(state, words)
    for found, reference in (*zip(chosen, wanted, strict=True), *zip(spoken, scores, strict=True)):
        assert np.allclose(found, reference.numpy(), atol=1e-4)
    for k in range(SESSIONS):
        alone = inference.choose(InputBatch.of(errands[k : k + 1]), guides[k : k + 1])
        assert all(np.array_equal(one[0], all_[k]) for one, all_ in zip(alone, chosen, strict=True))


def test_shares_are_those_of_softmax() -> None:
    logits = np.random.default_rng(0).normal(scale=4.0, size=50).astype(np.float32)
    wanted = torch.softmax(torch.from_numpy(logits).double() / 0.7, dim=0).numpy()
    assert np.allclose(shares_of(logits, 0.7), wanted, rtol=1e-12)
