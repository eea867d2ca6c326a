"""Disagreements, the final version, and agreement of a corpus."""

from __future__ import annotations

import random
from pathlib import Path

import pytest

from dorothie_gym.archive import Corpus
from dorothie_gym.errors import AnnotationError, SessionError
from dorothie_gym.evaluation.analysis import Handled, Units, handling, inconsistencies
from dorothie_gym.lab.annotation.comparison import Layer, adopted, consensus, disagreements
from dorothie_gym.lab.annotation.corpus_agreement import corpus_agreement
from dorothie_gym.lab.annotation.log import ADJUDICATED, RECORDED
from dorothie_gym.lab.annotation.marks import Annotation, Change, ExchangeMark, SpanMark
from dorothie_gym.lab.annotation.pre_annotation import pre_annotation
from dorothie_gym.lab.annotation.session_labels import recorded_annotation, relabelled
from dorothie_gym.lab.annotation.source_text import SourceText
from dorothie_gym.ontology import ActionValue, DialogueMove, LandmarkName, StreetName, UnitEnd
from dorothie_gym.session.recording import Session
from tests.lab.annotation.builders import FIRST, OKAY, YES, annotate, random_annotation, recorded, span
from tests.session.recording.builders import session, write
from tests.session.recording.dialogues import talk

M = DialogueMove


@pytest.fixture
def both(tmp_path: Path) -> tuple[SourceText, Annotation, Annotation]:
    """Two complete annotations: the second one numbers its units differently, and differs in two utterances."""
    one, text = recorded(tmp_path / "s")
    first = recorded_annotation(one, text)
    renumbered = {
        id: tuple(span(s.words, s.move, *s.slots, exchange=9) for s in spans) for id, spans in first.utterances.items()
    }
    second = Annotation.empty(text).after(
        Change(
            utterances={
                **renumbered,
                OKAY: (span(1, M.ACKNOWLEDGE, exchange=9), span(2, M.CONFIRM, ActionValue.J_TURN, exchange=9)),
                YES: (span(2, M.REPLY_Y, exchange=9), span(2, M.INSTRUCT, StreetName.FULLER, exchange=9)),
            }
        )
    )
    return text, first, second


def test_disagreements_name_the_layers_and_ignore_the_numbers_of_units(
    both: tuple[SourceText, Annotation, Annotation],
) -> None:
    text, first, second = both
    found = {each.id: each.layers for each in disagreements(text, {"a": first, "b": second})}
    assert found == {OKAY: (Layer.MOVES,), YES: (Layer.SPANS, Layer.MOVES, Layer.SLOTS)}
    assert disagreements(text, {"a": first, "b": first}) == ()


def test_other_borders_of_exchanges_and_unfinished_utterances_are_disagreements(
    both: tuple[SourceText, Annotation, Annotation],
) -> None:
    text, first, _ = both
    split = first.after(
        Change(utterances={YES: tuple(span(s.words, s.move, *s.slots, exchange=5) for s in first.utterances[YES])})
    )
    assert [(each.id, each.layers) for each in disagreements(text, {"a": first, "b": split})] == [
        (YES, (Layer.EXCHANGES,))
    ]
    marked = first.after(Change(exchanges={0: ExchangeMark(exception=Handled.TASK)}))
    assert [(each.id, each.layers) for each in disagreements(text, {"a": first, "b": marked})] == [
        (FIRST, (Layer.EXCHANGES,))
    ]
    open_ = first.after(Change(utterances={OKAY: (span(3),)}))
    assert [(each.id, each.layers) for each in disagreements(text, {"a": first, "b": open_})] == [
        (OKAY, (Layer.UNDECIDED,))
    ]


def test_the_final_version_begins_with_what_all_agree_on(both: tuple[SourceText, Annotation, Annotation]) -> None:
    text, first, second = both
    final = consensus(text, {"a": first, "b": second})
    assert [id for id, spans in final.utterances.items() if spans[0].move is None] == [OKAY, YES]
    assert final.utterances[FIRST][0].exchange == 0, "the number of the first word of the exchange"


def test_marks_taken_over_keep_exchanges_together(both: tuple[SourceText, Annotation, Annotation]) -> None:
    text, first, second = both
    second = second.after(Change(exchanges={9: ExchangeMark(exception=Handled.TASK, end=UnitEnd.FULFILLED)}))
    final = consensus(text, {"a": first, "b": second})
    final = (
        final.after(adopted(text, first, OKAY)).after(adopted(text, second, YES)).after(adopted(text, second, FIRST))
    )
    spans = [mark for each in final.utterances.values() for mark in each]
    assert {mark.exchange for mark in spans} == {0} and all(mark.move is not None for mark in spans)
    assert final.exchanges == {0: ExchangeMark(exception=Handled.TASK, end=UnitEnd.FULFILLED)}
    assert [mark.move for mark in final.utterances[OKAY]] == [M.ACKNOWLEDGE, M.EXPLAIN]
    assert [mark.words for mark in final.utterances[YES]] == [2, 2]


