"""Stages of a participant, from consent to completion code."""

from __future__ import annotations

import enum
from typing import TYPE_CHECKING

from dorothie_gym.errors import DorothieGymError

if TYPE_CHECKING:
    from dorothie_gym.lab.studies.study import Study


class RefusedError(DorothieGymError, ValueError):
    """A participant sent a request that the current stage does not permit; the message is shown to the person."""


class Stage(enum.StrEnum):
    """Stage of a participant."""

    CONSENT = "consent"
    BEFORE = "before"
    """Questionnaire before the sessions."""
    INSTRUCTIONS = "instructions"
    TUTORIAL = "tutorial"
    LOBBY = "lobby"
    """The participant waits for a partner, or for the next session with the same one."""
    SESSION = "session"
    AFTER_SESSION = "after_session"
    """Questionnaire after a session."""
    AFTER = "after"
    """Questionnaire after the last session."""
    DEBRIEFING = "debriefing"
    DONE = "done"
    """The completion code is shown."""


class Outcome(enum.StrEnum):
    """Outcome of a participation."""

    COMPLETED = "completed"
    """The participant played all sessions of the group."""
    INTERRUPTED = "interrupted"
    """A session ended early, or did not begin: a partner left or withdrew, or the program failed."""
    LEFT = "left"
    """The participant left a session and came back after its end."""
    NO_PARTNER = "no partner"
    """The participant found no partner and played no session."""


QUESTIONNAIRES = {
    Stage.BEFORE: "before",
    Stage.AFTER_SESSION: "after_session",
    Stage.AFTER: "after",
}
"""Names of the questionnaires of stages."""

_ORDER = list(Stage)


def next_stage(study: Study, stage: Stage, *, more_sessions: bool = False) -> Stage:
    """Returns the stage after the given one, without stages that the study does not have.

    Args:
        study: the study.
        stage: stage that has ended.
        more_sessions: whether the participant has another session to play.
    """
    if stage is Stage.AFTER_SESSION and more_sessions:
        return Stage.LOBBY
    following = _ORDER[min(_ORDER.index(stage) + 1, len(_ORDER) - 1)]
    if following in QUESTIONNAIRES and not study.questionnaire(QUESTIONNAIRES[following]):
        return next_stage(study, following, more_sessions=more_sessions)
    if following is Stage.TUTORIAL and study.tutorial is None:
        return next_stage(study, following)
    return following


def check_stage(stage: Stage, wanted: Stage) -> None:
    """Raises `RefusedError` unless a participant is at a stage."""
    if stage is not wanted:
        raise RefusedError("This step is over. The page is loaded again.")
