"""Requests that a study refuses: strangers, other pages, malformed and large bodies, floods, and steps out of order."""

from __future__ import annotations

import contextlib
import json
import random
import socket
from collections.abc import Iterator
from pathlib import Path

import pytest

pytest.importorskip("uvicorn", reason="needs the extra console")

from dorothie_gym.lab.gate import MAX_BODY
from dorothie_gym.lab.studies.server import REQUESTS
from tests.fuzzing import COUNTS, GROWTH, check_raw_requests, malformed, memory, needs_memory
from tests.lab.console.malformed_messages import SOUND, STRICT, refusals
from tests.lab.studies.content import SOLO, write_study
from tests.lab.studies.serving import Client, ServedStudy

JSON = {"Content-Type": "application/json"}
ACTIONS = "join", "news", "consent", "answers", "proceed", "wait", "withdraw"
EXPERIMENTERS = "experimenter/enter", "experimenter/overview"


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ServedStudy]:
    folder = tmp_path_factory.mktemp("study")
    with ServedStudy(write_study(folder, SOLO), folder / "data") as running:
        yield running


@pytest.fixture
def person(served: ServedStudy, monkeypatch: pytest.MonkeyPatch) -> Client:
    monkeypatch.setattr("dorothie_gym.lab.studies.server.ENTRIES", (1e6, 1e6))
    assert served.study is not None
    served.study.gate.budgets.clear()
    made = Client(served.port)
    made.do("join")
    return made


def test_strangers_and_wrong_cookies_learn_nothing(served: ServedStudy, person: Client) -> None:
    for cookie in (
        "",
        f"dorothie_study_{served.port}=",
        f"dorothie_study_{served.port}=nonsense",
        f"dorothie_study={person.cookie.partition('=')[2]}",
        f"other={person.cookie}",
        f"dorothie_study_{served.port}=\xff\xfe",
    ):
        stranger = Client(served.port)
        stranger.cookie = cookie
        for action in ("news", "withdraw"):
            assert stranger.post(action, {"sure": True} if action == "withdraw" else None) == 401
            assert set(stranger.answer) == {"error"}


def test_pages_of_other_hosts_are_refused(served: ServedStudy, person: Client) -> None:
    for origin in ("https://example.org", "null", "http://[", f"http://127.0.0.1:{served.port + 1}"):
        person.headers = {"Origin": origin}
        assert person.post("news") == 403
    person.headers = {"Origin": served.address}
    assert person.post("news") == 200


def test_steps_out_of_order_are_refused(person: Client) -> None:
    for action, body in (
        ("answers", {"stage": "before", "answers": {"age": 30}}),
        ("proceed", {"stage": "session"}),
        ("proceed", {"stage": "consent"}),
        ("wait", {"on": False}),
        ("consent", {"agreed": [True]}),
        ("consent", {"agreed": [True, False]}),
        ("withdraw", {"sure": False}),
    ):
        assert person.post(action, body) == 409, action
    person.do("consent", {"agreed": [True, True]})
    for answers in ({}, {"age": 5}, {"age": "30"}, {"age": 30, "other": 1}):
        assert person.post("answers", {"stage": "before", "answers": answers}) == 409
    assert person.post("answers", {"stage": "after", "answers": {"trust": 1}}) == 409
    person.do("answers", {"stage": "before", "answers": {"age": 30}})
    assert person.post("answers", {"stage": "before", "answers": {"age": 31}}) == 409, "sent twice"


def test_large_bodies_are_not_read(served: ServedStudy, person: Client) -> None:
    status, _, _ = person.send("POST", "/study/answers", b"a" * (MAX_BODY + 1), JSON)
    assert status == 413
    with socket.create_connection(("127.0.0.1", served.port), timeout=10) as raw:  # a body without an end
        raw.sendall(b"POST /study/join HTTP/1.1\r\nHost: x\r\nContent-Type: application/json\r\n")
        raw.sendall(b"Transfer-Encoding: chunked\r\n\r\n")
        chunk = b"10000\r\n" + b"a" * 65536 + b"\r\n"
        try:
            for _ in range(200):
                raw.sendall(chunk)
        except OSError:
            return
        assert b"413" in raw.recv(100)


