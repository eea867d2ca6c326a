from dorothie_gym.dialogue import plan_reading
from dorothie_gym.dialogue.plan_chunker import _Reader, _rules_from, read_items
from dorothie_gym.dialogue.route_grammar import route_grammar
from tests.dialogue.annotated_utterances import read_annotated

RULES = (
    _Reader._contingency,
    _Reader._stop_noun,
    _Reader._ranked,
    _Reader.read_direction,
    _Reader.read_quantity,
    _Reader._phrase,
    _Reader._noun,
)


def test_rules_that_are_not_tried_at_a_word_would_not_apply(monkeypatch):
    read = []
    monkeypatch.setattr(plan_reading, "read_items", lambda *given: read.append(given) or read_items(*given))
    for item in read_annotated("people_dev"):
        plan_reading.read_plan.__wrapped__(item.text)
    left_out = sum(_check(*given) for given in read)
    assert left_out > len(read)


def _check(words, names, lead, contracted):
    """Reads a sentence; returns how many rules were left out."""
    reader, place, count = _Reader(words, names, lead, route_grammar()), 0, 0
    reader.contracted = contracted
    while place < len(words):
        if words[place] in reader.grammar.subjects:
            reader._new_clause(place)
        tried = _rules_from(words[place])
        for rule in RULES if words[place] not in (",", "?") else ():
            if rule not in tried:
                before, count = list(reader.items), count + 1
                assert rule(reader, place) == place, (rule, words, place)
                assert reader.items == before
        place = next(end for rule in tried if (end := rule(reader, place)) > place)
    return count
