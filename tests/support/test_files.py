from __future__ import annotations

import errno
import os
from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path

import pytest

from dorothie_gym.support.files import PART, make_folder, new_folder, replacing, write_atomically
from tests.power_failure import Disk, disk, needs_linux

__all__ = ["disk"]


@pytest.mark.parametrize("shared", [False, True])
def test_file_is_replaced_and_no_part_is_left(tmp_path: Path, shared: bool) -> None:
    write_atomically(tmp_path / "a", "one", shared=shared)
    write_atomically(tmp_path / "a", b"two", shared=shared)
    assert (tmp_path / "a").read_text() == "two"
    assert [path.name for path in tmp_path.iterdir()] == ["a"]


@needs_linux
def test_written_file_survives_a_power_failure(tmp_path: Path, disk: Disk) -> None:
    for content in (b"one", b"two", b"three" * 10_000):
        write_atomically(tmp_path / "a", content)
        assert disk.content(tmp_path / "a") == content
    assert not disk.early


@needs_linux
def test_made_folder_survives_a_power_failure(tmp_path: Path, disk: Disk) -> None:
    for name in ("deep/er/one", "deep/er/two", "deep/er/two"):
        make_folder(tmp_path / name, parents=True)
        write_atomically(tmp_path / name / "a", b"one")
        assert disk.content(tmp_path / name / "a") == b"one"


@needs_linux
def test_file_that_can_be_made_again_is_not_synced(tmp_path: Path, disk: Disk) -> None:
    write_atomically(tmp_path / "a", b"one", synced=False)
    assert (tmp_path / "a").read_bytes() == b"one" and disk.content(tmp_path / "a") is None


@pytest.mark.parametrize("number", [errno.EINVAL, errno.ENOTSUP])
def test_file_system_that_cannot_sync_is_no_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: int) -> None:
    def refuse(_: int) -> None:
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(os, "fsync", refuse)
    write_atomically(tmp_path / "a", "one")
    assert (tmp_path / "a").read_text() == "one"


def test_failed_sync_is_reported_and_keeps_the_old_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(_: int) -> None:
        raise OSError(errno.EIO, os.strerror(errno.EIO))

    write_atomically(tmp_path / "a", "old")
    monkeypatch.setattr(os, "fsync", fail)
    with pytest.raises(OSError, match="Input/output error") as caught:
        write_atomically(tmp_path / "a", "new")
    assert caught.value.filename == str(tmp_path / "a")
    assert (tmp_path / "a").read_text() == "old" and [path.name for path in tmp_path.iterdir()] == ["a"]


@pytest.mark.parametrize("shared", [False, True])
def test_failed_write_keeps_the_old_file(tmp_path: Path, shared: bool) -> None:
    (tmp_path / "a").write_text("old")
    with pytest.raises(KeyboardInterrupt), replacing(tmp_path / "a", shared=shared) as part:  # noqa: PT012
        part.write_text("half")
        raise KeyboardInterrupt
    assert (tmp_path / "a").read_text() == "old"
    assert [path.name for path in tmp_path.iterdir()] == ["a"]


def test_link_in_the_place_of_the_part_is_not_followed(tmp_path: Path) -> None:
    (tmp_path / "outside").write_text("precious")
    (tmp_path / f"a{PART}").symlink_to(tmp_path / "outside")
    write_atomically(tmp_path / "a", "new")
    assert (tmp_path / "outside").read_text() == "precious"


@pytest.mark.skipif(os.name != "posix", reason="pipes of POSIX")
def test_pipe_is_not_replaced_by_a_file(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(OSError, match="pipe or device"):
        write_atomically(tmp_path / "pipe", "new")
    assert (tmp_path / "pipe").is_fifo()


def test_shared_parts_have_names_of_their_own(tmp_path: Path) -> None:
    with replacing(tmp_path / "a", shared=True) as one, replacing(tmp_path / "a", shared=True) as other:
        assert one != other
        one.write_text("first")
        other.write_text("second")
    assert (tmp_path / "a").read_text() == "first", "the outer block is left last"


def test_folder_appears_when_it_is_whole(tmp_path: Path) -> None:
    with new_folder(tmp_path / "deep/folder", hidden=True) as part:
        (part / "file").touch()
        assert not (tmp_path / "deep/folder").exists() and part.name.startswith(".folder.")
    assert [path.name for path in (tmp_path / "deep").iterdir()] == ["folder"]


def test_failed_folder_leaves_nothing(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="stop"), new_folder(tmp_path / "folder"):
        raise ValueError("stop")
    (tmp_path / "taken").mkdir()
    (tmp_path / "taken/file").touch()
    with pytest.raises(OSError, match="taken"), new_folder(tmp_path / "taken"):
        pass
    assert [path.name for path in tmp_path.iterdir()] == ["taken"]


@pytest.mark.skipif(not Path("/dev/full").is_char_device(), reason="a device of Linux")
@pytest.mark.parametrize("writing", [replacing, new_folder])
def test_full_disk_is_reported_with_the_name_of_the_file(
    writing: Callable[[Path], AbstractContextManager[Path]], tmp_path: Path
) -> None:
    with pytest.raises(OSError, match="No space left") as caught, writing(tmp_path / "a"):
        Path("/dev/full").write_text("more")
    assert caught.value.errno == errno.ENOSPC and caught.value.filename == str(tmp_path / "a")
    assert not list(tmp_path.iterdir())
