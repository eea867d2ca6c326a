"""Public names of the package and the modules that define them (read by type checkers and by lazy_loader)."""

from .backends import RECOGNIZER_NAMES as RECOGNIZER_NAMES
from .backends import SYNTHESIZER_NAMES as SYNTHESIZER_NAMES
from .backends import find_recognizer as find_recognizer
from .backends import find_synthesizer as find_synthesizer
from .cabin_noise import cabin_noise as cabin_noise
from .cabin_noise import mixed as mixed
from .cabin_noise import pink_noise as pink_noise
from .http_speech import HttpRecognizer as HttpRecognizer
from .http_speech import HttpSynthesizer as HttpSynthesizer
from .recognizer import Hypothesis as Hypothesis
from .recognizer import Recognition as Recognition
from .recognizer import RecognizedWord as RecognizedWord
from .recognizer import Recognizer as Recognizer
from .spoken_form import spoken_words as spoken_words
from .spoken_form import written_form as written_form
from .spoken_understanding import SpokenUnderstanding as SpokenUnderstanding
from .spoken_understanding import audible as audible
from .spoken_understanding import readable as readable
from .spoken_understanding import understand_speech as understand_speech
from .synthesizer import Synthesizer as Synthesizer
from .synthesizer import Voice as Voice
from .synthesizer import say as say
from .whisper_recognizer import WhisperRecognizer as WhisperRecognizer
