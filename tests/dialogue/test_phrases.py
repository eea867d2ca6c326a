from collections import Counter
from dataclasses import dataclass, field

import numpy as np
import pytest

from dorothie_gym.dialogue.phrases import Register, choice, manner_of, parse_alternatives
from dorothie_gym.errors import PhraseFileError


@dataclass
class Speaker:
    register: Register = Register.PLAIN
    indirect: bool = False
    chattiness: float = 0.5
    habit: float = 0.0
    idiolect: int = 1
    rng: np.random.Generator = field(default_factory=lambda: np.random.default_rng(0))

    @property
    def manner(self) -> int:
        return manner_of(self.register, self.indirect)

    def random(self) -> float:
        return self.rng.random()

    def gap(self, name: str) -> str:
        return name.upper()


def said(text: str, times: int = 400, **speaker: object) -> Counter[str]:
    phrase = choice("test", parse_alternatives("here:1", text, {}))
    teller = Speaker(**speaker)
    return Counter(" ".join(phrase.say(teller).split()) for _ in range(times))


def test_alternatives_weights_and_gaps():
    counts = said("go {way} *3 | (turn|hang) {way}")
    assert set(counts) == {"go WAY", "turn WAY", "hang WAY"}
    assert 0.65 < counts["go WAY"] / 400 < 0.85


def test_options_are_limited_to_chatty_speakers():
    assert set(said("go [now|please]", chattiness=0.0)) == {"go"}
    assert set(said("go [now|please]", chattiness=1.0)) == {"go now", "go please"}


def test_marks_apply_to_their_registers_only():
    text = "go | ~bounce | ^kindly go | !move | %could you go"
    assert set(said(text)) == {"go"}
    assert set(said(text, register=Register.SLANGY)) == {"go", "bounce"}
    assert set(said(text, register=Register.POLITE, indirect=True)) == {"go", "kindly go", "could you go"}
    assert set(said("~bounce | ^kindly go")) == {"bounce", "kindly go"}


def test_habits_favour_one_alternative_per_speaker():
    text = " | ".join(f"word{number}" for number in range(10))
    habitual = said(text, habit=0.6, idiolect=12345)
    assert habitual.most_common(1)[0][1] > 0.55 * 400
    favourites = {said(text, habit=0.9, idiolect=idiolect).most_common(1)[0][0] for idiolect in range(1, 40000, 997)}
    assert len(favourites) > 5


@pytest.mark.parametrize("text", ["(left", "left)", "[now", "<unknown>", "<", "go }"])
def test_error_names_line_of_faulty_phrase(text):
    with pytest.raises(PhraseFileError, match="here:1"):
        parse_alternatives("here:1", text, {})
