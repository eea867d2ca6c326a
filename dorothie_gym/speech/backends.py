"""Synthesisers and recognisers by name."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Final

from dorothie_gym.errors import SpeechError, did_you_mean
from dorothie_gym.speech.flite_synthesizer import FliteSynthesizer
from dorothie_gym.speech.hibari_synthesizer import hibari
from dorothie_gym.speech.sphinx_recognizer import SphinxRecognizer

if TYPE_CHECKING:
    from dorothie_gym.speech.recognizer import Recognizer
    from dorothie_gym.speech.synthesizer import Synthesizer

_SYNTHESIZERS: Final[Mapping[str, Callable[[], Synthesizer]]] = {"hibari": hibari, "flite": FliteSynthesizer}

SYNTHESIZER_NAMES: Final = tuple(_SYNTHESIZERS)
"""Names of the synthesisers that run on this machine; the first is the default."""

_RECOGNIZERS: Final[Mapping[str, Callable[[], Recognizer]]] = {"pocketsphinx": SphinxRecognizer}

RECOGNIZER_NAMES: Final = tuple(_RECOGNIZERS)
"""Names of the recognisers that need no settings; the first is the default."""


@functools.cache
def find_synthesizer(name: str = SYNTHESIZER_NAMES[0]) -> Synthesizer:
    """Returns a synthesiser by name, the same one for every call of a process.

    Raises:
        SpeechError: there is none with that name, or a package or program is missing.
    """
    if name not in _SYNTHESIZERS:
        known = ", ".join(SYNTHESIZER_NAMES)
        raise SpeechError(f"no synthesiser {name!r}: {did_you_mean(name, SYNTHESIZER_NAMES)}choose one of {known}")
    return _SYNTHESIZERS[name]()


@functools.cache
def find_recognizer(name: str = RECOGNIZER_NAMES[0]) -> Recognizer:
    """Returns a recogniser by name, the same one for every call of a process.

    Raises:
        SpeechError: there is none with that name, or a package is missing.
    """
    if name not in _RECOGNIZERS:
        known = ", ".join(RECOGNIZER_NAMES)
        raise SpeechError(f"no recogniser {name!r}: {did_you_mean(name, RECOGNIZER_NAMES)}choose one of {known}")
    return _RECOGNIZERS[name]()
