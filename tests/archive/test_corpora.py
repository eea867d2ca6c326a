"""Corpora on disk: folds, filters, manifests, tables."""

from __future__ import annotations

import json
from pathlib import Path

import pandas as pd
import pytest

from dorothie_gym.archive import Corpus, Fold, nfd_points
from dorothie_gym.errors import SessionError
from dorothie_gym.ontology import ExceptionKind, Role
from dorothie_gym.session.recording import Event, EventType, Session
from tests.archive.sdn.builders import release
from tests.session.recording.builders import write
from tests.session.recording.dialogues import talk

PLACES = {
    "train/a": ("midtown", "weather"),
    "train/b": ("northgate", None),
    "val/seen/c": ("midtown", "task_change"),
    "val/unseen/d": ("brookside", "weather"),
    "test/seen/e": ("midtown", None),
    "test/unseen/f": ("brookside", "place_prop"),
}


@pytest.fixture
def corpus(tmp_path: Path) -> Corpus:
    for place, (town, kind) in PLACES.items():
        events = talk()
        if kind is not None:
            events.insert(3, Event(frame=50, type=EventType.EXCEPTION, source=Role.AD_WIZARD, data={"kind": kind}))
        write(tmp_path / "corpus" / place, events, town=town)
    (tmp_path / "corpus/train/notes").mkdir()
    (tmp_path / "corpus/.part").mkdir()
    return Corpus.load(tmp_path / "corpus")


def names(corpus: Corpus) -> str:
    return "".join(sorted(entry.name for entry in corpus.entries))


def test_sessions_are_found_in_their_folds(corpus: Corpus) -> None:
    assert len(corpus) == 6 and names(corpus) == "abcdef"
    assert corpus.folds == {Fold.TRAIN: 2, Fold.VAL_SEEN: 1, Fold.VAL_UNSEEN: 1, Fold.TEST_SEEN: 1, Fold.TEST_UNSEEN: 1}
    assert sorted(session.name for session in corpus) == list("abcdef")


@pytest.mark.parametrize(
    ("fold", "found"),
    [
        (Fold.TRAIN, "ab"),
        ("val", "cd"),
        ("seen", "ce"),
        ("unseen", "df"),
        ("test/unseen", "f"),
        (Fold.VAL_SEEN, "c"),
    ],
)
def test_corpus_is_filtered_by_fold(corpus: Corpus, fold: str, found: str) -> None:
    assert names(corpus.filter(fold=fold)) == found


def test_corpus_is_filtered_by_town_and_kind_of_exception(corpus: Corpus) -> None:
    assert names(corpus.filter(town="brookside")) == "df"
    assert names(corpus.filter(exception=ExceptionKind.WEATHER)) == "ad"
    assert names(corpus.filter(exception="weather")) == "ad"
    assert names(corpus.filter(exception="environmental")) == "adf"
    assert names(corpus.filter(exception="task")) == "c"
    assert names(corpus.filter(exception="none")) == "be"
    assert names(corpus.filter(fold="seen", exception="none")) == "e"
    assert len(corpus.filter(town="nowhere")) == 0


def test_unknown_filters_are_reported(corpus: Corpus) -> None:
    with pytest.raises(SessionError, match="fold: 'dev' is unknown; choose from seen, test"):
        corpus.filter(fold="dev")
    with pytest.raises(SessionError, match="earthquake"):
        corpus.filter(exception="earthquake")


def test_sessions_of_sdn_are_in_a_corpus_like_ours(tmp_path: Path) -> None:
    release(tmp_path / "SDN/train/log_1")
    release(tmp_path / "SDN/val/log_2", ad_wizardlog__csv="")
    corpus = Corpus.load(tmp_path / "SDN")
    assert corpus.folds == {Fold.TRAIN: 1, Fold.VAL: 1}
    assert names(corpus.filter(exception=ExceptionKind.SPAWN_PEDESTRIANS)) == "log_1"
    assert names(corpus.filter(town="Town97", fold="val")) == "log_2"


