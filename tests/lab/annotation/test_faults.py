"""Faults while marks are written: writes that fail half way, and processes that are killed at random moments.

`--malformed-seed` is added to the seeds.
"""

from __future__ import annotations

import os
import random
import signal
import sys
import time
from multiprocessing import get_context
from pathlib import Path

import pytest

from dorothie_gym.lab.annotation.links import keep_links, read_links, seats_of
from dorothie_gym.lab.annotation.log import Action, AnnotationLog, log_path
from dorothie_gym.lab.annotation.marks import Annotation
from dorothie_gym.lab.annotation.rows import change_of
from dorothie_gym.lab.annotation.workplace import SeatKind
from tests.full_disk import full_disk
from tests.lab.annotation.builders import recorded
from tests.lab.annotation.killing import kill_again_and_again
from tests.lab.annotation.marking import ANNA, content_of, mark_on_and_on, random_edit, workplace

WRITES = [(1, 40), pytest.param(2, 400, marks=pytest.mark.long)]
KILLS = [(1, 4), pytest.param(2, 25, marks=pytest.mark.long), pytest.param(3, 300, marks=pytest.mark.slow)]
SERVER_KILLS = [pytest.param(1, 3, marks=pytest.mark.long), pytest.param(2, 40, marks=pytest.mark.slow)]


@pytest.mark.parametrize(("seed", "count"), WRITES)
def test_writes_that_fail_lose_nothing_and_leave_nothing(
    seed: int, count: int, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    rng = random.Random(seed + request.config.getoption("--malformed-seed"))
    _, text = recorded(tmp_path / "c" / "one")
    path, work, failed = log_path(tmp_path / "c" / "one", "anna"), workplace(tmp_path / "c"), 0
    base = work.marks(ANNA, 0)["edit"]
    for number in range(count):
        edit, before = random_edit(work, text, rng), path.read_bytes() if path.exists() else None
        size = len(before or b"")
        try:
            with full_disk(size + rng.choice([0, 1, rng.randrange(400), rng.randrange(4000), 10**6])):
                base = work.edit(ANNA, 0, base, edit)["edit"]
        except OSError:
            failed += 1
            assert (path.read_bytes() if path.exists() else None) == before
            if rng.random() < 0.3:
                work = workplace(tmp_path / "c")  # the server is started anew
            base = work.edit(ANNA, 0, base, edit, again=True)["edit"]
        if number % 20 == 0 or number == count - 1:  # reading all of it takes long
            log = AnnotationLog(text, tmp_path / "c" / "one", "anna")
            assert (log.annotation, log.edits) == (work.open(0).log(ANNA).annotation, base)
    assert count / 10 < failed < count and base == work.open(0).log(ANNA).edits
    assert work.open(0).log(ANNA).lines[0].action is Action.START, "the suggestions were kept"


@pytest.mark.parametrize("seed", range(3))
def test_links_that_cannot_be_written_leave_those_before(seed: int, tmp_path: Path) -> None:
    rng = random.Random(seed)
    recorded(tmp_path / "one")
    for k in range(20):
        before = read_links(tmp_path / "one")
        seats = seats_of(tmp_path / "one", [(f"a{k}", SeatKind.ANNOTATOR)], renew=bool(k % 2))
        with pytest.raises(OSError, match="too large"), full_disk(rng.randrange(60)):
            keep_links(tmp_path / "one", seats, renew=bool(k % 2))
        assert read_links(tmp_path / "one") == before
        keep_links(tmp_path / "one", seats, renew=bool(k % 2))
        assert [row for row in read_links(tmp_path / "one") if row.sha256 == seats[0].digest]
        assert [each.name for each in (tmp_path / "one" / "annotations").iterdir()] == ["links.json"]


def state_after(log: AnnotationLog, edit: int) -> Annotation:
    """The marks of a log after one of its edits."""
    found = Annotation.empty(log.text)
    for line in log.lines:
        if line.edit <= edit:
            found = found.after(change_of(line.change))
    return found


@pytest.mark.skipif(sys.platform == "win32", reason="needs signals")
@pytest.mark.parametrize(("seed", "count"), KILLS)
def test_killed_processes_lose_no_acknowledged_edit(
    seed: int, count: int, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    rng = random.Random(seed + request.config.getoption("--malformed-seed"))
    _, text = recorded(tmp_path / "c" / "one")
    context = get_context("forkserver")
    context.set_forkserver_preload(["tests.lab.annotation.marking"])
    last: tuple[int, bytes] | None = None
    for _ in range(count):
        ours, theirs = context.Pipe(duplex=False)
        process = context.Process(target=mark_on_and_on, args=(tmp_path / "c", rng.randrange(2**32), theirs))
        process.start()
        theirs.close()
        assert ours.poll(60.0), "it has begun"
        time.sleep(rng.random() * 0.2)
        assert process.pid is not None
        os.kill(process.pid, signal.SIGKILL)
        process.join()
        try:
            while True:
                first, last = (last, ours.recv())
                assert first is None or last[0] >= first[0], "a restart goes on where the last one was"
        except EOFError:
            pass
        assert last is not None
        log = AnnotationLog(text, tmp_path / "c" / "one", "anna")
        assert last[0] <= log.edits <= last[0] + 1, "at most one edit was not acknowledged"
        if log.lines:
            assert content_of(state_after(log, last[0])) == last[1]
    assert last is not None and last[0] > count


# --- Servers ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("seed", "count"), SERVER_KILLS)
def test_killed_servers_go_on_with_the_same_link_and_all_edits(
    seed: int, count: int, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    found = kill_again_and_again(tmp_path, times=count, seed=seed + request.config.getoption("--malformed-seed"))
    assert found["kills"] == count and found["edits"] > 0
