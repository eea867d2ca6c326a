"""Round trips of annotations through every format, and files that do not fit."""

from __future__ import annotations

import random
from dataclasses import replace
from pathlib import Path

import pytest
from lxml import etree

from dorothie_gym.archive import read_session
from dorothie_gym.errors import AnnotationError, DorothieGymError, SessionError
from dorothie_gym.lab.annotation.formats import Format, export_annotation, import_annotation
from dorothie_gym.lab.annotation.marks import Annotation, Change
from dorothie_gym.lab.annotation.session_labels import recorded_annotation
from dorothie_gym.lab.annotation.source_text import SourceText
from dorothie_gym.ontology import DialogueMove, LandmarkName, Role
from dorothie_gym.session.recording import Session
from tests.lab.annotation.builders import FIRST, YES, annotate, random_annotation, recorded, span
from tests.session.recording.builders import session, utterance, write
from tests.session.recording.dialogues import DONE, OKAY, TO_KFC, talk

FILES = [Format.JSONL, Format.ELAN]


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("to", list(Format))
def test_what_is_exported_is_imported(to: Format, seed: int, tmp_path: Path) -> None:
    one, text = recorded(tmp_path / "s")
    annotation = random_annotation(text, random.Random(seed), complete=True)
    path = export_annotation(one, annotation, "anna", tmp_path / f"out{to.suffix}", to)
    assert import_annotation(one, path) == annotation


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("to", FILES)
def test_unfinished_annotations_keep_what_is_undecided_and_suggested(to: Format, seed: int, tmp_path: Path) -> None:
    one, text = recorded(tmp_path / "s")
    annotation = random_annotation(text, random.Random(seed))
    path = export_annotation(one, annotation, "anna", tmp_path / f"out{to.suffix}", to)
    assert import_annotation(one, path) == annotation
    assert path.read_bytes() == export_annotation(one, annotation, "anna", tmp_path / f"b{to.suffix}", to).read_bytes()


@pytest.mark.parametrize("to", [Format.NATIVE, Format.SDN])
def test_copies_of_sessions_need_a_move_for_every_span(to: Format, tmp_path: Path) -> None:
    one, text = recorded(tmp_path / "s")
    with pytest.raises(AnnotationError, match="utterance 0 of participant, span 'To the KFC please.' has no move yet"):
        export_annotation(one, Annotation.empty(text), "anna", tmp_path / "out", to)
    assert not (tmp_path / "out").exists()


def test_a_copy_has_the_new_labels_and_everything_else_of_the_session(tmp_path: Path) -> None:
    one, text = recorded(tmp_path / "s")
    annotation = recorded_annotation(one, text).after(
        Change(
            utterances={
                YES: (span(2, DialogueMove.CONFIRM), span(2, DialogueMove.CHECK, LandmarkName.IKEA, exchange=4))
            }
        )
    )
    copy = read_session(export_annotation(one, annotation, "anna", tmp_path / "out", Format.NATIVE))
    moves = [move for move in copy.moves() if move.utterance == 2]
    assert [(move.span, str(move.act), move.exchange, move.flagged) for move in moves] == [
        ("Yes, left", "Confirm()", None, True),
        ("on Fuller.", "Check(Landmark=Ikea)", 4, True),
    ]
    assert copy.header.is_annotated and copy.header.extra["annotation"] == {"annotator": "anna"}
    assert [e for e in copy.events if e.type != "DialogueMove"] == [e for e in one.events if e.type != "DialogueMove"]
    assert len(copy.trajectory) == len(one.trajectory) and copy.complete and copy.decisions is None
    assert copy.check() == one.check()


def test_acts_of_sdn_without_spans_get_equal_parts_of_the_words() -> None:
    events = utterance(60, Role.PARTICIPANT, 0, ("a b c d e", TO_KFC), ("a b c d e", OKAY))
    whole = [replace(event, data={**event.data, "text": "a b c d e"}) for event in events]
    one = session(whole)
    text = SourceText.of(one)
    assert [mark.words for mark in recorded_annotation(one, text).utterances[FIRST]] == [2, 3]


def test_spans_that_are_not_the_words_are_refused() -> None:
    events = utterance(60, Role.PARTICIPANT, 0, ("a b", TO_KFC), ("c", OKAY))
    one = session([replace(event, data={**event.data, "text": "a b d"}) for event in events])
    with pytest.raises(SessionError, match="the spans together are not the words"):
        recorded_annotation(one, SourceText.of(one))


def test_a_session_without_talk_is_refused() -> None:
    with pytest.raises(SessionError, match="nobody speaks in it; there is nothing to annotate"):
        SourceText.of(session())


