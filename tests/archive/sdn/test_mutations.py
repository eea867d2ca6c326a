"""Sessions that are damaged at random: read, or refused by one error that names file and place; nothing else."""

from __future__ import annotations

import copy
import json
import shutil
from collections.abc import Iterator
from pathlib import Path
from random import Random
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from dorothie_gym.archive import read_session
from dorothie_gym.errors import SessionError
from dorothie_gym.evaluation.analysis import PHENOMENA, DialogueView, inconsistencies
from dorothie_gym.session.recording import Session
from tests.archive.sdn.builders import hub, release, sample
from tests.session.recording.builders import write
from tests.session.recording.dialogues import talk

ODD: tuple[Any, ...] = (
    None, True, -1, 3.5, 1e308, 2**63, 2**200, "", "../../x", "\0", "9" * 400, [], {}, [[]], {"a": {"b": []}},
    "Instruct", "NaN",
    float("nan"), float("-inf"), [1, 2, 3], {"Landmark": ["KFC"]}, "\u202e", "x" * 70_000,
)  # fmt: skip
"""Wrong values of a field."""

PIECES = (b'"', b"[", b"]", b"{", b"}", b",", b"\n", b"\0", b"1e999", b"NaN", b"\\ud800", b"\xff")


def places(value: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """The path of every value below a JSON value."""
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, below in items:
        yield (*path, key)
        yield from places(below, (*path, key))


def change_field(value: Any, random: Random) -> None:
    path = random.choice(list(places(value)) or [()])
    if not path:
        return
    around = value
    for key in path[:-1]:
        around = around[key]
    action = random.randrange(4)
    if action == 0:
        del around[path[-1]]
    elif action == 1 and isinstance(around, list):
        around.insert(random.randrange(len(around) + 1), copy.deepcopy(random.choice(around)))
    elif action == 2 and isinstance(around, dict):
        around[f"{path[-1]}s"] = around.pop(path[-1])
    else:
        around[path[-1]] = copy.deepcopy(random.choice(ODD))


def change_bytes(content: bytes, random: Random) -> bytes:
    place = random.randrange(max(len(content), 1))
    return random.choice(
        (
            content[:place],
            content[:place] + random.choice(PIECES) + content[place:],
            content[:place] + content[place + random.randrange(1, 200) :],
            content[:place] + content[: random.randrange(1, 300)] + content[place:],
        )
    )


def damage(file: Path, random: Random) -> None:
    content = file.read_bytes()
    if file.suffix == ".json" and random.random() < 0.7:
        value = json.loads(content)
        for _ in range(random.randrange(1, 5)):
            change_field(value, random)
        content = json.dumps(value).encode()
    else:
        content = change_bytes(content, random)
    file.write_bytes(content)


@pytest.fixture(scope="module")
def originals(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    root = tmp_path_factory.mktemp("originals")
    made = {"release": release(root / "release"), "sample": sample(root / "sample"), "hub": hub(root / "hub")}
    return {**made, "native": write(root / "native", talk())}


@pytest.mark.parametrize("layout", ["release", "sample", "hub", "native"])
@settings(
    max_examples=40,
    deadline=None,
    derandomize=True,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
    database=None,
)
@given(random=st.randoms(use_true_random=False))
def test_damaged_file_is_read_or_rejected_with_one_sentence(
    layout: str, random: Random, originals: dict[str, Path], tmp_path: Path
) -> None:
    folder = tmp_path / "damaged"
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(originals[layout], folder)
    damage(
        random.choice(
            sorted(path for path in folder.iterdir() if path.suffix in (".json", ".jsonl", ".csv", ".parquet"))
        ),
        random,
    )
    try:
        session = read_session(folder)
    except SessionError as error:
        assert str(folder) in str(error) and "\n" not in str(error) and len(str(error)) < 600
        return
    session.check()
    heard = DialogueView(session)
    inconsistencies(session, heard.units)
    for phenomenon in PHENOMENA:
        if phenomenon.has_cause(heard):
            list(phenomenon.find(heard))
    shutil.rmtree(tmp_path / "saved", ignore_errors=True)
    assert Session.load(session.save(tmp_path / "saved")).events == session.events
