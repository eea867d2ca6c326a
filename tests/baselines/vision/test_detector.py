from dataclasses import replace

import numpy as np
import pytest
import torch

pytest.importorskip("transformers")

from dorothie_gym.baselines import checkpoints
from dorothie_gym.baselines.vision import object_learner
from dorothie_gym.baselines.vision.detector import Detector, DetectorConfig
from dorothie_gym.baselines.vision.metrics import average_precisions
from dorothie_gym.baselines.vision.object_learner import ObjectLearner, detected_boxes, object_figures, targets
from dorothie_gym.baselines.vision.training import train_learner
from tests.baselines.vision.pictures import CAR_TURN, frame_set, session_frames

TINY = DetectorConfig(
    width=128, height=64, queries=5, encoder_layers=1, decoder_layers=2, size=32, feed_forward=32, heads=1, encoded=4,
    backbone_sizes=(8, 16, 16, 16), epochs=2, batch_size=4, learning_rate=2e-3,
)  # fmt: skip
CPU = torch.device("cpu")


def learner(config=TINY, seed=0):
    return ObjectLearner(config, frame_set(0, 1), frame_set(2, count=4), seed, CPU)


def run(folder, config=TINY, interrupt=None):
    trained = learner(config)

    def on_step(done, planned, loss):
        if done == interrupt:
            raise KeyboardInterrupt

    epochs = train_learner(trained, folder, seed=0, about={}, clock=iter(range(1000)).__next__, on_step=on_step)
    return trained, epochs


def weights(model):
    return torch.cat([value.flatten().float() for value in model.state_dict().values()])


@pytest.fixture(scope="module")
def long_training(tmp_path_factory):
    return run(tmp_path_factory.mktemp("long"), replace(TINY, epochs=40, learning_rate=4e-3, zoom=1.0))


@pytest.mark.long
def test_training_finds_cars(long_training):
    pictures, (trained, epochs) = frame_set(3, 4), long_training
    found, guessed = (
        average_precisions(detected_boxes(model, pictures), (0.2,))[0] for model in (trained.model, learner().model)
    )
    assert epochs[-1].loss < 0.5 * epochs[0].loss
    assert found > 0.3 and guessed < 0.1


@pytest.mark.long
def test_training_learns_places_sizes_and_headings(long_training):
    pictures, (trained, _) = frame_set(3, 4), long_training
    found, guessed = (object_figures(detected_boxes(model, pictures)) for model in (trained.model, learner().model))
    assert found["ap_place"] > 0.3 > guessed["ap_place"]
    assert found["range_error"] < 0.1 and found["size_error"] < 0.2 and found["heading_error"] < 60.0


def test_figures_are_of_each_kind_and_count_the_boxes():
    figures = object_figures(detected_boxes(Detector(TINY), frame_set(3)))
    assert figures["boxes_vehicles"] == 8 and figures["boxes_pedestrian"] == 0
    assert np.isnan(figures["ap50_pedestrian"]) and 0.0 <= figures["ap50"] == figures["ap50_vehicles"]


@pytest.mark.parametrize("two_stage", [True, False])
def test_interrupted_training_resumes_to_equal_weights(tmp_path, two_stage):
    config = replace(TINY, two_stage=two_stage)
    whole, _ = run(tmp_path / "whole", config)
    with pytest.raises(KeyboardInterrupt):
        run(tmp_path / "parts", config, interrupt=6)  # in the second epoch
    resumed, _ = run(tmp_path / "parts", config)
    assert torch.equal(weights(whole.model), weights(resumed.model))


def test_all_weights_learn_the_backbone_included():
    trained = learner()
    before = {name: weight.detach().clone() for name, weight in trained.model.named_parameters()}
    optimiser = torch.optim.SGD([weight for group, _ in trained.groups() for weight in group], lr=0.1)
    for rows in ([0, 1, 2, 3], [4, 5, 6, 7]):  # heads that begin at zero pass on what they learn in the second step
        optimiser.zero_grad()
        trained.loss(rows, 0).backward()
        optimiser.step()
    stuck = [name for name, weight in trained.model.named_parameters() if torch.equal(weight, before[name])]
    assert "backbone" in " ".join(before) and not stuck


