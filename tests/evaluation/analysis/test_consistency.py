from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from dorothie_gym.evaluation.analysis import inconsistencies
from dorothie_gym.ontology import ActionValue, LandmarkName
from dorothie_gym.session.recording import Event, EventType, Session
from tests.evaluation.analysis.builders import M, car, drive, human


def annotated(numbers: Iterable[int | None], *events: list[Event], **changes: object) -> Session:
    """Drive with acts in exchanges of the given numbers, all in one transaction."""
    flat = [event for part in events for event in part]
    stored = [
        replace(event, data={**event.data, "exchange": number, "transaction": 0})
        for event, number in zip(flat, numbers, strict=True)
    ]
    return replace(drive(stored), **changes)  # type: ignore[arg-type]  # fields of several types


TALK = (
    human(1.0, "KFC please", M.INSTRUCT, LandmarkName.KFC),
    car(4.0, "okay", M.ACKNOWLEDGE),
    car(8.0, "which way", M.QUERY_W, ActionValue.QUERIED),
    human(11.0, "left", M.REPLY_W, ActionValue.J_TURN),
)


def test_annotation_by_the_rules_is_consistent() -> None:
    assert inconsistencies(annotated((0, 0, 1, 1), *TALK)) == ()


def test_response_without_an_exchange_is_reported() -> None:
    faults = inconsistencies(annotated((0, None, 1, 1), *TALK))
    assert "events[1] (utterance 40, Acknowledge): responds in no exchange" in faults


def test_exchange_that_starts_with_a_response_is_reported() -> None:
    faults = inconsistencies(annotated((0, 1, 2, 2), *TALK))
    assert faults[0] == "events[1] (utterance 40, Acknowledge): begins exchange 1, which is not for a Acknowledge"
    assert "exchanges: 3 are stored, 2 are derived by the rules" in faults


def test_other_bounds_of_exchanges_are_reported_even_if_their_number_is_right() -> None:
    faults = inconsistencies(annotated((0, 0, 1, 0), *TALK))
    assert faults == ("events[3] (utterance 110, ReplyW): is stored in exchange 0, by the rules in 1",)


def test_missing_transactions_are_reported() -> None:
    session = annotated((0, 0, 1, 1), *TALK)
    bare = [
        replace(event, data={k: v for k, v in event.data.items() if k != "transaction"})
        if event.type is EventType.DIALOGUE_MOVE
        else event
        for event in session.events
    ]
    assert inconsistencies(replace(session, events=tuple(bare))) == (
        "transactions: 0 are stored, 1 are derived by the rules",
    )


def test_outcome_with_other_counts_is_reported() -> None:
    session = annotated((0, 0, 1, 1), *TALK, summary={"exchanges": 5, "utterances": 4})
    assert inconsistencies(session) == ("outcome: field 'exchanges' is 5, and 2 are derived by the rules",)


def test_annotations_by_people_are_checked_for_starts_and_responses_only() -> None:
    session = annotated((7, 7, 7, 7), *TALK)
    people = replace(session, header=replace(session.header, source="sdn-release"))
    assert inconsistencies(people) == ()
    assert inconsistencies(session) != ()