def test_words_outside_of_ascii_and_of_xml_survive_or_are_refused(tmp_path: Path) -> None:
    strange = Session.load(
        write(tmp_path / "s", utterance(60, Role.PARTICIPANT, 0, ("<b> & “Zoë” \u2028 ]]> 'x'", DONE)))
    )
    text = SourceText.of(strange)
    annotation = random_annotation(text, random.Random(1), complete=True)
    for to in Format:
        path = export_annotation(strange, annotation, "anna", tmp_path / f"{to}{to.suffix}", to)
        assert import_annotation(strange, path) == annotation, to
    control = Session.load(write(tmp_path / "t", utterance(60, Role.PARTICIPANT, 0, ("a \x01b", DONE))))
    with pytest.raises(AnnotationError, match="cannot be written as ELAN"):
        export_annotation(
            control, random_annotation(SourceText.of(control), random.Random(1)), "x", tmp_path / "c.eaf", Format.ELAN
        )


# --- ELAN -------------------------------------------------------------------------------------------------------------


def eaf(folder: Path, seed: int = 3) -> tuple[Session, Annotation, Path]:
    one, text = recorded(folder / "s")
    annotation = random_annotation(text, random.Random(seed), complete=True)
    return one, annotation, export_annotation(one, annotation, "anna", folder / "one.eaf", Format.ELAN)


def test_elan_files_have_the_structure_of_eaf_3(tmp_path: Path) -> None:
    schema = etree.XMLSchema(etree.parse(str(Path(__file__).parent / "eaf_structure.xsd")))
    _, _, path = eaf(tmp_path)
    schema.assertValid(etree.parse(str(path)))


def test_another_program_reads_the_elan_file(tmp_path: Path) -> None:
    elan = pytest.importorskip("pympi.Elan", reason="needs pympi-ling")
    one, annotation, path = eaf(tmp_path)
    read = elan.Eaf(str(path))
    said = [(row[0], row[1], row[2]) for row in read.get_annotation_data_for_tier("participant")]
    assert said == [(0, 1000, "To the KFC please."), (3000, 4000, "Yes, left on Fuller."), (7000, 8000, "Great.")]
    moves = [row[2] for row in read.get_annotation_data_for_tier("co_wizard moves")]
    own = [id for id in annotation.utterances if id.speaker is Role.CO_WIZARD]
    assert moves == [mark.move.label for id in own for mark in annotation.utterances[id] if mark.move]
    read.add_linguistic_type("notes")
    read.add_tier("notes", ling="notes")
    read.add_annotation("notes", 0, 900, "checked")
    read.to_file(str(tmp_path / "edited.eaf"))
    assert import_annotation(one, tmp_path / "edited.eaf") == annotation, "also after another program has written it"


@pytest.mark.parametrize(
    ("old", "new", "wanted"),
    [
        ("<HEADER", "<HEADE", "is not XML"),
        ("ANNOTATION_DOCUMENT", "DOCUMENT", "is not an ELAN file"),
        ('TIER_ID="co_wizard moves"', 'TIER_ID="x"', "has no tier 'co_wizard moves'"),
        ("<ANNOTATION_VALUE>Great.</ANNOTATION_VALUE>", "<ANNOTATION_VALUE>Bad.</ANNOTATION_VALUE>", "'Bad.'"),
        ('PREVIOUS_ANNOTATION="', 'PREVIOUS_ANNOTATION="z', "order of the spans"),
        ('TIME_SLOT_ID="ts3"', 'TIME_SLOT_ID="x"', "has no start or end (TIME_SLOT_REF1, TIME_SLOT_REF2)"),
        ('TIME_SLOT_REF2="', 'REF2="', "has no start or end (TIME_SLOT_REF1, TIME_SLOT_REF2)"),
        ('TIME_VALUE="3000"', 'TIME_VALUE="3 s"', "has the time '3 s'; it must be a number [ms]"),
        ('TIER_ID="co_wizard moves"', 'TIER_ID="co_wizard slots"', "has two tiers 'co_wizard slots'"),
        ('moves" PARTICIPANT', 'moves" X="&a;" PARTICIPANT', "is not XML"),
    ],
)
def test_elan_files_that_do_not_fit_are_one_error(old: str, new: str, wanted: str, tmp_path: Path) -> None:
    one, _, path = eaf(tmp_path)
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new), encoding="utf-8")
    with pytest.raises(AnnotationError) as refused:
        import_annotation(one, path)
    assert wanted in str(refused.value) and "one.eaf" in str(refused.value)


@pytest.mark.parametrize("seed", range(12))
def test_order_of_elements_has_no_meaning(seed: int, tmp_path: Path) -> None:
    one, annotation, path = eaf(tmp_path)
    drawn, tree = random.Random(seed), etree.parse(str(path))
    shuffled = [tree.getroot(), tree.find("TIME_ORDER"), *tree.findall("TIER")]
    for parent in shuffled if seed else reversed(shuffled):
        parts = list(parent)
        drawn.shuffle(parts)
        parent[:] = parts if seed else list(reversed(parent))
    tree.write(str(path), encoding="UTF-8", xml_declaration=True)
    assert import_annotation(one, path) == annotation


