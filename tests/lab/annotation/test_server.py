"""The server over real sockets: marks, blindness, adjudication, refusals."""

from __future__ import annotations

import json
import random
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import quote

import pytest

pytest.importorskip("uvicorn", reason="needs the extra console")

from dorothie_gym.lab.annotation.log import ADJUDICATED, read_annotation
from dorothie_gym.lab.annotation.server import BUDGET
from dorothie_gym.lab.annotation.session_labels import recorded_annotation
from dorothie_gym.lab.annotation.vocabulary import MOVE_KEYS
from dorothie_gym.lab.annotation.workplace import Seat
from dorothie_gym.lab.gate import MAX_BODY
from dorothie_gym.ontology import DECISION_TREE, DialogueMove, walk
from tests.fuzzing import COUNTS, GROWTH, check_raw_requests, memory, needs_memory
from tests.lab.annotation.builders import FIRST, annotate, recorded
from tests.lab.annotation.serving import Served
from tests.session.recording.builders import write

INSTRUCT = {"words": 4, "move": "Instruct", "slots": {"Landmark": ["KFC"]}, "exchange": 0}


@pytest.fixture
def served(tmp_path: Path) -> Iterator[Served]:
    recorded(tmp_path / "corpus" / "one")
    write(tmp_path / "corpus" / "silent")
    with Served(tmp_path / "corpus") as running:
        yield running


def test_marks_are_written_before_they_are_acknowledged(served: Served) -> None:
    session, text = recorded(served.corpus.parent / "copy")
    assert served.ask("sessions/0/marks")["edit"] == 0
    answer = served.mark(0, 0, INSTRUCT)
    assert (answer["edit"], answer["undo"], answer["done"], answer["spans"]) == (1, "test", 1, 5)
    found = read_annotation(text, served.corpus / "one", "anna")
    assert found.utterances[FIRST][0].move is DialogueMove.INSTRUCT
    undone = served.ask("sessions/0/undo", {"base": 1})
    assert undone["change"]["utterances"][0]["spans"] == [{"words": 4}] and undone["redo"] == "test"
    assert served.ask("sessions/0/redo", {"base": 2})["done"] == 1
    assert session.name


def test_annotators_do_not_see_each_other(served: Served) -> None:
    served.mark(0, 0, {"words": 4, "move": "Align", "slots": {"Street": ["Plymouth"]}})
    seen = b"".join(
        served.raw(f"/api/{path}", name="ben")[2]
        for path in ("sessions/0", "sessions/0/marks", "sessions/0/bodies?frame=0", "seat")
    )
    own = json.loads(served.raw("/api/sessions/0/marks", name="ben")[2])
    assert all(span.keys() == {"words"} for row in own["change"]["utterances"] for span in row["spans"])
    assert b"anna" not in seen and served.seats["anna"].token.encode() not in seen
    for path in ("versions", "history"):
        assert served.raw(f"/api/sessions/0/{path}", name="ben")[0] == 403
    body = json.dumps({"base": 0, "speaker": "participant", "utterance": 0, "annotator": "anna"}).encode()
    assert served.raw("/api/sessions/0/adopt", body, name="ben")[0] == 403


def test_the_page_of_a_session_has_no_labels_of_its_talk(served: Served) -> None:
    page = served.ask("sessions/0")
    assert {key for row in page["utterances"] for key in row} == {
        "speaker",
        "utterance",
        "words",
        "start",
        "end",
        "audio",
    }
    text = json.dumps(page)
    assert not any(f'"{move.label}"' in text for move in DialogueMove)


def test_suggestions_are_shown_only_if_wanted(tmp_path: Path) -> None:
    recorded(tmp_path / "c" / "one")
    with Served(tmp_path / "c", pre_annotate=True) as running:
        state = running.ask("sessions/0/marks")
        spans = [span for row in state["change"]["utterances"] for span in row["spans"]]
        assert all(span["suggested"] for span in spans) and state["done"] == 0 and state["pre_annotated"]
        accepted = {key: value for key, value in spans[0].items() if key != "suggested"}
        assert running.mark(0, 0, accepted)["done"] == 1
    with Served(tmp_path / "c", pre_annotate=False) as running:
        assert running.ask("sessions/0/marks")["pre_annotated"], "the log says how it was begun"