@pytest.mark.parametrize("two_stage", [True, False])
def test_saved_weights_give_equal_detections(tmp_path, two_stage):
    config = replace(TINY, two_stage=two_stage)
    model, other = Detector(config).eval(), Detector(config).eval()
    checkpoints.save(tmp_path / "weights", model, {})
    checkpoints.restore(tmp_path / "weights", other)
    pictures = frame_set(0, count=2)
    for here, there in zip(detected_boxes(model, pictures), detected_boxes(other, pictures), strict=True):
        assert np.array_equal(here.detected, there.detected) and np.array_equal(here.scores, there.scores)


def test_all_five_channels_are_read():
    torch.manual_seed(0)
    model = Detector(TINY).eval()
    rgb, depth, kinds = torch.zeros(1, 3, 64, 128), torch.full((1, 64, 128), 9.0), torch.zeros(1, 64, 128).long()
    before = model.encoded(rgb, depth, kinds)
    for changed in ((rgb + 0.5, depth, kinds), (rgb, 2.0 * depth, kinds), (rgb, depth, kinds + 1)):
        assert not torch.equal(model.encoded(*changed), before)
    sky = torch.full_like(depth, torch.inf)
    assert model.encoded(rgb, sky, kinds).isfinite().all()


def test_queries_have_the_size_of_the_config():
    found = Detector(TINY).eval()(
        torch.zeros(2, 3, 64, 128), torch.ones(2, 64, 128), torch.zeros(2, 64, 128, dtype=torch.int64)
    )
    assert found.queries.shape == (2, 5, 32) and found.boxes.shape == (2, 5, 4) and found.scores.shape == (2, 5, 3)


def test_targets_are_middles_and_sizes_and_leave_out_small_objects():
    session = session_frames(1)
    box = session.boxes_of(0)
    found = targets(box, replace(TINY, least_pixels=1))
    left, top = int(box["left"][0]), int(box["top"][0])
    assert found.boxes[0].tolist() == pytest.approx([(left + 12) / 128, (top + 8) / 64, 24 / 128, 16 / 64])
    assert found.kinds.tolist() == [0] and found.known.tolist() == [True]
    assert found.solids[0, :2].tolist() == pytest.approx([(left + 12) / 128, (top + 8) / 64], abs=1e-6)
    assert found.solids[0, 2:6].exp().tolist() == pytest.approx([10.0, 4.0, 1.8, 1.5], rel=1e-5)
    assert found.solids[0, 6:].tolist() == pytest.approx([np.sin(CAR_TURN), np.cos(CAR_TURN)], abs=1e-6)
    assert len(targets(box, replace(TINY, least_pixels=24 * 16 + 1)).boxes) == 0


def test_enlarged_part_moves_boxes_with_the_pixels():
    session = session_frames(1, seed=5)
    box = session.boxes_of(0)
    window = (0.1, 0.2, 0.7)
    _, depth, semantic = object_learner._part(
        torch.zeros(3, 64, 128),
        torch.from_numpy(session.depth[0].astype(np.float32)),
        torch.from_numpy(session.semantic[0].astype(np.int64)),
        window,
    )
    moved = object_learner._in_part(targets(box, TINY), window)
    rows, columns = np.nonzero(semantic.numpy() == box["kind"][0])
    drawn = [(columns.min() + columns.max() + 1) / 256, (rows.min() + rows.max() + 1) / 128]
    assert moved.boxes[0, :2].tolist() == pytest.approx(drawn, abs=0.02)
    assert moved.solids[0, :2].tolist() == pytest.approx(drawn, abs=0.02)  # this car's middle is that of its box
    shown = float(depth[int(rows.mean()), int(columns.mean())])
    assert float(moved.solids[0, 2].exp()) == pytest.approx(shown, rel=1e-3)  # as near as its pixels look
    assert moved.solids[0, 3:].tolist() == targets(box, TINY).solids[0, 3:].tolist()  # its size and side seen stay


def test_published_config_has_the_published_sizes():
    config = DetectorConfig.paper()
    assert (config.queries, config.size, config.learning_rate) == (300, 256, 2e-4)
    assert config.learning_rate * config.backbone_rate == pytest.approx(2e-5) and config.weight_decay == 1e-4
