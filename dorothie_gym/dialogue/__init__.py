"""Talk: utterances and their timing, exchanges, wording of acts and understanding of words."""

from dorothie_gym.dialogue.conversation import Conversation
from dorothie_gym.dialogue.exchanges import EXPECTATIONS, PATIENCE, Exchange, ExchangeState, ExchangeTracker
from dorothie_gym.dialogue.generation import MAX_CHARACTERS, word_act
from dorothie_gym.dialogue.lexicon import Lexicon, LexiconError, load_lexicon
from dorothie_gym.dialogue.utterances import SHORTEST_SPAN, WORDS_PER_SECOND, Span, Utterance, speech_seconds
from dorothie_gym.dialogue.wording import Direction, Wording
