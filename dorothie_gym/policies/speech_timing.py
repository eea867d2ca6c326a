"""Timing of speech: speaking rate, the gap before a reply, and the pauses between utterances of one speaker."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dorothie_gym.dialogue.conversation import WORDS_PER_SECOND, speech_seconds
from dorothie_gym.support import portable_math as pm

FULL_TURN = 7
"""Number of words of a turn that is spoken at the speaker's full rate; shorter turns are slower (Yuan et al., 2006)."""

SHORT_TURN = 0.8
"""Rate of a turn of one word, relative to the full rate; set by hand."""

SPREAD = 0.7
"""Standard deviation of the logarithm of gaps and pauses of one speaker; set by hand, so that they are skewed."""


@dataclass(frozen=True, kw_only=True)
class Delivery:
    """Timing of a speaker's speech. Without arguments: immediate and constant.

    Attributes:
        pace: speaking rate relative to `WORDS_PER_SECOND`.
        gap: median of the time between the other's last word and the speaker's first one [s]; 0 replies at once.
        pause: median of the silence between two utterances of the speaker [s].
        patience: silence after a move that requires an answer [s].
    """

    pace: float = 1.0
    gap: float = 0.0
    pause: float = 0.8
    patience: float = 3.0

    def pace_of(self, text: str) -> float:
        """Returns the relative speaking rate of a text, in whole percent."""
        if self.gap == 0.0:
            return self.pace
        share = min(len(text.split()), FULL_TURN) / FULL_TURN
        return round(self.pace * (SHORT_TURN + (1.0 - SHORT_TURN) * share), 2)

    def seconds(self, text: str) -> float:
        """Returns the duration of a text [s]."""
        return speech_seconds(text, self.pace_of(text) * WORDS_PER_SECOND)

    def draw_gap(self, rng: np.random.Generator) -> float:
        """Draws a gap before a reply [s]."""
        return _skewed(self.gap, rng)

    def draw_pause(self, rng: np.random.Generator, *, wants_answer: bool) -> float:
        """Draws the silence after an utterance of the speaker [s]."""
        usual = self.patience if wants_answer else self.pause
        return usual if self.gap == 0.0 else _skewed(usual, rng, SPREAD / 2.0)


def _skewed(median: float, rng: np.random.Generator, spread: float = SPREAD) -> float:
    return median * pm.exp(spread * float(rng.standard_normal())) if median > 0.0 else 0.0