def test_edits_of_two_windows_do_not_overwrite_each_other(served: Served) -> None:
    served.mark(0, 0, INSTRUCT)
    body = {"base": 0, "change": {"utterances": [{"speaker": "participant", "utterance": 0, "spans": [{"words": 4}]}]}}
    status, _, content = served.raw("/api/sessions/0/mark", json.dumps(body).encode())
    assert status == 409 and "changed elsewhere" in json.loads(content)["reason"]
    assert served.ask("sessions/0/marks")["edit"] == 1


def test_an_edit_that_is_sent_again_counts_once(served: Served) -> None:
    row = {"speaker": "participant", "utterance": 0, "spans": [INSTRUCT]}
    requests: list[tuple[str, dict[str, object]]] = [
        ("mark", {"base": 0, "label": "a", "change": {"utterances": [row]}}),
        ("undo", {"base": 1}),
        ("redo", {"base": 2}),
    ]
    for edit, (action, body) in enumerate(requests, start=1):
        first = served.ask(f"sessions/0/{action}", body)
        again = served.ask(f"sessions/0/{action}", {**body, "again": True})
        assert first == again and again["edit"] == edit, action
        assert served.raw(f"/api/sessions/0/{action}", json.dumps(body).encode())[0] == 409, "another window"
    other = {"base": 2, "again": True, "label": "b", "change": {"utterances": [row]}}
    assert served.raw("/api/sessions/0/mark", json.dumps(other).encode())[0] == 409, "the last edit is a redo"
    served.mark(3, 0, {"words": 4, "move": "Check"})
    late = {"base": 2, "again": True}
    assert served.raw("/api/sessions/0/redo", json.dumps(late).encode())[0] == 409, "there was another edit since"
    for label, move in (("test", "Align"), ("other", "Check")):
        change = {"utterances": [{**row, "spans": [{"words": 4, "move": move}]}]}
        body = {"base": 3, "again": True, "label": label, "change": change}
        assert served.raw("/api/sessions/0/mark", json.dumps(body).encode())[0] == 409
    adopt = {"base": 0, "speaker": "participant", "utterance": 0, "annotator": "anna"}
    first = served.ask("sessions/0/adopt", adopt, "carol")
    assert served.ask("sessions/0/adopt", {**adopt, "again": True}, "carol") == first
    assert len((served.corpus / "one" / "annotations" / "anna.jsonl").read_text().splitlines()) == 5


def test_logs_that_are_links_are_refused_and_not_written(served: Served) -> None:
    outside = served.corpus.parent / "outside"
    outside.write_bytes(b"a secret")
    folder = served.corpus / "one" / "annotations"
    folder.mkdir()
    (folder / "anna.jsonl").symlink_to(outside)
    (folder / "adjudicated.jsonl").symlink_to(outside.parent / "missing")
    body = json.dumps(
        {"base": 0, "change": {"utterances": [{"speaker": "participant", "utterance": 0, "spans": [INSTRUCT]}]}}
    )
    for name, path, content in (
        ("anna", "marks", None),
        ("anna", "mark", body),
        ("anna", "undo", '{"base":0}'),
        ("carol", "mark", body),
        ("carol", "versions", None),
    ):
        status, _, answer = served.raw(f"/api/sessions/0/{path}", content and content.encode(), name)
        assert status == 400 and "is a link" in json.loads(answer)["reason"], (name, path, answer)
    assert outside.read_bytes() == b"a secret" and not (outside.parent / "missing").exists()
    assert served.mark(0, 0, INSTRUCT, name="ben")["edit"] == 1, "others are not concerned"


def test_the_first_answer_has_all_marks_with_which_the_log_begins(tmp_path: Path) -> None:
    _, text = recorded(tmp_path / "c" / "one")
    with Served(tmp_path / "c") as running:
        assert running.ask("sessions/0/marks", name="carol")["done"] == 0
        seats = running.seats
    session, _ = recorded(tmp_path / "copy")
    annotate(tmp_path / "c" / "one", text, "anna", recorded_annotation(session, text))
    with Served(tmp_path / "c", seats=seats) as running:  # it begins with what all agree on by now
        state = running.mark(0, 0, {"words": 4, "move": "Check"}, name="carol")
        assert state["whole"] and state["done"] == 7 and len(state["change"]["utterances"]) == 5
        assert not running.mark(1, 0, {"words": 4, "move": "Align"}, name="carol")["whole"]


