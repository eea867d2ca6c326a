from dataclasses import replace

import pytest
import torch

from dorothie_gym.baselines.model_entries import ROWS, find_row
from dorothie_gym.baselines.point_tensors import NFD, Outputs, allowed_angle, decode
from dorothie_gym.baselines.toto import (
    ABLATIONS,
    ALL_CHANNELS,
    TOTO,
    Channel,
    FrozenTexts,
    SmallTextEncoder,
    TOTOConfig,
    Towns,
    TrainedTexts,
    point_losses,
)
from dorothie_gym.baselines.toto.losses import angle_error
from dorothie_gym.ontology import PhysicalAction
from tests.baselines import samples

TINY = replace(
    TOTOConfig.small(), width=96, heads=2, feed_forward=32, lane_width=8, map_heads=2, id_width=4, text_width=16
)

FIELDS = {
    Channel.MAP: ("landmark_place", "landmark_text", "street_text"),
    Channel.TRAJECTORY: ("window_pose", "window_lane"),
    Channel.ACTIONS: ("action", "action_angle"),
    Channel.MOVES: ("move", "move_slots"),
    Channel.TRANSCRIPT: ("utterance_text",),
    Channel.VISION: ("window_kind", "window_values"),
    Channel.SPEECH: ("current_recognised",),
    Channel.OBJECTS: ("kind", "values"),
}


@pytest.fixture(autouse=True)
def seeded():
    torch.manual_seed(0)


def make(config=TINY, graphs=None):
    torch.manual_seed(0)
    towns = Towns(graphs or [samples.town_graph()])
    if config.text == "frozen":
        texts = FrozenTexts(torch.randn(samples.TEXTS, 24))
    else:
        pieces = torch.randint(1, 50, (samples.TEXTS, 6))
        texts = TrainedTexts(pieces, SmallTextEncoder(50, 6, config.text_width, 1, 0.1), config.text_width)
    return TOTO(config, towns, texts)


def values(outputs):
    return torch.cat([outputs.move.flatten(1), outputs.slot_values.flatten(1), outputs.action, outputs.angle], dim=1)


@pytest.mark.parametrize("text", ["frozen", "trained"])
def test_padding_changes_nothing(text):
    model = make(replace(TINY, text=text)).eval()
    tight, roomy = samples.inputs(room=0), samples.inputs(room=5)
    torch.testing.assert_close(values(model(roomy)), values(model(tight)), atol=1e-5, rtol=1e-4)


def test_values_in_the_padding_do_not_change_the_outputs():
    model = make().eval()
    given = samples.inputs(room=2)
    wanted = values(model(given))
    for name in ("move", "action", "kind"):
        mask = given["objects_mask" if name == "kind" else f"{name}_mask"]
        given[name] = torch.where(mask, given[name], 1)
    given["window_pose"] = torch.where(given["window_mask"].unsqueeze(-1), given["window_pose"], 1e3)
    torch.testing.assert_close(values(model(given)), wanted, atol=1e-5, rtol=1e-4)


def test_other_towns_do_not_change_the_outputs():
    alone = make().eval()
    beside = make(graphs=[samples.town_graph(), samples.town_graph(30, seed=4)]).eval()
    beside.load_state_dict(alone.state_dict())
    given = samples.inputs()
    torch.testing.assert_close(values(beside(given)), values(alone(given)), atol=1e-5, rtol=1e-4)


def test_the_order_of_a_batch_does_not_matter():
    model = make().eval()
    given, order = samples.inputs(), torch.tensor([3, 1, 5, 0, 4, 2])
    shuffled = {name: value[order] for name, value in given.items()}
    torch.testing.assert_close(values(model(shuffled)), values(model(given))[order], atol=1e-5, rtol=1e-4)


def test_outputs_of_a_point_do_not_depend_on_the_batch():
    model = make().eval()
    given = samples.inputs()
    alone = torch.cat([values(model({name: value[[row]] for name, value in given.items()})) for row in range(6)])
    torch.testing.assert_close(alone, values(model(given)), atol=1e-5, rtol=1e-4)


def later(given, seconds):
    """The same points, everything that has a time so much later."""
    times = ("time", "move_time", "utterance_time", "action_time", "window_time")
    return {**given, **{name: given[name] + seconds for name in times}}


@pytest.mark.parametrize(("clock", "told"), [("point", False), ("session", True)])
def test_times_count_from_the_point_or_from_the_session_start_by_clock(clock, told):
    config = replace(TINY, clock=clock).without(Channel.MAP)  # known from the beginning: it has the session's time
    model, given = make(config).eval(), samples.inputs()
    assert torch.allclose(values(model(later(given, 60.0))), values(model(given)), atol=1e-4) is not told


def test_map_tokens_have_the_session_time_for_both_clocks():
    model, given = make(replace(TINY, clock="point")).eval(), samples.inputs()
    assert not torch.allclose(values(model(later(given, 60.0))), values(model(given)), atol=1e-4)


def test_settings_of_another_version_are_refused():
    fields = TINY.to_json()
    del fields["clock"]
    with pytest.raises(ValueError, match="clock.*another version"):
        TOTOConfig.from_json(fields)


def test_a_town_without_lanes_is_no_obstacle():
    given = samples.on_no_lane(samples.inputs())
    assert values(make(graphs=[samples.no_town()]).eval()(given)).isfinite().all()


@pytest.mark.parametrize("row", [row for row in ROWS if row.change and row.kind == "toto"], ids=lambda row: row.command)
def test_every_weight_of_every_row_learns(row):
    model = make(row.change(TINY))
    model.loss(samples.inputs(24), samples.labels(24)).backward()
    idle = [name for name, weights in model.named_parameters() if weights.grad is None or not weights.grad.any()]
    assert not idle


