"""Arrays in the user's cache: whatever happens to their file, they are read unchanged or built again."""

from __future__ import annotations

import os
import random
from pathlib import Path

import numpy as np
import pytest

from dorothie_gym.pictures.camera.array_cache import Arrays, through_cache
from tests.support.cache_damage import DAMAGES


@pytest.mark.skipif(os.name != "posix", reason="pipes of POSIX")
@pytest.mark.parametrize("kind", sorted(DAMAGES))
def test_damaged_arrays_are_built_again(kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("DOROTHIE_GYM_CACHE", str(tmp_path / "cache"))
    builds: list[bytes] = []

    def build(key: bytes) -> Arrays:
        builds.append(key)
        return {"heights": np.frombuffer(key, dtype=np.uint8).astype(np.float64)}

    def read(key: bytes) -> list[float]:
        found = through_cache("things", key, 4, build=lambda: build(key), pack=dict, unpack=dict)
        heights: list[float] = found["heights"].tolist()
        return heights

    read(b"12")
    others = set((tmp_path / "cache" / "things").iterdir())
    assert read(b"345") == read(b"345") == [51.0, 52.0, 53.0]
    (entry,) = set((tmp_path / "cache" / "things").iterdir()) - others
    assert builds == [b"12", b"345"]
    DAMAGES[kind](entry, random.Random(0))
    assert read(b"345") == read(b"345") == [51.0, 52.0, 53.0]
    assert builds == [b"12", b"345", b"345"]
