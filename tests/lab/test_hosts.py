"""Names of the server: those of this machine, and addresses; pages of other names cannot use it."""

from __future__ import annotations

import socket
from collections.abc import Iterator
from http.client import HTTPConnection
from typing import Any

import pytest

pytest.importorskip("uvicorn", reason="needs the extra console")

from websockets.exceptions import InvalidStatus

from tests.lab.console.people import Table
from tests.lab.console.serving import Served

PAGE = {"Accept": "text/html,application/xhtml+xml"}


@pytest.fixture(scope="module")
def served() -> Iterator[Served]:
    with Served(Table("co_wizard=human").room, host_names=["Lab.Example.org"]) as running:
        yield running


def join(served: Served, host: str, scheme: str = "http") -> Any:
    """Joins as a page of a host; returns the first message, or the refusal."""
    headers = {"Host": f"{host}:{served.port}", "Origin": f"{scheme}://{host}:{served.port}"}
    connection = HTTPConnection("127.0.0.1", served.port, timeout=10)
    upgrade = {"Upgrade": "websocket", "Connection": "Upgrade", "Sec-WebSocket-Version": "13"}
    connection.request("GET", "/ws", headers=headers | upgrade | {"Sec-WebSocket-Key": "AAAAAAAAAAAAAAAAAAAAAA=="})
    answer = connection.getresponse()
    content = b"" if answer.status == 101 else answer.read()
    connection.close()
    return answer.status, content.decode()


def get(served: Served, headers: dict[str, str], path: str = "/seat") -> tuple[int, str]:
    connection = HTTPConnection("127.0.0.1", served.port, timeout=10)
    connection.request("GET", path, headers=headers)
    answer = connection.getresponse()
    content = answer.read().decode()
    connection.close()
    return answer.status, content


def test_names_of_this_machine_and_addresses_may_join(served: Served) -> None:
    for host in ("127.0.0.1", "localhost", "LOCALHOST", "[::1]", "192.168.1.20", "0.0.0.0", socket.gethostname()):
        assert join(served, host)[0] == 101, host
    assert join(served, "lab.example.org")[0] == 101, "the name that was given with --host"


def test_a_name_that_points_here_may_not_join_without_tls(served: Served) -> None:
    for host in ("rebound.example.com", "localhost.example.com", "127.0.0.1.example.com", f"x{socket.gethostname()}"):
        status, content = join(served, host)
        assert status == 403 and content.count("\n") == 1 and host in content and "proxy with TLS" in content
        assert join(served, host, "https")[0] == 101, "nobody has a certificate for the name of somebody else"


def test_pages_of_foreign_names_explain_the_refusal(served: Served) -> None:
    foreign = {"Host": "rebound.example.com"}
    status, content = get(served, PAGE | foreign)
    assert status == 403 and "rebound.example.com" in content
    assert get(served, PAGE | foreign | {"X-Forwarded-Proto": "https"})[0] == 200
    assert get(served, PAGE | foreign | {"Sec-Fetch-Site": "none"})[0] == 200, "browsers send it with TLS only"
    assert get(served, PAGE | {"Host": f"localhost:{served.port}"})[0] == 200
    assert get(served, foreign)[0] == 200, "a program"


def test_pages_of_other_hosts_are_refused_as_before(served: Served) -> None:
    with pytest.raises(InvalidStatus), served.connect(origin="https://example.org"):
        pass