def test_suggestions_are_accepted_by_being_taken_over(tmp_path: Path) -> None:
    one, text = recorded(tmp_path / "s")
    assert all(not mark.suggested for mark in adopted(text, pre_annotation(one, text), FIRST).utterances[FIRST])


# --- Agreement of a corpus --------------------------------------------------------------------------------------------


def test_annotating_twice_gives_kappa_1_for_equal_marks(tmp_path: Path) -> None:
    one, text = recorded(tmp_path / "s")
    for name in ("anna", "ben"):
        annotate(tmp_path / "s", text, name, recorded_annotation(one, text))
    found = corpus_agreement(Corpus.load(tmp_path).entries, with_alpha=False).to_json()
    (pair,) = found["pairs"]  # type: ignore[misc]  # a list in JSON types
    assert pair["annotators"] == ["anna", "ben"] and pair["spans"]["agreement"] == 1.0
    assert pair["moves"]["kappa"] == pair["moves_of_pieces"]["kappa"] == pair["slots"]["kappa"] == 1.0


def test_agreement_is_that_worked_by_hand_over_two_sessions(tmp_path: Path) -> None:
    pytest.importorskip("krippendorff", reason="needs the extra agreement")
    for name in ("s", "t"):
        one, text = recorded(tmp_path / name)
        first = recorded_annotation(one, text)
        annotate(tmp_path / name, text, "anna", first)
        second = first
        if name == "s":
            change = {OKAY: (span(1, M.ACKNOWLEDGE, exchange=0), span(2, M.CONFIRM, ActionValue.J_TURN, exchange=0))}
            second = first.after(Change(utterances=change))
        annotate(tmp_path / name, text, "ben", second)
        if name == "t":
            annotate(tmp_path / name, text, "carl", first)
    found = corpus_agreement(Corpus.load(tmp_path).entries)
    assert found.sessions == 2 and found.annotators == ("anna", "ben", "carl")
    # A session has Instruct, Acknowledge, Explain, ReplyY, Instruct, Acknowledge, Explain; Ben has Confirm for one
    # Explain. 13 of 14 agree; by chance I (4/14)^2 + A (4/14)^2 + E (4/14)(3/14) + Y (2/14)^2 = 48/196.
    sessions, pair = found.pairs["anna", "ben"]
    assert (sessions, pair.labels.equal_spans, pair.labels.spans) == (2, 14, 1.0)
    assert pair.labels.moves_of_equal_spans == pytest.approx((13 / 14 - 48 / 196) / (1 - 48 / 196))
    assert found.pairs["anna", "carl"][0] == 1 and found.pairs["anna", "carl"][1].labels.moves == 1.0
    assert found.alpha is not None and found.alpha.pieces == 14 and found.alpha.moves is not None
    assert 0.9 < found.alpha.moves < 1.0


def test_borders_of_units_are_compared_whatever_their_numbers(tmp_path: Path) -> None:
    pytest.importorskip("krippendorff", reason="needs the extra agreement")
    one, text = recorded(tmp_path / "s")
    spans = [mark for _, _, mark in recorded_annotation(one, text).spans(text)]
    units = {"anna": (0, 0, 1, 1, 2, 2, 2), "ben": (7, 7, 7, 3, 5, 5, 5), "carl": (4, 4, 1, 1, 0, 0, 0)}
    for name, numbers in units.items():
        left = iter(zip(spans, numbers, strict=True))
        change = {
            line.id: tuple(
                span(mark.words, mark.move, *mark.slots, exchange=unit, transaction=unit if name != "ben" else 9)
                for mark, unit in (next(left) for _ in recorded_annotation(one, text).utterances[line.id])
            )
            for line in text.lines
        }
        annotate(tmp_path / "s", text, name, Annotation.empty(text).after(Change(utterances=change)))
    found = corpus_agreement(Corpus.load(tmp_path).entries)
    assert found.pairs["anna", "carl"][1].exchanges.kappa == 1.0
    # Six sites. Anna has borders at the second and fourth, Ben at the third and fourth: 4 of 6 agree, by chance
    # (2/6)(2/6) + (4/6)(4/6) = 20/36. One border is common, one is near: similarity 1 - (1/2)/2.
    pair = found.pairs["anna", "ben"][1]
    assert (pair.exchanges.sites, pair.exchanges.borders) == (6, (2, 2))
    assert pair.exchanges.kappa == pytest.approx((4 / 6 - 20 / 36) / (1 - 20 / 36))
    assert pair.exchanges.similarity == pytest.approx(0.75)
    assert pair.transactions.kappa == 0.0 and pair.transactions.similarity == 0.0, "Ben has one transaction"
    # Alpha: 18 marks, 6 of them borders; two sites on which one of three differs, with 4 ordered pairs over m - 1 = 2
    # each; expected are 2 * 6 * 12 ordered pairs over n - 1 = 17.
    assert found.exchange_alpha == pytest.approx(1 - (2 * 4 / 2) / (2 * 6 * 12 / 17))