def test_times_decide_even_if_names_and_references_are_in_another_order(tmp_path: Path) -> None:
    one, annotation, path = eaf(tmp_path)
    tree = etree.parse(str(path))
    names = [*tree.iter("ALIGNABLE_ANNOTATION"), *tree.iter("REF_ANNOTATION")]
    new = {str(each.get("ANNOTATION_ID")): f"z{len(names) - number}" for number, each in enumerate(names)}
    for each in names:
        for reference in ("ANNOTATION_ID", "ANNOTATION_REF", "PREVIOUS_ANNOTATION"):
            if each.get(reference):
                each.set(reference, new[str(each.get(reference))])
    tree.write(str(path), encoding="UTF-8", xml_declaration=True)
    assert import_annotation(one, path) == annotation


def test_times_that_are_not_given_follow_their_list(tmp_path: Path) -> None:
    one, annotation, path = eaf(tmp_path)
    tree = etree.parse(str(path))
    for number, slot in enumerate(tree.iter("TIME_SLOT")):
        if number % 3:
            del slot.attrib["TIME_VALUE"]
    tree.write(str(path), encoding="UTF-8", xml_declaration=True)
    assert import_annotation(one, path) == annotation


@pytest.mark.parametrize("seed", range(4))
def test_order_of_lines_has_no_meaning(seed: int, tmp_path: Path) -> None:
    one, text = recorded(tmp_path / "s")
    annotation = random_annotation(text, random.Random(seed), complete=True)
    path = export_annotation(one, annotation, "anna", tmp_path / "one.jsonl", Format.JSONL)
    head, *lines = path.read_text(encoding="utf-8").splitlines()
    random.Random(seed).shuffle(lines)
    path.write_text("\n".join([head, *lines]) + "\n", encoding="utf-8")
    assert import_annotation(one, path) == annotation


def test_files_of_another_session_are_refused(tmp_path: Path) -> None:
    one, annotation, path = eaf(tmp_path)
    other = Session.load(write(tmp_path / "other", talk()[:8]))
    jsonl = export_annotation(one, annotation, "anna", tmp_path / "one.jsonl", Format.JSONL)
    native = export_annotation(one, annotation, "anna", tmp_path / "copy", Format.NATIVE)
    for file in (path, jsonl, native):
        with pytest.raises(DorothieGymError):
            import_annotation(other, file)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("to", FILES)
def test_mutated_files_are_read_or_refused(to: Format, seed: int, tmp_path: Path) -> None:
    one, text = recorded(tmp_path / "s")
    rng = random.Random(seed)
    path = export_annotation(one, random_annotation(text, rng), "anna", tmp_path / f"m{to.suffix}", to)
    whole = path.read_bytes()
    for _ in range(300):
        content = bytearray(whole)
        for _ in range(rng.randint(1, 4)):
            at = rng.randrange(len(content))
            content[at : at + rng.choice([0, 1, 1, 9])] = rng.choice(
                [b"", b"\x00", b'"', b"9" * 30, b"<", b"{", b"\xff", b"null"]
            )
        path.write_bytes(content)
        try:
            import_annotation(one, path)
        except DorothieGymError as error:
            assert "\n" not in str(error) and len(str(error)) < 1500


def test_a_damaged_sdn_folder_is_one_error(tmp_path: Path) -> None:
    one, annotation, _ = eaf(tmp_path)
    folder = export_annotation(one, annotation, "anna", tmp_path / "log_7", Format.SDN)
    log = folder / "annotated_log.json"
    log.write_text(log.read_text().replace('"utterance_gt"', '"utterance_g"').replace('"utterance"', '"utt"'))
    with pytest.raises(DorothieGymError) as refused:
        import_annotation(one, folder)
    assert "\n" not in str(refused.value)


def test_folders_that_are_no_annotation_are_refused(tmp_path: Path) -> None:
    one, text = recorded(tmp_path / "s")
    (tmp_path / "empty").mkdir()
    for path in (tmp_path / "empty", tmp_path / "nothing.eaf", tmp_path / "s" / "events.jsonl2"):
        with pytest.raises(AnnotationError, match="is no annotation; give a .jsonl or .eaf file"):
            import_annotation(one, path)
    annotate(tmp_path / "s", text, "anna", random_annotation(text, random.Random(1)))
    with pytest.raises(SessionError, match="line 1"):  # a log is not the format for exchange
        import_annotation(one, tmp_path / "s" / "annotations" / "anna.jsonl")
