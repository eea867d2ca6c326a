"""Gate of the servers: who may ask, how much and how often, and how errors are answered."""

from __future__ import annotations

from typing import Any

import msgspec
import pytest

pytest.importorskip("uvicorn", reason="needs the extra console")
pytest.importorskip("httpx", reason="needs httpx, the client of starlette's tests")

from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route
from starlette.testclient import TestClient

from dorothie_gym.lab.gate import (
    MAX_BODY,
    RETRY_SECONDS,
    Caller,
    Gate,
    RequestError,
    Wording,
    bearer_token,
    gzipped_json,
    json_answer,
    receive_body,
)
from dorothie_gym.lab.web import application

WORDING = Wording(field="why", foreign="foreign", hasty="hasty", large="large", malformed="malformed: {}")
HOST = "http://127.0.0.1"


class Row(msgspec.Struct):
    """Body that is expected."""

    number: int


class Lodge:
    """Server whose callers are named by their secrets; strangers share what is left."""

    def __init__(self, *, json_only: bool = False) -> None:
        self.gate = Gate(self._identify, self._explain, WORDING, json_only=json_only)
        self.error: BaseException | None = None
        routes = [self.gate.route("/row", self._row), self.gate.route("/look", self._look, "GET")]
        self.client = TestClient(application(routes), base_url=HOST, raise_server_exceptions=False)

    def _identify(self, request: Request) -> Caller:
        name = bearer_token(request)
        if name == "refused":
            raise RequestError(401, "go away")
        return Caller(key=name, budget=(3.0, 0.0), known=bool(name))

    def _explain(self, error: BaseException) -> RequestError | None:
        return RequestError(409, str(error)) if isinstance(error, LookupError) else None

    async def _row(self, request: Request) -> Response:
        return json_answer({"number": self.gate.read(request, Row).number})

    async def _look(self, request: Request) -> Response:
        if self.error is not None:
            raise self.error
        return gzipped_json(b"x")

    def post(self, content: bytes, **headers: str) -> tuple[int, Any]:
        answer = self.client.post("/row", content=content, headers=headers)
        return answer.status_code, answer.json()


def test_a_body_is_read_by_its_type() -> None:
    lodge = Lodge()
    answer = lodge.client.post("/row", content=b'{"number": 3}')
    assert answer.json() == {"number": 3} and answer.headers["Cache-Control"] == "no-store"
    assert lodge.post(b'{"number": "3"}') == (400, {"why": "malformed: Expected `int`, got `str` - at `$.number`"})
    for content in (b"", b"{", b"\xff", b"[" * 100_000):
        assert Lodge().post(content)[0] == 400


def test_a_body_has_at_most_its_limit() -> None:
    most = b'{"number": 3}'.ljust(MAX_BODY)
    assert Lodge().post(most)[0] == 200
    assert Lodge().post(most + b" ") == (413, {"why": "large"})


def test_bodies_of_forms_are_refused_where_browsers_show_who_one_is() -> None:
    lodge = Lodge(json_only=True)
    for kind in ("", "text/plain", "multipart/form-data; boundary=application/json"):
        assert lodge.post(b'{"number": 3}', **{"Content-Type": kind})[0] == 415
    assert lodge.post(b'{"number": 3}', **{"Content-Type": "application/JSON; charset=utf-8"})[0] == 200


def test_requests_of_other_pages_and_refused_callers_do_not_count() -> None:
    lodge = Lodge()
    for _ in range(5):
        assert lodge.post(b"", Origin="http://example.org") == (403, {"why": "foreign"})
        assert lodge.post(b"", Authorization="Bearer refused") == (401, {"why": "go away"})
    assert lodge.post(b'{"number": 3}', Origin=HOST)[0] == 200
    assert set(lodge.gate.budgets) == {""}


def test_each_caller_has_a_budget_of_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    lodge = Lodge()
    look = lodge.client.get
    for name in ("ann", "ben"):
        answers = [look("/look", headers={"Authorization": f"bearer {name} "}) for _ in range(4)]
        assert [each.status_code for each in answers] == [200, 200, 200, 429]
        assert answers[-1].json() == {"why": "hasty"} and answers[-1].headers["Retry-After"] == str(RETRY_SECONDS)
    monkeypatch.setattr("dorothie_gym.lab.gate.MOST_CALLERS", 2)
    assert look("/look").status_code == 200
    assert list(lodge.gate.budgets) == ["ben", ""], "who has not asked for longest is forgotten"


def test_errors_are_explained_and_faults_of_the_program_are_not_hidden() -> None:
    lodge = Lodge()
    lodge.error = KeyError("no such place")
    answer = lodge.client.get("/look")
    assert answer.status_code == 409 and answer.json() == {"why": "'no such place'"}
    lodge.error = ArithmeticError()
    assert lodge.client.get("/look").status_code == 500
    assert "default-src 'none'" in answer.headers["Content-Security-Policy"]


def test_a_refusal_without_a_gate_is_plain_text() -> None:
    async def take(request: Request) -> Response:
        return Response(await receive_body(request, 2, "at most two bytes"))

    client = TestClient(application([Route("/", take, methods=["POST"])]), base_url=HOST)
    assert client.post("/", content=b"ab").content == b"ab"
    refused = client.post("/", content=b"abc")
    assert (refused.status_code, refused.text) == (413, "at most two bytes")
