"""Talk: utterances and their timing, exchanges, wording of acts and understanding of words."""

from dorothie_gym.dialogue.annotation import Annotator
from dorothie_gym.dialogue.conversation import Conversation
from dorothie_gym.dialogue.directions import Turn
from dorothie_gym.dialogue.exchanges import EXPECTATIONS, PATIENCE, Exchange, ExchangeState, ExchangeTracker
from dorothie_gym.dialogue.generation import MAX_CHARACTERS, word_act, word_acts
from dorothie_gym.dialogue.guessing import act_of, guess_act, guess_spans
from dorothie_gym.dialogue.lexicon import Lexicon, LexiconError, load_lexicon
from dorothie_gym.dialogue.mishearing import Channel, word_error_rate
from dorothie_gym.dialogue.phrases import Register
from dorothie_gym.dialogue.recognising import Recogniser
from dorothie_gym.dialogue.styles import SpeakerStyle, draw_style
from dorothie_gym.dialogue.understanding import Heard, understand
from dorothie_gym.dialogue.utterances import SHORTEST_SPAN, WORDS_PER_SECOND, Span, Utterance, speech_seconds
from dorothie_gym.dialogue.wording import Direction, Wording, WordingContext

__all__ = [
    "EXPECTATIONS",
    "MAX_CHARACTERS",
    "PATIENCE",
    "SHORTEST_SPAN",
    "WORDS_PER_SECOND",
    "Annotator",
    "Channel",
    "Conversation",
    "Direction",
    "Exchange",
    "ExchangeState",
    "ExchangeTracker",
    "Heard",
    "Lexicon",
    "LexiconError",
    "Recogniser",
    "Register",
    "Span",
    "SpeakerStyle",
    "Turn",
    "Utterance",
    "Wording",
    "WordingContext",
    "act_of",
    "draw_style",
    "guess_act",
    "guess_spans",
    "load_lexicon",
    "speech_seconds",
    "understand",
    "word_act",
    "word_acts",
    "word_error_rate",
]
