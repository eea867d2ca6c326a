from __future__ import annotations

import os
import random
import shutil
from pathlib import Path

import pytest

from dorothie_gym.archive import Corpus, load_sessions
from dorothie_gym.errors import CacheError
from dorothie_gym.evaluation.rollout import corpus_cache as corpus
from dorothie_gym.evaluation.rollout import default_corpus
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.support import user_cache
from tests.support.cache_damage import DAMAGES

SHORT = EnvConfig(max_seconds=3.0)


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    folder = tmp_path / "cache"
    monkeypatch.setenv("DOROTHIE_GYM_CACHE", str(folder))
    return folder


def test_sessions_are_played_once_and_kept(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = default_corpus(sessions=2, seed=3, config=SHORT)
    assert len(load_sessions(folder)) == 2
    assert all(session.complete for session in load_sessions(folder))
    assert Corpus.load(folder).verify() == ()
    left = {path.name for path in cache.iterdir()} - {
        "towns",
        "key",
    }  # loading a town makes both
    assert left == {folder.name}, "nothing else is left behind"
    monkeypatch.setattr(corpus, "generate_corpus", lambda *args, **kwargs: pytest.fail("played again"))
    assert default_corpus(sessions=2, seed=3, config=SHORT) == folder


def test_other_settings_are_kept_apart(cache: Path) -> None:
    first = default_corpus(sessions=1, seed=3, config=SHORT)
    second = default_corpus(sessions=1, seed=4, config=SHORT)
    third = default_corpus(sessions=1, seed=3, config=EnvConfig(max_seconds=2.0))
    assert len({first, second, third}) == 3


@pytest.mark.skipif(os.name != "posix", reason="pipes of POSIX")
@pytest.mark.parametrize("kind", sorted(DAMAGES))
def test_damaged_corpus_is_set_aside_and_played_again(
    cache: Path, kind: str, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(user_cache, "_damage_reported", False)
    folder = default_corpus(sessions=1, seed=3, config=SHORT)
    (before,) = load_sessions(folder)
    (events,) = folder.rglob("events.jsonl")
    labels = events.with_name("annotations") / "ann.jsonl"
    labels.parent.mkdir()
    labels.write_text("work of a person")
    assert default_corpus(sessions=1, seed=3, config=SHORT) == folder and labels.exists(), "other files are no damage"
    DAMAGES[kind](events, random.Random(0))
    assert default_corpus(sessions=1, seed=3, config=SHORT) == folder
    (after,) = load_sessions(folder)
    assert after.digest == before.digest and not labels.exists()
    aside = folder.with_name(f"{folder.name}.damaged")
    assert (aside / labels.relative_to(folder)).read_text() == "work of a person"
    assert f"now {aside.name}" in caplog.text


def test_file_in_the_place_of_the_corpus_is_set_aside(cache: Path) -> None:
    folder = default_corpus(sessions=1, seed=3, config=SHORT)
    shutil.rmtree(folder)
    folder.write_text("no folder")
    assert len(load_sessions(default_corpus(sessions=1, seed=3, config=SHORT))) == 1


def test_an_interrupted_corpus_leaves_nothing(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupt(*args: object, **kwargs: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(corpus, "generate_corpus", interrupt)
    with pytest.raises(KeyboardInterrupt):
        default_corpus(sessions=1, seed=3, config=SHORT)
    assert list(cache.iterdir()) == []


def test_corpus_of_a_faster_process_is_kept(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    done = default_corpus(sessions=1, seed=3, config=SHORT)
    part = cache / "other.part"
    part.mkdir()
    corpus._publish(part, done)
    assert len(load_sessions(done)) == 1


def test_unwritable_cache_is_reported_with_the_variable_to_set(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").touch()
    monkeypatch.setenv("DOROTHIE_GYM_CACHE", str(tmp_path / "file" / "below"))
    with pytest.raises(CacheError, match=r"below: no corpus can be stored here \(.*set DOROTHIE_GYM_CACHE to a folder"):
        default_corpus(sessions=1, seed=3, config=SHORT)


def test_disabled_cache_is_reported_with_the_variable_to_set(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("DOROTHIE_GYM_CACHE", "")
    with pytest.raises(CacheError, match="sessions cannot be kept: DOROTHIE_GYM_CACHE is empty or names a folder"):
        default_corpus(sessions=1, seed=3, config=SHORT)
