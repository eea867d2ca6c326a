"""Check that a recorded session is sound, survives a round trip through its files, and replays exactly."""

from __future__ import annotations

import tempfile
from pathlib import Path

from dorothie_gym.maps import Town, load_town
from dorothie_gym.recording import Session, first_difference
from dorothie_gym.rollout import resimulate
from dorothie_gym.tasks import StoryboardTemplate


def check_session(
    session: Session | Path | str,
    *,
    town: Town | str | Path | None = None,
    storyboard: StoryboardTemplate | None = None,
    replay: bool = True,
) -> None:
    """Checks a recorded session.

    `Session.check` must find no fault; saving and loading must keep the content (`Session.digest`); playing it again
    from its seed and actions must give the same frames and events to the bit.

    Args:
        session: a session, or its folder.
        town: the town that it was played in, where that is not shipped with the package.
        storyboard: its storyboard's template, where that is not shipped.
        replay: whether to play it again; sessions whose actions were not recorded cannot be.

    Raises:
        AssertionError: the session is not sound; the message names the first fault, field or frame.
        SessionError: the session cannot be read or replayed.
    """
    if not isinstance(session, Session):
        session = Session.load(session)
    faults = session.check()
    assert not faults, f"{session.name}: {len(faults)} faults, the first: {faults[0]}"
    with tempfile.TemporaryDirectory(prefix="dorothie_gym-") as folder:
        saved = Session.load(session.save(Path(folder) / session.name))
    assert saved.digest == session.digest, f"{session.name}: saving and loading changed its content"
    if replay:
        place = town if isinstance(town, Town) else load_town(session.header.town if town is None else town)
        difference = first_difference(session, resimulate(session, place, storyboard=storyboard))
        assert difference is None, f"{session.name}: replay differs at {difference}"
