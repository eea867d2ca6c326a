"""Websockets that end before the application has answered their handshake."""

from __future__ import annotations

import asyncio
import base64
import logging
import os
import socket
import threading

import pytest

pytest.importorskip("uvicorn", reason="needs the extra console")

from starlette.routing import WebSocketRoute
from starlette.websockets import WebSocket

from dorothie_gym.lab.web import application
from tests.served_application import ServedApplication

CLOSE = b"\x88\x82\x00\x00\x00\x00\x03\xe8"
"""Frame with which a browser closes a websocket: code 1000, masked with zeros."""


def handshake(path: str) -> bytes:
    key = base64.b64encode(os.urandom(16)).decode()
    return (
        f"GET {path} HTTP/1.1\r\nHost: 127.0.0.1\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
        f"Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: {key}\r\n\r\n"
    ).encode()


def exchange(port: int, sent: bytes) -> bytes:
    """Returns what a connection receives until the server closes it."""
    with socket.create_connection(("127.0.0.1", port), timeout=10.0) as connection:
        connection.sendall(sent)
        received = b""
        while part := connection.recv(65536):
            received += part
    return received


@pytest.mark.parametrize("path", ["/none", "/slow", "/late"])
def test_a_browser_that_leaves_before_it_is_answered_leaves_no_error(
    path: str, caplog: pytest.LogCaptureFixture
) -> None:
    async def slow(websocket: WebSocket) -> None:
        await asyncio.sleep(0.2)
        await websocket.accept()
        await websocket.receive()

    async def late(websocket: WebSocket) -> None:
        await asyncio.sleep(0.2)
        await websocket.close()

    routes = [WebSocketRoute("/slow", slow), WebSocketRoute("/late", late)]
    with caplog.at_level(logging.WARNING), ServedApplication(application(routes)) as served:
        exchange(served.port, handshake(path) + CLOSE)
        assert b"403" in exchange(served.port, handshake("/none"))
    assert not caplog.records


def test_the_server_stops_while_a_handshake_is_answered(caplog: pytest.LogCaptureFixture) -> None:
    begun, answered = threading.Event(), threading.Event()

    async def slow(websocket: WebSocket) -> None:
        begun.set()
        await asyncio.sleep(0.5)
        answered.set()
        await websocket.close()

    received: list[bytes] = []
    with caplog.at_level(logging.WARNING):
        with ServedApplication(application([WebSocketRoute("/slow", slow)])) as served:
            visitor = threading.Thread(target=lambda: received.append(exchange(served.port, handshake("/slow"))))
            visitor.start()
            assert begun.wait(10.0)
        visitor.join(10.0)
    assert answered.is_set() and received == [b""]  # strangers are not waited for
    assert not caplog.records
