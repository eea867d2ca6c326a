"""What the package computes, prints and writes is what it was when `frozen.json` was made.

After a change that is meant, `python -m tests.portability.digests --freeze PATTERN...` keeps the new digests.
"""

from __future__ import annotations

import json
import os
import platform
import subprocess
import sys
from collections.abc import Mapping
from enum import Enum, IntEnum
from fnmatch import fnmatchcase
from pathlib import Path

import numpy as np
import pytest

from dorothie_gym.maps import town_names
from tests.portability.digests import TEXTS, frozen, library_versions
from tests.portability.parts import GROUPS, Group, digests_of, part_names, values_of
from tests.portability.sessions import missing

ROOT = Path(__file__).parents[2]

QUICK = ("towns/brookside", "imported_maps/curved.xodr", "sessions/brookside text 0", "error_lines/unknown [st]*")

OTHER_TOWNS = [name for name in town_names() if name not in ("brookside", "midtown")]

CAMERA_ELSEWHERE = "sessions with a camera in other towns"
"""Sessions for which the scenes of two further towns are built, which takes most of the time."""

SLOW = (
    CAMERA_ELSEWHERE,
    "sessions in other towns",
    "towns, console and environments",
    "models, predictions and leaderboard",
)
"""Batches of a minute, most of whose kinds `test_all_sessions_are_equal` compares with the same digests."""

BATCHES: dict[str, tuple[str, ...]] = {
    "sessions in brookside and midtown": ("sessions/brookside *", "sessions/midtown *"),
    "sessions in other towns": tuple(f"sessions/{name} [!c]*" for name in OTHER_TOWNS),
    CAMERA_ELSEWHERE: tuple(f"sessions/{name} camera *" for name in OTHER_TOWNS),
    "towns, console and environments": (
        "towns/*",
        "imported_maps/*",
        "console/*",
        "role_exports/*",
        "navigation_episodes/*",
        "batches/*",
        "environments/*",
        "camera_observation/*",
    ),
    "models, predictions and leaderboard": ("shipped_models/*", "predictions/*", "leaderboard/*"),
    "texts of the command line": ("help_texts/*", "error_lines/*"),
}
"""Parts that are computed together in one process, which takes seconds to start, of at most a minute on one core."""

SHARED = ("shared_maps/*",)

COUNTS = {"imported_maps": 2, "console": 1, "error_lines": 10, "predictions": 2, "navigation_episodes": 2} | {
    f"sessions/{name}": 12 for name in town_names()
}
"""Least number of parts."""

same_processor = pytest.mark.skipif(
    platform.machine() not in ("x86_64", "AMD64"), reason="the digests are those of x86-64 processors"
)


def matching(parts: Mapping[str, dict[str, str]], patterns: tuple[str, ...]) -> dict[str, dict[str, str]]:
    return {part: found for part, found in parts.items() if any(fnmatchcase(part, pattern) for pattern in patterns)}


def differences(found: Mapping[str, dict[str, str]], wanted: Mapping[str, dict[str, str]]) -> list[str]:
    """Names the values that differ, are new or left, as `part: value`."""
    return [
        f"{part}: {name}"
        for part in {**wanted, **found}
        for name in {**wanted.get(part, {}), **found.get(part, {})}
        if wanted.get(part, {}).get(name) != found.get(part, {}).get(name)
    ]


def check(*patterns: str) -> None:
    """Computes parts in a fresh process and fails with the names of what differs; of texts, it prints them."""
    kept = frozen()
    done = subprocess.run(
        [sys.executable, "-m", "tests.portability.digests", *patterns],
        env={**os.environ, "PYTHONPATH": str(ROOT), "SDL_VIDEODRIVER": "dummy"},
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr[-3000:]
    wanted = {part: value for part, value in matching(kept["parts"], patterns).items() if not missing(part)}
    assert wanted
    found = differences(json.loads(done.stdout), wanted)
    if not found:
        return
    lines = [f"differs from frozen.json: {line}" for line in found]
    for part in {line.rsplit(": ", 1)[0] for line in found}:
        if part.split("/")[0] in TEXTS and part in part_names():
            lines += [f"----- {part} is now:", *(str(value) for _, value in values_of(part))]
    changed = {name: of for name, of in library_versions().items() if kept["libraries"].get(name) != of}
    if changed:
        lines.append(f"frozen with {kept['libraries']}; here is {changed}")
    pytest.fail("\n".join(lines), pytrace=False)


def skip_other_texts() -> None:
    """Skips where another release of the libraries that lay help texts out would write them otherwise."""
    kept, here = frozen()["libraries"], library_versions()
    other = [f"{name} {here[name]}" for name in ("typer", "click", "rich") if kept[name] != here[name]]
    if other:
        pytest.skip(f"help texts were frozen with other releases; here is {', '.join(other)}")


@same_processor
def test_towns_and_a_session_are_as_before() -> None:
    check(*QUICK)


@same_processor
@pytest.mark.long
@pytest.mark.timeout(900)  # other tests use the cores, too
@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.slow) if name in SLOW else name for name in BATCHES]
)
def test_digests_are_as_before(name: str) -> None:
    if any(pattern.split("/")[0] in TEXTS for pattern in BATCHES[name]):
        skip_other_texts()
    check(*BATCHES[name])


@same_processor
@pytest.mark.long
@pytest.mark.timeout(900)
def test_sessions_on_real_maps_are_as_before() -> None:
    if all(missing(part) for part in part_names(*SHARED)):
        pytest.skip("the maps are not in ../shared/maps")
    check(*SHARED)


# --- The net itself ---------------------------------------------------------------------------------------------------


def test_every_part_is_frozen_and_tested() -> None:
    every = set(part_names())
    assert every == set(frozen()["parts"]), "parts are new or gone: freeze them"
    patterns = (*SHARED, *(pattern for batch in BATCHES.values() for pattern in batch))
    assert every == set(part_names(*patterns))
    for start, count in COUNTS.items():
        assert len(part_names(f"{start}*")) >= count


def test_digest_sees_every_bit_and_no_class_name(monkeypatch: pytest.MonkeyPatch) -> None:
    class One(Enum):
        A = "a"

    class Another(IntEnum):
        B = 1

    def digest(*values: object) -> dict[str, str]:
        monkeypatch.setitem(GROUPS, "made", Group(("up",), lambda name: iter([("value", value) for value in values])))
        return digests_of("made/up")

    assert digest([One.A, Another.B]) == digest(["a", 1])
    with pytest.raises(TypeError):
        digest(object())
    others = [0.1, np.nextafter(0.1, 1), np.float32(0.1), 1, True, "1", b"1", None, [1], [[1]], {"1": 1}, np.array([1])]
    assert len({digest(value)["value"] for value in others}) == len(others)


def test_differences_name_part_and_value() -> None:
    kept = {"sessions/a": {"events.jsonl": "1", "frames": "2"}, "sessions/b": {"frames": "3"}}
    assert differences(kept, kept) == []
    changed = {"sessions/a": {"events.jsonl": "0", "frames": "2"}, "sessions/c": {"frames": "3"}}
    assert differences(changed, kept) == ["sessions/a: events.jsonl", "sessions/b: frames", "sessions/c: frames"]
