"""The test set of sentences as people would say them (benchmarks/people)."""

from __future__ import annotations

import json
import re
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import pytest

from dorothie_gym.evaluation.analysis.span_agreement import LabelledSpan, agreement_of
from dorothie_gym.ontology.dialogue_acts import DialogueAct, DialogueMove
from dorothie_gym.ontology.slots import SLOT_VALUES, Slot, SlotValue

Row = dict[str, Any]

FOLDER: Final = Path(__file__).parents[2] / "benchmarks" / "people"
KINDS: Final = [
    "turn",
    "route_plan",
    "condition",
    "landmark_place",
    "street_place",
    "side_of_street",
    "stop",
    "speed_units",
    "lane",
    "correction",
    "errand_order",
    "negation",
    "acknowledgement",
    "answer_yes_no",
    "question",
    "statement",
    "greeting_thanks_smalltalk",
    "indirect_request",
]
DRIVE_KINDS: Final = ["plan", "condition", "side", "units", "stop", "request", "question", "correction", "errands"]
ACTIONS: Final = [
    "turn",
    "straight",
    "lane",
    "u_turn",
    "stop",
    "go",
    "follow",
    "avoid",
    "speed",
    "lights",
    "visit",
    "wait",
]
RELATIONS: Final = ["at", "seen", "after", "past", "before", "until", "opposite", "beside", "from"]
REFERENCES: Final = ["there", "here", "last_stop", "start", "way_we_came"]
STEP_KEYS: Final = ["action", "direction", "ordinal", "distance", "condition", "side", "speed", "change", "place"]
PLACE_KEYS: Final = ["landmark", "street", "object", "ordinal", "side", "reference"]
PLACE_SLOTS: Final = {"landmark": Slot.LANDMARK, "street": Slot.STREET, "object": Slot.OBJECT}
SEEN_BY_THE_ADJUDICATOR: Final = {"b009", "b131", "b247", "b266", "b322", "b328"}
"""Sentences whose second labels were not given independently."""

MOVES: Final = {move.label: move for move in DialogueMove}
VALUES: Final = {(slot.label, value.label): value for slot, values in SLOT_VALUES.items() for value in values}


def rows(name: str) -> list[Row]:
    return [json.loads(line) for line in (FOLDER / f"{name}.jsonl").read_text(encoding="utf-8").splitlines()]


@pytest.fixture(scope="module")
def sentences() -> list[Row]:
    return rows("sentences")


@pytest.fixture(scope="module")
def drives() -> list[Row]:
    return rows("drives")


@pytest.fixture(scope="module")
def annotators() -> list[Row]:
    return rows("annotators")


def in_order(found: Row, keys: list[str]) -> bool:
    return list(found) == [key for key in keys if key in found]


def place_errors(place: Row, blanks: bool) -> Iterator[str]:
    """Yields what is wrong with a place; `blanks` are names in braces, which a driving test fills in."""
    if not place or not in_order(place, PLACE_KEYS):
        yield f"keys {list(place)}"
    for key in PLACE_SLOTS.keys() & place.keys():
        label = place[key]
        known = {value.label for value in SLOT_VALUES[PLACE_SLOTS[key]]} - {"Queried", "Unknown"}
        if label not in known and not (blanks and label in (f"{{{key}}}", f"{{{key}2}}")):
            yield f"{key} {label}"
    if place.get("side", "left") not in ("left", "right") or place.get("reference", "here") not in REFERENCES:
        yield f"side or reference of {place}"
    if place.get("ordinal", 1) < 1:
        yield f"ordinal {place['ordinal']}"


