"""Presence of participants, known from their browsers' requests for news, and their notification."""

from __future__ import annotations

import asyncio
import time
from collections import Counter
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Final

PRESENT_SECONDS: Final = 8.0
"""Time after the last request for news for which a person counts as present [s]: a reload takes time."""

LONGEST: Final = 60.0
"""Time for which the last sign of a person is remembered [s]."""


class Presence:
    """People whose browsers are connected."""

    def __init__(self) -> None:
        self._asking: Counter[str] = Counter()
        self._seen: dict[str, float] = {}
        self._news = asyncio.Event()

    @asynccontextmanager
    async def asking(self, name: str) -> AsyncIterator[None]:
        """Counts a participant as present while the block lasts, and shortly afterwards."""
        self._asking[name] += 1
        try:
            yield
        finally:
            self._asking[name] -= 1
            self._seen[name] = time.monotonic()
            if not self._asking[name]:
                del self._asking[name]

    def see(self, name: str) -> None:
        """Records that a participant has just sent a request."""
        self._seen[name] = time.monotonic()

    def present(self, within: float = PRESENT_SECONDS) -> list[str]:
        """Returns the ids of the people who are present.

        Args:
            within: time without a request after which a person has left [s], at most `LONGEST`.
        """
        now = time.monotonic()
        self._seen = {name: seen for name, seen in self._seen.items() if now - seen <= LONGEST}
        return sorted({*self._asking, *(name for name, seen in self._seen.items() if now - seen <= within)})

    def tell(self) -> None:
        """Wakes all requests that wait for news."""
        self._news.set()
        self._news = asyncio.Event()

    async def wait_for_news(self, seconds: float) -> None:
        """Waits until `tell` is called, or a time has passed [s]."""
        try:
            await asyncio.wait_for(self._news.wait(), seconds)
        except TimeoutError:
            return
