"""Reference implementation of the published model and its training loop, for measurements of speed.

One point at a time, its features rebuilt from the recording, one step of the optimiser for each; the map flattened to
one size, and all queries of the detector flattened into one linear layer, which holds 59 of its 93 million numbers.
Outputs of frozen encoders (BERT, ResNet-50, HuBERT, the detector) are random and cost neither side anything.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import torch
from torch import Tensor, nn
from torch.nn import functional as F

from dorothie_gym.archive import Task
from dorothie_gym.archive.prediction_points import DecisionPoint, InferencePoint, Point, PointView, history_angle
from dorothie_gym.baselines.gradients import backpropagate
from dorothie_gym.baselines.toto.layers import GraphAttention
from dorothie_gym.evaluation.teacher_forced.features import TownGraph
from dorothie_gym.maps.lane_graph import EDGE_TYPES, FEATURES
from dorothie_gym.ontology import LABELS, NAVIGATION_ACTIONS, VECTOR_SLOTS, DialogueMove, PhysicalAction, Role
from dorothie_gym.ontology.dialogue_acts import SLOT_SPANS
from dorothie_gym.session.recording import Session

TOKEN_WIDTH: Final = 770
LANES, ROADS, JUNCTIONS = 486, 259, 34
"""Sizes that the published model is tied to; towns beyond them are cut off."""

WORDS, IMAGE, SOUND, QUERIES, QUERY = 768, 1000, 1024, 300, 256
"""Output sizes of the frozen encoders: BERT, ResNet-50, HuBERT-large, and the detector's queries."""

IDS: Final = 50
_LANE: Final = 64
_WINDOW, _STEP = 100, 4
_FRAMES_APART: Final = 3  # recorded at 30 Hz, looked at with 10 Hz


class Senses:
    """Random outputs of frozen encoders: a row of a table for each text, frame or utterance.

    Args:
        seed: seed of the tables.
        rows: rows of each table.
    """

    def __init__(self, seed: int = 0, rows: int = 64):
        generator = torch.Generator().manual_seed(seed)
        self.rows = rows
        self.words = torch.randn(rows, WORDS, generator=generator)
        self.images = torch.randn(rows, IMAGE, generator=generator)
        self.sounds = torch.randn(rows, SOUND, generator=generator)
        self.queries = torch.randn(8, QUERIES, QUERY, generator=generator)


@dataclass(frozen=True, eq=False)
class Features:
    """Features of one point, rebuilt at each use; spec/toto.md describes the fields.

    Attributes:
        lanes, road, junction, edges, edge_types: the map.
        landmarks, streets: (K, 57 less the ids + 768), (R, 768); `landmark_lanes` (K,), `street_lanes` lists of lanes.
        actions, angles: (A,) each.
        dialogue: (U, 770).
        moves, move_bits: (M,), (M, 76).
        trajectory, window_lanes, images: (W, 4), (W,), (W, 1000).
        sound: (1024,).
        detector: (300, 256).
        frames: (T,) of each token, for the time.
    """

    lanes: Tensor
    road: Tensor
    junction: Tensor
    edges: Tensor
    edge_types: Tensor
    landmarks: Tensor
    landmark_lanes: Tensor
    streets: Tensor
    street_lanes: list[list[int]]
    actions: Tensor
    angles: Tensor
    dialogue: Tensor
    moves: Tensor
    move_bits: Tensor
    trajectory: Tensor
    window_lanes: Tensor
    images: Tensor
    sound: Tensor
    detector: Tensor
    frames: Tensor