def step_errors(step: Row, blanks: bool) -> Iterator[str]:
    """Yields what is wrong with a step of a plan."""
    if "action" not in step or not in_order(step, STEP_KEYS) or None in step.values():
        yield f"keys {list(step)}"
    condition = step.get("condition", {"relation": "at", "place": {"reference": "here"}})
    accepted = {
        "action": ACTIONS,
        "direction": ["left", "right"],
        "side": ["left", "right"],
        "change": ["on", "off"] if step["action"] == "lights" else ["faster", "slower"],
    }
    yield from (f"{key} {step[key]}" for key in accepted.keys() & step.keys() if step[key] not in accepted[key])
    yield from (f"{key} {step[key]}" for key in ("ordinal", "distance", "speed") if step.get(key, 1) < 1)
    if list(condition) != ["relation", "place"] or condition["relation"] not in RELATIONS:
        yield f"condition {condition}"
    for place in (condition["place"], step.get("place", condition["place"])):
        yield from place_errors(place, blanks)
    needed = {"speed": ("speed", "change"), "lights": ("change",), "follow": ("place",), "avoid": ("place",)}
    needed["visit"] = ("place", "condition")
    if step["action"] in needed and not step.keys() & set(needed[step["action"]]):
        yield "nothing to do"


def plan_errors(row: str, plan: list[Row], blanks: bool = False) -> list[str]:
    return [f"{row}: {error}" for step in plan for error in step_errors(step, blanks)]


def cut_errors(text: str, acts: list[Row]) -> Iterator[str]:
    """Yields stretches of a sentence that lie between its acts; only spaces may."""
    end = 0
    for act in acts:
        start = text.find(act["text"], end)
        if start < 0:
            yield f"{act['text']!r} is not a piece of {text!r}"
            return
        if text[end:start].strip():
            yield f"{text[end:start]!r} is in no act"
        end = start + len(act["text"])
    if text[end:].strip():
        yield f"{text[end:]!r} is in no act"


def dialogue_act(act: Row) -> DialogueAct:
    """Returns an act; a KeyError names an unknown label."""
    values: list[SlotValue] = [VALUES[slot, label] for slot, labels in act["slots"].items() for label in labels]
    return DialogueAct.of(MOVES[act["move"]], *values)


def test_sentences_have_the_fields_of_the_schema(sentences: list[Row]) -> None:
    assert len(sentences) == 660
    fields = ["id", "split", "kind", "speaker", "role", "before", "text", "acts", "plan"]
    assert all(list(row) == fields for row in sentences)
    assert {row["kind"] for row in sentences} == set(KINDS)
    assert {row["role"] for row in sentences} == {"participant", "co_wizard"}
    assert all(row["text"] == row["text"].strip() != "" and row["speaker"] and row["acts"] for row in sentences)
    assert [error for row in sentences for error in plan_errors(row["id"], row["plan"])] == []


def test_acts_cut_the_sentence_and_bear_labels_of_the_ontology(sentences: list[Row], annotators: list[Row]) -> None:
    texts = {row["id"]: row["text"] for row in sentences}
    for row in (*sentences, *annotators):
        assert list(cut_errors(texts[row["id"]], row["acts"])) == [], row["id"]
        assert all(list(act) == ["text", "move", "slots"] and dialogue_act(act) for act in row["acts"])
        assert all(
            labels and len(labels) == len(set(labels)) for act in row["acts"] for labels in act["slots"].values()
        )


def test_each_kind_is_halved_into_dev_and_test(sentences: list[Row], drives: list[Row]) -> None:
    for kind in KINDS:
        splits = Counter(row["split"] for row in sentences if row["kind"] == kind)
        assert splits["dev"] == splits["test"] and splits.total() >= 15, kind
    for kind in DRIVE_KINDS:
        splits = Counter(row["split"] for row in drives if row["kind"] == kind)
        assert abs(splits["dev"] - splits["test"]) <= 1 and splits.total() >= 8, kind
    assert {row["split"] for row in (*sentences, *drives)} == {"dev", "test"}


def test_nothing_is_said_twice(sentences: list[Row], drives: list[Row]) -> None:
    said = [row["text"] for row in sentences] + [turn["text"] for row in drives for turn in row["says"]]
    words = Counter(" ".join(re.findall(r"[\w'{}]+", text.lower())) for text in said)
    assert [text for text, count in words.items() if count > 1] == []
    assert len({row["id"] for row in (*sentences, *drives)}) == len(sentences) + len(drives)


