"""Reinforcement makes rewarded choices likelier, and is resumed where it was interrupted."""

import copy
import dataclasses
import json

import pytest
import torch
from safetensors.torch import load_file

from dorothie_gym.baselines.co_wizard.experience import Experience
from dorothie_gym.baselines.co_wizard.files import load_network
from dorothie_gym.baselines.co_wizard.network import CoWizardNetwork, Layout
from dorothie_gym.baselines.co_wizard.policy_gradient import (
    Optimisation,
    ValueNetwork,
    acting_parameters,
    advantages_of,
    divergence,
    improve,
    log_chance,
)
from dorothie_gym.baselines.co_wizard.reinforcement import ReinforcementSettings, reinforce_co_wizard
from dorothie_gym.baselines.imitation.batches import UNKNOWN
from dorothie_gym.errors import CheckpointError, ModelFileError, PolicyLoadError, SessionError
from dorothie_gym.ontology import Role
from dorothie_gym.policies import find_player
from dorothie_gym.policies.pretrained import pretrained_folder

FORMS, COMMANDS = 5, 3
SHIPPED = pretrained_folder("pretrained:co-wizard")


def network():
    torch.manual_seed(0)
    return CoWizardNetwork(Layout.of(FORMS)).eval()


def experience(**given):
    """Decisions in the same state: one session, unless `last` is given."""
    n = len(given["command"])
    layout = Layout.of(FORMS)
    generator = torch.Generator().manual_seed(1)
    state = torch.rand(1, layout.state, generator=generator).half().expand(n, -1)
    commands = torch.rand(1, COMMANDS, layout.command, generator=generator).half().expand(n, -1, -1)
    last = torch.zeros(n, dtype=torch.bool)
    last[-1] = True
    return Experience(
        **{
            "state": state, "words": torch.ones(n, 2, dtype=torch.int16), "commands": commands,
            "command_count": torch.full((n,), COMMANDS, dtype=torch.int16),
            "first": torch.full((n,), UNKNOWN, dtype=torch.int16),
            "possible": torch.zeros(n, FORMS, dtype=torch.bool), "reward": torch.zeros(n), "last": last, **given,
        }
    )  # fmt: skip


def numbers(*values):
    return torch.tensor(values, dtype=torch.int16)


def test_chances_of_all_choices_sum_to_one():
    possible = torch.tensor([[False, True, False, True, True]]).expand(4 * COMMANDS, -1)
    options = [(command, form) for command in range(COMMANDS) for form in (0, 1, 3, 4)]
    found = experience(
        command=numbers(*(command for command, _ in options)), first=numbers(*(form for _, form in options)),
        possible=possible,
    )  # fmt: skip
    assert float(chances(network(), found).exp().sum()) == pytest.approx(1.0, abs=1e-5)


def test_decision_in_which_nothing_could_be_said_counts_by_its_command():
    found = experience(command=numbers(0, 1, 2))
    assert float(chances(network(), found).exp().sum()) == pytest.approx(1.0, abs=1e-5)


def test_advantages_are_discounted_and_end_with_the_session():
    settings = Optimisation(discount=0.5, trace=0.5)
    found = experience(
        command=numbers(0, 0, 0), reward=torch.tensor([0.0, 1.0, 4.0]), last=torch.tensor([False, True, True])
    )
    advantages, returns = advantages_of(found, torch.tensor([0.2, 0.6, 1.0]), settings)
    # errors: 0 + .5 * .6 - .2 = .1; 1 - .6 = .4; 4 - 1 = 3; the first advantage adds .5 * .5 * .4
    assert advantages.tolist() == pytest.approx([0.2, 0.4, 3.0])
    assert returns.tolist() == pytest.approx([0.4, 1.0, 4.0])


@torch.no_grad()
def chances(own, found):
    return log_chance(own, found, Optimisation())


def trained(found, seed=3, **changes):
    own = network()
    settings = Optimisation(rate=1e-3, batch_size=16, divergence=1.0, **changes)
    improve(own, ValueNetwork(own.layout.state), copy.deepcopy(own), found, settings, seed)
    return own


def rewarded_command():
    command = numbers(*[0, 1, 2] * 40)
    ends = torch.ones(120, dtype=torch.bool)  # each decision is a session: nothing else explains its reward
    return experience(command=command, reward=(command == 1).float(), last=ends)


def test_rewarded_command_becomes_likelier():
    found = rewarded_command()
    before, after = (chances(each, found.rows(torch.tensor([1]))) for each in (network(), trained(found)))
    assert float(after) > float(before) + 0.1


