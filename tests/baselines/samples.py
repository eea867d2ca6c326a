"""A made-up batch in a made-up town: no session has to be played for the tests of models."""

from dataclasses import fields, replace

import numpy as np
import torch

from dorothie_gym.baselines.point_tensors import Labels, join, tensor
from dorothie_gym.evaluation.teacher_forced.features import Batch, BatchSpec, TownGraph

TEXTS = 40


def town_graph(lanes=12, seed=0):
    generator = np.random.default_rng(seed)
    edges = np.stack([np.arange(lanes), (np.arange(lanes) + 1) % lanes]).astype(np.int32)
    streets = 3
    return TownGraph(
        name=f"ring {lanes}",
        lanes=generator.normal(size=(lanes, 14)).astype(np.float32) * 50,
        road=(np.arange(lanes) // 2).astype(np.int32),
        junction=(np.arange(lanes) % 3).astype(np.int32),
        street=(np.arange(lanes) % streets).astype(np.int32),
        edges=edges,
        edge_types=(np.arange(lanes) % 4).astype(np.int32),
        member_start=np.arange(streets + 1, dtype=np.int32) * (lanes // streets),
        members=np.arange(streets * (lanes // streets), dtype=np.int32),
    )


def no_town():
    """A town without lanes and streets."""
    graph = town_graph()
    return replace(
        graph,
        lanes=graph.lanes[:0],
        road=graph.road[:0],
        junction=graph.junction[:0],
        street=graph.street[:0],
        edges=graph.edges[:, :0],
        edge_types=graph.edge_types[:0],
        members=graph.members[:0],
        member_start=graph.member_start[:1],
    )


def on_no_lane(given):
    """The fields of a batch in which no place is on a lane."""
    return {**given, **{name: given[name] * 0 - 1 for name in ("window_lane", "landmark_lane")}}


def inputs(points=6, spec=None, seed=0, towns=1, room=0):
    """Fields of a batch with random content; `room` adds so much that is not there to every sequence."""
    spec = spec or BatchSpec(
        moves=5, utterances=4, actions=3, window=4, window_objects=2, objects=3, landmarks=3, streets=3
    )
    generator = np.random.default_rng(seed)
    lengths = {
        "move": spec.moves,
        "utterance": spec.utterances,
        "action": spec.actions,
        "window": spec.window,
        "objects": spec.objects,
        "landmark": spec.landmarks,
        "street": spec.streets,
    }
    masks = {
        name: np.arange(length + room) < generator.integers(1, length + 1, points)[:, None]
        for name, length in lengths.items()
    }
    values = {"session": np.zeros(points), "town": generator.integers(0, towns, points)}
    values["time"] = 100 + 60 * generator.random(points)
    values["has_objects"] = np.ones(points, bool)
    values["current_text"] = np.where(generator.random(points) < 0.5, generator.integers(0, TEXTS, points), -1)
    values["current_recognised"] = np.where(values["current_text"] >= 0, generator.integers(-1, TEXTS, points), -1)

    def whole(high, mask, low=0, empty=0, shape=()):
        drawn = generator.integers(low, high, (points, mask.shape[1] - room, *shape))
        return _filled(drawn, mask, empty, room)

    def real(scale, mask, shape=()):
        drawn = scale * generator.normal(size=(points, mask.shape[1] - room, *shape))
        return _filled(drawn, mask, 0.0, room)

    move, said, action, window = (masks[name] for name in ("move", "utterance", "action", "window"))
    values |= {
        "move": whole(15, move), "move_speaker": whole(2, move), "move_slots": whole(2, move, shape=(69,)) > 0,
        "move_time": real(30, move), "move_text": whole(TEXTS, move, empty=-1), "move_mask": move,
        "utterance_text": whole(TEXTS, said, empty=-1), "utterance_recognised": whole(TEXTS, said, empty=-1),
        "utterance_speaker": whole(2, said), "utterance_time": real(30, said), "utterance_mask": said,
        "action": whole(8, action), "action_angle": real(90, action), "action_up": whole(2, action, low=-1),
        "action_time": real(30, action), "action_mask": action,
        "window_pose": real(50, window, (3,)), "window_speed": real(5, window), "window_time": real(30, window),
        "window_lane": whole(12, window, low=-1, empty=-1), "window_mask": window,
        "window_kind": whole(9, window, shape=(spec.window_objects,)),
        "window_values": real(10, window, (spec.window_objects, 8)),
        "window_objects_mask": whole(2, window, shape=(spec.window_objects,)) > 0,
        "kind": whole(9, masks["objects"]), "values": real(10, masks["objects"], (8,)),
        "objects_mask": masks["objects"],
        "landmark_place": real(50, masks["landmark"], (2,)),
        "landmark_lane": whole(12, masks["landmark"], low=-1, empty=-1),
        "landmark_street": whole(3, masks["landmark"], low=-1, empty=-1),
        "landmark_text": whole(TEXTS, masks["landmark"], empty=-1), "landmark_mask": masks["landmark"],
        "street_text": whole(TEXTS, masks["street"], empty=-1), "street_mask": masks["street"],
    }  # fmt: skip
    known = {field.name for field in fields(Batch)}
    assert known == set(values), known ^ set(values)
    return {name: _tensor(value) for name, value in values.items()}


def labels(points=6, seed=0):
    generator = torch.Generator().manual_seed(seed)
    parts = []
    for point in range(points):
        task = point % 3
        decides = task == 2
        parts.append(
            Labels(
                torch.tensor([task]),
                torch.tensor([-1]) if decides else torch.randint(15, (1,), generator=generator),
                torch.zeros(1, 69) if decides else (torch.rand(1, 69, generator=generator) < 0.05).float(),
                torch.randint(6, (1,), generator=generator) if decides else torch.tensor([-1]),
                360 * torch.rand(1, generator=generator) - 180 if decides else torch.tensor([torch.nan]),
                torch.randn(1, 5, generator=generator),
            )
        )
    return join(parts)


def _filled(drawn, mask, empty, room):
    full = np.concatenate([drawn, np.full((len(drawn), room, *drawn.shape[2:]), empty)], axis=1)
    there = mask.reshape(*mask.shape, *(1,) * (drawn.ndim - 2))
    return np.where(there, full, empty).astype(drawn.dtype)


def _tensor(value):
    kind = value.dtype.kind
    return tensor(value.astype(np.float32) if kind == "f" else value)