def test_labels_of_the_session_and_the_final_version_can_be_compared(tmp_path: Path) -> None:
    one, text = recorded(tmp_path / "s")
    annotate(tmp_path / "s", text, "anna", random_annotation(text, random.Random(2), complete=True))
    annotate(tmp_path / "s", text, ADJUDICATED, recorded_annotation(one, text))
    entries = Corpus.load(tmp_path).entries
    found = corpus_agreement(entries, [RECORDED, ADJUDICATED], with_alpha=False)
    assert found.pairs[ADJUDICATED, RECORDED][1].labels.moves == 1.0 and found.alpha is None
    with pytest.raises(AnnotationError, match="nothing to compare"):
        corpus_agreement(entries)
    with pytest.raises(AnnotationError, match="'x' has annotated no session of the corpus \\(anna\\)"):
        corpus_agreement(entries, ["x", RECORDED])


def test_a_damaged_log_is_one_error(tmp_path: Path) -> None:
    one, text = recorded(tmp_path / "s")
    for name in ("anna", "ben"):
        annotate(tmp_path / "s", text, name, recorded_annotation(one, text))
    path = tmp_path / "s" / "annotations" / "ben.jsonl"
    path.write_text(path.read_text().replace('"edit":1', '"edit":true'))
    with pytest.raises(SessionError, match="ben.jsonl, line 2"):
        corpus_agreement(Corpus.load(tmp_path).entries, with_alpha=False)


# --- Labels of people in statistics -----------------------------------------------------------------------------------


def test_statistics_use_the_exchanges_and_exceptions_that_people_marked(tmp_path: Path) -> None:
    one, text = recorded(tmp_path / "s")
    first = recorded_annotation(one, text)
    changed = first.after(
        Change(
            utterances={
                id: tuple(span(s.words, s.move, *s.slots, exchange=k % 2, transaction=k // 3) for s in spans)
                for k, (id, spans) in enumerate(first.utterances.items())
            },
            exchanges={0: ExchangeMark(exception=Handled.ENVIRONMENTAL), 1: ExchangeMark(exception=Handled.NONE)},
        )
    )
    copy = relabelled(one, text, changed, "anna")
    copy.save(tmp_path / "copy")
    units = Units(Session.load(tmp_path / "copy"))
    assert [unit.id for unit in units.exchanges] == [0, 1] and len(units.transactions) == 2
    assert handling(units) == {0: Handled.ENVIRONMENTAL, 1: Handled.NONE}
    assert not any("are derived by the rules" in fault for fault in inconsistencies(copy))
    assert handling(Units(one)) == dict.fromkeys(handling(Units(one)), Handled.NONE)


def test_pre_annotation_does_not_read_the_labels(tmp_path: Path) -> None:
    one, text = recorded(tmp_path / "s")
    wrong = Session.load(
        write(
            tmp_path / "w",
            [e for e in relabelled(one, text, random_annotation(text, random.Random(4), complete=True), "x").events],
        )
    )
    assert pre_annotation(one, text).utterances == pre_annotation(wrong, SourceText.of(wrong)).utterances


def test_pre_annotation_suggests_acts_and_units(tmp_path: Path) -> None:
    one, text = recorded(tmp_path / "s")
    found = pre_annotation(one, text)
    marks: list[SpanMark] = [mark for spans in found.utterances.values() for mark in spans]
    assert all(mark.suggested and mark.act is None for mark in marks)
    assert found.utterances[FIRST][0].move is M.INSTRUCT and LandmarkName.KFC in found.utterances[FIRST][0].slots
    assert found.utterances[FIRST][0].exchange == 0 and found.utterances[FIRST][0].transaction == 0
    assert found == pre_annotation(one, text)


def test_silent_sessions_have_nothing_to_suggest() -> None:
    with pytest.raises(SessionError):
        pre_annotation(session(), SourceText.of(session(talk()[:1])))
