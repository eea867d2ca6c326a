"""Speech recognition: protocol of the recognisers, their results, and the choice of one by name."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

from dorothie_gym.support.copying import shared

if TYPE_CHECKING:
    from dorothie_gym.support.audio import Samples


@shared
@dataclass(frozen=True, kw_only=True)
class RecognizedWord:
    """Word in recognised speech.

    Attributes:
        text: the word as it is spoken, in lower case.
        start: start in the audio [s].
        end: end in the audio [s].
        confidence: posterior probability in [0, 1]; NaN if the recogniser gives none.
    """

    text: str
    start: float
    end: float
    confidence: float


@shared
@dataclass(frozen=True, kw_only=True)
class Hypothesis:
    """Possible words of an audio.

    Attributes:
        text: spoken words in lower case, without punctuation.
        weight: share of the probability of all hypotheses, in [0, 1].
    """

    text: str
    weight: float


@shared
@dataclass(frozen=True, kw_only=True)
class Recognition:
    """Result of the recognition of an audio.

    Attributes:
        text: spoken words in lower case, without punctuation; empty if nothing was recognised.
        words: the words with times and confidences; empty if the recogniser gives none.
        hypotheses: distinct hypotheses, the most probable first; empty if nothing was recognised.
    """

    text: str
    words: tuple[RecognizedWord, ...] = ()
    hypotheses: tuple[Hypothesis, ...] = ()


class Recognizer(Protocol):
    """Speech recogniser; equal arguments give equal results, regardless of earlier calls."""

    def recognize(self, samples: Samples, sample_rate: int, *, hints: Sequence[str] = ()) -> Recognition:
        """Returns the words of an audio.

        Args:
            samples: mono audio (n,), float32, full scale is 1.
            sample_rate: their rate [Hz], 8,000 to 96,000; other rates than the recogniser's are converted.
            hints: names that may be spoken, such as those on a map. Recognisers prefer them, and may ignore them.

        Raises:
            AudioError: the audio is empty, longer than a minute, not finite, or of an unsupported rate.
            SpeechError: a server or model failed.
        """
        ...


def single_hypothesis(text: str) -> Recognition:
    """Returns the result of a recogniser that gives words only."""
    return Recognition(text=text, hypotheses=(Hypothesis(text=text, weight=1.0),) if text else ())
