"""Sessions over OpenEnv: a real server, its client, and the rule program as the model.

They need an environment of their own: `pip install '.[openenv]' pytest pytest-timeout hypothesis`, then
`python -m pytest -m integrations tests/agents/test_openenv.py`.
"""

from __future__ import annotations

import asyncio
import json
import math
import os
import signal
import socket
import statistics
import subprocess
import sys
import time
import urllib.request
from collections.abc import Iterator
from importlib.resources import files
from pathlib import Path

import pytest

from dorothie_gym.agents import TextSession
from tests.agents.players import play, reader_of

openenv = pytest.importorskip("openenv", reason="needs an environment with the extra 'openenv'")
pytestmark = pytest.mark.integrations

SEEDS = range(9100, 9110)


@pytest.fixture(scope="module")
def url() -> Iterator[str]:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    command = [sys.executable, "-m", "dorothie_gym", "serve", "openenv", "--port", str(port)]
    server = subprocess.Popen(command)
    address = f"http://127.0.0.1:{port}"
    try:
        deadline = time.monotonic() + 270
        while True:
            try:
                urllib.request.urlopen(f"{address}/health", timeout=1)
                break
            except OSError:
                assert server.poll() is None and time.monotonic() < deadline
                time.sleep(0.2)
        yield address
    finally:
        server.terminate()
        server.wait(60)


async def rolled_out(url: str, seed: int, times: list[float] | None = None, steps: int = 1000) -> dict[str, float]:
    """Plays a session over the server, up to a number of steps; returns its outcome, with the sum of the rewards."""
    from dorothie_gym.agents.openenv.client import DorothieClient
    from dorothie_gym.agents.openenv.models import TextAction

    reader = reader_of("co_wizard")
    async with DorothieClient(base_url=url) as env:
        result = await env.reset(seed=seed, town="brookside")
        gained = result.reward or 0.0
        assert result.observation.system.startswith("You are the Co-Wizard")
        while not result.done and steps > 0:
            steps -= 1
            begun = time.perf_counter()
            result = await env.step(TextAction(value=json.dumps(reader(result.observation.page))))
            assert result.reward is not None and math.isfinite(result.reward)
            if times is not None:
                times.append(time.perf_counter() - begun)
            gained += result.reward or 0.0
        return {**result.observation.outcome, "gained": gained}


def test_session_over_the_server_is_that_of_the_text_session(url: str) -> None:
    session = TextSession("co_wizard", "brookside")
    expected = play(session, reader_of("co_wizard"), 3)
    found = asyncio.run(rolled_out(url, 3))
    assert found.pop("gained") == pytest.approx(expected.score, abs=1e-4)
    assert found == expected.numbers()


def test_ten_sessions_succeed_with_the_rule_program(url: str) -> None:
    async def all_of_them() -> list[dict[str, float]]:
        return [await rolled_out(url, seed) for seed in SEEDS]

    outcomes = asyncio.run(all_of_them())
    assert sum(outcome["success"] for outcome in outcomes) >= 9


def test_sixteen_sessions_at_once(url: str) -> None:
    times: list[float] = []

    async def all_at_once() -> list[dict[str, float]]:
        return await asyncio.gather(*(rolled_out(url, 9200 + k, times, 20) for k in range(16)))

    begun = time.perf_counter()
    outcomes = asyncio.run(all_at_once())
    wall = time.perf_counter() - begun
    times.sort()
    print(f"{len(times)} steps in {wall:.1f} s; median {1e3 * statistics.median(times):.0f} ms, "
          f"p99 {1e3 * times[int(0.99 * len(times))]:.0f} ms")  # fmt: skip
    assert len(times) == 16 * 20 and all(0.0 <= outcome["gained"] < 1.0 for outcome in outcomes)


def test_faults_from_outside_are_words_and_disturb_nobody(url: str) -> None:
    from dorothie_gym.agents.openenv.client import DorothieClient
    from dorothie_gym.agents.openenv.models import TextAction

    async def misbehave() -> None:
        async with DorothieClient(base_url=url) as env:
            with pytest.raises(Exception, match=r"call reset\(\) first"):
                await env.step(TextAction(value="{}"))
        async with DorothieClient(base_url=url) as env:
            with pytest.raises(Exception, match="no argument speed"):
                await env.reset(seed=1, speed=3)
        async with DorothieClient(base_url=url) as env:
            await env.reset(seed=1)
            for value in ("", "no json", '{"drive": NaN}', "x" * 10**6, '{"drive": "Fly"}'):
                result = await env.step(TextAction(value=value))
                assert result.observation.error and not result.done and result.reward == 0.0
            result = await env.step(TextAction(tool="wait", value="nan"))
            assert "number of seconds" in result.observation.error
            result = await env.step(TextAction(tool="fly"))
            assert "there is no tool" in result.observation.error
            assert not (await env.step(TextAction(tool="wait", value="5"))).observation.error
            assert (await env.state()).step_count == 8

    async def vanish(number: int) -> None:
        env = DorothieClient(base_url=url)
        await env.connect()
        await env.reset(seed=number)
        await env.disconnect()

    async def everything() -> dict[str, float]:
        other = asyncio.create_task(rolled_out(url, 4))
        await misbehave()
        for number in range(64):
            await vanish(number)
        return await other

    assert asyncio.run(everything())["score"] > 0.5


