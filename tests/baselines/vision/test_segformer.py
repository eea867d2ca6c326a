from dataclasses import replace

import numpy as np
import pytest
import torch

pytest.importorskip("transformers")

from dorothie_gym.baselines.trainer import LAST_FILE
from dorothie_gym.baselines.vision.pixel_learner import PixelLearner, pixel_scores, predict_pixels
from dorothie_gym.baselines.vision.predicted_pixels import with_predictions
from dorothie_gym.baselines.vision.segformer import SegFormer, SegFormerConfig, class_weights, soft_jaccard_loss
from dorothie_gym.baselines.vision.training import train_learner
from dorothie_gym.errors import CheckpointError
from tests.baselines.vision.pictures import frame_set, session_frames

TINY = SegFormerConfig(
    width=128, height=64, depths=(1, 1, 1, 1), hidden_sizes=(16, 16, 16, 16), heads=(1, 1, 1, 1), mlp_ratio=2,
    decoder=16, bins=64, epochs=2, coarse=0.5, batch_size=4, learning_rate=5e-3,
)  # fmt: skip
CPU = torch.device("cpu")


def learner(config=TINY, seed=0):
    return PixelLearner(config, frame_set(0, 1), frame_set(2, count=4), seed, CPU)


def run(folder, config=TINY, seed=0, interrupt=None):
    clock = iter(range(1000)).__next__
    trained = learner(config, seed)

    def on_step(done, planned, loss):
        if done == interrupt:
            raise KeyboardInterrupt

    epochs = train_learner(trained, folder, seed=seed, about={"model": "segformer"}, clock=clock, on_step=on_step)
    return trained, epochs


def weights(model):
    return torch.cat([value.flatten().float() for value in model.state_dict().values()])


@pytest.mark.long
def test_training_learns_classes_and_depths(tmp_path):
    trained, epochs = run(tmp_path, replace(TINY, epochs=40, coarse=0.25))
    figures = pixel_scores(trained.model, frame_set(3)).figures()
    untrained = pixel_scores(SegFormer(TINY), frame_set(3)).figures()
    assert epochs[-1].loss < 0.5 * epochs[0].loss
    assert figures["miou"] > 0.7 > untrained["miou"]
    assert figures["depth_error"] < 0.5 < untrained["depth_error"]


def test_equal_seeds_give_equal_weights_and_others_do_not(tmp_path):
    first, again, other = (run(tmp_path / name, seed=seed)[0] for name, seed in (("a", 0), ("b", 0), ("c", 1)))
    assert torch.equal(weights(first.model), weights(again.model))
    assert not torch.equal(weights(first.model), weights(other.model))


def test_interrupted_training_resumes_to_equal_weights(tmp_path):
    whole, epochs = run(tmp_path / "whole")
    with pytest.raises(KeyboardInterrupt):
        run(tmp_path / "parts", interrupt=6)  # in the second epoch
    resumed, found = run(tmp_path / "parts")
    assert torch.equal(weights(whole.model), weights(resumed.model))
    assert [epoch.loss for epoch in found] == [epoch.loss for epoch in epochs]


def test_finished_training_is_read_and_other_settings_are_refused(tmp_path):
    run(tmp_path)
    before = (tmp_path / LAST_FILE).read_bytes()
    run(tmp_path, interrupt=1)  # no step is made
    assert (tmp_path / LAST_FILE).read_bytes() == before
    with pytest.raises(CheckpointError, match="another config"):
        run(tmp_path, replace(TINY, learning_rate=1e-4))


@pytest.mark.parametrize("detail", [1, 2, 4])
def test_outputs_have_the_size_of_the_pictures(detail):
    model = SegFormer(replace(TINY, detail=detail, depth_detail=min(detail, 2))).eval()
    classes, depth = predict_pixels(model, session_frames(2).rgb)
    assert classes.shape == depth.shape == (2, 64, 128)
    assert classes.max() < 23 and depth.min() > 0.9 and depth.max() < 201.0


def test_depth_is_the_median_of_its_bins():
    model = SegFormer(replace(TINY, depth_detail=1)).eval()
    with torch.no_grad():
        model.depth_head.weight.zero_()
        model.depth_head.bias.fill_(-50.0)
        model.depth_head.bias[30] = 0.0
        outputs = model(torch.zeros(1, 3, 64, 128))
        depth = model.depth(outputs, (64, 128))
    assert torch.allclose(depth.log(), model.bin_centres[30].expand_as(depth), atol=1e-4)


def test_predictions_of_a_picture_do_not_depend_on_those_beside_it():
    torch.manual_seed(1)
    model, rgb = SegFormer(TINY).eval(), session_frames(3).rgb
    classes, depth = predict_pixels(model, rgb)
    for k in range(3):
        alone = predict_pixels(model, rgb[k : k + 1])
        assert (alone[0][0] == classes[k]).mean() > 0.999
        assert np.allclose(alone[1][0], depth[k], rtol=1e-3)


def test_rare_classes_weigh_more_and_missing_ones_nothing():
    found = class_weights(torch.tensor([0.0, 900.0, 100.0]), 0.5)
    assert found[0] == 0.0 and found[2] == pytest.approx(3.0 * found[1])
    assert class_weights(torch.tensor([0.0, 900.0, 100.0]), 0.0).tolist() == [0.0, 1.0, 1.0]


def test_soft_jaccard_loss_is_zero_for_sure_and_right_scores_only():
    kinds = torch.tensor([[[0, 1], [1, 1]]])
    right = 50.0 * torch.nn.functional.one_hot(kinds, 3).permute(0, 3, 1, 2).float()
    assert soft_jaccard_loss(right, kinds) == pytest.approx(0.0, abs=1e-6)
    assert soft_jaccard_loss(right.roll(1, 1), kinds) == pytest.approx(1.0, abs=1e-6)


def test_predictions_replace_labels_but_not_boxes_and_are_kept(tmp_path):
    model, pictures = SegFormer(TINY), frame_set(0, count=3)
    pictures.sessions[0].rgb.setflags(write=False)  # as the cache's
    found = with_predictions(pictures, model, tmp_path)
    classes, depth = predict_pixels(model, pictures.take(range(3)).rgb)
    assert np.array_equal(found.take(range(3)).semantic, classes)
    assert np.allclose(found.take(range(3)).depth, depth, rtol=1e-2)
    assert np.array_equal(found.sessions[0].boxes, pictures.sessions[0].boxes)
    again = with_predictions(pictures, SegFormer(TINY), tmp_path)  # the folder is that of one model
    assert np.array_equal(again.take(range(3)).semantic, classes)


@pytest.mark.parametrize("change", [{"width": 100}, {"detail": 3}, {"epochs": 0}, {"coarse": 1.5}])
def test_settings_out_of_range_are_refused(change):
    with pytest.raises(ValueError, match="SegFormerConfig"):
        replace(TINY, **change)


def test_published_config_has_the_published_learning():
    config = SegFormerConfig.paper()
    assert (config.learning_rate, config.weight_decay, config.bins) == (6e-5, 0.01, 256)
