"""Dialogue: utterances and timing, exchange units, language generation (NLG) and understanding (NLU)."""

from dorothie_gym.dialogue.asr_channel import USUAL_WORD_ERROR_RATE, AsrChannel, Recogniser, word_error_rate
from dorothie_gym.dialogue.conversation import (
    INAUDIBLE,
    SHORTEST_SPAN,
    WORDS_PER_SECOND,
    Conversation,
    Span,
    Utterance,
    is_partly_inaudible,
    speech_seconds,
)
from dorothie_gym.dialogue.dialogue_act_classifier import act_of, guess_act, guess_spans
from dorothie_gym.dialogue.directions import RouteTurn
from dorothie_gym.dialogue.disfluency import fluent
from dorothie_gym.dialogue.exchanges import ANSWER_TIMEOUT, EXPECTATIONS, Exchange, ExchangeState, ExchangeTracker
from dorothie_gym.dialogue.intentions import CommunicativeFunction, Intention
from dorothie_gym.dialogue.lexicon import Lexicon, load_lexicon
from dorothie_gym.dialogue.nlg import MAX_CHARACTERS, word_act, word_acts
from dorothie_gym.dialogue.nlu import ParsedText, understand
from dorothie_gym.dialogue.phrases import Register
from dorothie_gym.dialogue.propositions import ASKED, Predicate, Proposition, encode_meaning, find_meaning, read_meaning
from dorothie_gym.dialogue.realization_context import Direction, Wording, WordingContext
from dorothie_gym.dialogue.recognition_errors import ErrorProfile, Loudness, WordClass, measured_errors, word_class
from dorothie_gym.dialogue.speaker_style import SpeakerStyle, draw_style
from dorothie_gym.dialogue.transactions import Annotator
from dorothie_gym.errors import PhraseFileError

__all__ = [
    "ANSWER_TIMEOUT",
    "ASKED",
    "EXPECTATIONS",
    "INAUDIBLE",
    "MAX_CHARACTERS",
    "SHORTEST_SPAN",
    "USUAL_WORD_ERROR_RATE",
    "WORDS_PER_SECOND",
    "Annotator",
    "AsrChannel",
    "CommunicativeFunction",
    "Conversation",
    "Direction",
    "ErrorProfile",
    "Exchange",
    "ExchangeState",
    "ExchangeTracker",
    "Intention",
    "Lexicon",
    "Loudness",
    "ParsedText",
    "PhraseFileError",
    "Predicate",
    "Proposition",
    "Recogniser",
    "Register",
    "RouteTurn",
    "Span",
    "SpeakerStyle",
    "Utterance",
    "WordClass",
    "Wording",
    "WordingContext",
    "act_of",
    "draw_style",
    "encode_meaning",
    "find_meaning",
    "fluent",
    "guess_act",
    "guess_spans",
    "is_partly_inaudible",
    "load_lexicon",
    "measured_errors",
    "read_meaning",
    "speech_seconds",
    "understand",
    "word_act",
    "word_acts",
    "word_class",
    "word_error_rate",
]