def test_timeout_of_a_client_amid_a_step_ends_its_session_in_words_and_no_other(url: str) -> None:
    from dorothie_gym.agents.openenv.client import DorothieClient
    from dorothie_gym.agents.openenv.models import TextAction

    async def impatient() -> None:
        async with DorothieClient(base_url=url) as other:
            before = await other.reset(seed=2)
            async with DorothieClient(base_url=url) as env:
                await env.reset(seed=1)
                env._message_timeout = 0.001
                with pytest.raises(TimeoutError):
                    await env.step(TextAction(value='{"again": "30"}'))
                env._message_timeout = 60.0
                with pytest.raises(Exception, match=r"call reset\(\) first, also after a lost connection"):
                    await env.step(TextAction(value="{}"))
                assert not (await env.reset(seed=1)).done  # the connection is a new one, and goes on
            after = await other.step(TextAction(tool="look"))
            assert after.observation.page == before.observation.page

    asyncio.run(impatient())


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"role": "driver"}, "role is 'driver'; it must be one of participant"),
        ({"role": ["driver"]}, "role is"),
        ({"pages": 3}, "pages is 3; it must be one of full, changes"),
        ({"town": "atlantis"}, "town is 'atlantis'; the towns are .* and generated:SEED"),
        ({"town": "/etc/passwd"}, "town is '/etc/passwd'; the towns are"),
        ({"town": str(files("dorothie_gym.maps") / "data" / "brookside.yaml")}, "town is .*; the towns are"),
        ({"town": None}, "town is None"),
        ({"seed": -1}, "seed is -1"),
        ({"seed": "7"}, "seed is '7'"),
    ],
)
def test_wrong_arguments_of_a_reset_are_words(url: str, arguments: dict[str, object], words: str) -> None:
    from dorothie_gym.agents.openenv.client import DorothieClient

    async def reset() -> None:
        async with DorothieClient(base_url=url) as env:
            with pytest.raises(Exception, match=words):
                await env.reset(**arguments)
            assert not (await env.reset(seed=1)).done  # the connection goes on

    asyncio.run(reset())


def test_refused_reset_leaves_the_session_as_it_was(url: str) -> None:
    from dorothie_gym.agents.openenv.client import DorothieClient
    from dorothie_gym.agents.openenv.models import TextAction

    async def refused() -> None:
        async with DorothieClient(base_url=url) as env:
            await env.reset(seed=1, episode_id="one")
            before = (await env.step(TextAction(tool="wait", value="5"))).observation.time
            with pytest.raises(Exception, match="VALIDATION_ERROR"):
                await env.reset(seed=2, episode_id={"number": 2})
            state, after = await env.state(), await env.step(TextAction(tool="look"))
            assert (state.episode_id, state.step_count) == ("one", 1)
            assert after.observation.time == before > 0.0

    asyncio.run(refused())


def test_port_in_use_is_named(url: str) -> None:
    command = [sys.executable, "-m", "dorothie_gym", "serve", "openenv", "--port", url.rpartition(":")[2]]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 2 and "cannot be used (Address already in use); give another --port" in done.stderr


def test_interruption_ends_the_server_amid_a_session() -> None:
    from dorothie_gym.agents.openenv.client import DorothieClient
    from dorothie_gym.agents.openenv.models import TextAction

    command = [sys.executable, "-m", "dorothie_gym", "serve", "openenv", "--port", "0"]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as server:
        try:
            assert server.stderr is not None
            address = server.stderr.readline().strip()

            async def played() -> None:
                async with DorothieClient(base_url=address) as env:
                    await env.reset(seed=1)
                    waiting = asyncio.create_task(env.step(TextAction(value='{"again": "30"}')))
                    await asyncio.sleep(0.01)
                    server.send_signal(signal.SIGINT)
                    await asyncio.wait([waiting])  # answered, or cut off

            asyncio.run(played())
            assert server.wait(20) == 130
            assert server.stderr.read().splitlines()[-1] == "Interrupted."
        finally:
            server.kill()


def test_server_and_manifest_are_valid(url: str) -> None:
    command = Path(sys.executable).with_name("openenv")
    plain = {**os.environ, "NO_COLOR": "1"}
    served = subprocess.run([command, "validate", "--url", url], capture_output=True, text=True, env=plain)
    assert served.returncode == 0, served.stdout + served.stderr
