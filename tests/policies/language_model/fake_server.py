"""Endpoint on the loopback interface: answers by a program that reads prompts, and misbehaves on request."""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Callable, Iterator, Mapping, MutableSequence
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

from tests.policies.language_model.prompt_reader import answer_of

Answerer = Callable[[Mapping[str, Any]], Mapping[str, str]]


class FakeServer(ThreadingHTTPServer):
    """Server whose `fault` names what it does wrong; `fault_calls` limits that to the first requests."""

    daemon_threads = True
    block_on_close = False

    def __init__(self, answerer: Answerer = answer_of, port: int = 0) -> None:
        super().__init__(("127.0.0.1", port), _Handler)
        self.answerer = answerer
        self.fault, self.fault_calls = "", 10**9
        self.refuses: tuple[str, ...] = ()  # parameters of requests that it does not take
        self.words = "Unsupported parameter: '{name}' is not supported with this model."
        self.requests: MutableSequence[dict[str, Any]] = []
        self.headers: MutableSequence[dict[str, str]] = []
        self.over = threading.Event()
        self.lock = threading.Lock()

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self.server_port}/v1"

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Keeps quiet about clients that have hung up."""


class _Handler(BaseHTTPRequestHandler):
    server: FakeServer

    def do_POST(self) -> None:
        request = json.loads(self.rfile.read(int(self.headers["Content-Length"])))
        with self.server.lock:
            self.server.requests.append(request)
            self.server.headers.append(dict(self.headers))
            number = len(self.server.requests)
        for name in self.server.refuses:
            if name in request:
                self._refuse(name)
                return
        fault = self.server.fault if number <= self.server.fault_calls else ""
        getattr(self, f"_{fault.replace(' ', '_') or 'fine'}")(request)

    def _send(self, body: bytes, status: int = 200, kind: str = "application/json", **headers: str) -> None:
        self.send_response(status)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(body)))
        for name, value in headers.items():
            self.send_header(name.replace("_", "-"), value)
        self.end_headers()
        self.wfile.write(body)

    def _complete(self, text: str | None, ended: str = "stop", refusal: str | None = None, **fields: Any) -> None:
        answer = {"role": "assistant", "content": text, "refusal": refusal}
        page = {
            "id": "x",
            "object": "chat.completion",
            "created": 1,
            "model": self.server.requests[-1]["model"],
            "usage": {"prompt_tokens": 100, "completion_tokens": 7, "total_tokens": 107},
            "choices": [{"index": 0, "message": answer, "finish_reason": ended}],
            **fields,
        }
        self._send(json.dumps(page).encode())

    def _fine(self, request: Mapping[str, Any]) -> None:
        self._complete(json.dumps(self.server.answerer(request)))

    def _fences(self, request: Mapping[str, Any]) -> None:
        self._complete(f"```json\n{json.dumps(self.server.answerer(request))}\n```")

    def _refuse(self, name: str) -> None:
        message = self.server.words.format(name=name)
        self._send(json.dumps({"error": {"message": message, "type": "invalid_request_error"}}).encode(), 400)

    def _unknown_model(self, request: Mapping[str, Any]) -> None:
        self._send(b'{"error": {"message": "The model `m` does not exist", "code": "model_not_found"}}', 404)

    def _streams_only(self, request: Mapping[str, Any]) -> None:
        if not request.get("stream"):
            self._send(b'{"error": {"message": "Only streaming is supported: set stream to true"}}', 400)
            return
        self._streams(request)

    def _streams(self, request: Mapping[str, Any]) -> None:
        text = json.dumps(self.server.answerer(request))
        parts = [{"choices": [{"delta": {"content": letter}}]} for letter in text]
        parts.append({"choices": [{"delta": {}, "finish_reason": "stop"}]})
        parts.append({"choices": [], "usage": {"prompt_tokens": 100, "completion_tokens": 7}})
        lines = [f"data: {json.dumps(part)}\n\n" for part in parts]
        self._send("".join([": hello\n\n", *lines, "data: [DONE]\n\n"]).encode(), kind="text/event-stream")

    def _cached(self, request: Mapping[str, Any]) -> None:
        usage = {"prompt_tokens": 100, "completion_tokens": 7, "prompt_tokens_details": {"cached_tokens": 64}}
        self._complete(json.dumps(self.server.answerer(request)), usage=usage)

    def _other_usage(self, request: Mapping[str, Any]) -> None:
        self._complete(json.dumps(self.server.answerer(request)), usage={"total_tokens": None, "prompt_tokens": "many"})

    def _no_usage(self, request: Mapping[str, Any]) -> None:
        self._complete(json.dumps(self.server.answerer(request)), usage=None)

    def _other_model(self, request: Mapping[str, Any]) -> None:
        self._complete(json.dumps(self.server.answerer(request)), model="m-2026-11")

    def _rate_limit(self, request: Mapping[str, Any]) -> None:
        self._send(b'{"error": {"message": "slow down"}}', 429, Retry_After="0.05")

    def _long_rate_limit(self, request: Mapping[str, Any]) -> None:
        self._send(b"", 429, Retry_After="3600")

    def _error(self, request: Mapping[str, Any]) -> None:
        self._send(b"oops", 500)

    def _wrong_key(self, request: Mapping[str, Any]) -> None:
        self._send(f"wrong key: {self.headers['Authorization']}".encode(), 401)

    def _hang(self, request: Mapping[str, Any]) -> None:
        self.server.over.wait(60)

    def _trickle(self, request: Mapping[str, Any]) -> None:
        self.send_response(200)
        self.send_header("Content-Length", "100000")
        self.end_headers()
        while not self.server.over.wait(0.02):
            self.wfile.write(b" ")
            self.wfile.flush()

    def _html(self, request: Mapping[str, Any]) -> None:
        self._send(b"<html>gateway</html>", kind="text/html")

    def _other_json(self, request: Mapping[str, Any]) -> None:
        self._send(b'{"choices": [{"message": 3}]}')

    def _broken_gzip(self, request: Mapping[str, Any]) -> None:
        self._send(b"no gzip", Content_Encoding="gzip")

    def _hang_up(self, request: Mapping[str, Any]) -> None:
        self.close_connection = True
        self.connection.close()

    def _redirect(self, request: Mapping[str, Any]) -> None:
        self._send(b"", 302, Location="http://127.0.0.1:9/")

    def _cut(self, request: Mapping[str, Any]) -> None:
        self._complete('{"drive": "JTu', "length")

    def _half_json(self, request: Mapping[str, Any]) -> None:
        self._complete('{"drive": "JTu')

    def _prose(self, request: Mapping[str, Any]) -> None:
        self._complete("I would turn left here.")

    def _refusal(self, request: Mapping[str, Any]) -> None:
        self._complete(None, refusal="I cannot help with that.")

    def _wrong_field(self, request: Mapping[str, Any]) -> None:
        self._complete('{"action": "Stop", "angle": 0}')

    def _impossible(self, request: Mapping[str, Any]) -> None:
        self._complete('{"drive": "Fly"}')

    def _slow(self, request: Mapping[str, Any]) -> None:
        time.sleep(0.15)
        self._fine(request)

    def log_message(self, *_: object) -> None:
        pass


@contextmanager
def serving(answerer: Answerer = answer_of) -> Iterator[FakeServer]:
    server = FakeServer(answerer)
    thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.02})
    thread.start()
    try:
        yield server
    finally:
        server.over.set()
        server.shutdown()
        thread.join()
        server.server_close()
