"""Measures the console with many sessions at once on one core: simulated Co-Wizards over real websockets.

python benchmarks/console.py --sessions 20 --seconds 20 --pictures 4

Server and browsers are processes of their own; the server is bound to one core where the system allows it. Printed are
the processor time of a session, the time between two frames at a browser, and the time from a command to the frame that
acknowledges it.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import multiprocessing
import os
import random
import resource
import time
from multiprocessing.connection import Connection as Pipe
from typing import Any

import numpy as np

TOWN = "brookside"


def serve(sessions: int, pipe: Pipe) -> None:
    """Serves sessions with a human Co-Wizard, and answers each message of the pipe with the processor time [s]."""
    import threading

    import uvicorn

    from dorothie_gym.lab.console.config import ConsoleConfig
    from dorothie_gym.lab.console.room import Room
    from dorothie_gym.lab.console.seating import parse_roles
    from dorothie_gym.lab.console.server import Console
    from dorothie_gym.session.session_engine import SessionEngine

    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    config, plans = (
        ConsoleConfig(max_seconds=3600.0),
        parse_roles("participant=scripted,co_wizard=human,ad_wizard=scripted"),
    )
    rooms = [Room(SessionEngine(TOWN, config=config.environment()), plans, config, seed=k) for k in range(sessions)]
    server = uvicorn.Server(
        uvicorn.Config(
            Console(rooms).app(), port=0, log_level="warning", ws="websockets-sansio", ws_per_message_deflate=False
        )
    )
    thread = threading.Thread(target=server.run, daemon=True)
    thread.start()
    while not server.started:
        time.sleep(0.05)
    pipe.send((server.servers[0].sockets[0].getsockname()[1], [room.seats["co_wizard"].token for room in rooms]))
    while pipe.recv() == "cost":
        used = resource.getrusage(resource.RUSAGE_SELF)
        pipe.send((used.ru_utime + used.ru_stime, used.ru_maxrss / 1024))
    server.should_exit = True
    thread.join(10.0)


class Browser:
    """Simulated Co-Wizard: drives every two seconds, and notes when frames and acknowledgements arrive."""

    def __init__(self, address: str, token: str, rate: int) -> None:
        self.address, self.token, self.rate = address, token, rate
        self.gaps: list[float] = []
        self.delays: list[float] = []
        self.waiting: dict[int, float] = {}
        self.bytes = self.pictures = 0
        self.measuring = False

    async def run(self, until: float) -> None:
        """Drives until a time on the monotonic clock [s]."""
        import websockets

        async with websockets.connect(self.address, compression=None, max_size=2**22, open_timeout=60) as socket:
            await socket.send(json.dumps({"k": "join", "token": self.token}))
            if self.rate:
                await socket.send(json.dumps({"k": "view", "rate": self.rate}))
            clicking = asyncio.create_task(self.click(socket))
            last = 0.0
            while time.monotonic() < until:
                content = await asyncio.wait_for(socket.recv(), 60.0)
                now = time.monotonic()
                if isinstance(content, bytes):
                    self.pictures += self.measuring
                    continue
                message: dict[str, Any] = json.loads(content)
                if message["k"] != "frame":
                    continue
                if self.measuring and last:
                    self.gaps.append(now - last)
                    self.bytes += len(content)
                last = now
                for n in [n for n in self.waiting if n <= message.get("done", 0)]:
                    self.delays.append(now - self.waiting.pop(n))
            clicking.cancel()

    async def click(self, socket: Any) -> None:
        """Changes the speed every two seconds, at any moment between two frames."""
        number = 0
        while True:
            await asyncio.sleep(1.0 + 2.0 * random.random())
            number += 1
            if self.measuring:
                self.waiting[number] = time.monotonic()
            await socket.send(json.dumps({"k": "drive", "n": number, "action": "SpeedChange", "up": bool(number % 2)}))


def percentile(values: list[float], share: float) -> float:
    """Returns a percentile in milliseconds."""
    return round(1000.0 * float(np.quantile(values, share)), 1)


async def measure(port: int, tokens: list[str], seconds: float, pictures: int, pipe: Pipe) -> dict[str, object]:
    """Returns the figures of some seconds."""
    warm = 6.0
    address = f"ws://127.0.0.1:{port}/ws"
    browsers = [Browser(address, token, 10 if k < pictures else 0) for k, token in enumerate(tokens)]
    tasks = [asyncio.create_task(each.run(time.monotonic() + warm + seconds)) for each in browsers]
    await asyncio.sleep(warm)
    pipe.send("cost")
    before, _ = pipe.recv()
    for each in browsers:
        each.measuring = True
    await asyncio.sleep(seconds - 0.5)
    pipe.send("cost")
    after, memory = pipe.recv()
    await asyncio.gather(*tasks)
    gaps = [gap for each in browsers for gap in each.gaps]
    delays = [delay for each in browsers for delay in each.delays]
    return {
        "sessions": len(tokens),
        "with pictures": pictures,
        "processor, % of a core per session": round(100.0 * (after - before) / (seconds - 0.5) / len(tokens), 2),
        "gap p50/p95/p99 [ms]": [percentile(gaps, share) for share in (0.5, 0.95, 0.99)],
        "click to acknowledged p50/p95 [ms]": [percentile(delays, share) for share in (0.5, 0.95)],
        "bytes a frame": round(sum(each.bytes for each in browsers) / max(len(gaps), 1)),
        "pictures a second": round(sum(each.pictures for each in browsers) / seconds / max(pictures, 1), 1),
        "memory [MiB]": round(memory),
    }


def main() -> None:
    """Measures a server with simulated people and prints the figures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sessions", type=int, default=20)
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--pictures", type=int, default=0, help="sessions with pictures through the windscreen")
    parser.add_argument("--json", action="store_true", help="print JSON")
    given = parser.parse_args()
    here, there = multiprocessing.Pipe()
    context = multiprocessing.get_context("spawn")
    server = context.Process(target=serve, args=(given.sessions, there))
    server.start()
    try:
        port, tokens = here.recv()
        figures = asyncio.run(measure(port, tokens, given.seconds, given.pictures, here))
        here.send("stop")
        server.join(20)
    finally:
        server.kill()
    if given.json:
        print(json.dumps(figures))
    else:
        print("\n".join(f"{name}: {value}" for name, value in figures.items()))


if __name__ == "__main__":
    main()
