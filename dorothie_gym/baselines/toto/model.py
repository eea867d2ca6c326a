"""TOTO, the Temporally-Ordered Task-Oriented Transformer (paper, section 6 and appendix C), in one file.

Letters in shapes: B points, M moves, U utterances, A actions, W tokens of the window, V objects at each, O objects now,
K landmarks, R streets, L lanes of all towns, d the width of a token. A channel gives tokens (B, n, d), a mask (B, n)
that is True where there is a token, and times (B, n) [s].
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, TypeAlias

import torch
from torch import Tensor, nn

from dorothie_gym.baselines.encoders.sound import SoundReader
from dorothie_gym.baselines.point_tensors import Inputs, Labels, Outputs, Predicted, decode
from dorothie_gym.baselines.toto.config import Channel, TOTOConfig
from dorothie_gym.baselines.toto.layers import Block, GraphAttention, segment_softmax, time_encoding
from dorothie_gym.baselines.toto.losses import point_losses
from dorothie_gym.baselines.toto.towns import ANGLE_UNIT, POSITION_UNIT, Towns
from dorothie_gym.baselines.trainer import Model
from dorothie_gym.maps.lane_graph import EDGE_TYPES, FEATURES, LANE_ID, LENGTH
from dorothie_gym.ontology.actions import NAVIGATION_ACTIONS, PhysicalAction
from dorothie_gym.ontology.dialogue_acts import LABELS, SLOT_SPANS, VECTOR_SLOTS, DialogueMove

if TYPE_CHECKING:
    from dorothie_gym.baselines.toto.texts import Texts

Tokens: TypeAlias = tuple[Tensor, Tensor, Tensor]
"""Tokens (B, n, d), their mask (B, n), their times (B, n) [s]."""

ROLES: Final = 2
"""Number of bits that encode the speaker."""

OBJECT_KINDS: Final = 32
"""Rows of the table of kinds of objects; there are fewer."""

BELIEFS: Final = 5
"""Displacement to the next frame dx, dy, its heading, displacement to the goal dx, dy."""

YAW: Final = FEATURES.index("start_yaw")
"""Column of a lane's heading at its start."""

_UPS: Final = 3
_BELIEF_UNITS: Final = (1.0, 1.0, ANGLE_UNIT, POSITION_UNIT, POSITION_UNIT)
_OBJECT_UNITS: Final = (30.0, ANGLE_UNIT, 30.0, 30.0, ANGLE_UNIT, 10.0, 5.0, 5.0)
"""Divisors of the columns of `OBJECT_VALUES`, which scale each to about 1."""


