"""Turns in which connections are read: no address, and no connection of an address, keeps the others waiting."""

from __future__ import annotations

import asyncio
import time
from typing import Any, cast

import pytest

pytest.importorskip("uvicorn", reason="needs the extra console")

from dorothie_gym.lab.admission import REQUESTS, Turns, Visitor


class Line:
    """Connection with something to be read, which notes when it was read."""

    def __init__(self, read: list[str], name: str, address: str = "192.0.2.1", *, known: bool = False) -> None:
        self.transport: Any = self
        self.visitor = Visitor(address=address, transport=cast(asyncio.Transport, self), since=0.0, known=known)
        self._order, self._name, self.read = read, name, False

    def is_closing(self) -> bool:
        return False

    def take_turn(self) -> None:
        assert not self.read
        self._order.append(self._name)
        self.read = True


async def read_all(*lines: Line) -> None:
    turns = Turns()
    for line in lines:
        turns.ask(line)
    while not all(line.read for line in lines):
        await asyncio.sleep(0.01)


def test_known_people_come_first_and_those_that_ask_too_often_last() -> None:
    read: list[str] = []

    async def run() -> None:
        heavy, stranger, known = Line(read, "heavy"), Line(read, "stranger"), Line(read, "known", known=True)
        while heavy.visitor.requests.admits(asyncio.get_running_loop().time()):
            pass
        await read_all(heavy, stranger, known)

    asyncio.run(run())
    assert read == ["known", "stranger", "heavy"] and REQUESTS[1] < 100.0


def test_addresses_take_turns_and_of_each_the_newest_and_the_oldest() -> None:
    read: list[str] = []
    lines = [Line(read, f"flood {number}") for number in range(200)]
    lines.insert(150, Line(read, "other", "198.51.100.1"))
    asyncio.run(read_all(*lines))
    assert "other" in read[:2] and {"flood 0", "flood 199", "flood 1", "flood 198"} <= set(read[:8])


def test_what_turns_set_off_leaves_half_of_the_time_to_others() -> None:
    spent: list[float] = []

    def work() -> None:
        began = time.monotonic()
        time.sleep(0.005)
        spent.append(time.monotonic() - began)

    class Costly(Line):
        def take_turn(self) -> None:
            super().take_turn()
            asyncio.get_running_loop().call_soon(work)

    async def run() -> float:
        began = time.monotonic()
        await read_all(*(Costly([], str(number)) for number in range(40)))
        return time.monotonic() - began

    # 1.8 times the work, as nobody waits for the pause behind the last eight turns; 1.0 times without pauses
    assert asyncio.run(run()) > 1.4 * sum(spent) > 0.0
