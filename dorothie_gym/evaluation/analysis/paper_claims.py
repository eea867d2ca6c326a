"""Behaviour reported in the paper (sections 4.2 and 4.3): each claim as a figure with a bootstrap interval.

Every claim is a difference that is positive according to the paper, so a claim holds if its interval is above zero.
Claims about exceptions compare exchanges that handle an exception with those that handle none: means over exchanges, as
in the paper's figure.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.evaluation.analysis.exception_attribution import Handled, handling
from dorothie_gym.evaluation.analysis.intervals import RESAMPLES, bootstrap_weights, percentile_interval
from dorothie_gym.evaluation.analysis.units import Units
from dorothie_gym.ontology.dialogue_acts import DialogueMove, MoveGroup
from dorothie_gym.ontology.roles import Role
from dorothie_gym.ontology.slots import Slot

if TYPE_CHECKING:
    from dorothie_gym.session.recording.session import Session

MAX_UNDEFINED_SHARE: Final = 0.5
"""Share of undefined bootstrap samples at which the interval becomes undefined."""

_HUMAN, _CAR = Role.PARTICIPANT, Role.CO_WIZARD
_ENV, _TASK, _NONE = Handled.ENVIRONMENTAL, Handled.TASK, Handled.NONE

Key: TypeAlias = tuple[object, ...]


class Tally:
    """Counts of exchanges, acts and slot values of each session, by kind of exchange, speaker and move or slot.

    pandas was tried for the sums: with equal lines of code it takes three times as long, and half a second to import.

    A column is a key: ("exchanges", kind), ("move", kind, speaker, move), ("slot", kind, speaker, slot), and
    ("instruct", kind, slot) for the participant's Instructs that carry the slot.
    """

    def __init__(self) -> None:
        self._rows: list[Counter[Key]] = []

    def add(self, units: Units) -> None:
        """Counts a session."""
        row: Counter[Key] = Counter()
        kinds = handling(units)
        for exchange in units.exchanges:
            kind = kinds[exchange.id]
            row["exchanges", kind] += 1
            for move in exchange.moves:
                row["move", kind, move.speaker, move.act.move] += 1
                slots = [value.slot for value in move.act.slots]
                row.update(("slot", kind, move.speaker, slot) for slot in slots)
                if move.speaker is _HUMAN and move.act.move is DialogueMove.INSTRUCT:
                    row.update(("instruct", kind, slot) for slot in set(slots))
        self._rows.append(row)

    @property
    def sessions(self) -> int:
        """Number of sessions."""
        return len(self._rows)

    def totals(self, weights: NDArray[np.float64]) -> Totals:
        """Returns the sums over sessions.

        Args:
            weights: (n, sessions), weight of each session; a row for each sum.
        """
        keys = sorted({key for row in self._rows for key in row}, key=repr)
        table = np.array([[row[key] for key in keys] for row in self._rows], dtype=np.float64)
        sums = weights @ table.reshape(len(self._rows), len(keys))
        return Totals({key: sums[:, k] for k, key in enumerate(keys)}, len(weights))


class Totals:
    """Sums over sessions by key, n of each (see `Tally`)."""

    def __init__(self, sums: dict[Key, NDArray[np.float64]], count: int) -> None:
        self._sums, self._nothing = sums, np.zeros(count)

    def of(self, *keys: Key) -> NDArray[np.float64]:
        """Returns the sum of the keys, (n,)."""
        return sum((self._sums.get(key, self._nothing) for key in keys), self._nothing)

    def mean(self, kind: Handled, *keys: Key) -> NDArray[np.float64]:
        """Returns the mean sum of the keys over exchanges of a kind, (n,); NaN without such an exchange."""
        exchanges = self.of(("exchanges", kind))
        return np.divide(self.of(*keys), exchanges, out=np.full_like(exchanges, np.nan), where=exchanges > 0)

    def share(self, speaker: Role, *moves: DialogueMove) -> NDArray[np.float64]:
        """Returns the share of the moves among all acts of a speaker, (n,); NaN without acts."""
        every = self.of(*(("move", kind, speaker, move) for kind in Handled for move in DialogueMove))
        found = self.of(*(("move", kind, speaker, move) for kind in Handled for move in moves))
        return np.divide(found, every, out=np.full_like(every, np.nan), where=every > 0)


Figure: TypeAlias = Callable[[Totals], NDArray[np.float64]]


@dataclass(frozen=True, kw_only=True)
class BehaviourClaim:
    """Claim of the paper about the dialogue of people and cars.

    Attributes:
        name: short, for JSON.
        title: title in words.
        figure: a number that is positive if the claim is true.
    """

    name: str
    title: str
    figure: Figure


@dataclass(frozen=True, kw_only=True)
class BehaviourVerdict:
    """Result of testing a claim on a corpus.

    Attributes:
        claim: the claim.
        difference: difference of the claim over all sessions; None if undefined.
        low, high: limits of its interval; None if undefined.
    """

    claim: BehaviourClaim
    difference: float | None
    low: float | None
    high: float | None

    @property
    def holds(self) -> bool:
        """Whether the interval is above zero."""
        return self.low is not None and self.low > 0.0

    def to_json(self) -> dict[str, object]:
        """Returns `name`, `title`, `difference`, `low`, `high` and `holds`."""
        names = ("difference", "low", "high", "holds")
        return {"name": self.claim.name, "title": self.claim.title, **{name: getattr(self, name) for name in names}}


def verdicts_of(
    sessions: Iterable[Session], *, resamples: int = RESAMPLES, seed: int = 0
) -> tuple[BehaviourVerdict, ...]:
    """Returns the evidence of sessions for each of the `CLAIMS`.

    The interval is that of the percentile bootstrap over sessions; samples with an undefined figure are left out. It is
    None with fewer than two sessions, or if half of the samples, or more, are undefined.

    Args:
        sessions: sessions of a corpus.
        resamples: number of bootstrap samples, at least 1.
        seed: seed of the samples.
    """
    tally = Tally()
    for session in sessions:
        tally.add(Units(session))
    if not tally.sessions:
        return tuple(BehaviourVerdict(claim=claim, difference=None, low=None, high=None) for claim in CLAIMS)
    count = tally.sessions
    whole = tally.totals(np.ones((1, count)))
    totals = tally.totals(bootstrap_weights(count, resamples=resamples, seed=seed))
    return tuple(_verdict(claim, whole, totals if count > 1 else None) for claim in CLAIMS)


def _verdict(claim: BehaviourClaim, whole: Totals, drawn: Totals | None) -> BehaviourVerdict:
    difference = float(claim.figure(whole)[0])
    if np.isnan(difference):
        return BehaviourVerdict(claim=claim, difference=None, low=None, high=None)
    figures = np.full(1, np.nan) if drawn is None else claim.figure(drawn)
    if np.isnan(figures).mean() >= MAX_UNDEFINED_SHARE:
        return BehaviourVerdict(claim=claim, difference=difference, low=None, high=None)
    low, high = percentile_interval(figures)
    return BehaviourVerdict(claim=claim, difference=difference, low=low, high=high)


# --- Claims ----------------------------------------------------------------------------------------------------------


def _mostly(speaker: Role, moves: Sequence[DialogueMove], totals: Totals) -> NDArray[np.float64]:
    """Returns the share of the moves among a speaker's acts, less that of the most frequent other move."""
    others = np.array([totals.share(speaker, move) for move in DialogueMove if move not in moves])
    above: NDArray[np.float64] = totals.share(speaker, *moves) - others.max(axis=0)
    return above


