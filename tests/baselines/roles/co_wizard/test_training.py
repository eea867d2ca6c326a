import dataclasses
import json

import pytest
import torch
from safetensors.torch import load_file

from dorothie_gym.baselines.roles.co_wizard.demonstrations import CoWizardTraining
from dorothie_gym.baselines.roles.co_wizard.features import STATE
from dorothie_gym.baselines.roles.co_wizard.files import FILES
from dorothie_gym.baselines.roles.co_wizard.training import train_co_wizard
from dorothie_gym.baselines.roles.learned_role.dagger import LESSONS
from dorothie_gym.baselines.roles.learned_role.utterance_inputs import KEPT, UTTERANCE_SIZE
from dorothie_gym.errors import ModelFileError, SessionError
from dorothie_gym.evaluation.rollout import generate_corpus
from dorothie_gym.evaluation.rollout.play import play_session
from dorothie_gym.ontology import Role
from dorothie_gym.policies import ScriptedAdWizard, ScriptedParticipant, find_player
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.session.session_engine import SessionEngine
from dorothie_gym.session.spaces import SpaceLimits

pytestmark = pytest.mark.timeout(600)


@pytest.fixture(scope="module")
def corpus(tmp_path_factory):
    folder = tmp_path_factory.mktemp("corpus")
    generate_corpus(folder, sessions=16, seed=5, workers=1, config=EnvConfig(max_seconds=60.0))
    return folder


def settings(corpus):
    return CoWizardTraining(
        corpus=corpus, seed=3, rounds=1, sessions=2, max_seconds=30.0, first_epochs=1, epochs=1, last_epochs=1, least=1
    )


@pytest.fixture(scope="module")
def trained(corpus, tmp_path_factory):
    folder = tmp_path_factory.mktemp("runs") / "one"
    stages = train_co_wizard(settings(corpus), folder, workers=1, on_stage=lambda *_: None)
    assert len(stages) == 2
    return folder


def weights(folder):
    return {name: value.numpy().tobytes() for name, value in load_file(folder / "model.safetensors").items()}


@pytest.mark.long
def test_examples_have_the_lengths_that_the_network_takes(trained):
    lessons = load_file(next((trained / LESSONS).rglob("*.safetensors")))
    assert lessons["listening"].shape[1] == STATE.size + KEPT * UTTERANCE_SIZE
    page = json.loads((trained / "model.json").read_text())
    layout = page["layout"]
    assert (layout["state"], layout["place"], layout["command"]) == tuple(
        lessons[name].shape[-1] for name in ("acting", "places", "commands")
    )


@pytest.mark.long
def test_interrupted_training_ends_with_the_same_weights(corpus, trained, tmp_path):
    class InterruptedTrainingError(Exception):
        pass

    def stop(stage, done, total):
        if stage.startswith("Practice") and done:
            raise InterruptedTrainingError

    with pytest.raises(InterruptedTrainingError):
        train_co_wizard(settings(corpus), tmp_path / "two", workers=1, on_stage=stop)
    assert not (tmp_path / "two" / "model.json").exists()
    stages = train_co_wizard(settings(corpus), tmp_path / "two", workers=1, on_stage=lambda *_: None)
    assert [stage.name for stage in stages] == ["two"]  # the first fit is not done again
    assert weights(tmp_path / "two") == weights(trained)


def test_weights_are_stored_in_half_precision(trained):
    stored = load_file(trained / "model.safetensors")
    assert {value.dtype for value in stored.values()} == {torch.float16}
    network, _ = FILES.load(trained)
    assert {name: value.half().numpy().tobytes() for name, value in network.state_dict().items()} == weights(trained)
    assert {value.dtype for value in network.state_dict().values()} == {torch.float32}


def test_trainings_with_other_seeds_share_the_lessons_of_the_corpus(corpus, trained, tmp_path):
    shared = tmp_path / "shared"
    for seed in (3, 4):
        other = dataclasses.replace(settings(corpus), seed=seed, rounds=0)
        train_co_wizard(other, tmp_path / str(seed), workers=1, on_stage=lambda *_: None, lessons=shared)
        assert not (tmp_path / str(seed) / LESSONS).exists()
    own = trained / LESSONS / "corpus"
    found = {path.name: path.read_bytes() for path in own.glob("*.safetensors")}
    assert found == {path.name: path.read_bytes() for path in shared.glob("*.safetensors")}
    assert weights(tmp_path / "3") != weights(tmp_path / "4")


def test_folder_of_other_settings_is_refused(corpus, trained):
    other = CoWizardTraining(corpus=corpus, seed=4)
    with pytest.raises(SessionError, match="has seed 3, not 4"):
        train_co_wizard(other, trained, workers=1, on_stage=lambda *_: None)


def test_corpus_that_cannot_be_read_leaves_no_training_behind(tmp_path):
    missing = CoWizardTraining(corpus=tmp_path / "missing")
    with pytest.raises(SessionError, match="no such folder"):
        train_co_wizard(missing, tmp_path / "out", workers=1, on_stage=lambda *_: None)
    assert not (tmp_path / "out").exists()


def test_player_talks_and_drives_the_same_session_twice(trained, tmp_path):
    engine = SessionEngine("midtown", config=EnvConfig(max_seconds=60.0))
    logs = []
    for name in ("a", "b"):
        player = find_player(str(trained), Role.CO_WIZARD).make(Role.CO_WIZARD, engine.limits)
        cast = {
            Role.PARTICIPANT: ScriptedParticipant(engine.limits),
            Role.CO_WIZARD: player,
            Role.AD_WIZARD: ScriptedAdWizard(engine.limits),
        }
        play_session(engine, cast, seed=8, folder=tmp_path / name)
        logs.append((tmp_path / name / "events.jsonl").read_text())
    assert logs[0] == logs[1]


def test_model_plays_no_other_role(trained):
    player = find_player(str(trained), Role.PARTICIPANT)
    with pytest.raises(ValueError, match="plays the co_wizard, not the participant"):
        player.make(Role.PARTICIPANT, SpaceLimits())


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"format": 1}, "another version"),
        ({"vocabulary": ["", "{}"]}, "layout"),
        ({"layout": {"state": 1, "place": 1, "command": 1, "remarks": 1}}, "layout"),
    ],
)
def test_model_of_another_version_is_refused(trained, tmp_path, change, message):
    page = json.loads((trained / "model.json").read_text())
    (tmp_path / "model.json").write_text(json.dumps({**page, **change}))
    (tmp_path / "model.safetensors").write_bytes((trained / "model.safetensors").read_bytes())
    with pytest.raises(ModelFileError, match=message):
        FILES.load(tmp_path)


def test_cut_weights_are_refused(trained, tmp_path):
    (tmp_path / "model.json").write_text((trained / "model.json").read_text())
    (tmp_path / "model.safetensors").write_bytes((trained / "model.safetensors").read_bytes()[:-100])
    with pytest.raises(ModelFileError, match="cannot be read"):
        FILES.load(tmp_path)
