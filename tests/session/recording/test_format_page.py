"""The page on the session format names everything that is in the files."""

from __future__ import annotations

import json
from pathlib import Path

import pyarrow.parquet as pq
import pytest

from dorothie_gym.archive import Corpus
from dorothie_gym.session.recording import FORMAT_VERSION, EventType, LandmarkRow, SubgoalRow
from dorothie_gym.session.recording.files import MAX_EVENTS, MAX_FRAMES
from dorothie_gym.support.input_files import MAX_SESSION_TEXT
from tests.session.recording.builders import write
from tests.session.recording.dialogues import talk
from tests.session.recording.test_scene import record

PAGE = (Path(__file__).parents[3] / "docs/session-format.md").read_text(encoding="utf-8")


def row(name: str) -> bool:
    """Whether the page has a name in the first column of a table."""
    return any(f"`{name}`" in line.split("|")[1] for line in PAGE.splitlines() if line.startswith("|"))


def test_every_field_of_the_header_is_on_the_page(tmp_path: Path) -> None:
    page = json.loads((write(tmp_path / "one", talk()) / "session.json").read_text())
    assert [name for name in page if not row(name)] == []
    assert [
        name for kind in (LandmarkRow, SubgoalRow) for name in kind.__annotations__ if f"`{name}`" not in PAGE
    ] == []


def test_every_column_of_the_frames_is_on_the_page(tmp_path: Path) -> None:
    record(tmp_path / "one", finish=True)
    schema = pq.read_schema(tmp_path / "one/frames.parquet")
    assert [name for name in schema.names if not row(name)] == []
    inner = [field.name for name in ("actors", "lights") for field in schema.field(name).type.value_type]
    assert [name for name in inner if f"`{name}`" not in PAGE] == []


def test_every_column_of_the_tables_and_the_manifest_is_on_the_page(tmp_path: Path) -> None:
    write(tmp_path / "corpus/train/a", talk())
    corpus = Corpus.load(tmp_path / "corpus")
    names = [name for path in corpus.export(tmp_path) for name in pq.read_schema(path).names]
    names += list(json.loads(corpus.write_manifest().read_text())["sessions"][0])
    assert [name for name in names if f"`{name}`" not in PAGE] == []


@pytest.mark.parametrize("kind", [EventType.DIALOGUE_MOVE, EventType.PHYSICAL_ACTION, EventType.COLLISION])
def test_checked_types_are_on_the_page(kind: EventType) -> None:
    assert row(kind.value)


def test_version_and_limits_are_those_of_the_code() -> None:
    assert f"version {FORMAT_VERSION}." in PAGE
    assert f"{MAX_EVENTS:,} events and {MAX_FRAMES:,} frames" in PAGE and f"{MAX_SESSION_TEXT >> 20} MiB" in PAGE