class TOTO(Model):
    """Transformer encoder over all data visible at a point, with a head for each prediction.

    Args:
        config: sizes and inputs.
        towns: lane graphs.
        texts: encoder of texts.
    """

    def __init__(self, config: TOTOConfig, towns: Towns, texts: Texts):
        super().__init__()
        self.config: TOTOConfig = config
        self.towns = towns
        self.texts = texts
        self._make_knowledge(config, texts.width)
        self._make_history(config, texts.width)
        self._make_senses(config, texts.width)
        self.now = nn.Parameter(torch.zeros(config.width))
        self.norm = nn.LayerNorm(config.width)
        self.blocks = nn.ModuleList(
            Block(config.width, config.heads, config.feed_forward, config.dropout, config.attention_dropout)
            for _ in range(config.layers)
        )
        self.head = nn.Linear(config.width, 2 * (len(DialogueMove) + len(VECTOR_SLOTS) + len(LABELS)))
        self.action_head = nn.Linear(config.width, len(NAVIGATION_ACTIONS) + 2)
        if config.belief:
            self.belief_head = nn.Linear(config.width, BELIEFS)
        self.register_buffer("object_units", torch.tensor(_OBJECT_UNITS), persistent=False)
        self.register_buffer("slot_of_value", _slot_of_value(), persistent=False)
        nn.init.normal_(self.now, std=0.02)

    def _make_knowledge(self, config: TOTOConfig, words: int) -> None:
        """Creates the layers of map, landmarks and streets."""
        given, width, ids = set(config.channels), config.width, 2 * config.id_width
        if given & {Channel.MAP, Channel.TRAJECTORY}:
            self.road = nn.Embedding(config.roads, config.id_width)
            self.junction = nn.Embedding(config.junctions, config.id_width)
        if Channel.MAP in given:
            lane = config.lane_width
            self.lanes = GraphAttention(len(FEATURES) + ids, lane, config.map_heads, len(EDGE_TYPES))
            self.map_score = nn.Linear(lane, 1, bias=False)
            self.map_token = nn.Linear(lane, width)
            self.landmark = nn.Linear(2 + 5 + ids + words, width)
            self.street = nn.Linear(lane + words, width)

    def _make_history(self, config: TOTOConfig, words: int) -> None:
        """Creates the layers of actions, moves and words."""
        given, width = set(config.channels), config.width
        if Channel.ACTIONS in given:
            self.action = nn.Embedding(len(PhysicalAction) * _UPS, width - 1)
        if Channel.MOVES in given:
            self.move = nn.Embedding(len(DialogueMove), width - ROLES - len(VECTOR_SLOTS) - len(LABELS))
        if Channel.TRANSCRIPT in given:
            self.utterance = nn.Linear(words + ROLES, width)
            if config.current_text:
                self.current = nn.Linear(words, width)

    def _make_senses(self, config: TOTOConfig, words: int) -> None:
        """Creates the layers of the window, the current utterance's sound, and objects."""
        given, width, ids = set(config.channels), config.width, 2 * config.id_width
        if given & {Channel.TRAJECTORY, Channel.VISION}:
            self.window = nn.Linear(4 + ids if Channel.TRAJECTORY in given else 1, width)
        scenes = Channel.VISION in given and not config.image_width
        if scenes or (Channel.OBJECTS in given and config.detector is None):
            self.object_kind = nn.Embedding(OBJECT_KINDS, width)
            self.object_values = nn.Linear(len(_OBJECT_UNITS), width)
        if Channel.VISION in given:
            self.scene = nn.Linear(config.image_width or width, width)
        if Channel.SPEECH in given:
            if config.sound_frames:
                self.sound = SoundReader(width, config.dropout)
            else:
                self.speech = nn.Linear(config.sound_width or words, width)
        if Channel.OBJECTS in given and config.detector is not None:
            self.queries = nn.Linear(config.detector[0] * config.detector[1], width)

    object_units: Tensor
    slot_of_value: Tensor

    def forward(self, inputs: Inputs) -> Outputs:
        """Returns the outputs at B points; see `Batch` for the fields of the inputs."""
        return self.heads(self.read(inputs))

    def read(self, inputs: Inputs) -> Tensor:
        """Returns the last token after the encoder (B, d)."""
        tokens, mask = self._timed(self._channels(inputs), inputs["time"])
        for block in self.blocks[:-1]:
            tokens = block(tokens, mask)
        last: Tensor = self.blocks[-1](tokens, mask, tokens[:, :1])  # of the last layer one token is looked at
        return last[:, 0]

    def _timed(self, channels: list[Tokens], now: Tensor) -> tuple[Tensor, Tensor]:
        """Returns all tokens (B, T, d) with time encodings, and their mask (B, T)."""
        tokens, times, mask = gather_tokens(channels)
        if self.config.clock == "point":
            times = (now[:, None] - times).clamp(min=0.0)
        return self.norm(tokens) + time_encoding(times, self.config.width), mask

    def token_count(self, inputs: Inputs) -> int:
        """Returns the number of tokens of the longest of B points."""
        return int(torch.cat([mask for _, mask, _ in self._channels(inputs)], dim=1).sum(1).max())

    def heads(self, last: Tensor) -> Outputs:
        """Returns the outputs of the heads on the readout token (B, d)."""
        moves, types, values = len(DialogueMove), len(VECTOR_SLOTS), len(LABELS)
        spoken = self.head(last).float().view(len(last), 2, -1)  # (B, 2, 15 + 5 + 69)
        move, slot_types, slot_values = spoken.split((moves, types, values), dim=-1)
        action, angle = self.action_head(last).float().split((len(NAVIGATION_ACTIONS), 2), dim=-1)
        belief = last.new_zeros(len(last), BELIEFS, dtype=torch.float32)
        if self.config.belief:
            belief = self.belief_head(last).float() * belief.new_tensor(_BELIEF_UNITS)
        return Outputs(move, slot_types, slot_values, action, angle, belief)

    def loss(self, inputs: Inputs, labels: Labels) -> Tensor:
        """Returns the mean loss of B points."""
        return point_losses(self(inputs), labels, self.config).mean()

    def predict(self, inputs: Inputs, task: Tensor, allowed: Tensor | None = None) -> Predicted:
        """Returns the predictions at B points.

        Args:
            inputs: fields of the points.
            task: (B,) number of each point's task.
            allowed: (B, 6) navigation actions that may be predicted; all if None.
        """
        return decode(self(inputs), task, allowed)

    def _channels(self, inputs: Inputs) -> list[Tokens]:
        """Returns the channels of the model; first the readout token."""
        given = set(self.config.channels)
        time = inputs["time"]
        batch = len(time)
        here = torch.ones(batch, 1, dtype=torch.bool, device=time.device)
        channels: list[Tokens] = [(self.now.expand(batch, 1, -1), here, time[:, None])]
        if Channel.MAP in given:
            channels += self._knowledge(inputs)
        if Channel.ACTIONS in given:
            channels.append(self._actions(inputs))
        if Channel.TRANSCRIPT in given:
            channels += self._transcript(inputs)
        if Channel.MOVES in given:
            channels.append(self._moves(inputs))
        if given & {Channel.TRAJECTORY, Channel.VISION}:
            channels.append(self._window(inputs))
        if Channel.SPEECH in given:
            channels.append(self._speech(inputs))
        if Channel.OBJECTS in given:
            channels.append(self._objects(inputs))
        return channels

    def _knowledge(self, inputs: Inputs) -> list[Tokens]:
        """Returns the map, landmarks and streets: known from the start, so their time is 0."""
        town = inputs["town"]  # (B,)
        towns = self.towns
        ids = self._ids(torch.arange(len(towns.lanes), device=town.device))  # (L, 2 id)
        lanes = self.lanes(torch.cat((towns.lanes, ids), dim=-1), towns.edges, towns.edge_types)  # (L, lane)
        share = segment_softmax(self.map_score(lanes), towns.town, towns.count)  # (L, 1)
        pooled = lanes.new_zeros(towns.count, lanes.shape[1]).index_add(0, towns.town, lanes * share)  # (towns, lane)
        whole = self.map_token(pooled).index_select(0, town).unsqueeze(1)  # (B, 1, d)

        row = towns.lane_rows(town, inputs["landmark_lane"])  # (B, K)
        place = inputs["landmark_place"] / POSITION_UNIT
        lane = [self._of_lane(row, column) for column in (YAW, LENGTH, LANE_ID)]
        known = torch.stack((*lane, row >= 0, inputs["landmark_street"] >= 0), dim=-1)  # (B, K, 5)
        name = self.texts(inputs["landmark_text"])
        landmarks = self.landmark(torch.cat((place, known, self._ids(row), name), dim=-1))  # (B, K, d)

        sums = lanes.new_zeros(towns.streets, lanes.shape[1])
        sums = sums.index_add(0, towns.member_street, lanes.index_select(0, towns.members))
        counts = lanes.new_zeros(towns.streets).index_add(0, towns.member_street, lanes.new_ones(len(towns.members)))
        means = sums / counts.clamp(min=1.0).unsqueeze(-1)  # (s, lane)
        means = torch.cat((means, means.new_zeros(1, means.shape[1])))  # of a street whose lanes are not known
        mask = inputs["street_mask"]
        number = torch.arange(mask.shape[1], device=town.device)
        street = torch.where(number < towns.street_count[town][:, None], towns.street_start[town][:, None] + number, -1)
        mean = nn.functional.embedding(street % len(means), means)  # (B, R, lane)
        streets = self.street(torch.cat((mean, self.texts(inputs["street_text"])), dim=-1))  # (B, R, d)

        known_landmarks = inputs["landmark_mask"]
        beginning = [torch.zeros(part.shape[:2], device=town.device) for part in (whole, landmarks, streets)]
        here = torch.ones(len(town), 1, dtype=torch.bool, device=town.device)
        return list(
            zip((whole, landmarks, streets), (here, known_landmarks, mask), beginning, strict=True),
        )

    def _ids(self, row: Tensor) -> Tensor:
        """Returns embeddings of the road and junction of lanes (..., 2 id); zeros for an unknown lane, -1."""
        if not len(self.towns.lanes):
            return torch.zeros(*row.shape, 2 * self.config.id_width, device=row.device)
        lane = row.clamp(min=0)
        road = self.road(self.towns.road[lane] % self.config.roads)
        junction = self.junction(self.towns.junction[lane] % self.config.junctions)
        return torch.cat((road, junction), dim=-1) * (row >= 0).unsqueeze(-1)

    def _of_lane(self, row: Tensor, column: int) -> Tensor:
        """Returns a column of lanes (...); 0 for an unknown lane, -1."""
        if not len(self.towns.lanes):
            return torch.zeros(row.shape, device=row.device)
        return self.towns.lanes[row.clamp(min=0), column] * (row >= 0)

    def _actions(self, inputs: Inputs) -> Tokens:
        """Returns tokens of physical actions and their arguments."""
        action = self.action(inputs["action"] * _UPS + inputs["action_up"] + 1)  # (B, A, d - 1)
        tokens = torch.cat((action, inputs["action_angle"].unsqueeze(-1) / ANGLE_UNIT), dim=-1)
        return tokens, inputs["action_mask"], inputs["action_time"]

    def _transcript(self, inputs: Inputs) -> list[Tokens]:
        """Returns tokens of past utterances and of the current one (UfN)."""
        said = torch.cat((self.texts(inputs["utterance_text"]), roles(inputs["utterance_speaker"])), dim=-1)
        tokens = [(self.utterance(said), inputs["utterance_mask"], inputs["utterance_time"])]  # (B, U, d)
        if self.config.current_text:
            current = inputs["current_text"][:, None]  # (B, 1)
            tokens.append((self.current(self.texts(current)), current >= 0, inputs["time"][:, None]))
        return tokens

    def _moves(self, inputs: Inputs) -> Tokens:
        """Returns tokens of dialogue moves: speaker, move and slots."""
        values = inputs["move_slots"].float()  # (B, M, 69)
        types = (values @ self.slot_of_value).clamp(max=1.0)  # (B, M, 5)
        parts = (roles(inputs["move_speaker"]), self.move(inputs["move"]), types, values)
        return torch.cat(parts, dim=-1), inputs["move_mask"], inputs["move_time"]

    def _window(self, inputs: Inputs) -> Tokens:
        """Returns tokens of the car's poses and surroundings over the last ten seconds."""
        mask = inputs["window_mask"]
        if Channel.TRAJECTORY in self.config.channels:
            row = self.towns.lane_rows(inputs["town"], inputs["window_lane"])  # (B, W)
            x, y, yaw = inputs["window_pose"].unbind(-1)
            numbers = torch.stack(
                (x / POSITION_UNIT, y / POSITION_UNIT, yaw / ANGLE_UNIT, self._of_lane(row, LANE_ID)), dim=-1
            )
            tokens = self.window(torch.cat((numbers, self._ids(row)), dim=-1))
        else:
            tokens = self.window(torch.ones(*mask.shape, 1, device=mask.device))
        if Channel.VISION in self.config.channels:
            tokens = tokens + self.scene(self._pictures(inputs))
        return tokens, mask, inputs["window_time"]

    def _pictures(self, inputs: Inputs) -> Tensor:
        """Returns the view at each token of the window (B, W, d or image): image features, or pooled objects."""
        if self.config.image_width:
            return inputs["window_image"]
        seen = inputs["window_objects_mask"].unsqueeze(-1)  # (B, W, V, 1)
        objects = self._object_tokens(inputs["window_kind"], inputs["window_values"]).relu()
        return (objects * seen).sum(2) / seen.sum(2).clamp(min=1)

    def _speech(self, inputs: Inputs) -> Tokens:
        """Returns the token of the current utterance as heard (UfN)."""
        heard, said = inputs["current_recognised"], inputs["current_text"]
        if self.config.sound_width or self.config.sound_frames:
            read, time = self.sound if self.config.sound_frames else self.speech, inputs["time"][:, None]
            if "current_sound" not in inputs:  # of a session in progress, in which no utterance must be predicted
                return time.new_zeros(len(time), 1, self.config.width), torch.zeros_like(time, dtype=torch.bool), time
            return read(inputs["current_sound"])[:, None], (said >= 0)[:, None], time
        text = torch.where(heard >= 0, heard, said)[:, None]
        return self.speech(self.texts(text)), text >= 0, inputs["time"][:, None]

    def _objects(self, inputs: Inputs) -> Tokens:
        """Returns a token for each object around the car, or one for all queries of a detector."""
        time = inputs["time"][:, None]
        if self.config.detector is not None:
            token = self.queries(inputs["detector"].flatten(1).to(self.queries.weight.dtype))[:, None]  # (B, 1, d)
            return token, torch.ones_like(time, dtype=torch.bool), time
        mask = inputs["objects_mask"]
        return self._object_tokens(inputs["kind"], inputs["values"]), mask, time.expand(mask.shape)

    def _object_tokens(self, kind: Tensor, values: Tensor) -> Tensor:
        """Objects (..., d) of their kinds (...) and values (..., 8)."""
        tokens: Tensor = self.object_kind(kind) + self.object_values(values / self.object_units)
        return tokens