def _more(kind: Handled, keys: Callable[[Handled], Iterable[Key]], sign: float, totals: Totals) -> NDArray[np.float64]:
    """Returns the mean number in exchanges that handle an exception of a kind, less that in those that handle none."""
    return sign * (totals.mean(kind, *keys(kind)) - totals.mean(_NONE, *keys(_NONE)))


def _moves(speaker: Role, moves: Sequence[DialogueMove], kind: Handled) -> Iterable[Key]:
    return (("move", kind, speaker, move) for move in moves)


def _slots(speaker: Role, slot: Slot, kind: Handled) -> Iterable[Key]:
    return (("slot", kind, speaker, slot),)


def _instructs(slot: Slot, kind: Handled) -> Iterable[Key]:
    return (("instruct", kind, slot),)


def _claim(
    name: str, title: str, kind: Handled, keys: Callable[[Handled], Iterable[Key]], sign: float = 1.0
) -> BehaviourClaim:
    return BehaviourClaim(name=name, title=title, figure=partial(_more, kind, keys, sign))


_INSTRUCT, _EXPLAIN = (DialogueMove.INSTRUCT,), (DialogueMove.EXPLAIN,)
_GROUNDING = (DialogueMove.ACKNOWLEDGE, DialogueMove.CONFIRM)
_ASK, _INFORM = MoveGroup.ASK.moves, MoveGroup.INFORM.moves

CLAIMS: Final[tuple[BehaviourClaim, ...]] = (
    BehaviourClaim(
        name="human_mostly_instructs",
        title="participant: mostly Instruct",
        figure=partial(_mostly, _HUMAN, _INSTRUCT),
    ),
    BehaviourClaim(
        name="car_mostly_grounds",
        title="car: mostly Acknowledge, Confirm",
        figure=partial(_mostly, _CAR, _GROUNDING),
    ),
    _claim("environmental_car_explains", "environmental: car, more Explain", _ENV, partial(_moves, _CAR, _EXPLAIN)),
    _claim("environmental_car_asks", "environmental: car, more questions", _ENV, partial(_moves, _CAR, _ASK)),
    _claim("environmental_car_actions", "environmental: car, more Action slots", _ENV,
           partial(_slots, _CAR, Slot.ACTION)),
    _claim("environmental_car_objects", "environmental: car, more Object slots", _ENV,
           partial(_slots, _CAR, Slot.OBJECT)),
    _claim("environmental_human_instructs_less", "environmental: participant, fewer Instruct", _ENV,
           partial(_moves, _HUMAN, _INSTRUCT), -1.0),
    _claim("environmental_human_informs", "environmental: participant, more replies", _ENV,
           partial(_moves, _HUMAN, _INFORM)),
    _claim("task_human_instructs", "task: participant, more Instruct", _TASK, partial(_moves, _HUMAN, _INSTRUCT)),
    _claim("task_human_landmarks", "task: participant, more Landmark slots", _TASK,
           partial(_slots, _HUMAN, Slot.LANDMARK)),
    _claim("task_human_statuses", "task: participant, more Status slots", _TASK,
           partial(_slots, _HUMAN, Slot.STATUS)),
    _claim("task_human_instructs_landmark", "task: participant, more Instruct + Landmark", _TASK,
           partial(_instructs, Slot.LANDMARK)),
    _claim("task_human_instructs_status", "task: participant, more Instruct + Status", _TASK,
           partial(_instructs, Slot.STATUS)),
    _claim("task_car_informs", "task: car, more informing moves", _TASK, partial(_moves, _CAR, _INFORM)),
)  # fmt: skip
"""Claims in the order of the paper. Questions are Align, Check, QueryYN and QueryW; informing moves are Clarify,
Confirm and the replies (spec of the ontology, decision tree)."""
