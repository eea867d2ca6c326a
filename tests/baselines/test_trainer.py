from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from dorothie_gym.baselines.checkpoints import about, restore, save
from dorothie_gym.baselines.learning_curves import draw_loss_curves
from dorothie_gym.baselines.point_tensors import Examples
from dorothie_gym.baselines.toto import TOTOConfig
from dorothie_gym.baselines.trainer import BEST_FILE, LAST_FILE, batches, predict, train
from dorothie_gym.errors import CheckpointError
from tests.baselines import samples
from tests.baselines.test_toto import TINY, make

CONFIG = replace(TINY, batch_size=8, min_epochs=3, max_epochs=4, learning_rate=1e-3)
ABOUT = {"model": "TOTO", "corpus": "abc", "encoder": "hashing-1-24"}


def examples(points, seed):
    return Examples(samples.inputs(points, seed=seed), samples.labels(points, seed))


TRAINING, VALIDATION = examples(40, 0), examples(16, 1)


def run(folder: Path, on_epoch=lambda epoch: None, seed=0, config=CONFIG, told=ABOUT):
    model = make(config)
    return model, train(model, TRAINING, VALIDATION, folder=folder, seed=seed, about=told, on_epoch=on_epoch)


def same(one, two):
    return all(torch.equal(a, b) for a, b in zip(one.state_dict().values(), two.state_dict().values(), strict=True))


def test_the_same_seed_gives_the_same_losses_to_the_last_digit(tmp_path):
    _, one = run(tmp_path / "one")
    _, two = run(tmp_path / "two")
    _, other = run(tmp_path / "other", seed=1)
    assert one.epochs == two.epochs
    assert one.epochs != other.epochs


@pytest.mark.parametrize("died_after", [1, 2, 3])
def test_interrupted_training_resumes_to_equal_weights(tmp_path, died_after):
    whole, wanted = run(tmp_path / "whole")

    class Killed(BaseException):
        pass

    def die(epoch):
        if epoch.number == died_after:
            raise Killed

    with pytest.raises(Killed):
        run(tmp_path / "killed", die)
    later, found = run(tmp_path / "killed")
    assert found.epochs == wanted.epochs
    assert same(later, whole)
    for name in (BEST_FILE, LAST_FILE):
        ours, theirs = make(CONFIG), make(CONFIG)
        restore(tmp_path / "whole" / name, ours)
        restore(tmp_path / "killed" / name, theirs)
        assert same(ours, theirs)


def test_complete_training_is_not_repeated(tmp_path):
    run(tmp_path)
    told = []
    run(tmp_path, told.append)
    assert not told


def test_the_model_is_left_as_it_was_in_its_best_epoch(tmp_path):
    model, trained = run(tmp_path)
    best = trained.epochs[-1]
    assert best.lowest == min(epoch.validation for epoch in trained.epochs)
    assert about(tmp_path / BEST_FILE)["epoch"] == best.best
    with torch.inference_mode():
        model.eval()
        assert float(model.loss(VALIDATION.inputs, VALIDATION.labels)) == pytest.approx(best.lowest, rel=1e-5)


def test_a_checkpoint_gives_the_same_predictions(tmp_path):
    model, _ = run(tmp_path)
    again = make(CONFIG)
    restore(tmp_path / BEST_FILE, again)
    one, two = predict(model, VALIDATION), predict(again, VALIDATION)
    assert all(torch.equal(getattr(one, name), getattr(two, name)) for name in ("move", "slots", "action", "angle"))


def test_training_stops_when_validation_no_longer_gets_better(tmp_path):
    config = replace(CONFIG, learning_rate=0.3, min_epochs=3, max_epochs=30, patience=2)
    _, trained = run(tmp_path, config=config)
    last = trained.epochs[-1]
    assert 3 <= last.number < 30
    assert last.number >= 3 and last.number - last.best >= 2


@pytest.mark.parametrize(("name", "value"), [("corpus", "xyz"), ("encoder", "minilm"), ("model", "E.T.")])
def test_other_training_in_the_folder_is_refused_with_the_difference(tmp_path, name, value):
    run(tmp_path)
    with pytest.raises(CheckpointError, match=f"another {name}"):
        run(tmp_path, told={**ABOUT, name: value})


def test_another_config_in_the_folder_is_refused(tmp_path):
    run(tmp_path)
    with pytest.raises(CheckpointError, match="another config"):
        run(tmp_path, config=replace(CONFIG, learning_rate=1e-4))


def test_damaged_checkpoint_is_refused(tmp_path):
    run(tmp_path)
    file = tmp_path / LAST_FILE
    file.write_bytes(file.read_bytes()[:100])
    with pytest.raises(CheckpointError, match="damaged"):
        run(tmp_path)


def test_checkpoint_of_other_sizes_is_refused(tmp_path):
    save(tmp_path / "a.safetensors", make(CONFIG), {})
    with pytest.raises(CheckpointError, match="other sizes"):
        restore(tmp_path / "a.safetensors", make(replace(CONFIG, feed_forward=48)))


def test_every_point_is_seen_once_in_an_epoch_in_another_order_each_time():
    one, two = (torch.cat(list(batches(TRAINING, 8, seed))) for seed in (1, 2))
    assert sorted(one.tolist()) == list(range(40))
    assert one.tolist() != two.tolist()


def test_losses_are_drawn(tmp_path):
    _, trained = run(tmp_path)
    draw_loss_curves(trained.epochs, "TOTO", tmp_path / "loss.png")
    assert (tmp_path / "loss.png").read_bytes()[:4] == b"\x89PNG"


def test_small_is_the_papers_but_for_sizes():
    small, paper = TOTOConfig.small(), TOTOConfig.paper()
    assert small.channels == paper.channels and small.loss == paper.loss
    assert small.min_epochs == paper.min_epochs == 10 and small.patience == paper.patience == 5


def test_predictions_are_made_for_every_point():
    assert len(predict(make(CONFIG), TRAINING).move) == 40
    assert np.isfinite(predict(make(CONFIG), TRAINING).angle.numpy()).all()