def test_other_types_and_methods_are_refused(served: ServedStudy, person: Client) -> None:
    for kind in ("text/plain", "application/x-www-form-urlencoded", ""):
        assert person.send("POST", "/study/news", b"{}", {"Content-Type": kind})[0] == 415
    for action in ACTIONS:
        assert person.send("GET", f"/study/{action}")[0] == 405
    for path in (
        "/studies/../server.py",
        "/studies/%2e%2e/server.py",
        "/studies//etc/passwd",
        "/study/",
    ):
        assert person.send("GET", path)[0] == 404
    assert person.send("GET", "/study.sqlite")[0] == 404


def test_answers_forbid_foreign_content_and_are_not_stored(person: Client) -> None:
    status, headers, _ = person.send("GET", "/?PROLIFIC_PID=x")
    assert status == 200 and "script-src 'self'" in headers["Content-Security-Policy"]
    assert headers["Referrer-Policy"] == "no-referrer"
    _, headers, _ = person.send("POST", "/study/news", b"{}", JSON)
    assert headers["Cache-Control"] == "no-store"
    joined = Client(person.port)
    _, headers, _ = joined.send("POST", "/study/join", b"{}", JSON)
    assert {"HttpOnly", "SameSite=strict"} <= set(headers["Set-Cookie"].split("; "))


def test_two_studies_on_one_machine_do_not_take_each_others_cookies(tmp_path: Path) -> None:
    with (
        ServedStudy(write_study(tmp_path, SOLO), tmp_path / "one") as one,
        ServedStudy(write_study(tmp_path, SOLO), tmp_path / "two") as two,
    ):
        people = Client(one.port), Client(two.port)
        for person in people:
            person.do("join")
        names = {person.cookie.partition("=")[0] for person in people}
        assert names == {f"dorothie_study_{one.port}", f"dorothie_study_{two.port}"}
        both = "; ".join(person.cookie for person in people)  # browsers send the cookies of all ports
        for person in people:
            person.cookie = both
            person.do("news")


def test_pages_of_a_foreign_name_that_points_to_the_server_may_not_join(served: ServedStudy) -> None:
    for host, status in ((f"rebound.example.com:{served.port}", 403), (f"127.0.0.1:{served.port}", 200)):
        stranger = Client(served.port)
        headers = {**JSON, "Host": host, "Origin": f"http://{host}"}
        assert stranger.send("POST", "/study/join", b"{}", headers)[0] == status


