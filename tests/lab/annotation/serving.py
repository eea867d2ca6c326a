"""Annotation server on a free port of this machine, in a thread of the test."""

from __future__ import annotations

import json
import urllib.error
import urllib.request
from pathlib import Path
from typing import Any

from dorothie_gym.archive import Corpus
from dorothie_gym.lab.annotation.server import AnnotationServer
from dorothie_gym.lab.annotation.workplace import Seat, SeatKind, Workplace
from tests.served_application import ServedApplication


class Served(ServedApplication):
    """Server with the annotators Anna and Ben, and the adjudicator Carol."""

    def __init__(
        self, corpus: Path, *, pre_annotate: bool = False, seats: dict[str, Seat] | None = None, port: int = 0
    ) -> None:
        self.seats = seats or {
            **{name: Seat(name, SeatKind.ANNOTATOR) for name in ("anna", "ben")},
            "carol": Seat("carol", SeatKind.ADJUDICATOR),
        }
        self.corpus = corpus
        workplace = Workplace(Corpus.load(corpus).entries, list(self.seats.values()), pre_annotate=pre_annotate)
        self.application = AnnotationServer(workplace)
        super().__init__(self.application.app(), port=port)

    def link(self, name: str) -> str:
        return f"http://127.0.0.1:{self.port}/annotate#{self.seats[name].token}"

    def raw(
        self, path: str, body: bytes | None = None, name: str | None = "anna", method: str | None = None, **headers: str
    ) -> tuple[int, Any, bytes]:
        """Sends a request; returns status, headers and body of the answer."""
        if name is not None:
            headers["Authorization"] = f"Bearer {self.seats[name].token}"
        request = urllib.request.Request(
            f"http://127.0.0.1:{self.port}{path}", data=body, headers=headers, method=method
        )
        try:
            with urllib.request.urlopen(request, timeout=30) as answer:
                return answer.status, answer.headers, answer.read()
        except urllib.error.HTTPError as error:
            with error:
                return error.code, error.headers, error.read()

    def ask(self, path: str, body: object = None, name: str = "anna") -> Any:
        """Sends a request that must be answered with JSON."""
        status, _, content = self.raw(f"/api/{path}", None if body is None else json.dumps(body).encode(), name)
        assert status == 200, content
        return json.loads(content)

    def mark(
        self, base: int, utterance: int, *spans: dict[str, object], name: str = "anna", speaker: str = "participant"
    ) -> Any:
        row = {"speaker": speaker, "utterance": utterance, "spans": list(spans)}
        return self.ask("sessions/0/mark", {"base": base, "change": {"utterances": [row]}, "label": "test"}, name)