def test_drives_have_the_fields_of_the_schema(drives: list[Row]) -> None:
    assert len(drives) == 110
    answers = [
        "speed",
        "traffic",
        "next_turn",
        "why_slow",
        "weather",
        "where",
        "distance",
        "time",
        "list",
        "speed_limit",
        "ahead",
    ]
    for row in drives:
        assert list(row) == ["id", "split", "kind", "speaker", "situation", "needs", "says", "expected"], row["id"]
        assert list(row["needs"]) == ["junctions", "lights", "landmark", "street"] and row["kind"] in DRIVE_KINDS
        assert row["says"] and all(re.fullmatch(r"start|after_reply|seconds:\d+", turn["at"]) for turn in row["says"])
        expected = row["expected"]
        assert list(expected) == ["plan", "reply", "about", "note"] and expected["note"]
        assert expected["reply"] in ("confirm", "answer", "reason", "ask", "any")
        assert expected["about"] in (None, *answers) and (expected["about"] or expected["reply"] != "answer"), row["id"]
        assert plan_errors(row["id"], expected["plan"], blanks=True) == []


def test_names_that_a_drive_fills_in_are_asked_of_the_town(drives: list[Row]) -> None:
    for row in drives:
        said = set(re.findall(r"\{(landmark|street)2?\}", " ".join(turn["text"] for turn in row["says"])))
        planned = set(re.findall(r"\{(landmark|street)2?\}", json.dumps(row["expected"]["plan"])))
        needed = {key for key in ("landmark", "street") if row["needs"][key] is not None}
        assert planned <= said <= needed, row["id"]


def test_each_sentence_was_labelled_by_two(sentences: list[Row], annotators: list[Row]) -> None:
    assert all(list(row) == ["id", "annotator", "acts", "plan"] for row in annotators)
    labelled = Counter((row["id"], row["annotator"]) for row in annotators)
    assert labelled == {(row["id"], annotator): 1 for row in sentences for annotator in "AB"}
    assert [error for row in annotators for error in plan_errors(row["id"], row["plan"])] == []


def slot_values(row: Row) -> set[tuple[str, str]]:
    return {(slot, label) for act in row["acts"] for slot, labels in act["slots"].items() for label in labels}


def test_readme_states_the_agreement_of_the_annotators(sentences: list[Row], annotators: list[Row]) -> None:
    labels = {(row["id"], row["annotator"]): row for row in annotators}
    pairs = [
        (labels[row["id"], "A"], labels[row["id"], "B"])
        for row in sentences
        if row["id"] not in SEEN_BY_THE_ADJUDICATOR
    ]
    spans = [
        [[LabelledSpan(len(act["text"].split()), dialogue_act(act)) for act in row["acts"]] for row in side]
        for side in zip(*pairs, strict=True)
    ]
    figures = agreement_of(*spans)
    cut = [[act["text"] for act in a["acts"]] == [act["text"] for act in b["acts"]] for a, b in pairs]
    plans = [a["plan"] == b["plan"] for a, b in pairs]
    ordering = [a["plan"] == b["plan"] for a, b in pairs if a["plan"] or b["plan"]]
    values = [(slot_values(a), slot_values(b)) for a, b in pairs]
    f1 = 2 * sum(len(a & b) for a, b in values) / sum(len(a) + len(b) for a, b in values)
    measured = {
        "sentences cut at the same places": f"{sum(cut) / len(cut):.3f}",
        "span agreement": f"{figures.spans:.3f}",
        "kappa of moves, pieces": f"{figures.moves:.3f}",
        "kappa of moves, equal spans": f"{figures.moves_of_equal_spans:.3f}",
        "F1 of slot values": f"{f1:.3f}",
        "equal plans": f"{sum(plans) / len(plans):.3f}",
        "equal plans where either annotator has one": f"{sum(ordering) / len(ordering):.3f}",
    }
    readme = (FOLDER / "README.md").read_text(encoding="utf-8")
    stated = dict(re.findall(r"^\| ([^|]+?) \| (\d\.\d{3}) \|", readme, flags=re.MULTILINE))
    assert stated == measured


def test_readme_states_the_counts(sentences: list[Row], drives: list[Row]) -> None:
    readme = " ".join((FOLDER / "README.md").read_text(encoding="utf-8").split())
    for found in (sentences, drives):
        assert all(f"`{kind}` {count}" in readme for kind, count in Counter(row["kind"] for row in found).items())