def test_the_adjudicator_decides_with_a_history(served: Served) -> None:
    session, text = recorded(served.corpus.parent / "copy")
    first = recorded_annotation(session, text)
    annotate(served.corpus / "one", text, "anna", first)
    served.mark(0, 0, {"words": 4, "move": "Check"}, name="ben")
    found = served.ask("sessions/0/versions", name="carol")
    assert set(found["annotators"]) == {"anna", "ben"} and len(found["disagreements"]) == 5
    assert found["agreement"][0]["moves"]["spans"] == 1
    state = served.ask("sessions/0/marks", name="carol")
    adopt = {"base": state["edit"], "speaker": "participant", "utterance": 0, "annotator": "ben"}
    state = served.ask("sessions/0/adopt", adopt, "carol")
    assert state["change"]["utterances"][0]["spans"][0]["move"] == "Check"
    served.ask("sessions/0/adopt", {**adopt, "base": state["edit"], "annotator": "anna"}, "carol")
    served.mark(2, 4, {"words": 1, "move": "Acknowledge"}, name="carol")
    history = served.ask("sessions/0/history", name="carol")
    assert [(row["by"], row["source"]) for row in history] == [("carol", ""), ("carol", "anna"), ("carol", "ben")]
    final = read_annotation(text, served.corpus / "one", ADJUDICATED)
    assert final.utterances[FIRST][0].move is DialogueMove.INSTRUCT
    assert read_annotation(text, served.corpus / "one", "anna") == first, "annotators keep their own"


def test_the_tree_of_the_page_is_that_of_the_ontology(served: Served) -> None:
    vocabulary = served.ask("seat")["vocabulary"]

    def leaves(node: object, path: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], str]]:
        if isinstance(node, str):
            yield path, node
        else:
            for label, after in node["answers"]:  # type: ignore[index]  # a question
                yield from leaves(after, (*path, label))

    assert vocabulary["tree"]["text"] == DECISION_TREE.text
    found = dict(leaves(vocabulary["tree"]))
    assert {walk(path).label: path for path in found} == {move: path for path, move in found.items()}
    keys = [MOVE_KEYS[move] for move in DialogueMove]
    assert len(set(keys)) == len(keys) and not set(keys) & set("sm[]gxptrbjk+-?123456789")


def test_sessions_that_cannot_be_annotated_say_why(served: Served) -> None:
    status, _, content = served.raw("/api/sessions/1")
    assert status == 400 and "nobody speaks in it" in json.loads(content)["reason"]
    (served.corpus / "one" / "annotations").mkdir()
    (served.corpus / "one" / "annotations" / "anna.jsonl").write_text("{\n")
    status, _, content = served.raw("/api/sessions/0/marks")
    assert status == 400 and "anna.jsonl, line 1" in json.loads(content)["reason"]


# --- Security ---------------------------------------------------------------------------------------------------------


def test_wrong_tokens_and_pages_of_other_hosts_are_refused(served: Served) -> None:
    assert served.raw("/api/seat", name=None)[0] == 401
    for token in ("Bearer ", "Bearer x", "Basic x", f"Bearer {served.seats['anna'].token}x", "ä"):
        assert served.raw("/api/seat", name=None, Authorization=token)[0] == 401
    assert served.raw("/api/seat", Origin="https://example.org")[0] == 403
    assert served.raw("/api/seat", Origin=f"http://127.0.0.1:{served.port}")[0] == 200


@pytest.mark.parametrize(
    "origin",
    [
        "http://[",
        "http://[::1",
        "http://[x]",
        "//[",
        "http://a]b",
        "null",
        "",
        "x",
        "http://\xe9.example",
        "http://a:b@[",
    ],
)
def test_a_malformed_origin_is_refused_before_the_token_is_looked_at(
    served: Served, caplog: pytest.LogCaptureFixture, origin: str
) -> None:
    bodies = {"sessions/0/mark": json.dumps({"base": 0, "change": {}}).encode(), "sessions/0/undo": b"{"}
    for path in ("seat", "sessions/0/marks", "sessions/0/mark", "sessions/0/undo", "sessions/99999999999999"):
        for headers in ({}, {"Authorization": "Bearer x"}, {"Authorization": f"Bearer {served.seats['anna'].token}"}):
            status, _, content = served.raw(f"/api/{path}", bodies.get(path), None, Origin=origin, **headers)
            assert status == 403 and "other pages" in json.loads(content)["reason"], (path, headers)
    assert not caplog.records and not (served.corpus / "one" / "annotations").exists()


def test_every_answer_forbids_foreign_content(served: Served) -> None:
    for path in ("/annotate", "/annotation/main.js", "/static/dom.js", "/api/seat", "/nothing"):
        _, headers, _ = served.raw(path)
        assert "default-src 'none'" in headers["Content-Security-Policy"]
        assert "unsafe" not in headers["Content-Security-Policy"] and headers["Referrer-Policy"] == "no-referrer"


