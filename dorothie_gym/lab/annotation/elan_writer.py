"""Writer of annotations as ELAN files (`.eaf`, EUDICO annotation format 3.0).

Each speaker has a tier of utterances with their times. Its spans are a symbolic subdivision of the utterances; moves,
slots, exchanges and transactions are symbolically associated with the spans. The marks of an exchange or transaction
follow its number at its first span.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Final, TypeAlias

from lxml import etree

from dorothie_gym.errors import AnnotationError
from dorothie_gym.lab.annotation.marks import Annotation, ExchangeMark, SpanMark, TransactionMark
from dorothie_gym.lab.annotation.source_text import SPEAKERS, SourceLine, SourceText
from dorothie_gym.ontology.dialogue_acts import DialogueAct, DialogueMove
from dorothie_gym.support.files import write_atomically

if TYPE_CHECKING:
    from dorothie_gym.ontology.roles import Role

Element: TypeAlias = etree._Element
"""XML element; the stubs of lxml name the class with an underscore."""

_XSI: Final = "http://www.w3.org/2001/XMLSchema-instance"
_SCHEMA: Final = "http://www.mpi.nl/tools/elan/EAFv3.0.xsd"
_DATE: Final = "2000-01-01T00:00:00Z"
"""Date of all files: equal annotations give equal bytes."""

SPANS: Final = "spans"
LAYERS: Final = ("moves", "slots", "exchanges", "transactions")
_STEREOTYPES: Final = {
    "Symbolic_Subdivision": "Symbolic subdivision of a parent annotation. Annotations refering to the same parent are "
    "ordered",
    "Symbolic_Association": "1-1 association with a parent annotation",
}
SUGGESTED: Final = "?"
"""Ending of a move that the classifier suggests and the annotator has not accepted."""


class _Document:
    """Annotation document with its time slots and numbered annotations."""

    def __init__(self, text: SourceText) -> None:
        self.root = etree.Element("ANNOTATION_DOCUMENT", nsmap={"xsi": _XSI})
        self.root.set(f"{{{_XSI}}}noNamespaceSchemaLocation", _SCHEMA)
        for name, value in (("AUTHOR", ""), ("DATE", _DATE), ("FORMAT", "3.0"), ("VERSION", "3.0")):
            self.root.set(name, value)
        header = etree.SubElement(self.root, "HEADER", MEDIA_FILE="", TIME_UNITS="milliseconds")
        etree.SubElement(header, "PROPERTY", NAME="session").text = text.session
        self._times = etree.SubElement(self.root, "TIME_ORDER")
        self._annotations = 0

    def tier(self, name: str, speaker: Role, annotator: str, kind: str, parent: str | None = None) -> Element:
        """Appends a tier."""
        settings = {"TIER_ID": name, "PARTICIPANT": speaker.value, "ANNOTATOR": annotator, "LINGUISTIC_TYPE_REF": kind}
        if parent is not None:
            settings["PARENT_REF"] = parent
        return etree.SubElement(self.root, "TIER", settings)

    def slot(self, seconds: float) -> str:
        """Appends a time [s]; returns its name."""
        name = f"ts{len(self._times) + 1}"
        etree.SubElement(self._times, "TIME_SLOT", TIME_SLOT_ID=name, TIME_VALUE=str(max(round(1000 * seconds), 0)))
        return name

    def annotate(self, tier: Element, kind: str, value: str, references: Mapping[str, str]) -> str:
        """Appends an annotation to a tier; returns its name."""
        self._annotations += 1
        name = f"a{self._annotations}"
        one = etree.SubElement(etree.SubElement(tier, "ANNOTATION"), kind, {"ANNOTATION_ID": name, **references})
        etree.SubElement(one, "ANNOTATION_VALUE").text = value
        return name


def write_elan(path: Path, text: SourceText, annotation: Annotation, annotator: str) -> None:
    """Writes an annotation.

    Raises:
        AnnotationError: an utterance contains characters that XML cannot represent.
        OSError: the file cannot be written.
    """
    document = _Document(text)
    firsts = _first_spans(text, annotation)
    try:
        for speaker in SPEAKERS:
            _write_speaker(document, speaker, text, annotation, annotator, firsts)
    except ValueError as error:
        raise AnnotationError(f"session {text.session} cannot be written as ELAN: {error}") from None
    root = document.root
    for name, constraint in _types():
        aligned = "true" if constraint is None else "false"
        settings = {"LINGUISTIC_TYPE_ID": name, "TIME_ALIGNABLE": aligned, "GRAPHIC_REFERENCES": "false"}
        if constraint is not None:
            settings["CONSTRAINTS"] = constraint
        etree.SubElement(root, "LINGUISTIC_TYPE", settings)
    for stereotype, description in _STEREOTYPES.items():
        etree.SubElement(root, "CONSTRAINT", STEREOTYPE=stereotype, DESCRIPTION=description)
    etree.indent(root)
    write_atomically(path, etree.tostring(root, xml_declaration=True, encoding="UTF-8") + b"\n")


def _types() -> Iterator[tuple[str, str | None]]:
    yield "utterances", None
    yield SPANS, "Symbolic_Subdivision"
    for layer in LAYERS:
        yield layer, "Symbolic_Association"


def _first_spans(text: SourceText, annotation: Annotation) -> dict[tuple[str, int], tuple[SourceLine, int]]:
    """Returns the first span of each unit: its utterance, and the number of its first word."""
    firsts: dict[tuple[str, int], tuple[SourceLine, int]] = {}
    for line, first, span in annotation.spans(text):
        for layer, number in (("exchanges", span.exchange), ("transactions", span.transaction)):
            if number is not None:
                firsts.setdefault((layer, number), (line, first))
    return firsts


def _write_speaker(
    document: _Document,
    speaker: Role,
    text: SourceText,
    annotation: Annotation,
    annotator: str,
    firsts: Mapping[tuple[str, int], tuple[SourceLine, int]],
) -> None:
    name = speaker.value
    utterances = document.tier(name, speaker, annotator, "utterances")
    spans = document.tier(f"{name} {SPANS}", speaker, annotator, SPANS, name)
    layers = {layer: document.tier(f"{name} {layer}", speaker, annotator, layer, f"{name} {SPANS}") for layer in LAYERS}
    over = 0.0
    for line in text.lines:
        if line.id.speaker is not speaker:
            continue
        start = max(line.start, over)  # annotations of a tier do not overlap
        over = max(line.end, start + 0.001)
        slots = {"TIME_SLOT_REF1": document.slot(start), "TIME_SLOT_REF2": document.slot(over)}
        parent = document.annotate(utterances, "ALIGNABLE_ANNOTATION", " ".join(line.words), slots)
        first, before = 0, dict[str, str]()
        for span in annotation.utterances[line.id]:
            words = line.text(first, span.words)
            of = document.annotate(spans, "REF_ANNOTATION", words, {"ANNOTATION_REF": parent, **before})
            before = {"PREVIOUS_ANNOTATION": of}
            for layer, value in _values(span, annotation, {key for key, at in firsts.items() if at == (line, first)}):
                document.annotate(layers[layer], "REF_ANNOTATION", value, {"ANNOTATION_REF": of})
            first += span.words


def _values(span: SpanMark, annotation: Annotation, begun: set[tuple[str, int]]) -> Iterator[tuple[str, str]]:
    """Yields the layers of a span with their values; `begun` holds the units that begin with it."""
    if span.move is not None:
        yield "moves", span.move.label + (SUGGESTED if span.suggested else "")
    if span.slots:
        labels = DialogueAct(DialogueMove.IRRELEVANT, span.slots).slot_labels()
        yield "slots", "; ".join(f"{slot}={'+'.join(values)}" for slot, values in labels.items())
    if span.exchange is not None:
        fields: dict[str, str | None] = {}
        if ("exchanges", span.exchange) in begun:
            mark = annotation.exchanges.get(span.exchange, ExchangeMark())
            fields = {"exception": mark.exception, "end": mark.end}
        yield "exchanges", _unit_text(span.exchange, fields)
    if span.transaction is not None:
        fields = {}
        if ("transactions", span.transaction) in begun:
            task = annotation.transactions.get(span.transaction, TransactionMark())
            fields = {"goal": None if task.goal is None else task.goal.label, "end": task.end}
        yield "transactions", _unit_text(span.transaction, fields)


def _unit_text(number: int, fields: Mapping[str, str | None]) -> str:
    return "; ".join([str(number), *(f"{name}={value}" for name, value in fields.items() if value is not None)])
