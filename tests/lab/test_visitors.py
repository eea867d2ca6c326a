"""Places of connections: who gives way to whom, and for how long the server waits."""

from __future__ import annotations

import asyncio
from typing import Any, cast

import pytest

from dorothie_gym.lab.admission import (
    ANSWER_SECONDS,
    ENDED_AT_ONCE,
    KNOWN_SECONDS,
    STRANGER_SECONDS,
    Visitor,
    Visitors,
    network_of,
)


class Line:
    """Connection that notes that it was ended."""

    def __init__(self, address: str) -> None:
        self.address, self.ended = address, False

    def get_extra_info(self, name: str) -> Any:
        return (self.address, 1) if name == "peername" else None

    def abort(self) -> None:
        self.ended = True


class Hall:
    """Places whose clock is set by the test."""

    def __init__(self, strangers: int, known: int = 5) -> None:
        self.now = 100.0
        self.visitors = Visitors(lambda: self.now, strangers=strangers, known=known)

    def enter(self, address: str = "192.0.2.1") -> tuple[Line, Visitor]:
        line = Line(address)
        self.now += 0.01
        return line, self.visitors.enter(cast(asyncio.Transport, line))


def test_the_oldest_strangers_give_way_and_the_newest_is_let_in() -> None:
    hall = Hall(40)
    lines = [hall.enter()[0] for _ in range(500)]
    ended = [line.ended for line in lines]
    assert not any(ended[-24:]) and all(ended[:400])
    assert ended == sorted(ended, reverse=True), "in the order in which they came"


def test_known_people_keep_their_connection() -> None:
    hall = Hall(20)
    line, visitor = hall.enter()
    hall.visitors.recognise(visitor)
    for _ in range(300):
        hall.enter()
    hall.now += 10 * KNOWN_SECONDS
    visitor.socket = True
    hall.visitors.sweep()
    assert not line.ended


def test_the_address_with_most_strangers_makes_room() -> None:
    hall = Hall(40)
    quiet = [hall.enter(f"198.51.100.{number}")[0] for number in range(10)]
    flood = [hall.enter()[0] for _ in range(300)]
    assert not any(line.ended for line in quiet) and sum(line.ended for line in flood) >= 260


def test_those_that_ask_too_often_give_way_first() -> None:
    hall = Hall(40)
    lines = [hall.enter() for _ in range(40)]
    for _, visitor in lines[30:]:
        visitor.heavy = True
    hall.enter()
    assert [line.ended for line, _ in lines] == [False] * 30 + [True] * 10


def test_the_time_for_a_request_is_limited() -> None:
    hall = Hall(40)
    (silent, _), (answered, served), (recording, known) = (hall.enter() for _ in range(3))
    served.served = True
    hall.visitors.recognise(known)
    seen = []
    for seconds in (STRANGER_SECONDS - 2, 4.0, ANSWER_SECONDS - STRANGER_SECONDS, KNOWN_SECONDS):
        hall.now += seconds
        hall.visitors.sweep()
        seen.append((silent.ended, answered.ended, recording.ended))
    assert seen == [(False, False, False), (True, False, False), (True, True, False), (True, True, True)]


def test_those_that_are_late_together_are_ended_in_several_passes() -> None:
    hall = Hall(1000)
    lines = [hall.enter()[0] for _ in range(2 * ENDED_AT_ONCE + 10)]
    hall.now += 2 * STRANGER_SECONDS
    seen = []
    for _ in range(3):
        hall.visitors.sweep()
        seen.append(sum(line.ended for line in lines))
    assert seen == [ENDED_AT_ONCE, 2 * ENDED_AT_ONCE, len(lines)]


def test_more_known_connections_than_places_are_strangers() -> None:
    hall = Hall(40, known=3)
    visitors = [hall.enter()[1] for _ in range(5)]
    for visitor in visitors:
        hall.visitors.recognise(visitor)
    assert [visitor.known for visitor in visitors] == [True] * 3 + [False] * 2


def test_a_server_that_stops_ends_strangers_and_admits_nobody() -> None:
    hall = Hall(40)
    (stranger, _), (seated, visitor) = hall.enter(), hall.enter()
    hall.visitors.recognise(visitor)
    hall.visitors.close()
    assert stranger.ended and not seated.ended and hall.enter()[0].ended


@pytest.mark.parametrize(
    ("host", "network"),
    [
        ("192.0.2.7", "192.0.2.7"),
        ("::ffff:192.0.2.7", "192.0.2.7"),
        ("2001:db8:1:2:3:4:5:6", "2001:db8:1:2::/64"),
        ("fe80::1%eth0", "fe80::/64"),
        ("unknown", ""),
        ("9" * 10_000, ""),
        (None, ""),
    ],
)
def test_addresses_are_counted_by_what_one_person_has(host: str | None, network: str) -> None:
    assert network_of(host) == network