@pytest.mark.parametrize("channel", ALL_CHANNELS, ids=str)
def test_a_channel_that_is_taken_away_is_not_looked_at_and_one_that_is_given_is(channel):
    given = samples.inputs()
    changed = samples.inputs(seed=1)
    other = {**given, **{name: changed[name] for name in FIELDS[channel]}}
    for config, looks in ((TINY, True), (TINY.without(channel), False)):
        model = make(config).eval()
        same = torch.allclose(values(model(given)), values(model(other)), atol=1e-6)
        assert same is not looks


def test_the_row_without_the_current_utterance_reads_it_in_no_form():
    change = find_row("toto-no-current-utterance").change
    assert change is not None
    model = make(change(TINY)).eval()
    given = samples.inputs()
    changed = {name: (given[name] + 7) % samples.TEXTS for name in ("current_text", "current_recognised")}
    torch.testing.assert_close(values(model({**given, **changed})), values(model(given)))


def test_without_speech_the_words_of_the_current_utterance_stay():
    model = make(TINY.without(Channel.SPEECH)).eval()
    given = samples.inputs()
    other = {**given, "current_text": (given["current_text"] + 7) % samples.TEXTS}
    assert not torch.allclose(values(model(other)), values(model(given)))


def test_without_object_history_there_are_objects_neither_in_the_window_nor_at_the_point():
    left = set(TINY.without(*ABLATIONS["Object History"]).channels)
    assert not left & {Channel.VISION, Channel.OBJECTS}


def test_the_published_sizes_are_the_papers():
    paper = TOTOConfig.paper()
    assert (paper.width, paper.layers, paper.heads, paper.feed_forward, paper.dropout) == (770, 2, 11, 770, 0.1)
    assert (paper.learning_rate, paper.weight_decay, paper.clip) == (1e-5, 1e-4, 1.0)
    assert (paper.min_epochs, paper.patience, paper.window, paper.window_step) == (10, 5, 25, 4)


def test_config_is_restored_from_json():
    for config in (TOTOConfig.paper(), TOTOConfig.published(), TOTOConfig.small().without(Channel.MAP)):
        assert TOTOConfig.from_json(config.to_json()) == config


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"width": 90}, "width is 90.* multiple of heads"),
        ({"dropout": 1.0}, r"dropout is 1.0.*\[0, 1\)"),
        ({"channels": ()}, "channels is empty"),
        ({"min_epochs": 99}, "min_epochs is 99, above max_epochs"),
    ],
)
def test_invalid_config_is_refused_with_the_field(change, message):
    with pytest.raises(ValueError, match=message):
        replace(TINY, **change, **({"heads": 4} if "width" in change else {}))


def test_an_angle_of_179_is_next_to_one_of_minus_179():
    right = torch.deg2rad(torch.tensor([179.0]))
    direction = torch.stack((right.cos(), right.sin()), dim=-1)
    assert angle_error(direction, torch.tensor([-179.0])) == pytest.approx(2.0, abs=0.1)
    assert angle_error(direction, torch.tensor([89.0])) > 75.0
    assert angle_error(direction, torch.tensor([torch.nan])) == 0.0


def test_left_and_right_lane_switches_can_both_be_learnt():
    model = make()
    model.train()
    optimiser = torch.optim.AdamW(model.parameters(), lr=3e-3)
    given, truth = samples.inputs(12), samples.labels(12)
    sides = torch.where(torch.arange(12) % 2 == 0, 90.0, -90.0)
    switch = torch.full((12,), PhysicalAction.LANE_SWITCH.nfd_class)
    truth = replace(truth, task=torch.full((12,), NFD), action=switch, angle=sides)
    for _ in range(60):
        optimiser.zero_grad()
        model.loss(given, truth).backward()
        optimiser.step()
    predicted = model.eval().predict(given, truth.task)
    torch.testing.assert_close(predicted.action, switch)
    torch.testing.assert_close(predicted.angle, sides)


def test_angles_are_as_the_ontology_has_them():
    actions = [PhysicalAction.STOP, PhysicalAction.U_TURN, PhysicalAction.LANE_SWITCH, PhysicalAction.LANE_SWITCH]
    classes = torch.tensor([action.nfd_class for action in [*actions, PhysicalAction.J_TURN, PhysicalAction.J_TURN]])
    found = allowed_angle(classes, torch.tensor([33.0, 33.0, 12.0, -170.0, 33.0, 190.0]))
    assert found.tolist() == [0.0, 0.0, 90.0, -90.0, 33.0, -170.0]


def test_the_head_of_the_speaker_is_read():
    move = torch.zeros(2, 2, 15)
    move[:, 0, 3], move[:, 1, 8] = 1.0, 1.0
    empty = torch.zeros(2, 2, 69)
    outputs = Outputs(move, torch.zeros(2, 2, 5), empty, torch.zeros(2, 6), torch.ones(2, 2), torch.zeros(2, 5))
    assert decode(outputs, torch.tensor([0, 1])).move.tolist() == [3, 8]


def test_belief_loss_counts_known_labels_only():
    given, truth = samples.inputs(), samples.labels()
    plain, with_belief = make(), make(replace(TINY, belief=True)).eval()
    outputs = with_belief(given)
    known = point_losses(outputs, truth, with_belief.config)
    unknown = replace(truth, belief=torch.full_like(truth.belief, torch.nan))
    torch.testing.assert_close(
        point_losses(outputs, unknown, with_belief.config), point_losses(outputs, truth, plain.config)
    )
    assert (known > point_losses(outputs, truth, plain.config)).all()
