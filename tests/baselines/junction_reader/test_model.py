from dataclasses import replace

import numpy as np
import pytest
import torch

from dorothie_gym.baselines.junction_reader import JunctionReader, exit_table, mentions
from dorothie_gym.baselines.junction_reader.features import label_words
from dorothie_gym.baselines.model_entries import reader_config
from dorothie_gym.baselines.point_tensors import NFD
from dorothie_gym.baselines.toto import FrozenTexts, Towns
from dorothie_gym.evaluation.teacher_forced.features import build
from dorothie_gym.maps.lane_graph import EDGE_TYPES, FEATURES, EdgeType
from dorothie_gym.ontology import LABELS, LandmarkName, ObjectClass, PhysicalAction, StreetName
from dorothie_gym.ontology.dialogue_acts import LABEL_INDEX
from tests.baselines import samples
from tests.baselines.test_toto import TINY


def crossing():
    """A lane to the east (0), one more (1), and ways on to the north (2), east (3) and south (4); 5 ends."""
    yaws = [(0, 0), (0, 0), (0, -90), (0, 0), (0, 90), (0, 0)]  # start, end [degrees, clockwise]
    graph = samples.town_graph(6)
    lanes = np.zeros((6, 14), np.float32)
    lanes[:, [FEATURES.index("start_yaw"), FEATURES.index("end_yaw")]] = yaws
    lanes[:, FEATURES.index("length")] = 20.0
    edges = np.array([[0, 1, 1, 1, 0], [1, 2, 3, 4, 5]], np.int32)
    kinds = [EdgeType.CONCAT] * 4 + [EdgeType.LEFT_LANE_CHANGE]
    out = np.concatenate([lanes, lanes[2:5], 0 * lanes[:3]])  # lanes 6 to 8 lead on as the connectors end
    out[6:9, FEATURES.index("start_yaw")] = [-90, 0, 90]
    edges = np.concatenate([edges, [[2, 3, 4], [6, 7, 8]]], axis=1)
    types = np.array([EDGE_TYPES.index(kind) for kind in [*kinds, *[EdgeType.CONCAT] * 3]], np.int32)
    junction = np.array([0, 0, 1, 1, 1, 0, 0, 0, 0, 0, 0, 0], np.int32)
    zeros = np.zeros(12, np.int32)
    return replace(
        graph, lanes=out, road=zeros, street=zeros, junction=junction, edges=edges.astype(np.int32), edge_types=types
    )


def test_exits_are_those_of_the_next_place_with_a_choice_left_positive():
    table = exit_table(crossing())
    for lane, before in ((0, 20.0), (1, 0.0)):
        assert table.angle[lane][table.there[lane]].tolist() == [-90.0, 0.0, 90.0]
        assert table.lane[lane][table.there[lane]].tolist() == [8, 7, 6]
        assert table.distance[lane] == before


def test_where_a_road_ends_there_are_no_exits():
    assert not exit_table(crossing()).there[5:].any()


def test_labels_are_spelt_in_words():
    assert label_words(LandmarkName.BURGER_KING.label) == ("burger", "king")
    assert label_words(LandmarkName.KFC.label) == ("kfc",)
    assert label_words(ObjectClass.TRAFFIC_LIGHT.label) == ("traffic", "light")


def test_mentions_match_complete_words_only():
    table = mentions(["Take Fuller to the burger king!", "Fullerton", ""])
    named = {LABELS[place] for place in np.flatnonzero(table[0])}
    assert {StreetName.FULLER, LandmarkName.BURGER_KING} <= named
    assert not table[1, LABEL_INDEX[StreetName.FULLER]] and not table[2].any()


class Columns:
    """What of a corpus the reader looks at."""

    def __init__(self, towns):
        self.towns = towns
        self.texts = tuple(f"text {number}" for number in range(samples.TEXTS))


