"""Real time: ticks of a room on threads, so that the event loop is never blocked, and delivery of their results."""

from __future__ import annotations

import asyncio
import logging
from concurrent.futures import Executor
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from dorothie_gym.lab.console.room import Room

logger = logging.getLogger(__name__)

QUIET_PERIOD: Final = 0.25
"""Time between the ticks of a room in which nothing happens [s]."""

MOST_BEHIND: Final = 0.5
"""Delay at which a session stops trying to catch up with the clock [s]."""


async def run_room(room: Room, threads: Executor, builders: Executor) -> None:
    """Ticks a room in real time until it is cancelled or fails.

    Args:
        room: the room.
        threads: threads for the ticks; each tick runs on one of them, and a room has one tick at a time.
        builders: threads for slow work that must not delay ticks: scenes of towns for pictures.
    """
    loop = asyncio.get_running_loop()
    period = 1.0 / room.config.decision_frequency
    preparing: asyncio.Future[None] | None = None
    due = loop.time()
    while True:
        if preparing is None or preparing.done():
            if preparing is not None:
                preparing.result()
            preparing = _prepare_pictures(room, builders)
        try:
            out = await loop.run_in_executor(threads, room.tick, loop.time())
        except Exception:
            logger.exception("a session of the console failed")
            for each in room.fail():
                each.deliver()
            return
        for each in out:
            each.deliver()
        due += QUIET_PERIOD if room.is_quiet else period
        now = loop.time()
        if now - due > MOST_BEHIND:
            due = now
        await asyncio.sleep(max(0.0, due - now))


def _prepare_pictures(room: Room, builders: Executor) -> asyncio.Future[None] | None:
    """Starts to build the scene of a session that needs it on a thread; returns None if there is nothing to do."""
    windscreen, session = room.windscreen, room.engine.session
    if windscreen is None or not room.wants_pictures or windscreen.is_ready(session):
        return None
    return asyncio.get_running_loop().run_in_executor(builders, windscreen.prepare, session)
