"""Settings of the console: pace, pictures, and absences of people."""

from __future__ import annotations

import enum
from dataclasses import dataclass, field, replace

from dorothie_gym.evaluation.tiers import find_tier
from dorothie_gym.session.config import CameraConfig, ChannelKind, EnvConfig


class WhileAway(enum.StrEnum):
    """Behaviour of a session while a person with a seat is away."""

    PAUSE = "pause"
    """The clock stops."""
    CONTINUE = "continue"
    """The clock continues; the role does nothing."""


class AfterAbsence(enum.StrEnum):
    """Behaviour of a session after a person has been away for too long."""

    END = "end"
    """The session ends with the reason "left"."""
    SCRIPT = "script"
    """The scripted policy plays the role until the person comes back."""
    WAIT = "wait"
    """The session waits without limit."""


@dataclass(frozen=True, kw_only=True)
class AbsenceRules:
    """Rules for people who leave a seat that needs a person.

    Attributes:
        while_away: immediate effect of an absence.
        seconds: time to return [s].
        then: effect after that time.

    Raises:
        ValueError: the time is negative or not finite; names the field.
    """

    while_away: WhileAway = WhileAway.PAUSE
    seconds: float = 60.0
    then: AfterAbsence = AfterAbsence.END

    def __post_init__(self) -> None:
        if not 0.0 <= self.seconds <= 86400.0:
            raise ValueError(f"AbsenceRules.seconds is {self.seconds}; it must be in 0..86400 s")


@dataclass(frozen=True, kw_only=True)
class ConsoleConfig:
    """Settings of the sessions that people take part in.

    Attributes:
        decision_frequency: decisions per second [Hz]; a divisor of the 30 Hz of the physics. People need more than the
            2 Hz of policies: an action is carried out within one decision.
        max_seconds: simulated time after which a session ends [s].
        word_error_rate: word error rate between participant and Co-Wizard; typed text arrives as it is.
        pictures: whether seats can look through the windscreen.
        picture_size: width and height of the pictures [px].
        picture_quality: quality of the pictures as JPEG, in 1..95.
        speech: whether people can speak into a microphone and hear the others.
        absence: rules for people who leave.
        repeatable: whether people at the seats may begin another session after the last one.
        tier: name of the `Tier` whose settings the sessions have; words stay text, and times and word errors that
            differ from the defaults replace those of the tier.

    Raises:
        ValueError: a value is out of range, or there is no such tier; names the field.
    """

    decision_frequency: float = 10.0
    max_seconds: float = 900.0
    word_error_rate: float = 0.0
    pictures: bool = True
    picture_size: tuple[int, int] = (480, 270)
    picture_quality: int = 72
    speech: bool = False
    absence: AbsenceRules = field(default_factory=AbsenceRules)
    repeatable: bool = True
    tier: str | None = None

    def __post_init__(self) -> None:
        if not 1 <= self.picture_quality <= 95:
            raise ValueError(f"ConsoleConfig.picture_quality is {self.picture_quality}; it must be in 1..95")
        CameraConfig(width=self.picture_size[0], height=self.picture_size[1])
        self.environment()

    def environment(self) -> EnvConfig:
        """Returns the settings of the engine."""
        if self.tier is None:
            return EnvConfig(
                decision_frequency=self.decision_frequency,
                max_seconds=self.max_seconds,
                word_error_rate=self.word_error_rate,
            )
        found = replace(
            find_tier(self.tier).config, decision_frequency=self.decision_frequency, channel=ChannelKind.TEXT
        )
        if self.max_seconds != ConsoleConfig.max_seconds:
            found = replace(found, max_seconds=self.max_seconds, time_factor=None)
        if self.word_error_rate != ConsoleConfig.word_error_rate:
            found = replace(found, word_error_rate=self.word_error_rate)
        return found
