"""Reader of annotations in ELAN files with the tiers of `elan_writer`, also if people have edited them in ELAN.

The order of annotations and tiers in such a file has no meaning: utterances follow each other by their times, spans by
their references to each other.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final, NoReturn, TypeVar

from lxml import etree

from dorothie_gym.errors import AnnotationError, OntologyError, one_line
from dorothie_gym.evaluation.analysis.exception_attribution import Handled
from dorothie_gym.lab.annotation.elan_writer import LAYERS, SPANS, SUGGESTED, Element
from dorothie_gym.lab.annotation.marks import Annotation, Change, ExchangeMark, SpanMark, TransactionMark, check_change
from dorothie_gym.lab.annotation.rows import read_label
from dorothie_gym.lab.annotation.source_text import SPEAKERS, SourceLine, SourceText, UtteranceId
from dorothie_gym.ontology.dialogue_acts import UnitEnd
from dorothie_gym.ontology.spellings import parse_landmark
from dorothie_gym.session.recording.files import read_bytes

if TYPE_CHECKING:
    from dorothie_gym.ontology.roles import Role

MAX_ELEMENTS: Final = 500_000
"""Maximum number of elements of a file; each takes some 200 bytes of memory."""

_NUMBER: Final = re.compile(r"\d{1,8}", re.ASCII)
_TIME: Final = re.compile(r"\d{1,12}", re.ASCII)
_Label = TypeVar("_Label")


@dataclass(frozen=True)
class _Noted:
    """Annotation of a tier.

    Attributes:
        name: its id.
        value: its text.
        of: annotation that it belongs to.
        before: annotation before it.
        slots: names of the times at which it begins and ends.
    """

    name: str
    value: str
    of: str | None
    before: str | None
    slots: tuple[str | None, str | None]


def read_elan(path: Path, text: SourceText) -> Annotation:
    """Returns the annotation of an ELAN file for the session with a text.

    Raises:
        AnnotationError: the file is not XML, lacks a tier, or does not match the session; the message names file and
            annotation.
        SessionError: the file is missing or too large.
    """
    reader = _Reader(path)
    spans: dict[UtteranceId, tuple[SpanMark, ...]] = {}
    for speaker in SPEAKERS:
        spans |= reader.read(speaker, text)
    change = Change(utterances=spans, exchanges=reader.exchanges, transactions=reader.transactions)
    try:
        check_change(change, text)
    except AnnotationError as error:
        raise AnnotationError(f"{path}: {error}") from None
    return Annotation.empty(text).after(change)


class _Reader:
    """Tiers of a file, and the marks of units that were read so far."""

    def __init__(self, path: Path) -> None:
        self._path = path
        root = self._root()
        self._times = self._read_times(root)
        self._tiers: dict[str, Element] = {}
        for tier in root.iterfind("TIER"):
            if self._tiers.setdefault(str(tier.get("TIER_ID")), tier) is not tier:
                self._fail(f"has two tiers {str(tier.get('TIER_ID'))[:60]!r}")
        self.exchanges: dict[int, ExchangeMark] = {}
        self.transactions: dict[int, TransactionMark] = {}

    def _fail(self, reason: str) -> NoReturn:
        raise AnnotationError(f"{self._path}: {reason}")

    def _root(self) -> Element:
        content = read_bytes(self._path)
        if content.count(b"<") > MAX_ELEMENTS or content.count(b"=") > 4 * MAX_ELEMENTS:
            self._fail(f"has more than {MAX_ELEMENTS} elements; it is not read")
        parser = etree.XMLParser(resolve_entities=False, no_network=True, remove_comments=True, remove_pis=True)
        try:
            root = etree.fromstring(content, parser)
        except (etree.XMLSyntaxError, ValueError) as error:
            self._fail(f"is not XML: {one_line(error)}")
        if root.tag != "ANNOTATION_DOCUMENT":
            self._fail("is not an ELAN file; its outermost element must be ANNOTATION_DOCUMENT")
        return root

    def _read_times(self, root: Element) -> dict[str, tuple[int, int]]:
        """Returns the times of a file by name: [ms], and the place in the list, which orders slots without a time."""
        found, latest = dict[str, tuple[int, int]](), 0
        for place, slot in enumerate(root.iterfind("TIME_ORDER/TIME_SLOT")):
            name, value = str(slot.get("TIME_SLOT_ID")), slot.get("TIME_VALUE")
            if value is not None and not _TIME.fullmatch(value):
                self._fail(f"time slot {name[:60]!r} has the time {value[:60]!r}; it must be a number [ms]")
            latest = latest if value is None else int(value)
            found[name] = latest, place
        return found

    def read(self, speaker: Role, text: SourceText) -> dict[UtteranceId, tuple[SpanMark, ...]]:
        """Returns the spans of the utterances of a speaker."""
        lines = [line for line in text.lines if line.id.speaker is speaker]
        utterances = sorted(self._tier(speaker.value), key=self._span_of_time)
        if len(utterances) != len(lines):
            self._fail(
                f"tier {speaker.value!r} has {len(utterances)} utterances, and session {text.session} has {len(lines)}"
            )
        spans = self._children(f"{speaker.value} {SPANS}")
        layers = {layer: self._children(f"{speaker.value} {layer}") for layer in LAYERS}
        found = {}
        for line, utterance in zip(lines, utterances, strict=True):
            if (tuple(utterance.value.split()) or ("",)) != line.words:
                self._fail(
                    f"annotation {utterance.name} is {utterance.value[:60]!r}, and {line.id} of session {text.session} "
                    f"is {' '.join(line.words)[:60]!r}"
                )
            found[line.id] = self._spans(line, self._ordered(spans.get(utterance.name, [])), layers)
        return found

    def _tier(self, name: str) -> list[_Noted]:
        """Returns the annotations of a tier, in no order."""
        tier = self._tiers.get(name)
        if tier is None:
            self._fail(f"has no tier {name!r}")
        found = []
        for one in tier.iterfind("ANNOTATION/*"):
            value, id = one.findtext("ANNOTATION_VALUE") or "", one.get("ANNOTATION_ID")
            if id is None:
                self._fail(f"tier {name!r} has an annotation without ANNOTATION_ID")
            slots = one.get("TIME_SLOT_REF1"), one.get("TIME_SLOT_REF2")
            found.append(_Noted(id, value, one.get("ANNOTATION_REF"), one.get("PREVIOUS_ANNOTATION"), slots))
        return found

    def _span_of_time(self, utterance: _Noted) -> tuple[int, ...]:
        """Returns the sort key of utterances: start and end [ms], and their places in the list of times."""
        found = [self._times[slot] for slot in utterance.slots if slot in self._times]
        if len(found) != len(utterance.slots):
            self._fail(f"annotation {utterance.name} has no start or end (TIME_SLOT_REF1, TIME_SLOT_REF2)")
        return (*(time for time, _ in found), *(place for _, place in found))

    def _children(self, name: str) -> dict[str, list[_Noted]]:
        """Returns the annotations of a tier, by the annotation that they belong to."""
        found: dict[str, list[_Noted]] = {}
        for noted in self._tier(name):
            if noted.of is None:
                self._fail(f"tier {name!r}: annotation {noted.name} has no ANNOTATION_REF")
            found.setdefault(noted.of, []).append(noted)
        return found

    def _ordered(self, spans: list[_Noted]) -> list[_Noted]:
        """Returns the spans of an utterance in the order of their references to each other."""
        after = {span.before: span for span in spans}
        ordered, last = list[_Noted](), None
        while last in after and len(ordered) < len(spans):
            ordered.append(after[last])
            last = ordered[-1].name
        if len(ordered) != len(spans):
            self._fail(f"the order of the spans at annotation {spans[0].name} is broken (PREVIOUS_ANNOTATION)")
        return ordered

    def _spans(
        self, line: SourceLine, spans: list[_Noted], layers: Mapping[str, Mapping[str, list[_Noted]]]
    ) -> tuple[SpanMark, ...]:
        words = [tuple(span.value.split()) for span in spans]
        if len(spans) == 1 and line.words == ("",):
            words = [line.words]
        if sum(words, ()) != line.words or not all(words):
            self._fail(f"the spans of {line.id} together are not its words ({' '.join(line.words)[:60]!r})")
        found = []
        for span, own in zip(spans, words, strict=True):
            values = {layer: self._only(layer, layers[layer].get(span.name, [])) for layer in LAYERS}
            found.append(self._span(span.name, len(own), values))
        return tuple(found)

    def _only(self, layer: str, noted: list[_Noted]) -> str:
        if len(noted) > 1:
            self._fail(f"annotation {noted[1].name} is a second one of the {layer} of a span")
        return noted[0].value.strip() if noted else ""

    def _span(self, name: str, words: int, values: Mapping[str, str]) -> SpanMark:
        move, suggested = values["moves"].removesuffix(SUGGESTED), values["moves"].endswith(SUGGESTED)
        try:
            label, act = read_label(move or None, _slots(values["slots"]))
        except AnnotationError as error:
            self._fail(f"the span of annotation {name}: {error}")
        return SpanMark(
            words=words,
            move=label,
            slots=act.slots,
            exchange=self._exchange(values["exchanges"]),
            transaction=self._transaction(values["transactions"]),
            suggested=suggested,
        )

    def _exchange(self, value: str) -> int | None:
        number, fields = self._unit(value, ("exception", "end"))
        if number is not None and fields:
            exception = self._label(fields.get("exception"), Handled, value)
            self.exchanges[number] = self._mark(
                ExchangeMark, value, exception=exception, end=self._label(fields.get("end"), UnitEnd, value)
            )
        return number

    def _transaction(self, value: str) -> int | None:
        number, fields = self._unit(value, ("goal", "end"))
        if number is not None and fields:
            goal = self._label(fields.get("goal"), parse_landmark, value)
            self.transactions[number] = self._mark(
                TransactionMark, value, goal=goal, end=self._label(fields.get("end"), UnitEnd, value)
            )
        return number

    def _unit(self, value: str, names: tuple[str, ...]) -> tuple[int | None, dict[str, str]]:
        """Returns the number of a unit, and the marks after it."""
        if not value:
            return None, {}
        number, *rest = (part.strip() for part in value.split(";"))
        fields = {name.strip(): label.strip() for name, _, label in (part.partition("=") for part in rest)}
        if not _NUMBER.fullmatch(number) or not set(fields) <= set(names):
            self._fail(f"{value[:60]!r} is not the number of a unit with marks, such as '3; {names[1]}=abandoned'")
        return int(number), fields

    def _label(self, label: str | None, read: Callable[[str], _Label], where: str) -> _Label | None:
        try:
            return None if label is None else read(label)
        except (ValueError, OntologyError) as error:
            self._fail(f"{where[:60]!r}: {error}")

    def _mark(self, kind: Callable[..., _Label], where: str, **fields: object) -> _Label:
        try:
            return kind(**fields)
        except AnnotationError as error:
            self._fail(f"{where[:60]!r}: {error}")


def _slots(value: str) -> dict[str, list[str]]:
    """Returns the slots of a text such as "Landmark=KFC+Ikea; Action=Stop"."""
    parts = (part.partition("=") for part in value.split(";") if part.strip())
    return {slot.strip(): [label.strip() for label in labels.split("+")] for slot, _, labels in parts}