def gather_tokens(channels: list[Tokens]) -> tuple[Tensor, Tensor, Tensor]:
    """Returns the tokens of all channels (B, T, d), their times (B, T) and their mask (B, T).

    Valid tokens come first, and T is the largest number of tokens of a point: missing tokens cost nothing, and
    results do not depend on the padding. Attention does not depend on the order of tokens.
    """
    tokens = torch.cat([part for part, _, _ in channels], dim=1)
    mask = torch.cat([part for _, part, _ in channels], dim=1)
    times = torch.cat([part for _, _, part in channels], dim=1)
    longest = int(mask.sum(1).max())
    order = mask.logical_not().to(torch.uint8).argsort(dim=1, stable=True)[:, :longest]  # (B, T)
    flat = order + torch.arange(len(order), device=order.device)[:, None] * mask.shape[1]
    kept = tokens.flatten(0, 1).index_select(0, flat.flatten()).view(*order.shape, -1)
    return kept, times.gather(1, order), mask.gather(1, order)


def roles(speaker: Tensor) -> Tensor:
    """Returns the speaker, one-hot (..., 2)."""
    return nn.functional.one_hot(speaker.clamp(0, ROLES - 1), ROLES).float()


def _slot_of_value() -> Tensor:
    """Returns the slot of each value, one-hot (69, 5)."""
    table = torch.zeros(len(LABELS), len(VECTOR_SLOTS))
    for column, slot in enumerate(VECTOR_SLOTS):
        table[SLOT_SPANS[slot], column] = 1.0
    return table
