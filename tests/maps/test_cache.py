import json
import logging
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from dorothie_gym.errors import TownError
from dorothie_gym.maps import Town, load_town
from dorothie_gym.maps import cache as cache_module
from dorothie_gym.maps.cache import compiler_digest, through_cache
from dorothie_gym.maps.yaml import read_yaml_town
from dorothie_gym.support.user_cache import CACHE_VARIABLE

from .same_town import town_bits

LOOP = """\
junctions: {a: [0, 0], b: [100, 0]}
streets: {North: [a, [0, -80], [100, -80], b], Middle: [a, b], South: [a, [0, 80], [100, 80], b]}
"""


class Reader:
    """Reads towns and counts how often it had to."""

    def __init__(self, read: Callable[[Path], Town] = read_yaml_town) -> None:
        self.count, self._read = 0, read

    def __call__(self, path: Path) -> Town:
        self.count += 1
        return self._read(path)


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A cache folder of the test's own."""
    monkeypatch.setenv(CACHE_VARIABLE, str(tmp_path / "cache"))
    return tmp_path / "cache" / "towns"


@pytest.fixture
def path(tmp_path: Path) -> Path:
    path = tmp_path / "loop.yaml"
    path.write_text(LOOP)
    return path


def _entry(folder: Path) -> Path:
    (entry,) = folder.iterdir()
    return entry


def test_a_town_is_compiled_once_and_is_the_same_from_the_cache(path: Path, folder: Path) -> None:
    reader = Reader()
    first, second = through_cache(path, reader), through_cache(path, reader)
    assert reader.count == 1
    assert first is not second
    assert town_bits(first) == town_bits(second)
    assert _entry(folder).suffix == ".npz"


def test_load_town_uses_the_cache(path: Path, folder: Path) -> None:
    load_town(path)
    assert _entry(folder).stat().st_size > 1000


def test_a_file_that_changed_is_compiled_again_even_if_it_looks_the_same(path: Path) -> None:
    reader, before = Reader(), path.stat()
    through_cache(path, reader)
    path.write_text(LOOP.replace("Middle", "Centre"))
    os.utime(path, ns=(before.st_atime_ns, before.st_mtime_ns))
    assert path.stat().st_size == before.st_size
    assert through_cache(path, reader).streets[1].name == "Centre"
    assert reader.count == 2


def test_files_of_equal_content_keep_their_names(path: Path, tmp_path: Path) -> None:
    other = tmp_path / "ring.yaml"
    other.write_text(LOOP)
    assert [through_cache(p, Reader()).name for p in (path, other, path, other)] == ["loop", "ring", "loop", "ring"]


def test_files_of_equal_content_and_name_share_an_entry(path: Path, tmp_path: Path, folder: Path) -> None:
    (tmp_path / "copy").mkdir()
    other = tmp_path / "copy" / path.name
    other.write_text(LOOP)
    reader = Reader()
    assert through_cache(path, reader).name == through_cache(other, reader).name
    assert reader.count == 1
    assert _entry(folder)


