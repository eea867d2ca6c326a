"""Cut of the film on the first page: the frames of a recorded session that show its events."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np

from dorothie_gym.ontology import ActionValue, GoalStatus, PhysicalAction
from dorothie_gym.session.recording import Session
from dorothie_gym.session.recording.events import ActionRecord, EventType
from dorothie_gym.sim.config import FRAME_RATE

TURNED: Final = 55.0
"""Change of heading that counts as a turn [degrees]."""

ANNOUNCED: Final = 12.0
"""Longest time between the words that name a turn and the command [s]."""

DRIVEN: Final = 9.0
"""Longest time from the command of a turn to the end of the turn [s]."""

TICK: Final = 35
"""Frames after an arrival, in which the errand has its tick."""

GREETING, TURN, EXCEPTION, ARRIVAL = (2.5, 4.5, 2.5, 2.5)
"""Length of each part [s]: twelve seconds together."""


def film_parts(session: Session) -> dict[str, range]:
    """Returns the frames of the parts of the film, by name and in the order of time.

    The parts are a greeting (the first utterance), a turn that is named and then driven, an exception, and the arrival
    at a stop with the tick of its errand.

    Raises:
        ValueError: the session has no such part; names it.
    """
    opening = session.utterances()[0]
    turn = next(_turns(session), None)
    exceptions = session.of_type(EventType.EXCEPTION)
    last = int(session.trajectory["frame"][-1])
    arrivals = [
        event.frame + TICK
        for event in session.of_type(EventType.SUBGOAL)
        if event.data.get("status") == GoalStatus.COMPLETE.label and event.data.get("cause") == "arrival"
        if event.frame + TICK <= last
    ]
    for name, found in (("turn", turn), ("exception", exceptions), ("arrival", arrivals)):
        if not found:
            raise ValueError(f"the session has no {name}; film another one")
    assert turn is not None
    ends = {
        "greeting": (round(opening.end * FRAME_RATE) + 30, GREETING),
        "turn": (turn, TURN),
        "exception": (exceptions[0].frame + 50, EXCEPTION),
        "arrival": (arrivals[0], ARRIVAL),
    }
    parts = {
        name: range(max(min(end, last) - round(length * FRAME_RATE), 1), min(end, last))
        for name, (end, length) in ends.items()
    }
    return dict(sorted(parts.items(), key=lambda part: part[1].start))


def film_frames(session: Session, rate: int = 10) -> list[int]:
    """Returns the frames of the film, `rate` per second of each part."""
    parts = film_parts(session).values()
    return sorted({frame for part in parts for frame in range(part.start, part.stop, FRAME_RATE // rate)})


def _turns(session: Session) -> Iterator[int]:
    """Yields the frames in which turns end that were named before they were commanded."""
    named = [move.end for move in session.moves() if ActionValue.J_TURN in move.act.slots]
    for command in session.physical_actions:
        told = any(0.0 <= command.frame / FRAME_RATE - end <= ANNOUNCED for end in named)
        if command.action is PhysicalAction.J_TURN and told and abs(command.angle or 0.0) >= TURNED:
            end = _end_of_turn(session, command)
            if end is not None:
                yield end


def _end_of_turn(session: Session, command: ActionRecord) -> int | None:
    """Returns the frame in which the heading has changed by `TURNED`, plus half a second; None if it has not."""
    rows = session.trajectory
    frames: Sequence[int] = rows["frame"].tolist()
    begin = int(np.searchsorted(frames, command.frame))
    headings = np.unwrap(rows["heading"][begin : begin + round(DRIVEN * FRAME_RATE)])
    turned = np.flatnonzero(np.abs(np.degrees(headings - headings[0])) >= TURNED) if len(headings) else []
    return frames[begin + int(turned[0])] + FRAME_RATE // 2 if len(turned) else None
