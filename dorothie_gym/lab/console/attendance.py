"""Attendance of people at the seats: whether a session can begin, must pause, or continues without a person."""

from __future__ import annotations

from collections.abc import Collection, Iterator

from dorothie_gym.lab.console.config import AbsenceRules, WhileAway
from dorothie_gym.lab.console.seat import PauseReason, Seat


def is_missing(seat: Seat) -> bool:
    """Returns whether the session waits for a person at a seat."""
    return seat.needs_person and not seat.present and not seat.taken_over


def is_ready(seats: Collection[Seat], *, started: bool) -> bool:
    """Returns whether a session can begin.

    Args:
        seats: all seats of the room.
        started: whether it begins without waiting for people.
    """
    roles = [seat for seat in seats if seat.role is not None]
    if any(map(is_missing, roles)):
        return False
    return started or any(seat.present for seat in roles or seats)


def overdue(seats: Collection[Seat], rules: AbsenceRules, now: float) -> Iterator[Seat]:
    """Yields the seats whose person has been away for longer than the rules allow.

    Args:
        seats: all seats of the room.
        rules: rules for people who leave.
        now: clock of the room [s].
    """
    for seat in seats:
        if seat.needs_person and not seat.taken_over and seat.away_since is not None:
            if now - seat.away_since >= rules.seconds:
                yield seat


def pause_reason(seats: Collection[Seat], rules: AbsenceRules, *, started: bool) -> PauseReason | None:
    """Returns the reason for which absences stop the clock of a session; None if it continues.

    Args:
        seats: all seats of the room.
        rules: rules for people who leave.
        started: whether the session was begun without waiting for people.
    """
    roles = [seat for seat in seats if seat.role is not None]
    if rules.while_away is WhileAway.PAUSE and any(map(is_missing, roles)):
        return PauseReason.ABSENCE
    if not started and not any(seat.present for seat in seats) and not any(seat.taken_over for seat in roles):
        return PauseReason.ABSENCE  # no person is connected
    return None