def test_forwarded_addresses_are_believed_from_configured_proxies_only(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for proxy, believed in (("", False), ("127.0.0.1", True)):
        monkeypatch.setenv("FORWARDED_ALLOW_IPS", proxy)
        with ServedStudy(write_study(tmp_path, SOLO), tmp_path / f"data{proxy}") as served:
            for forwarded in ("203.0.113.5", "2001:db8::1", "2001:db8::2", "x" * 5000):
                person = Client(served.port)
                person.headers = {"X-Forwarded-For": forwarded}
                person.do("join")
            assert served.study is not None
            addresses = {"203.0.113.5", "2001:db8::/64", ""} if believed else {"127.0.0.1"}
            assert set(served.study.gate.budgets) == addresses


def test_floods_are_refused(served: ServedStudy, person: Client, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("dorothie_gym.lab.studies.server.REQUESTS", (REQUESTS[0], 0.0))  # also on a slow machine
    person.do("consent", {"agreed": [True, True]})
    statuses = [person.post("consent", {"agreed": None}) for _ in range(int(REQUESTS[0]) + 20)]
    assert statuses[0] == 409 and statuses[-1] == 429


def test_entries_of_one_address_are_limited(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("dorothie_gym.lab.studies.server.ENTRIES", (20, 0.0))
    with ServedStudy(write_study(tmp_path, SOLO), tmp_path / "data") as served:
        assert [Client(served.port).post("join") for _ in range(25)] == [200] * 20 + [429] * 5


def test_requests_that_never_end_do_not_count_for_others_at_their_address(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("dorothie_gym.lab.studies.server.ENTRIES", (5, 0.0))
    head = b"POST /study/join HTTP/1.1\r\nHost: x\r\nContent-Type: application/json\r\nContent-Length: 9\r\n\r\n{"
    with ServedStudy(write_study(tmp_path, SOLO), tmp_path / "data") as served, contextlib.ExitStack() as stack:
        for _ in range(20):
            stack.enter_context(socket.create_connection(("127.0.0.1", served.port))).sendall(head)
        for _ in range(5):
            Client(served.port).do("join")
        assert Client(served.port).post("join") == 429


VALUES = [None, True, 0, -1, 2**70, 1.5, "", "a" * 5000, "\x00", "../..", [], {}, [[]] * 40, {"a": {"a": {}}}]
NAMES = ["parameters", "invitation", "token", "have", "agreed", "stage", "answers", "on", "sure", "x", ""]


def body(drawn: random.Random) -> bytes:
    """Returns a body: malformed, or of random fields."""
    kind = drawn.random()
    if kind < 0.2:
        return drawn.randbytes(drawn.randrange(200))
    if kind < 0.3:
        return b"[" * drawn.randrange(1, 20_000)
    fields = {drawn.choice(NAMES): drawn.choice([*VALUES, "session", "before"]) for _ in range(drawn.randrange(4))}
    text = json.dumps(fields).encode()
    return text[: drawn.randrange(len(text))] if kind < 0.4 else text


@needs_memory()
@pytest.mark.parametrize(("seed", "count"), COUNTS)
def test_random_requests_are_refused_and_leave_no_traces(
    served: ServedStudy,
    person: Client,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
    request: pytest.FixtureRequest,
    seed: int,
    count: int,
) -> None:
    monkeypatch.setattr("dorothie_gym.lab.studies.server.REQUESTS", (1e6, 1e6))
    monkeypatch.setattr("dorothie_gym.lab.studies.server.NEWS_SECONDS", 0.0)
    assert served.study is not None
    served.study.gate.budgets.clear()
    drawn, before = random.Random(seed + request.config.getoption("--malformed-seed")), memory()
    known = person.view["id"]
    for _ in range(count):
        action, content = drawn.choice([*ACTIONS[1:], *EXPERIMENTERS]), body(drawn)
        if (action == "consent" and content == b'{"agreed": null}') or action == "withdraw":
            continue  # what a person may do
        status, _, _ = person.send("POST", f"/study/{action}", content, JSON)
        assert status in (200, 400, 409, 413, *([401] if action in EXPERIMENTERS else [])), (action, content[:200])
        assert status != 200 or action == "news", (action, content[:200])
    large = b'{"have": "' + b"a" * 2**20 + b'"}'
    for action in (*ACTIONS, *EXPERIMENTERS):
        for _ in range(5):
            assert person.send("POST", f"/study/{action}", large, JSON)[0] == 413
    person.tag = ""
    person.do("news")
    assert person.view["id"] == known and person.stage == "consent"
    check_raw_requests(served.port, drawn, count // 20)
    assert person.send("GET", "/")[0] == 200
    assert memory() - before < GROWTH
    assert not [record for record in caplog.records if record.levelname == "ERROR"], caplog.text


@needs_memory()
@pytest.mark.parametrize(("seed", "count"), COUNTS)
def test_malformed_messages_at_a_seat_of_the_study_are_refused(
    served: ServedStudy,
    person: Client,
    monkeypatch: pytest.MonkeyPatch,
    request: pytest.FixtureRequest,
    seed: int,
    count: int,
) -> None:
    monkeypatch.setattr("dorothie_gym.lab.console.connection.BURST", 1e9)
    drawn = random.Random(seed + request.config.getoption("--malformed-seed"))
    person.do("consent", {"agreed": [True, True]})
    person.do("answers", {"stage": "before", "answers": {"age": 30}})
    person.do("proceed", {"stage": "instructions"})
    person.follow(lambda: person.view.get("token"))
    before = memory()
    for _ in range(count // 40):
        with person.sit() as socket:
            for _ in range(40):
                socket.send(malformed(drawn, SOUND, STRICT).encode("utf-8", "surrogatepass").decode("utf-8", "replace"))
            refusals(socket, 40)
    assert memory() - before < GROWTH
    person.do("news")
    assert person.stage == "tutorial"
