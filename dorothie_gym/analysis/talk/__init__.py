"""Checks of what is said: truth, reasons, arrival times, answers, exceptions and loops."""

from dorothie_gym.analysis.talk.checks import TalkChecks, talk_checks_of

__all__ = ["TalkChecks", "talk_checks_of"]