def test_only_the_files_of_the_page_are_served(served: Served) -> None:
    for path in (
        "/annotation/../server.py",
        "/annotation/%2e%2e/server.py",
        "/static//etc/passwd",
        "/annotation/..%2flog.py",
    ):
        assert served.raw(path)[0] == 404
    for name in ("..%2f..%2fsession.json", "x", "%00", "utterance_0_0.flac"):
        assert served.raw(f"/api/sessions/0/audio/{name}")[0] in (400, 404)


def test_links_have_secrets_of_128_bits_behind_the_number_sign(served: Served) -> None:
    tokens = {seat.token for seat in served.seats.values()} | {
        Seat("x", served.seats["anna"].kind).token for _ in range(50)
    }
    assert len(tokens) == 53 and min(map(len, tokens)) >= 22
    assert "#" in served.link("anna") and served.seats["anna"].token in served.link("anna").split("#")[1]


def test_large_and_frequent_requests_are_refused(served: Served, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("dorothie_gym.lab.annotation.server.BUDGET", (BUDGET[0], 0.0))  # also on a slow machine
    assert served.raw("/api/sessions/0/mark", b"x" * (MAX_BODY + 1))[0] == 413
    statuses = [served.raw("/api/seat", name="ben")[0] for _ in range(int(BUDGET[0]) + 1)]
    assert statuses[-2:] == [200, 429]
    assert served.raw("/api/seat")[0] == 200, "others are not slowed down"


@needs_memory()
@pytest.mark.parametrize(("seed", "count"), COUNTS)
def test_fuzzed_requests_get_refusals_only(
    served: Served,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
    request: pytest.FixtureRequest,
    seed: int,
    count: int,
) -> None:
    monkeypatch.setattr("dorothie_gym.lab.annotation.server.BUDGET", (1e9, 1e9))  # it has a test of its own
    rng = random.Random(seed + request.config.getoption("--malformed-seed"))
    served.mark(0, 0, INSTRUCT)
    before = (served.corpus / "one" / "annotations" / "anna.jsonl").read_bytes()
    sound = {
        "base": 1,
        "label": "x",
        "change": {"utterances": [{"speaker": "participant", "utterance": 0, "spans": [INSTRUCT]}]},
    }
    numbers = ["0", "1", "2", "-1", "999999999999999999999", "9" * 5000, "a", "%00", "..", "0x0", "１"]
    endings = [
        "",
        "/mark",
        "/undo",
        "/redo",
        "/adopt",
        "/marks",
        "/bodies",
        "/picture",
        "/audio/x",
        "/town",
        "/versions",
        "/x",
    ]
    queries = ["", "?frame=-1", "?frame=1e9", f"?frame={'9' * 400}", "?frame=0&frame=1", "?frame=%ff"]
    memory_before = 0.0
    for number in range(count):
        if number == 100:
            memory_before = memory()
        text = bytearray(json.dumps(sound).encode())
        for _ in range(rng.randint(1, 5)):
            at = rng.randrange(len(text))
            text[at : at + rng.choice([0, 1, 2, 20])] = rng.choice(
                [b"", b"\x00", b'"', b"9" * 40, b"[" * 500, b"\xff", b"null", b"-1", b"{}", b"NaN", b"1e999"]
            )
        path = f"/api/sessions/{quote(rng.choice(numbers), safe='%')}{rng.choice(endings)}{rng.choice(queries)}"
        body = None if rng.random() < 0.3 else bytes(text)
        status, _, content = served.raw(path, body, name=rng.choice(["anna", "ben", "carol"]))
        assert status in (200, 400, 403, 404, 405, 409), (path, status, content)
        if status not in (200, 404, 405):
            reason = json.loads(content)["reason"]
            assert reason and "\n" not in reason and len(reason) < 1500
    for _ in range(10):
        large = b'{"label":"' + b"a" * 2**20 + b'"}'
        assert served.raw("/api/sessions/0/mark", large)[0] == 413
    assert not caplog.records
    check_raw_requests(served.port, rng, count // 20)
    assert not [record for record in caplog.records if record.levelname == "ERROR"], caplog.text
    assert memory() - memory_before < GROWTH
    log = (served.corpus / "one" / "annotations" / "anna.jsonl").read_bytes()
    assert log.startswith(before)
    assert served.ask("sessions/0/marks")["spans"] >= 5
