"""Words of several acts are parted where the rules that guess acts from words agree."""

from dorothie_gym.baselines.benchmark_co_wizard.policy import spans_of
from dorothie_gym.ontology import ActionValue, DialogueAct, DialogueMove, LandmarkName

OKAY = DialogueAct.of(DialogueMove.ACKNOWLEDGE)
LEFT = DialogueAct.of(DialogueMove.INSTRUCT, ActionValue.J_TURN)
TO_KFC = DialogueAct.of(DialogueMove.INSTRUCT, LandmarkName.KFC)
HEARD = DialogueAct.of(DialogueMove.ALIGN)


def test_words_of_one_act_are_all_its_own():
    assert [span.text for span in spans_of("Okay, now turn left, please.", (LEFT,))] == ["Okay, now turn left, please."]


def test_words_are_parted_so_that_each_act_has_words_that_sound_like_it():
    spans = spans_of("Okay, okay, turn left up there, did you get that?", (OKAY, LEFT, HEARD))
    assert [span.text for span in spans] == ["Okay, okay,", "turn left up there,", "did you get that?"]
    assert [span.act for span in spans] == [OKAY, LEFT, HEARD]


def test_words_without_clauses_are_shared_out_and_none_is_lost():
    spans = spans_of("okay take me to the KFC", (OKAY, TO_KFC))
    assert " ".join(span.text for span in spans) == "okay take me to the KFC"
    assert [span.act for span in spans] == [OKAY, TO_KFC]


def test_fewer_words_than_acts_leave_acts_out():
    assert [span.act for span in spans_of("okay", (OKAY, TO_KFC))] in ([OKAY], [OKAY, TO_KFC])
    assert [span.act for span in spans_of("okay then", (OKAY, TO_KFC, LEFT))] == [OKAY, TO_KFC]


def test_without_acts_the_rules_guess_them():
    (span,) = spans_of("Turn left.", None)
    assert span.act == LEFT
    assert spans_of("", None) == spans_of("  ", (OKAY,)) == ()
