"""Junction Reader: predicts turns from the exits on the map and slots from the words (docs/reader.md).

Letters in shapes: B points, X exits of the next junction, P pieces of a text, d the width of a token.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

import torch
from torch import Tensor, nn
from torch.nn import functional as F

from dorothie_gym.baselines.encoders.byte_pairs import PAD
from dorothie_gym.baselines.junction_reader.features import (
    EXITS,
    LANE_END,
    RECENT_SIZE,
    exit_table,
    mentions,
    recent,
    ways,
)
from dorothie_gym.baselines.point_tensors import (
    NFD,
    TAKES_ANGLE,
    TAKES_SIDE,
    TASKS,
    UFN,
    Inputs,
    Labels,
    Predicted,
    allowed_angle,
    likeliest,
)
from dorothie_gym.baselines.toto.losses import angle_error
from dorothie_gym.baselines.toto.model import TOTO, Tokens
from dorothie_gym.baselines.toto.towns import POSITION_UNIT, Towns
from dorothie_gym.evaluation.teacher_forced.features.columns import CO_WIZARD, PARTICIPANT, Columns
from dorothie_gym.ontology.actions import NAVIGATION_ACTIONS
from dorothie_gym.ontology.dialogue_acts import LABELS, DialogueMove

if TYPE_CHECKING:
    from dorothie_gym.baselines.toto.config import TOTOConfig
    from dorothie_gym.baselines.toto.texts import FrozenTexts

WORD_BY_WORD: Final = 3
"""Number of utterances that are encoded piece by piece: the current one and the two before it."""

EXIT_TOLERANCE: Final = 15.0
"""Largest error of the angle at which an exit counts as the labelled one [degrees] (paper, section 5, Evaluation)."""

SLOT_THRESHOLD: Final = 0.3
"""Probability from which a slot value is predicted: F1 is maximal at half its optimum (Lipton et al., 2014)."""

_MAX_WORD_AGE: Final = 30.0
"""Largest age of words; older ones count as this old [s]."""

_SPANS: Final = 4
_SAME_TIME: Final = 0.05
_MEMORY: Final = (1, 2, 4, 8)
_NAMED: Final = 3 + 2 * len(_MEMORY) + 2
"""Features of a slot value: mentions in utterances, in the last moves of each speaker, and in the town."""

_HIDDEN: Final = 32
_SIDES: Final = 2
_STATE: Final = 9
_AT_PLACE: Final = 20.0
"""Decay length of the exponential that encodes the distance to the last-named place [m]."""


class JunctionReader(TOTO):
    """TOTO's channels and encoder with map exits, subwords and slot-wise scores.

    Times count back from the point. The most recent events have features of their own, the last utterances are encoded
    piece by piece, and spans of the current utterance with known acts are marked. The exits of the next junction are
    tokens, and a turn selects one of them. Each slot value has its own score from its mentions. The task is an input.

    Args:
        config: sizes and inputs.
        towns: lane graphs.
        texts: vectors of texts.
        columns: the corpus, for its graphs and texts.
        pieces: (n, P) pieces of each text of the corpus.
        vocabulary: number of pieces.
    """

    def __init__(
        self, config: TOTOConfig, towns: Towns, texts: FrozenTexts, columns: Columns, pieces: Tensor, vocabulary: int
    ):
        super().__init__(config, towns, texts)
        width = config.width
        self.task = nn.Embedding(len(TASKS), width)
        self.move_text = nn.Linear(texts.width, width)
        self.piece = nn.Embedding(vocabulary, width, padding_idx=PAD)
        self.place = nn.Embedding(pieces.shape[1], width)
        self.source = nn.Embedding(WORD_BY_WORD + 1, width)
        self.exit = nn.Linear(2 + 3 + 3 + 3 + texts.width, width)
        self.state = nn.Linear(_STATE, width)
        self.recent = nn.Linear(RECENT_SIZE, width)
        self.spans = nn.Embedding(_SPANS, width)
        self.acts = nn.ModuleList(nn.Linear(width, len(DialogueMove)) for _ in range(2))
        self.direct = nn.Linear(texts.width, len(DialogueMove) + len(LABELS))
        self.echo = nn.Linear(texts.width, len(LABELS))
        self.value_of = nn.ModuleList(nn.Linear(width, _HIDDEN) for _ in range(2))
        self.value = nn.Parameter(torch.zeros(2, len(LABELS), _HIDDEN))
        self.named = nn.ModuleList(nn.Linear(_NAMED, _HIDDEN) for _ in range(2))
        self.value_score = nn.ModuleList(nn.Linear(_HIDDEN, 1) for _ in range(2))
        self.decision = nn.Linear(width, len(NAVIGATION_ACTIONS) + _SIDES + 2)
        self.which_exit = nn.Linear(width, width)
        nn.init.normal_(self.value, std=0.1)
        for weights in (self.task, self.piece, self.place, self.source, self.spans):
            nn.init.normal_(weights.weight, std=0.3)
        for head in (self.head, self.action_head):
            head.requires_grad_(False)  # TOTO's heads are not used
        self._keep_exits(columns, towns)
        self.register_buffer("pieces", pieces, persistent=False)
        self.register_buffer("mentions", torch.empty(0), persistent=False)
        self.register_buffer("ways", torch.empty(0), persistent=False)
        self.take_words(columns.texts, pieces)

    pieces: Tensor
    mentions: Tensor
    ways: Tensor
    exit_angle: Tensor
    exit_lane: Tensor
    exit_place: Tensor
    exit_there: Tensor
    exit_distance: Tensor
    lane_end: Tensor
    lane_street: Tensor

    def take_words(self, texts: Sequence[str], pieces: Tensor) -> None:
        """Replaces the texts.

        Args:
            texts: (n) of them.
            pieces: (n, P) the pieces of each.
        """
        named = torch.from_numpy(mentions(texts)).float()
        self.pieces = torch.cat((pieces, pieces.new_full((1, pieces.shape[1]), PAD)))
        self.mentions = torch.cat((named, named.new_zeros(1, len(LABELS))))
        directions = torch.from_numpy(ways(texts)).float()
        self.ways = torch.cat((directions, directions.new_zeros(1, directions.shape[1])))

    def _keep_exits(self, columns: Columns, towns: Towns) -> None:
        tables = [exit_table(graph) for graph in columns.towns]
        for name in ("angle", "lane", "place", "there", "distance"):
            values = torch.cat([torch.from_numpy(getattr(table, name)) for table in tables])
            nowhere = torch.zeros(1, *values.shape[1:], dtype=values.dtype)  # the last row, of a lane not known: -1
            self.register_buffer(f"exit_{name}", torch.cat((values, nowhere)), persistent=False)
        ends = torch.cat((towns.lanes[:, LANE_END], towns.lanes.new_zeros(1, 2))) * POSITION_UNIT
        self.register_buffer("lane_end", ends, persistent=False)
        streets = torch.cat((towns.street, towns.street.new_full((1,), -1)))
        self.register_buffer("lane_street", streets, persistent=False)

    # --- reading ------------------------------------------------------------------------------------------------------

    def loss(self, inputs: Inputs, labels: Labels) -> Tensor:
        """Returns the mean loss of B points."""
        last, exits, there, angles = self._look(inputs, labels.task)
        move, values = self._act(inputs, labels.task, last)
        action, side, direction = self._decision(last)
        moves = F.cross_entropy(move, labels.move.clamp(min=0), reduction="none")
        slots = F.binary_cross_entropy_with_logits(values, labels.slots, reduction="none").sum(-1)
        act = self.config.loss.move * moves + self.config.loss.slot_values * slots
        choice = self._exit_loss(exits, there, angles, labels)
        turned = F.cross_entropy(side, (labels.angle < 0).long(), reduction="none")
        takes_side = torch.tensor(TAKES_SIDE, device=last.device)[labels.action.clamp(min=0)]
        decision = F.cross_entropy(action, labels.action.clamp(min=0), reduction="none") + choice
        decision = decision + torch.where(takes_side & ~labels.angle.isnan(), turned, 0.0)
        decision = decision + self.config.loss.angle * angle_error(direction, labels.angle)
        return torch.where(labels.task == NFD, decision, act).mean()

    def predict(self, inputs: Inputs, task: Tensor, allowed: Tensor | None = None) -> Predicted:
        """Returns the predictions at B points; see `TOTO.predict`."""
        last, exits, there, angles = self._look(inputs, task)
        move, values = self._act(inputs, task, last)
        scores, side, direction = self._decision(last)
        action = likeliest(scores, allowed)
        chosen = angles.gather(1, exits.masked_fill(~there, -torch.inf).argmax(-1, keepdim=True))[:, 0]
        free = torch.rad2deg(torch.atan2(direction[:, 1], direction[:, 0]))
        angle = torch.where(there.any(1), chosen, free)
        takes_angle = torch.tensor(TAKES_ANGLE, device=last.device)[action]
        angle = torch.where(takes_angle, angle, 1.0 - 2.0 * side.argmax(-1))
        return Predicted(move.argmax(-1), values.sigmoid() > SLOT_THRESHOLD, action, allowed_angle(action, angle))

    def _look(self, inputs: Inputs, task: Tensor) -> tuple[Tensor, Tensor, Tensor, Tensor]:
        """Returns the readout (B, d), the scores (B, X), mask (B, X) and angles (B, X) of the exits."""
        exits, there, angles, distance = self._exits(inputs)
        channels = self._channels(inputs)
        _, here, now = channels[0]
        readout = self.now + self.task(task) + self.state(self._state(inputs, there, distance))
        readout = readout + self.recent(recent(inputs))
        readout = readout + self.spans(self._understood(inputs)[0].sum(1).clamp(max=_SPANS - 1))
        channels[0] = (readout[:, None], here, now)
        channels += [(exits, there, now.expand(there.shape)), *self._words(inputs)]
        tokens, mask = self._timed(channels, inputs["time"])
        for block in self.blocks[:-1]:
            tokens = block(tokens, mask)
        # The readout is the first token; the exits are queries as well, so that each attends to the dialogue.
        asked = self.blocks[-1](tokens, mask, torch.cat((tokens[:, :1], self.norm(exits)), dim=1))
        last, ways = asked[:, 0], asked[:, 1:]
        scores = (ways @ self.which_exit(last).unsqueeze(-1)).squeeze(-1) / ways.shape[-1] ** 0.5
        return last, scores, there, angles

    def _act(self, inputs: Inputs, task: Tensor, last: Tensor) -> tuple[Tensor, Tensor]:
        """Returns the scores of the moves (B, 15) and of the slot values (B, 69), for the speaker of the task."""
        named = self._named(inputs)  # (B, 69, n)
        words = self.texts(self._heard(inputs))  # (B, E)
        heard = self.direct(words).split((len(DialogueMove), len(LABELS)), dim=-1)
        moves, slots = [], []
        for role in range(2):
            hidden = F.relu(self.value_of[role](last)[:, None] + self.value[role] + self.named[role](named))
            moves.append(self.acts[role](last))
            slots.append(self.value_score[role](hidden).squeeze(-1))
        moves[0], slots[0], slots[1] = moves[0] + heard[0], slots[0] + heard[1], slots[1] + self.echo(words)
        understands = (task == UFN)[:, None]
        return torch.where(understands, moves[0], moves[1]), torch.where(understands, slots[0], slots[1])

    def _decision(self, last: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Returns scores of the actions (B, 6) and sides (B, 2), and a direction (B, 2) away from junctions."""
        action, side, direction = self.decision(last).split((len(NAVIGATION_ACTIONS), _SIDES, 2), dim=-1)
        return action, side, direction

    def _exit_loss(self, scores: Tensor, there: Tensor, angles: Tensor, labels: Labels) -> Tensor:
        """Returns the cross entropy of the labelled exit (B,); 0 without a labelled exit or an angle."""
        apart = ((angles - labels.angle[:, None].nan_to_num() + 180.0) % 360.0 - 180.0).abs()
        apart = apart.masked_fill(~there, torch.inf)
        nearest, which = apart.min(1)
        takes_angle = torch.tensor(TAKES_ANGLE, device=scores.device)[labels.action.clamp(min=0)]
        known = (nearest < EXIT_TOLERANCE) & takes_angle & ~labels.angle.isnan() & (labels.task == NFD)
        masked = scores.masked_fill(~there, -1e4)
        return torch.where(known, F.cross_entropy(masked, which, reduction="none"), 0.0)

    # --- inputs beyond TOTO's -----------------------------------------------------------------------------------------

    def _moves(self, inputs: Inputs) -> Tokens:
        tokens, mask, times = super()._moves(inputs)
        return tokens + self.move_text(self.texts(inputs["move_text"])), mask, times

    def _exits(self, inputs: Inputs) -> tuple[Tensor, Tensor, Tensor, Tensor]:
        """Returns tokens (B, X, d), mask, angles (B, X) of the exits of the next junction; its distance (B,) [m]."""
        lane, pose = _newest(inputs["window_lane"], inputs["window_mask"]), _newest_pose(inputs)
        row = self.towns.lane_rows(inputs["town"], lane)  # (B,)
        there, angles, places = self.exit_there[row], self.exit_angle[row], self.exit_place[row]
        end = self.lane_end[row]
        distance = self.exit_distance[row] + (end - pose[:, :2]).norm(dim=-1)
        mark, known = self._wanted_place(inputs)
        turn, way, far = torch.deg2rad(angles), places - end[:, None], mark[:, None] - places
        nearer = (mark - end).norm(dim=-1)[:, None] - far.norm(dim=-1)
        along = F.cosine_similarity(way, (mark - end)[:, None], dim=-1)
        seen = known[:, None].expand(along.shape)
        street = self._street_names(inputs, torch.where(there, self.exit_lane[row], -1))
        sides = torch.stack((angles >= 30, angles <= -30, angles.abs() < 30), dim=-1).float()  # (B, X, 3)
        numbers = torch.stack(
            (turn.cos(), turn.sin(), seen.float(), along * seen, (nearer / POSITION_UNIT) * seen), dim=-1
        )
        tokens = self.exit(torch.cat((numbers, sides, self._told_way(inputs, sides), street), dim=-1))
        return tokens, there, angles, distance

    def _told_way(self, inputs: Inputs, sides: Tensor) -> Tensor:
        """Returns whether the participant's last words name each exit's side, any side, and their age (B, X, 3).

        Args:
            inputs: inputs of the points.
            sides: (B, X, 3) whether each exit leads to the left, to the right, straight on.
        """
        human = inputs["utterance_mask"] & (inputs["utterance_speaker"] == PARTICIPANT)  # (B, U)
        place = (human * torch.arange(1, human.shape[1] + 1, device=human.device)).amax(1, keepdim=True) - 1  # (B, 1)
        row = place.clamp(min=0)
        text = torch.where(place >= 0, inputs["utterance_text"].gather(1, row), -1)[:, 0]
        age = (inputs["time"] - inputs["utterance_time"].gather(1, row)[:, 0]).clamp(0.0, _MAX_WORD_AGE) / _MAX_WORD_AGE
        ways = self.ways[text]  # (B, 3)
        fits = torch.einsum("bxw,bw->bx", sides, ways)
        any_way = ways.amax(1)[:, None].expand(fits.shape)
        return torch.stack((fits, any_way, age[:, None].expand(fits.shape)), dim=-1)

    def _street_names(self, inputs: Inputs, lane: Tensor) -> Tensor:
        """Returns the vectors of the names of the streets of lanes (B, X, E); zeros where a lane has none."""
        row = self.towns.lane_rows(inputs["town"], lane)
        street = torch.where(row >= 0, self.lane_street[row], -1)  # (B, X)
        names = inputs["street_text"]  # (B, R)
        known = (street >= 0) & (street < names.shape[1])
        text = names.gather(1, torch.where(known, street, 0))
        vectors: Tensor = self.texts(torch.where(known, text, -1))
        return vectors

    def _wanted_place(self, inputs: Inputs) -> tuple[Tensor, Tensor]:
        """Returns the place of the last-named landmark (B, 2) [m], and whether it is known (B,)."""
        names = self.mentions[inputs["landmark_text"]] * inputs["landmark_mask"].unsqueeze(-1)  # (B, K, 69)
        moves = inputs["move_slots"].float() * inputs["move_mask"].unsqueeze(-1)  # (B, M, 69)
        said = torch.einsum("bmv,bkv->bmk", moves, names) > 0
        order = torch.arange(1, said.shape[1] + 1, device=said.device)
        when = (said * order[None, :, None]).amax(1)  # (B, K) the last move that named each
        best, which = when.max(1)
        place = inputs["landmark_place"].gather(1, which[:, None, None].expand(-1, 1, 2))[:, 0]
        return place, best > 0

    def _understood(self, inputs: Inputs) -> tuple[Tensor, Tensor]:
        """Returns the mask of earlier acts of the point's own utterance (B, M), and the number of their pieces (B,)."""
        now = (inputs["time"][:, None] - inputs["move_time"]).abs() < _SAME_TIME
        speaker = torch.where(inputs["current_text"] >= 0, PARTICIPANT, CO_WIZARD)[:, None]  # of UfN, or of RfN
        spans = now & inputs["move_mask"] & (inputs["move_speaker"] == speaker)
        taken = (self.pieces[inputs["move_text"]] != PAD).sum(-1)  # (B, M)
        return spans, (taken * spans).sum(1)

    def _words(self, inputs: Inputs) -> list[Tokens]:
        """Returns tokens of the pieces of the current utterance and of the last two (B, P, d)."""
        _, taken = self._understood(inputs)
        found = []
        for back in range(WORD_BY_WORD):
            text = (
                inputs["current_text"]
                if back == 0
                else _newest(inputs["utterance_text"], inputs["utterance_mask"], back)
            )
            pieces = self.pieces[text]  # (B, P)
            mask = pieces != PAD
            place = torch.arange(pieces.shape[1], device=pieces.device)
            source = torch.full_like(pieces, back)
            if back == 0:
                source = torch.where(place[None] < taken[:, None], WORD_BY_WORD, source)
            tokens = self.piece(pieces) + self.place.weight + self.source(source)
            found.append((tokens, mask, inputs["time"][:, None].expand(mask.shape)))
        return found

    def _heard(self, inputs: Inputs) -> Tensor:
        """Returns the current utterance, or the last one if there is none (B,)."""
        last = _newest(inputs["utterance_text"], inputs["utterance_mask"])
        return torch.where(inputs["current_text"] >= 0, inputs["current_text"], last)

    def _named(self, inputs: Inputs) -> Tensor:
        """Returns features of each slot value (B, 69, n): who named it and when, and whether the town has it."""
        mask = inputs["move_mask"]
        after = mask.sum(1, keepdim=True) - 1 - torch.arange(mask.shape[1], device=mask.device)
        slots = inputs["move_slots"].float() * mask.unsqueeze(-1)  # (B, M, 69)
        spans, _ = self._understood(inputs)
        parts = [self.mentions[inputs["current_text"]], self.mentions[self._heard(inputs)]]
        parts.append((slots * spans.unsqueeze(-1)).amax(1))
        for speaker in range(2):
            own = (inputs["move_speaker"] == speaker).unsqueeze(-1)
            parts += [(slots * own * (after < last).unsqueeze(-1)).amax(1) for last in _MEMORY]
        for text, there in (("street_text", "street_mask"), ("landmark_text", "landmark_mask")):
            parts.append((self.mentions[inputs[text]] * inputs[there].unsqueeze(-1)).amax(1))
        return torch.stack(parts, dim=-1)

    def _state(self, inputs: Inputs, there: Tensor, distance: Tensor) -> Tensor:
        """Returns the state of the car in numbers of about 1 (B, 9)."""
        speed = _newest(inputs["window_speed"], inputs["window_mask"])
        ahead = inputs["values"][..., 0].masked_fill(~inputs["objects_mask"], POSITION_UNIT).amin(1)
        place, known = self._wanted_place(inputs)
        far = (place - _newest_pose(inputs)[:, :2]).norm(dim=-1)
        return torch.stack(
            (speed / 10.0, (speed < 0.3).float(), (distance / 50.0).clamp(max=4.0), (distance < 15.0).float(),
             there.sum(1) / EXITS, (ahead / 30.0).clamp(max=3.0), (inputs["current_text"] >= 0).float(),
             known.float(), torch.exp(-far / _AT_PLACE) * known), dim=-1,
        )  # fmt: skip


def _newest(values: Tensor, mask: Tensor, back: int = 1) -> Tensor:
    """Returns the element at a place from each sequence's end (B,); -1 (0 of reals) for none."""
    place = mask.sum(1) - back
    empty = 0.0 if values.is_floating_point() else -1
    return torch.where(place >= 0, values.gather(1, place.clamp(min=0)[:, None])[:, 0], empty)


def _newest_pose(inputs: Inputs) -> Tensor:
    place = (inputs["window_mask"].sum(1) - 1).clamp(min=0)
    return inputs["window_pose"].gather(1, place[:, None, None].expand(-1, 1, 3))[:, 0]
