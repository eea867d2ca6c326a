"""Models of both roles survive being written and read, in half precision."""

import json

import pytest
import torch

from dorothie_gym.baselines.roles.co_wizard.files import FILES as CO_WIZARD_FILES
from dorothie_gym.baselines.roles.participant.files import FILES as PARTICIPANT_FILES
from dorothie_gym.errors import ModelFileError
from dorothie_gym.policies import pretrained_folder

ROLES = {"co-wizard": CO_WIZARD_FILES, "participant": PARTICIPANT_FILES}


@pytest.mark.parametrize("name", ROLES)
def test_shipped_model_is_written_as_it_was_read(name, tmp_path):
    files, shipped = ROLES[name], pretrained_folder(f"pretrained:{name}")
    network, page = files.load(shipped)
    files.save(
        network,
        tmp_path / name,
        vocabulary=page.vocabulary,
        steps=page.steps,
        seconds=page.seconds,
        settings=page.settings,
    )
    for file in ("model.json", "model.safetensors"):
        again, once = ((folder / file).read_bytes() for folder in (tmp_path / name, shipped))
        assert (json.loads(again) == json.loads(once)) if file.endswith("json") else again == once
    assert not network.training


@pytest.mark.parametrize("name", ROLES)
def test_model_of_the_other_role_is_refused(name):
    other = next(files for role, files in ROLES.items() if role != name)
    with pytest.raises(ModelFileError, match="field 'layout'"):
        other.load(pretrained_folder(f"pretrained:{name}"))


@pytest.mark.parametrize("name", ROLES)
def test_network_takes_a_vocabulary_of_any_size(name):
    network = ROLES[name].network(7)
    assert network.first.out_features == 7
    assert network.then(torch.zeros(2, 256), torch.tensor([1, 2])).shape == (2, 7)


@pytest.mark.parametrize("name", ROLES)
def test_text_that_is_no_remark_is_refused_by_its_number(name, tmp_path):
    files = ROLES[name]
    vocabulary = ("", '{"move":"Sing","slots":[],"meaning":[],"content":null,"wording":{}}')
    files.save(files.network(2), tmp_path, vocabulary=vocabulary, steps=1, seconds=0.0, settings={})
    with pytest.raises(ModelFileError, match=r"vocabulary\[1\] is no remark"):
        files.load(tmp_path)
