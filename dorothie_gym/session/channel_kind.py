"""Kinds of channel between participant and Co-Wizard, for settings and for the command line, which imports little."""

from __future__ import annotations

import enum


class ChannelKind(enum.StrEnum):
    """Channel of the words between participant and Co-Wizard."""

    TEXT = "text"
    """Text with simulated recognition errors, `EnvConfig.word_error_rate`."""

    SPEECH = "speech"
    """Synthesised speech in the noise of the car, which is recognised."""
