"""Replay checks: recorded sessions are simulated again and compared with their records."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path

from dorothie_gym._version import __version__
from dorothie_gym.errors import SessionError, StoryboardError, TownError
from dorothie_gym.maps import Town, load_town
from dorothie_gym.maps.catalogue import find_town
from dorothie_gym.recording import CorpusEntry, Difference, Session, first_difference
from dorothie_gym.rollout.processes import run_tasks
from dorothie_gym.rollout.resimulation import resimulate
from dorothie_gym.tasks import StoryboardTemplate, load_template


@dataclass(frozen=True, kw_only=True)
class ReplaySources:
    """Maps and storyboard for sessions whose own are not shipped.

    Attributes:
        town: name or file of the town of all sessions; None takes the town that each session names.
        maps: folder with maps of towns that are not shipped.
        storyboard: file of the storyboard; None takes the one that each session names.
    """

    town: str | None = None
    maps: Path | None = None
    storyboard: Path | None = None

    def town_of(self, session: Session) -> Town:
        """Returns the town of a session.

        Raises:
            SessionError: the town is neither shipped nor given.
            TownError: a given town cannot be read.
        """
        if self.town is not None:
            return load_town(self.town)
        found = find_town(session.header.town, self.maps)
        if found is None:
            raise SessionError(
                f"{session.name}: its town {session.header.town!r} is not shipped; give --town FILE, or --maps DIR"
            )
        return found


@dataclass(frozen=True, kw_only=True)
class ReplayCheck:
    """Comparison of a session with its replay.

    Attributes:
        session: name of the session.
        complete: whether the session was recorded to its end.
        frames: number of recorded frames.
        decisions: number of recorded decisions.
        recorded_by: version of the package that recorded the session.
        difference: first difference; None if the replay is equal.
        wall_seconds: time that the replay took [s].
    """

    session: str
    complete: bool
    frames: int
    decisions: int
    recorded_by: str
    difference: Difference | None
    wall_seconds: float

    @property
    def equal(self) -> bool:
        """Whether the replay equals the record."""
        return self.difference is None

    def to_json(self) -> dict[str, object]:
        """Returns the fields in JSON types, with `equal` and the version that replayed the session."""
        return {
            "session": self.session,
            "equal": self.equal,
            "complete": self.complete,
            "frames": self.frames,
            "decisions": self.decisions,
            "recorded_by": self.recorded_by,
            "replayed_by": __version__,
            "difference": None if self.difference is None else asdict(self.difference),
            "wall_seconds": self.wall_seconds,
        }


def check_replays(
    entries: Sequence[CorpusEntry], sources: ReplaySources | None = None, *, workers: int = 1
) -> Iterator[ReplayCheck]:
    """Yields the check of each session, in their order.

    Args:
        entries: sessions of a corpus.
        sources: maps and storyboard that are not shipped.
        workers: number of processes; more than one needs an importable main module of the caller.

    Raises:
        SessionError: a session cannot be read or replayed, or its town is unknown.
        TownError: a given town cannot be read.
        StoryboardError: the given storyboard cannot be read.
        ProcessError: a process died.
    """
    prepare = partial(_ReplayTask, sources or ReplaySources())
    early: dict[int, ReplayCheck] = {}
    following = 0
    for number, found in run_tasks(prepare, enumerate(entries), workers=min(workers, max(len(entries), 1))):
        if isinstance(found, Exception):
            raise found
        early[number] = found
        while following in early:
            yield early.pop(following)
            following += 1


class _ReplayTask:
    """Checks sessions in one process."""

    def __init__(self, sources: ReplaySources) -> None:
        self._sources = sources
        self._storyboard: StoryboardTemplate | None = None

    def __call__(self, task: tuple[int, CorpusEntry]) -> tuple[int, ReplayCheck | Exception]:
        number, entry = task
        try:
            if self._sources.storyboard is not None and self._storyboard is None:
                self._storyboard = load_template(self._sources.storyboard)
            session = entry.load()
            return number, _check(session, self._sources.town_of(session), self._storyboard)
        except (SessionError, TownError, StoryboardError) as error:
            return number, error  # raised in the calling process: a mistake of the user, not of the worker


def _check(session: Session, town: Town, storyboard: StoryboardTemplate | None) -> ReplayCheck:
    begun = time.perf_counter()
    difference = first_difference(session, resimulate(session, town, storyboard=storyboard))
    return ReplayCheck(
        session=session.name,
        complete=session.complete,
        frames=len(session.trajectory),
        decisions=len(session.decisions or ()),
        recorded_by=session.header.package_version,
        difference=difference,
        wall_seconds=round(time.perf_counter() - begun, 3),
    )