def rebuild(session: Session, view: PointView, graph: TownGraph, senses: Senses) -> Features:
    """Returns the features of a point, built from the recording with everything that came before it."""
    moves, actions = view.moves, view.actions
    landmarks = [
        [mark["x"], mark["y"], mark["station"], float(mark["lane"]), float(mark["street"]), 0.0, 0.0]
        for mark in view.landmarks
    ]
    names = [senses.words[_row(mark["name"], senses)] for mark in view.landmarks]
    streets = [senses.words[_row(name, senses)] for name in view.street_names]
    members = [
        graph.members[graph.member_start[street] : graph.member_start[street + 1]].tolist()
        for street in range(len(view.street_names))
    ]
    dialogue = [torch.cat((senses.words[_row(move.text, senses)], torch.tensor(_role(move.speaker)))) for move in moves]
    bits = [[*_role(move.speaker), *_types(move.act.vector), *map(float, move.act.vector)] for move in moves]
    past = session.trajectory[session.trajectory["frame"] < view.frame][::-_FRAMES_APART][:_WINDOW:_STEP][::-1]
    window = [[float(row["x"]), float(row["y"]), float(row["heading"]), 0.0] for row in past]
    said = [move.frame for move in moves]
    frames = [
        *[0] * (1 + len(landmarks) + len(streets)),
        *(action.frame for action in actions),
        *said,
        *said,
        *past["frame"].tolist(),
        view.frame,
        view.frame,
    ]
    return Features(
        lanes=torch.tensor(graph.lanes[:LANES].tolist()),
        road=torch.tensor(graph.road[:LANES].tolist()) % ROADS,
        junction=torch.tensor(graph.junction[:LANES].tolist()) % JUNCTIONS,
        edges=torch.tensor([pair for pair in graph.edges.T.tolist() if max(pair) < LANES]).view(-1, 2).T,
        edge_types=torch.tensor(
            [
                kind
                for pair, kind in zip(graph.edges.T.tolist(), graph.edge_types.tolist(), strict=True)
                if max(pair) < LANES
            ],
            dtype=torch.int64,
        ),
        landmarks=torch.cat((torch.tensor(landmarks).view(-1, 7), _stacked(names)), dim=1),
        landmark_lanes=torch.tensor([max(0, min(mark["lane"], LANES - 1)) for mark in view.landmarks]).long(),
        streets=_stacked(streets),
        street_lanes=[[lane for lane in lanes if lane < LANES] for lanes in members],
        actions=torch.tensor([action.action.value - 1 for action in actions], dtype=torch.int64),
        angles=torch.tensor([history_angle(action) / 180.0 for action in actions]),
        dialogue=_stacked(dialogue, TOKEN_WIDTH),
        moves=torch.tensor([int(move.act.move) for move in moves], dtype=torch.int64),
        move_bits=torch.tensor(bits).view(-1, 2 + len(VECTOR_SLOTS) + len(LABELS)),
        trajectory=torch.tensor(window).view(-1, 4),
        window_lanes=torch.tensor([max(0, min(int(row["lane"]), LANES - 1)) for row in past], dtype=torch.int64),
        images=senses.images[torch.tensor([int(row["frame"]) % senses.rows for row in past], dtype=torch.int64)],
        sound=senses.sounds[view.frame % senses.rows],
        detector=senses.queries[view.frame % len(senses.queries)],
        frames=torch.tensor(frames),
    )