def test_another_compiler_compiles_again(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    reader = Reader()
    through_cache(path, reader)
    monkeypatch.setattr(cache_module, "compiler_digest", lambda: "of another version")
    through_cache(path, reader)
    assert reader.count == 2


def test_the_compiler_s_digest_covers_all_of_our_modules_that_compile() -> None:
    code = (
        "import sys, json; from dorothie_gym.maps.opendrive import read_opendrive;"
        "from dorothie_gym.maps.yaml import read_yaml_town;"
        "print(json.dumps([m for m in sys.modules if m.startswith('dorothie_gym.')]))"
    )
    loaded = json.loads(subprocess.run([sys.executable, "-c", code], capture_output=True, check=True).stdout)
    helpers = [f"support.{name}" for name in ("copying", "files", "input_files", "libraries", "schemas", "user_cache")]
    names = ["_registration", "_startup", "_version", "errors", "support", *helpers]
    without_effect = {f"dorothie_gym.{name}" for name in names}
    covered = ("dorothie_gym.maps", "dorothie_gym.support.compilation")
    others = {m for m in loaded if not m.startswith(covered)} - without_effect
    assert others == {f"dorothie_gym.support.{name}" for name in ("portable_arrays", "portable_math")}


def test_the_compiler_s_digest_follows_its_sources(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def digest() -> str | None:
        compiler_digest.cache_clear()
        return compiler_digest()

    real = digest()
    monkeypatch.setattr(cache_module, "files", lambda package: tmp_path)
    try:
        assert digest() is None  # no sources, no cache
        (tmp_path / "deep").mkdir()
        seen = [real]
        for name, text in (("a.py", "1"), ("a.py", "2"), ("b.py", "2"), ("deep/a.py", "3")):
            (tmp_path / name).write_text(text)
            seen.append(digest())
        assert len(set(seen)) == len(seen)
        (tmp_path / "data.yaml").write_text("no source")
        assert digest() == seen[-1]
    finally:
        monkeypatch.undo()
        assert digest() == real


@pytest.mark.parametrize("at", [0, 10, 0.1, 0.5, 0.9, -70, -64, -1])
def test_a_damaged_entry_is_compiled_again_and_replaced(path: Path, folder: Path, at: float) -> None:
    good = town_bits(through_cache(path, Reader()))
    entry, reader = _entry(folder), Reader()
    data = entry.read_bytes()
    place = int(at * len(data)) if isinstance(at, float) else at % len(data)
    entry.write_bytes(data[:place] + bytes([data[place] ^ 1]) + data[place + 1 :])
    assert town_bits(through_cache(path, reader)) == good
    assert entry.read_bytes() == data
    assert town_bits(through_cache(path, reader)) == good
    assert reader.count == 1


@pytest.mark.parametrize("share", [0.0, 0.01, 0.5, 0.99])
def test_a_truncated_entry_is_compiled_again_and_replaced(
    path: Path, folder: Path, share: float, caplog: pytest.LogCaptureFixture
) -> None:
    through_cache(path, Reader())
    entry, reader = _entry(folder), Reader()
    data = entry.read_bytes()
    entry.write_bytes(data[: int(share * len(data))])
    with caplog.at_level(logging.DEBUG):
        through_cache(path, reader)
    assert reader.count == 1
    assert entry.read_bytes() == data
    (record,) = (record for record in caplog.records if record.name.startswith("dorothie_gym"))
    assert f"{entry} in the cache is damaged" in record.getMessage()


def test_the_entry_of_another_town_under_a_wrong_name_is_not_trusted(path: Path, tmp_path: Path, folder: Path) -> None:
    through_cache(path, Reader())
    entry, other = _entry(folder), tmp_path / "ring.yaml"
    other.write_text(LOOP)
    through_cache(other, Reader())
    (stranger,) = set(folder.iterdir()) - {entry}
    entry.write_bytes(stranger.read_bytes())
    assert through_cache(path, Reader()).name == "loop"


def test_a_folder_in_place_of_an_entry_is_ignored(path: Path, folder: Path) -> None:
    through_cache(path, Reader())
    entry = _entry(folder)
    entry.unlink()
    entry.mkdir()
    assert through_cache(path, Reader()).name == "loop"
    assert not list(folder.glob("*.part"))


def test_a_cache_folder_that_cannot_be_is_no_error(
    path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setenv(CACHE_VARIABLE, str(path))  # a file is no folder
    reader = Reader()
    with caplog.at_level(logging.DEBUG, cache_module.__name__):
        assert through_cache(path, reader).name == through_cache(path, reader).name == "loop"
    assert reader.count == 2
    assert {record.levelno for record in caplog.records} == {logging.DEBUG}


def test_a_cache_folder_without_permission_is_no_error(path: Path, folder: Path) -> None:
    folder.mkdir(parents=True)
    folder.chmod(0o000)
    try:
        if os.access(folder, os.W_OK):
            pytest.skip("this user may write everywhere")
        assert through_cache(path, Reader()).name == "loop"
    finally:
        folder.chmod(0o700)


def test_a_write_that_fails_leaves_nothing_behind(path: Path, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> None:
        raise PermissionError("no")

    read_yaml_town(path)  # machine code of the reader is written before
    monkeypatch.setattr(os, "replace", refuse)
    assert through_cache(path, Reader()).name == "loop"
    assert list(folder.iterdir()) == []


def test_a_file_that_changes_while_it_is_compiled_is_not_kept(path: Path, folder: Path) -> None:
    def read(path: Path) -> Town:
        town = read_yaml_town(path)
        path.write_text(LOOP + "\n")
        return town

    through_cache(path, read)
    assert not folder.exists()


def test_an_invalid_file_is_reported_under_its_own_path_every_time(tmp_path: Path, folder: Path) -> None:
    for name in ("first.yaml", "second.yaml", "first.yaml"):
        bad = tmp_path / name
        bad.write_text("junctions: [")
        with pytest.raises(TownError, match=name):
            load_town(bad)
    assert not folder.exists()


def test_nothing_is_kept_where_the_cache_is_turned_off(
    path: Path, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(CACHE_VARIABLE, "")
    reader = Reader()
    through_cache(path, reader)
    through_cache(path, reader)
    assert reader.count == 2
    assert not folder.exists()


def test_the_cache_does_not_grow_for_ever(path: Path, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cache_module, "MOST_TOWNS", 3)
    folder.mkdir(parents=True)
    left_behind = folder / "killed.part"
    left_behind.write_bytes(b"half a town")
    os.utime(left_behind, ns=(1, 1))
    (folder / "notes.txt").write_text("somebody else's")
    for k in range(5):
        path.write_text(LOOP + "\n" * k)
        through_cache(path, Reader())
        os.utime(max(folder.glob("*.npz"), key=lambda p: p.stat().st_mtime_ns), ns=(k + 2, k + 2))
    assert len(list(folder.glob("*.npz"))) == 3
    assert not left_behind.exists()
    assert (folder / "notes.txt").exists()
    reader = Reader()
    through_cache(path, reader)
    assert reader.count == 0  # the newest is still there


WRITER = """
import sys
from pathlib import Path
from dorothie_gym.maps import cache
from dorothie_gym.maps.yaml import read_yaml_town
path, folder = Path(sys.argv[1]), cache.towns_folder()
town = read_yaml_town(path)
for _ in range(60):
    cache._keep(folder, "shared", town)
    found = cache._recall(folder, "shared")
    assert found is not None and len(found.lanes) == len(town.lanes)
    assert cache.through_cache(path, read_yaml_town).name == "loop"
"""


@pytest.mark.long
def test_processes_that_write_the_same_entry_at_the_same_time_see_whole_towns(path: Path, folder: Path) -> None:
    command = [sys.executable, "-c", WRITER, str(path)]
    writers = [subprocess.Popen(command, stderr=subprocess.PIPE) for _ in range(3)]
    errors = [writer.communicate(timeout=60)[1].decode() for writer in writers]
    assert [writer.returncode for writer in writers] == [0, 0, 0], errors
    assert len(list(folder.iterdir())) == 2
    assert not list(folder.glob("*.part"))
