"""Talk: utterances and their timing, exchanges, wording of acts and understanding of words."""

from dorothie_gym.dialogue.generation import word_act, word_acts
from dorothie_gym.dialogue.styles import SpeakerStyle, draw_style
from dorothie_gym.dialogue.utterances import SHORTEST_SPAN, WORDS_PER_SECOND, Span, Utterance, speech_seconds
from dorothie_gym.dialogue.wording import Direction, Wording, WordingContext
