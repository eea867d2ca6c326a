"""Shares of the most frequent labels of the three tasks, compared with those inferred from the paper.

A model that sees only detector features does no better than the most frequent class, so the paper's full table gives
the share of that class, and in the same way the share of moves without a slot.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any, Final

from dorothie_gym.ontology import NAVIGATION_ACTIONS, Role
from dorothie_gym.recording.session import Session

SEEN: Final[Mapping[str, float]] = MappingProxyType(
    {
        "commonest_human_move": 0.315,
        "commonest_car_move": 0.244,
        "commonest_navigation_action": 0.315,
        "human_moves_without_slot": 0.369,
        "car_moves_without_slot": 0.557,
    }
)
"""Shares in the paper's seen towns (spec of the dialogue, Anchors)."""

UNSEEN: Final[Mapping[str, float]] = MappingProxyType(
    {
        "commonest_human_move": 0.376,
        "commonest_car_move": 0.307,
        "commonest_navigation_action": 0.369,
        "human_moves_without_slot": 0.262,
        "car_moves_without_slot": 0.548,
    }
)
"""Shares in the paper's unseen town."""

TOLERANCE = 0.08
"""Accepted difference from the shares in seen towns."""


@dataclass
class Anchors:
    """Counts of the labels of the three tasks: flagged moves of both speakers, flagged navigation actions."""

    moves: dict[Role, Counter[str]] = field(
        default_factory=lambda: {Role.PARTICIPANT: Counter(), Role.CO_WIZARD: Counter()}
    )
    without_slot: Counter[Role] = field(default_factory=Counter)
    actions: Counter[str] = field(default_factory=Counter)

    def add(self, session: Session) -> None:
        """Counts the points of a session."""
        for move in session.all_moves:
            if move.flagged and move.speaker in self.moves:
                self.moves[move.speaker][move.act.move.label] += 1
                self.without_slot[move.speaker] += not move.act.slots
        for action in session.physical_actions:
            if action.flagged and action.source is Role.CO_WIZARD and action.action in NAVIGATION_ACTIONS:
                self.actions[action.action.label] += 1

    def to_json(self) -> dict[str, Any]:
        """Returns for each anchor `share` and `points` (and `label` of the most frequent class), `paper`, `within`.

        `paper` is the share in seen towns, `within` whether the corpus differs by at most `TOLERANCE`. Share and
        `within` are None without a point.
        """
        human, car = self.moves[Role.PARTICIPANT], self.moves[Role.CO_WIZARD]
        rows = {
            "commonest_human_move": _commonest(human),
            "commonest_car_move": _commonest(car),
            "commonest_navigation_action": _commonest(self.actions),
            "human_moves_without_slot": _share(self.without_slot[Role.PARTICIPANT], human.total()),
            "car_moves_without_slot": _share(self.without_slot[Role.CO_WIZARD], car.total()),
        }
        for name, row in rows.items():
            row["paper"], row["paper_unseen"] = SEEN[name], UNSEEN[name]
            share = row["share"]
            row["within"] = None if share is None else abs(share - SEEN[name]) <= TOLERANCE
        return rows


def anchors_of(sessions: Iterable[Session]) -> dict[str, Any]:
    """Returns the anchors of sessions in the form of `Anchors.to_json`."""
    anchors = Anchors()
    for session in sessions:
        anchors.add(session)
    return anchors.to_json()


def _commonest(counts: Counter[str]) -> dict[str, Any]:
    label, count = min(counts.items(), key=lambda item: (-item[1], item[0])) if counts else (None, 0)
    return {"label": label, **_share(count, counts.total())}


def _share(count: int, points: int) -> dict[str, Any]:
    return {"share": count / points if points else None, "points": points}
