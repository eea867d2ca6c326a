from __future__ import annotations

import os
import random
import shutil
from pathlib import Path

import numpy as np
import pytest

from dorothie_gym.errors import FeatureStoreError, SessionError
from dorothie_gym.evaluation.teacher_forced.features import build
from dorothie_gym.evaluation.teacher_forced.features import corpus_columns as building
from dorothie_gym.evaluation.teacher_forced.features.corpus_columns import (
    INDEX_FILE,
    SIGNATURE_FILE,
    features_folder,
    keep,
    read_columns,
)
from tests.evaluation.teacher_forced.features.test_layouts import assert_same
from tests.session.recording.builders import write
from tests.session.recording.dialogues import talk
from tests.support.cache_damage import DAMAGES


@pytest.fixture
def corpus(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("DOROTHIE_GYM_CACHE", str(tmp_path / "cache"))
    write(tmp_path / "corpus" / "train" / "a", talk())
    return tmp_path / "corpus"


def entry() -> Path:
    folder = features_folder()
    assert folder is not None
    (found,) = folder.iterdir()
    return found


def forbid_extraction(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(building, "extract", lambda *_: pytest.fail("built anew"))


def test_columns_are_built_once_and_mapped_then(corpus: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    first = build(corpus)
    forbid_extraction(monkeypatch)
    again = build(corpus)
    assert_same(first, again)
    assert again.sessions.names == ("a",) and again.key == first.key
    assert isinstance(again.frames.pose.base, np.memmap)
    assert not again.frames.pose.flags.writeable


def test_no_file_is_written_without_a_cache(corpus: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    build(corpus, cache=False)
    folder = features_folder()
    assert folder is not None and not folder.exists()
    monkeypatch.setenv("DOROTHIE_GYM_CACHE", "")
    assert features_folder() is None
    assert len(build(corpus).moves.move) == 7


def test_changed_sessions_and_folds_are_built_again(corpus: Path) -> None:
    keys = {build(corpus).key}
    events = corpus / "train" / "a" / "events.jsonl"
    events.write_text(events.read_text().replace("turning left.", "turning right."))
    keys.add(build(corpus).key)
    (corpus / "train" / "a").rename(corpus / "train" / "b")
    keys.add(build(corpus).key)
    (corpus / "train").rename(corpus / "test")
    keys.add(build(corpus).key)
    assert len(keys) == 4


def test_content_hash_does_not_depend_on_names_of_sessions(corpus: Path) -> None:
    first = build(corpus).content
    (corpus / "train" / "a").rename(corpus / "train" / "b")
    assert build(corpus).content == build(corpus, cache=False).content == first
    events = corpus / "train" / "b" / "events.jsonl"
    events.write_text(events.read_text().replace("turning left.", "turning right."))
    assert build(corpus).content != first


@pytest.mark.parametrize("name", ["moves.slots.npy", "frames.pose.npy", INDEX_FILE])
@pytest.mark.parametrize("damage", ["torn", "changed", "gone"])
def test_damaged_entries_are_built_again(corpus: Path, name: str, damage: str) -> None:
    first = build(corpus)
    path = entry() / name
    data = bytearray(path.read_bytes())
    if damage == "gone":
        path.unlink()
    else:
        data[-3] ^= 1
        path.write_bytes(bytes(data) if damage == "changed" else bytes(data[:-9]))
        with pytest.raises(FeatureStoreError, match=path.name.split(".npy")[0]):
            read_columns(entry())
    assert_same(first, build(corpus))
    assert_same(first, read_columns(entry()))


@pytest.mark.skipif(os.name != "posix", reason="pipes of POSIX")
@pytest.mark.parametrize("kind", sorted(DAMAGES))
@pytest.mark.parametrize("name", ["moves.slots.npy", INDEX_FILE, SIGNATURE_FILE])
def test_entry_with_any_damage_is_replaced(corpus: Path, name: str, kind: str) -> None:
    first = build(corpus)
    DAMAGES[kind](entry() / name, random.Random(0))
    assert_same(first, build(corpus))
    assert_same(first, read_columns(entry()))


def test_file_in_the_place_of_an_entry_is_replaced(corpus: Path) -> None:
    first, place = build(corpus), entry()
    shutil.rmtree(place)
    place.write_bytes(b"no folder")
    assert_same(first, build(corpus))
    assert_same(first, read_columns(entry()))


def test_whole_entry_of_another_corpus_is_not_read(corpus: Path) -> None:
    build(corpus)
    stranger = entry().rename(corpus.parent / "stranger")
    events = corpus / "train" / "a" / "events.jsonl"
    events.write_text(events.read_text().replace("turning left.", "turning right."))
    expected = build(corpus)
    shutil.rmtree(entry())
    stranger.rename(features_folder() / expected.key)
    assert_same(build(corpus), expected)


def test_the_faster_of_two_processes_wins(corpus: Path) -> None:
    first = build(corpus)
    before = (entry() / INDEX_FILE).stat().st_ino
    keep(build(corpus, cache=False))
    assert (entry() / INDEX_FILE).stat().st_ino == before
    assert_same(first, build(corpus))


def test_pickled_objects_in_the_cache_are_refused(corpus: Path) -> None:
    build(corpus)
    assert {path.suffix for path in entry().iterdir()} == {".npy", ".json", ".signature"}
    for path in entry().glob("*.npy"):
        assert np.load(path, allow_pickle=False).dtype.kind in "biuf"


def test_sessions_that_cannot_be_read_are_listed(corpus: Path) -> None:
    broken = write(corpus / "train" / "broken", talk())
    (broken / "session.json").write_text("{")
    columns = build(corpus)
    assert columns.sessions.names == ("a",)
    ((name, reason),) = columns.unreadable
    assert name == "broken" and "session.json" in reason
    assert build(corpus).unreadable == columns.unreadable


def test_corpus_without_a_readable_session_is_refused(tmp_path: Path) -> None:
    broken = write(tmp_path / "corpus" / "broken", talk())
    (broken / "session.json").write_text("{")
    with pytest.raises(SessionError, match=r"no session can be read: .*session\.json"):
        build(tmp_path / "corpus")


def test_progress_is_reported_for_each_session(corpus: Path) -> None:
    told: list[int] = []
    build(corpus, cache=False, on_session=lambda: told.append(1))
    assert told == [1]
