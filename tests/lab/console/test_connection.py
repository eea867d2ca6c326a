"""Outgoing messages of a connection, and its rate of incoming ones."""

from __future__ import annotations

import asyncio

from dorothie_gym.lab.console.connection import BURST, MOST_WAITING, RATE, CloseCode, Closing, Connection, changes


def drain(connection: Connection, count: int) -> list[object]:
    async def take() -> list[object]:
        return [await asyncio.wait_for(connection.next(), 1.0) for _ in range(count)]

    return asyncio.run(take())


def test_messages_keep_their_order_and_old_pictures_are_dropped() -> None:
    connection = Connection()
    connection.send(b"1")
    connection.show(b"old picture")
    connection.send(b"2")
    connection.show(b"new picture")
    assert drain(connection, 3) == ["1", b"new picture", "2"]


def test_a_browser_that_does_not_read_is_closed() -> None:
    connection = Connection()
    for _ in range(MOST_WAITING + 5):
        connection.send(b"{}")
    assert drain(connection, MOST_WAITING + 1)[-1] == Closing(CloseCode.TOO_SLOW)


def test_a_browser_that_sends_too_much_is_held_back() -> None:
    connection = Connection()
    admitted = sum(connection.admits(0.0) for _ in range(200))
    assert admitted == BURST
    assert sum(connection.admits(1.0) for _ in range(200)) == RATE


def test_only_changed_fields_are_sent() -> None:
    assert changes({"a": 1, "b": [1, 2], "c": None}, {"a": 1, "b": [1, 3]}) == {"b": [1, 2], "c": None}