def test_manifest_reports_changed_sessions(corpus: Corpus) -> None:
    path = corpus.write_manifest()
    before = path.read_bytes()
    assert corpus.verify() == ()
    assert corpus.write_manifest().read_bytes() == before
    row = json.loads(before)["sessions"][0]
    assert (row["path"], row["fold"], row["town"]) == ("test/seen/e", "test/seen", "midtown")
    assert row["sha256"] == Session.load(corpus.root / "test/seen/e").digest
    events = corpus.root / "train/a/events.jsonl"
    events.write_text(events.read_text().replace("Great.", "Grand."))
    (corpus.root / "train/b/frames.parquet").unlink()
    (corpus.root / "val/seen/c").rename(corpus.root / "val/seen/x")
    faults = Corpus.load(corpus.root).verify()
    assert faults[0] == "val/seen/c: is missing"
    assert faults[1] == "train/a: its content was changed"
    assert faults[2].startswith("train/b: cannot be read (")
    assert faults[3] == "val/seen/x: is not in the manifest"


def test_manifest_that_was_changed_itself_is_noticed(corpus: Corpus) -> None:
    with pytest.raises(SessionError, match="manifest.json: is missing; write it"):
        corpus.verify()
    path = corpus.write_manifest()
    whole = path.read_text()
    path.write_text(whole.replace("train/a", "../../a"))
    with pytest.raises(SessionError, match="do not match its hash"):
        corpus.verify()
    path.write_text(whole.replace('"version": "1.0"', '"version": "9.0"'))
    with pytest.raises(SessionError, match="version"):
        corpus.verify()
    path.write_text(whole[: len(whole) // 2])
    with pytest.raises(SessionError, match="manifest.json, line 33, column 14: not JSON"):
        corpus.verify()


def test_table_of_utterances_has_a_row_for_each_act(corpus: Corpus, tmp_path: Path) -> None:
    utterances, _ = corpus.export(tmp_path / "tables")
    table = pd.read_parquet(utterances)
    assert len(table) == 6 * 7
    one = table[table.session == "a"].reset_index(drop=True)
    assert one.fold.unique().tolist() == ["train"] and one.town.unique().tolist() == ["midtown"]
    assert one[["utterance", "act"]].to_numpy().tolist() == [[0, 0], [1, 0], [1, 1], [2, 0], [2, 1], [3, 0], [4, 0]]
    assert one.move.tolist()[:3] == ["Instruct", "Acknowledge", "Explain"]
    assert [list(value) for value in one.landmark[:2]] == [["KFC"], []]
    assert one.speaker.tolist()[0] == "participant" and one.recognised.isna().all()
    events = Session.load(corpus.root / "train/a").events
    assert [events[k].data["span"] for k in one.event] == one.span.tolist()


def test_table_of_decision_points_has_a_row_for_each_point(corpus: Corpus, tmp_path: Path) -> None:
    _, decisions = corpus.export(tmp_path / "tables")
    table = pd.read_parquet(decisions)
    one = table[table.session == "f"].reset_index(drop=True)
    points = list(nfd_points(Session.load(corpus.root / "test/unseen/f")))
    assert one.action.tolist() == [point.action.label for point in points]
    assert one.angle.tolist() == [point.angle for point in points]
    assert one.co_wizard_said.tolist()[0] is None or pd.isna(one.co_wizard_said[0])
    assert one.participant_said.tolist()[-1] == "Great."
    assert [len(past) for past in one.past_actions] == [0, 1, 3, 4, 5]
    assert list(one.past_angles[4])[-2:] == [-180.0, -179.0]
    assert one.x[0] == pytest.approx(44 / 5)


def test_tables_of_equal_corpora_are_equal(corpus: Corpus, tmp_path: Path) -> None:
    for name in ("one", "two"):
        corpus.export(tmp_path / name)
    for path in (tmp_path / "one").iterdir():
        assert path.read_bytes() == (tmp_path / "two" / path.name).read_bytes()


def test_a_session_without_talk_has_no_rows(tmp_path: Path) -> None:
    write(tmp_path / "corpus/train/a", (), frames=3)
    utterances, decisions = Corpus.load(tmp_path / "corpus").export(tmp_path)
    assert len(pd.read_parquet(utterances)) == len(pd.read_parquet(decisions)) == 0