def test_rewarded_remark_becomes_likelier():
    first = numbers(*[0, 1, 3] * 40)
    found = experience(
        command=numbers(*[0] * 120), first=first, reward=(first == 3).float(), last=torch.ones(120, dtype=torch.bool),
        possible=torch.tensor([[False, True, False, True, False]]).expand(120, -1),
    )  # fmt: skip
    before, after = (chances(each, found.rows(torch.tensor([2]))) for each in (network(), trained(found)))
    assert float(after) > float(before) + 0.1


def test_penalty_keeps_the_policy_near_the_one_before():
    found = rewarded_command()
    near, far = (
        float(divergence(trained(found, penalty=penalty), network(), found, Optimisation()).mean().detach())
        for penalty in (10.0, 0.0)
    )
    assert near < 0.5 * far


def test_listening_does_not_change():
    own, before = trained(rewarded_command()), network()
    changed = {name for name, value in own.state_dict().items() if not torch.equal(value, before.state_dict()[name])}
    assert changed
    assert all(name.split(".")[0] in ("acting", "command", "first", "second", "remarks") for name in changed)
    assert len(acting_parameters(own)) < len(list(own.parameters()))


def settings(**changes):
    return ReinforcementSettings(
        **{"start": SHIPPED, "seed": 4, "iterations": 2, "sessions": 2, "max_seconds": 20.0, **changes}
    )


def quiet(*_):
    return None


@pytest.fixture(scope="module")
def reinforced(tmp_path_factory):
    folder = tmp_path_factory.mktemp("runs") / "one"
    found = reinforce_co_wizard(settings(), folder, workers=1, on_stage=quiet)
    assert [each.sessions for each in found] == [2, 2]
    return folder


def weights(folder):
    return {name: value.numpy().tobytes() for name, value in load_file(folder / "model.safetensors").items()}


def test_model_can_be_played_and_states_its_cost(reinforced):
    network, page = load_network(reinforced)
    assert not all(
        torch.equal(value, load_network(SHIPPED)[0].state_dict()[name]) for name, value in network.state_dict().items()
    )
    decisions = sum(each["decisions"] for each in json.loads((reinforced / "progress.json").read_text()))
    assert decisions == 2 * 2 * 40  # two decisions a second
    assert page.steps == load_network(SHIPPED)[1].steps + decisions
    assert find_player(str(reinforced), Role.CO_WIZARD).trained


def test_interrupted_reinforcement_ends_with_the_same_weights(reinforced, tmp_path):
    class InterruptedTrainingError(Exception):
        pass

    def stop(stage, done, total):
        if "iteration 2" in stage and done == 1:
            raise InterruptedTrainingError

    with pytest.raises(InterruptedTrainingError):
        reinforce_co_wizard(settings(), tmp_path / "two", workers=1, on_stage=stop)
    assert not (tmp_path / "two" / "model.json").exists()
    reinforce_co_wizard(settings(), tmp_path / "two", workers=1, on_stage=quiet)
    assert weights(tmp_path / "two") == weights(reinforced)
    assert not list((tmp_path / "two").rglob("experience"))


def test_folder_of_other_settings_is_refused(reinforced):
    with pytest.raises(SessionError, match="has seed 4, not 5"):
        reinforce_co_wizard(settings(seed=5), reinforced, workers=1, on_stage=quiet)


def test_damaged_figures_are_one_error_that_names_the_file(tmp_path):
    folder = tmp_path / "run"
    reinforce_co_wizard(settings(iterations=1, sessions=1, max_seconds=5.0), folder, workers=1, on_stage=quiet)
    (folder / "iteration-1" / "progress.json").write_text('{"decisions": "many"}')
    with pytest.raises(CheckpointError, match=r"progress\.json.*delete it"):
        reinforce_co_wizard(settings(iterations=1, sessions=1, max_seconds=5.0), folder, workers=1, on_stage=quiet)


def test_unknown_ad_wizard_or_model_is_reported_before_a_folder_is_made(tmp_path):
    with pytest.raises(PolicyLoadError, match="no policy 'scriptd'"):
        reinforce_co_wizard(settings(ad_wizard="scriptd"), tmp_path / "out", workers=1, on_stage=quiet)
    with pytest.raises(ModelFileError, match=r"model\.json"):
        reinforce_co_wizard(settings(start=tmp_path), tmp_path / "out", workers=1, on_stage=quiet)
    assert not (tmp_path / "out").exists()


def test_settings_are_checked():
    with pytest.raises(ValueError, match="iterations is 0; it must be at least 1"):
        dataclasses.replace(settings(), iterations=0)
