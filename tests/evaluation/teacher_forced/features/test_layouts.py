"""A session in SDN's layout gives the same columns as the one that it was written from."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from dorothie_gym.archive import Corpus, Task, read_session
from dorothie_gym.archive.sdn import write_sdn
from dorothie_gym.evaluation.teacher_forced.features import Columns, build, columns_of, gather, points
from dorothie_gym.evaluation.teacher_forced.features.columns import GROUPS
from tests.archive.sdn.builders import hub, release, sample
from tests.evaluation.teacher_forced.features.played import play
from tests.session.recording.builders import write
from tests.session.recording.dialogues import talk


def assert_same(one: Columns, other: Columns) -> None:
    assert one.texts == other.texts
    assert one.sessions.folds == other.sessions.folds
    for name in GROUPS:
        for field, array in vars(getattr(one, name)).items():
            if field != "names":
                np.testing.assert_array_equal(array, getattr(getattr(other, name), field), err_msg=f"{name}.{field}")
    for town, again in zip(one.towns, other.towns, strict=True):
        np.testing.assert_equal(vars(town), vars(again))


def in_sdn(corpus: Path, out: Path) -> Path:
    """Writes a corpus as SDN, names in an order of their own."""
    for number, entry in enumerate(reversed(Corpus.load(corpus).entries)):
        folder = out / entry.path.relative_to(corpus).parent
        folder.mkdir(parents=True, exist_ok=True)
        write_sdn(entry.load(), folder / f"log_{number}")
    return out


def test_columns_do_not_depend_on_the_layout(tmp_path: Path) -> None:
    corpus = tmp_path / "ours"
    play(corpus / "train" / "a", seed=1, seconds=40.0)
    play(corpus / "train" / "b", seed=2, seconds=40.0)
    write(corpus / "test" / "seen" / "c", talk())
    ours, theirs = build(corpus, cache=False), build(in_sdn(corpus, tmp_path / "sdn"), cache=False)
    assert_same(ours, theirs)
    assert ours.content == theirs.content and ours.key != theirs.key
    assert len(ours.objects.kind) > 0 and len(ours.towns[0].lanes) > 0
    assert ours.sessions.names != theirs.sessions.names
    for task in Task:
        assert points(ours, task).event.tolist() == points(theirs, task).event.tolist()


def test_columns_do_not_depend_on_names_within_a_fold(tmp_path: Path) -> None:
    one, other = tmp_path / "one", tmp_path / "other"
    write(one / "train" / "a", talk(), seed=1)
    write(one / "train" / "b", talk()[:6], seed=2)
    shutil.copytree(one / "train" / "a", other / "train" / "z")
    shutil.copytree(one / "train" / "b", other / "train" / "y")
    assert_same(build(one, cache=False), build(other, cache=False))


@pytest.mark.parametrize("layout", [release, sample, hub])
def test_sessions_of_the_paper_s_corpus_give_points_and_batches(tmp_path: Path, layout: Callable[[Path], Path]) -> None:
    columns = columns_of(read_session(layout(tmp_path / "log_1")))
    for task in Task:
        table = points(columns, task)
        batch = gather(columns, table, np.arange(len(table)))
        assert len(table) > 0 and len(batch) == len(table)
        assert batch.window_mask.any() == (layout is not hub), "the hub has no trajectory"
        assert not batch.has_objects.any()