class PublishedTOTO(nn.Module):
    """The published model, for one point at a time."""

    def __init__(self) -> None:
        super().__init__()
        self.road = nn.Embedding(ROADS, IDS // 2)
        self.junction = nn.Embedding(JUNCTIONS, IDS // 2)
        self.graph = GraphAttention(len(FEATURES) + IDS, _LANE, 8, len(EDGE_TYPES))
        self.map = nn.Linear(LANES * _LANE, TOKEN_WIDTH)
        self.landmark = nn.Linear(7 + IDS + WORDS, TOKEN_WIDTH)
        self.street = nn.Linear(_LANE + WORDS, TOKEN_WIDTH)
        self.action = nn.Embedding(len(PhysicalAction), TOKEN_WIDTH - 1)
        self.move = nn.Embedding(len(DialogueMove) + 1, TOKEN_WIDTH - 2 - len(VECTOR_SLOTS) - len(LABELS))
        self.window = nn.Linear(4 + IDS + IMAGE, TOKEN_WIDTH)
        self.sound = nn.Linear(SOUND, TOKEN_WIDTH)
        self.detector = nn.Linear(QUERIES * QUERY, TOKEN_WIDTH)
        layer = nn.TransformerEncoderLayer(TOKEN_WIDTH, 11, TOKEN_WIDTH, 0.1)
        self.encoder = nn.TransformerEncoder(layer, 2, enable_nested_tensor=False)
        self.action_head = nn.Linear(TOKEN_WIDTH, len(NAVIGATION_ACTIONS))
        self.angle_head = nn.Linear(TOKEN_WIDTH, 1)
        spoken = len(DialogueMove) + 1 + len(VECTOR_SLOTS) + len(LABELS)
        self.act_heads = nn.ModuleList(nn.Linear(TOKEN_WIDTH, spoken) for _ in range(2))

    def forward(self, given: Features) -> Tensor:
        """Returns the last token after the encoder (770,)."""
        ids = torch.cat((self.road(given.road), self.junction(given.junction)), dim=-1)  # (L, 50)
        lanes = self.graph(torch.cat((given.lanes, ids), dim=-1), given.edges, given.edge_types)  # (L, 64)
        whole = self.map(F.pad(lanes, (0, 0, 0, LANES - len(lanes))).flatten())[None]
        marks = given.landmarks
        landmarks = self.landmark(torch.cat((marks[:, :7], ids[given.landmark_lanes], marks[:, 7:]), dim=-1))
        means = [lanes[rows].mean(0) if rows else lanes.new_zeros(_LANE) for rows in given.street_lanes]
        streets = self.street(torch.cat((_stacked(means, _LANE), given.streets), dim=-1))
        actions = torch.cat((self.action(given.actions), given.angles[:, None]), dim=-1)
        moves = torch.cat((given.move_bits[:, :2], self.move(given.moves), given.move_bits[:, 2:]), dim=-1)
        window = self.window(torch.cat((given.trajectory, ids[given.window_lanes], given.images), dim=-1))
        sound, objects = self.sound(given.sound)[None], self.detector(given.detector.flatten())[None]
        parts = (whole, landmarks, streets, actions, given.dialogue, moves, window, sound, objects)
        tokens = torch.cat(parts) + given.frames[:, None].float().sin()  # one number added to all channels
        last: Tensor = self.encoder(tokens[:, None])[-1, 0]
        return last

    def loss(self, given: Features, point: Point) -> Tensor:
        """Returns the published loss of one point."""
        last = self(given)
        if isinstance(point, DecisionPoint):
            angle = 180.0 * torch.tanh(self.angle_head(last))[0]
            wanted = 0.0 if math.isnan(point.angle) else point.angle
            action = F.cross_entropy(self.action_head(last), torch.tensor(point.action.nfd_class))
            return action + 1e-2 * (angle - wanted).square().sqrt()
        return self._act_loss(last, point)

    def _act_loss(self, last: Tensor, point: InferencePoint) -> Tensor:
        head = self.act_heads[0 if point.view.task is Task.UFN else 1](last)
        move, types, values = head.split((len(DialogueMove) + 1, len(VECTOR_SLOTS), len(LABELS)))
        vector = list(map(float, point.act.vector))
        loss = F.cross_entropy(move, torch.tensor(int(point.act.move)))
        loss = loss + 1e-2 * F.binary_cross_entropy_with_logits(types, torch.tensor(_types(vector)))
        return loss + 2e-3 * F.binary_cross_entropy_with_logits(values, torch.tensor(vector))


def train_step(model: PublishedTOTO, optimiser: torch.optim.Optimizer, given: Features, point: Point) -> float:
    """Takes one step for one point, as published (but that gradients are zeroed); returns the loss."""
    optimiser.zero_grad()
    loss = model.loss(given, point)
    backpropagate(loss)
    nn.utils.clip_grad_norm_(model.parameters(), 1.0)
    optimiser.step()
    return float(loss.detach())


def _row(text: str, senses: Senses) -> int:
    return sum(text.encode()) % senses.rows


def _role(speaker: Role) -> list[float]:
    return [1.0, 0.0] if speaker is Role.PARTICIPANT else [0.0, 1.0]


def _types(vector: Sequence[float]) -> list[float]:
    return [float(max(vector[SLOT_SPANS[slot]])) for slot in VECTOR_SLOTS]


def _stacked(rows: Sequence[Tensor], width: int = WORDS) -> Tensor:
    return torch.stack(list(rows)) if rows else torch.zeros(0, width)
