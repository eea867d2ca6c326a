import json

import pytest
import torch
from safetensors.torch import load_file

from dorothie_gym.baselines.roles.learned_role.dagger import LESSONS, RoundSettings
from dorothie_gym.baselines.roles.participant.files import FILES
from dorothie_gym.baselines.roles.participant.training import train_participant
from dorothie_gym.errors import ModelFileError, SessionError
from dorothie_gym.evaluation.rollout import generate_corpus
from dorothie_gym.evaluation.rollout.play import play_session
from dorothie_gym.ontology import Role
from dorothie_gym.policies import ScriptedAdWizard, ScriptedCoWizard, find_player
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.session.session_engine import SessionEngine
from dorothie_gym.session.spaces import SpaceLimits

pytestmark = pytest.mark.timeout(600)


@pytest.fixture(scope="module")
def corpus(tmp_path_factory):
    folder = tmp_path_factory.mktemp("corpus")
    generate_corpus(folder, sessions=12, seed=6, workers=1, config=EnvConfig(max_seconds=60.0))
    return folder


def settings(corpus, **changes):
    usual = {"seed": 3, "rounds": 1, "sessions": 2, "max_seconds": 30.0, "least": 1}
    epochs = {"first_epochs": 1, "epochs": 1, "last_epochs": 1}
    return RoundSettings(corpus=corpus, **{**usual, **epochs, **changes})


@pytest.fixture(scope="module")
def trained(corpus, tmp_path_factory):
    folder = tmp_path_factory.mktemp("runs") / "one"
    stages = train_participant(settings(corpus), folder, workers=1, on_stage=lambda *_: None)
    assert len(stages) == 2
    return folder


def weights(folder):
    return {name: value.numpy().tobytes() for name, value in load_file(folder / "model.safetensors").items()}


@pytest.mark.long
def test_interrupted_training_ends_with_the_same_weights(corpus, trained, tmp_path):
    class InterruptedTrainingError(Exception):
        pass

    def stop(stage, done, total):
        if stage.startswith("Practice") and done == 1:
            raise InterruptedTrainingError

    with pytest.raises(InterruptedTrainingError):
        train_participant(settings(corpus), tmp_path / "two", workers=1, on_stage=stop)
    assert not (tmp_path / "two" / "model.json").exists()
    stages = train_participant(settings(corpus), tmp_path / "two", workers=1, on_stage=lambda *_: None)
    assert [stage.name for stage in stages] == ["two"]  # the first fit is not done again
    assert weights(tmp_path / "two") == weights(trained)


def test_weights_are_stored_in_half_precision(trained):
    stored = load_file(trained / "model.safetensors")
    assert {value.dtype for value in stored.values()} == {torch.float16}
    network, _ = FILES.load(trained)
    assert {name: value.half().numpy().tobytes() for name, value in network.state_dict().items()} == weights(trained)


def test_folder_of_other_settings_is_refused(corpus, trained):
    with pytest.raises(SessionError, match="has seed 3, not 4"):
        train_participant(settings(corpus, seed=4), trained, workers=1, on_stage=lambda *_: None)


def test_remarks_that_are_not_in_the_vocabulary_are_not_learnt(trained):
    lessons = load_file(next((trained / LESSONS).rglob("*.safetensors")))
    assert lessons["remarks"].shape[1] == 4 and lessons["remarks"].min() >= -1


@pytest.mark.long
def test_player_talks_in_the_same_session_twice(trained, tmp_path):
    engine = SessionEngine("midtown", config=EnvConfig(max_seconds=60.0))
    logs = []
    for name in ("a", "b"):
        cast = {
            Role.PARTICIPANT: find_player(str(trained), Role.PARTICIPANT).make(Role.PARTICIPANT, engine.limits),
            Role.CO_WIZARD: ScriptedCoWizard(engine.limits),
            Role.AD_WIZARD: ScriptedAdWizard(engine.limits),
        }
        play_session(engine, cast, seed=8, folder=tmp_path / name)
        logs.append((tmp_path / name / "events.jsonl").read_text())
    assert logs[0] == logs[1]


def test_model_plays_no_other_role(trained):
    with pytest.raises(ValueError, match="plays the participant, not the co_wizard"):
        find_player(str(trained), Role.CO_WIZARD).make(Role.CO_WIZARD, SpaceLimits())


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"format": 2}, "another version"),
        ({"vocabulary": ["", "{}"]}, "layout"),
        ({"layout": {"state": 1, "errand": 1, "remarks": 1}}, "layout"),
    ],
)
def test_model_of_another_version_is_refused(trained, tmp_path, change, message):
    page = json.loads((trained / "model.json").read_text())
    (tmp_path / "model.json").write_text(json.dumps({**page, **change}))
    (tmp_path / "model.safetensors").write_bytes((trained / "model.safetensors").read_bytes())
    with pytest.raises(ModelFileError, match=message):
        FILES.load(tmp_path)