def make(graphs=None):
    torch.manual_seed(0)
    columns = Columns(graphs or (samples.town_graph(),))
    pieces = torch.randint(1, 50, (samples.TEXTS, 5))
    texts = FrozenTexts(torch.randn(samples.TEXTS, 24))
    return JunctionReader(reader_config(TINY), Towns(columns.towns), texts, columns, pieces, 50)


def answers(model, given, task):
    found = model.eval().predict(given, task)
    return torch.cat([found.move[:, None], found.slots, found.action[:, None], found.angle[:, None]], dim=1)


def test_padding_changes_nothing():
    task = torch.arange(6) % 3
    model = make().eval()
    tight, roomy = (model._look(samples.inputs(room=room), task) for room in (0, 4))
    for one, two in zip(tight, roomy, strict=True):
        torch.testing.assert_close(one, two, atol=1e-5, rtol=1e-4)


def test_the_order_of_a_batch_does_not_matter():
    model, given, task = make(), samples.inputs(), torch.arange(6) % 3
    order = torch.tensor([2, 0, 5, 1, 3, 4])
    shuffled = {name: value[order] for name, value in given.items()}
    assert torch.equal(answers(model, shuffled, task[order]), answers(model, given, task)[order])


def test_every_weight_learns():
    model = make((crossing(),))
    model.train()
    given, truth = samples.inputs(60), samples.labels(60)
    given["window_lane"] = torch.zeros_like(given["window_lane"])
    decides, turn = truth.task == NFD, PhysicalAction.J_TURN.nfd_class
    angle = torch.where(decides, 90.0 - 180.0 * (torch.arange(60) % 2), truth.angle)
    action = torch.where(decides & (torch.arange(60) < 40), turn, truth.action)
    model.loss(given, replace(truth, action=action, angle=angle)).backward()
    idle = [
        name
        for name, weights in model.named_parameters()
        if weights.requires_grad and (weights.grad is None or not weights.grad.any())
    ]
    assert not idle


def test_turns_are_exits_of_the_junction_ahead():
    model = make((crossing(),))
    given = samples.inputs(40)
    given["window_lane"] = torch.zeros_like(given["window_lane"])
    found = model.eval().predict(given, torch.full((40,), 2))
    assert set(found.angle.tolist()) <= {-90.0, 0.0, 90.0}


def test_a_town_that_is_not_known_is_no_obstacle():
    given = samples.on_no_lane(samples.inputs())
    assert answers(make((samples.no_town(),)), given, torch.arange(6) % 3).isfinite().all()


def test_spans_with_known_acts_are_marked():
    model = make()
    given = samples.inputs()
    given["current_text"] = torch.zeros(6, dtype=torch.int64)
    given["move_time"][:, 0] = given["time"]
    given["move_speaker"][:, 0] = 0
    spans, taken = model._understood(given)
    assert spans[:, 0].all() and not spans[:, 1:].any()
    assert (taken == 5).all(), "each text of the sample has five pieces"


@pytest.mark.slow
def test_exits_of_a_played_corpus_hold_nearly_all_turns(tmp_path):
    from dorothie_gym.archive import Task
    from dorothie_gym.evaluation.rollout import generate_corpus
    from dorothie_gym.evaluation.teacher_forced.features import points

    generate_corpus(tmp_path, sessions=6, seed=1, workers=1)
    columns = build(tmp_path)
    table = points(columns, Task.NFD)
    tables = [exit_table(graph) for graph in columns.towns]
    turns = np.flatnonzero(table.label_action == PhysicalAction.J_TURN.nfd_class)
    hits = 0
    for row in turns:
        lane = columns.frames.lane[table.frames_stop[row] - 1]
        exits = tables[columns.sessions.town[table.session[row]]]
        apart = (exits.angle[lane] - table.label_angle[row] + 180) % 360 - 180
        hits += bool((np.abs(apart) < 15)[exits.there[lane]].any())
    assert hits / len(turns) > 0.85
