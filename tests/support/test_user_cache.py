from __future__ import annotations

import logging
import os
import random
import sys
import time
from pathlib import Path

import pytest

from dorothie_gym.maps import Town, load_town
from dorothie_gym.maps.cache import pack, through_cache, unpack
from dorothie_gym.support import user_cache
from dorothie_gym.support.user_cache import (
    CACHE_VARIABLE,
    KEY_FILE,
    RECENT,
    SEAL_FILE,
    SIGNATURE_LENGTH,
    cache_folder,
    is_sealed,
    mark_used,
    read_signed,
    remove_least_used,
    seal,
    write_signed,
)
from tests.maps.yaml_text import MIDTOWN, written
from tests.support.cache_damage import DAMAGES

needs_posix = pytest.mark.skipif(os.name != "posix", reason="pipes of POSIX")


@pytest.mark.skipif(sys.platform != "linux", reason="folders of the Linux desktop standard")
@pytest.mark.parametrize(
    ("variables", "expected"),
    [
        ({"XDG_CACHE_HOME": "/elsewhere"}, "/elsewhere/dorothie_gym"),
        ({"XDG_CACHE_HOME": "not/absolute"}, "/home/me/.cache/dorothie_gym"),
        ({}, "/home/me/.cache/dorothie_gym"),
        ({CACHE_VARIABLE: "/mine", "XDG_CACHE_HOME": "/elsewhere"}, "/mine"),
        ({CACHE_VARIABLE: "~/mine"}, "/home/me/mine"),
    ],
)
def test_the_cache_folder_follows_the_variable_and_the_desktop_standard(
    monkeypatch: pytest.MonkeyPatch, variables: dict[str, str], expected: str
) -> None:
    for name in (CACHE_VARIABLE, "XDG_CACHE_HOME"):
        monkeypatch.delenv(name, raising=False)
    for name, value in {"HOME": "/home/me", **variables}.items():
        monkeypatch.setenv(name, value)
    assert cache_folder() == Path(expected)


