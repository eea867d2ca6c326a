"""Annotator that edits at random, in a process of its own."""

from __future__ import annotations

import random
from multiprocessing.connection import Connection
from pathlib import Path

import msgspec

from dorothie_gym.archive import Corpus
from dorothie_gym.lab.annotation.log import Action, Edit
from dorothie_gym.lab.annotation.marks import Annotation, Change
from dorothie_gym.lab.annotation.rows import rows_of
from dorothie_gym.lab.annotation.source_text import SourceText
from dorothie_gym.lab.annotation.workplace import Seat, SeatKind, Workplace
from dorothie_gym.session.recording import Session
from tests.lab.annotation.builders import random_change

ANNA = Seat("anna", SeatKind.ANNOTATOR)


def workplace(folder: Path) -> Workplace:
    return Workplace(Corpus.load(folder).entries, [ANNA], pre_annotate=True)


def random_edit(work: Workplace, text: SourceText, rng: random.Random) -> Edit:
    log = work.open(0).log(ANNA)
    possible = [Action.MARK] * 3 + [Action.UNDO] * bool(log.can_undo) + [Action.REDO] * bool(log.can_redo)
    action = rng.choice(possible)
    return Edit(action=action, change=random_change(text, rng) if action is Action.MARK else Change(), label="x")


def mark_on_and_on(folder: Path, seed: int, acknowledged: Connection) -> None:
    """Edits until the process is killed; sends each edit's number and the marks after it once it is acknowledged."""
    rng, work = random.Random(seed), workplace(folder)
    text = SourceText.of(Session.load(folder / "one"))
    base = work.marks(ANNA, 0)["edit"]
    acknowledged.send((base, content_of(work.open(0).log(ANNA).annotation)))
    while True:
        base = work.edit(ANNA, 0, base, random_edit(work, text, rng))["edit"]
        acknowledged.send((base, content_of(work.open(0).log(ANNA).annotation)))


def content_of(annotation: Annotation) -> bytes:
    return msgspec.json.encode(rows_of(annotation.difference(Annotation(utterances={}))))