def test_an_empty_variable_turns_the_cache_off(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(CACHE_VARIABLE, "")
    assert cache_folder() is None


def kept(folder: Path, most: int, used: set[str]) -> list[str]:
    """Returns the names of the entries that stay."""
    remove_least_used(folder, most, used)
    return sorted(entry.name for entry in folder.iterdir())


def test_least_recently_used_entries_are_removed_beyond_the_limit(tmp_path: Path) -> None:
    for age, name in enumerate(("new", "middle", "old", "oldest"), start=2):
        (tmp_path / name).mkdir()
        (tmp_path / name / "pictures").write_bytes(bytes(100))
        os.utime(tmp_path / name, (time.time() - age * RECENT,) * 2)
    (tmp_path / "note").write_bytes(bytes(1000))
    assert kept(tmp_path, 400, set()) == ["middle", "new", "note", "old", "oldest"], "they fit"
    assert kept(tmp_path, 399, set()) == ["middle", "new", "note", "old"]
    assert kept(tmp_path, 200, {"old"}) == ["new", "note", "old"], "the running command uses the old one"
    mark_used(tmp_path / "new")
    assert kept(tmp_path, 0, set()) == ["new", "note"], "another process may read the new one"


def test_cache_is_created_for_its_user_alone(cache: Path) -> None:
    load_town(own_town(cache.parent))
    assert all(path.stat().st_mode & 0o777 == 0o700 for path in (cache, cache / "towns"))
    assert all(path.stat().st_mode & 0o077 == 0 for path in cache.rglob("*"))


def test_altered_town_is_compiled_again_though_its_checksum_is_right(cache: Path) -> None:
    path = own_town(cache.parent)
    sound = load_town(path)
    (entry,) = (cache / "towns").glob("*.npz")
    data = entry.read_bytes()[:-SIGNATURE_LENGTH]
    altered = pack(replaced_name(unpack(data, entry.stem)), entry.stem)
    for content in (altered, altered + data[-SIGNATURE_LENGTH:], altered + b"0" * SIGNATURE_LENGTH):
        entry.write_bytes(content)
        assert through_cache(path, lambda _: sound) is sound


@pytest.mark.skipif(sys.platform == "win32", reason="has other permissions")
def test_cache_that_others_can_write_is_not_used(cache: Path, caplog: pytest.LogCaptureFixture) -> None:
    path = own_town(cache.parent)
    load_town(path)
    (cache / "towns").chmod(0o777)
    (entry,) = (cache / "towns").glob("*.npz")
    for shared in (cache / "towns", entry, cache):
        shared.chmod(0o777)
        compiled = load_town("brookside")
        assert through_cache(path, lambda _, town=compiled: town) is compiled
        assert f"{shared} can be written by other users" in caplog.text
        shared.chmod(0o700)


@needs_posix
@pytest.mark.parametrize("kind", sorted(set(DAMAGES) - {"missing"}))
@pytest.mark.parametrize("seed", range(5))
def test_damaged_entry_is_removed_and_can_be_written_again(cache: Path, kind: str, seed: int) -> None:
    drawn = random.Random(seed)
    contents = {cache / "things" / name: drawn.randbytes(drawn.randrange(5000)) for name in "abc"}
    for path, content in contents.items():
        write_signed(path, content)
    damaged = cache / "things" / "b"
    DAMAGES[kind](damaged, drawn)
    for path, content in contents.items():
        assert read_signed(path) == (None if path == damaged else content)
    assert not damaged.exists()
    write_signed(damaged, contents[damaged])
    assert read_signed(damaged) == contents[damaged]


def test_first_damage_of_a_process_is_a_warning(
    cache: Path, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(user_cache, "_damage_reported", False)
    caplog.set_level(logging.DEBUG, user_cache.__name__)
    for name in "abc":
        write_signed(cache / "things" / name, b"content")
        (cache / "things" / name).write_bytes(b"")
        assert read_signed(cache / "things" / name) is None
    assert [record.levelname for record in caplog.records] == ["WARNING", "DEBUG", "DEBUG"]
    assert f"{cache / 'things' / 'a'} in the cache is damaged" in caplog.text
    caplog.clear()
    assert read_signed(cache / "things" / "d") is None and not caplog.records, "it was never there"


@needs_posix
@pytest.mark.parametrize("kind", sorted(DAMAGES))
def test_damaged_key_is_replaced(cache: Path, kind: str) -> None:
    entry = cache / "things" / "a"
    write_signed(entry, b"content")
    (cache / "other").write_bytes(b"something else")
    DAMAGES[kind](cache / KEY_FILE, random.Random(0))
    assert read_signed(entry) is None
    write_signed(entry, b"content")
    assert read_signed(entry) == b"content"


def test_write_replaces_a_folder_and_a_file_in_the_place_of_a_folder(cache: Path) -> None:
    cache.mkdir()
    (cache / "things").write_text("no folder")
    assert read_signed(cache / "things" / "a") is None
    (cache / "others" / "a" / "deep").mkdir(parents=True)
    for name in ("things", "others"):
        write_signed(cache / name / "a", b"content")
        assert read_signed(cache / name / "a") == b"content"


def test_only_folders_of_the_cache_replace_a_file(cache: Path, tmp_path: Path) -> None:
    (tmp_path / "precious").write_text("of the user")
    with pytest.raises(FileExistsError):
        write_signed(tmp_path / "precious" / "a", b"content")
    assert (tmp_path / "precious").read_text() == "of the user"


@needs_posix
@pytest.mark.parametrize("kind", sorted(DAMAGES))
@pytest.mark.parametrize("file", ["one", "deep/two", SEAL_FILE])
def test_seal_notices_damage_of_any_file(tmp_path: Path, kind: str, file: str) -> None:
    folder = tmp_path / "part"
    (folder / "deep").mkdir(parents=True)
    for name, content in {"one": b"1" * 100, "deep/two": b"2" * 5000, "deep/three": b"3"}.items():
        (folder / name).write_bytes(content)
    seal(folder, "whole", tmp_path)
    assert not is_sealed(folder, tmp_path), "it has another name"
    folder = folder.rename(tmp_path / "whole")
    (folder / "deep" / "more").write_text("added later")
    assert is_sealed(folder, tmp_path)
    DAMAGES[kind](folder / file, random.Random(0))
    assert not is_sealed(folder, tmp_path)


def own_town(folder: Path) -> Path:
    path = folder / "own.yaml"
    return written(folder, MIDTOWN).rename(path)


def replaced_name(town: Town) -> Town:
    town.name = "altered"
    return town


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv(CACHE_VARIABLE, str(tmp_path / "cache"))
    return tmp_path / "cache"
