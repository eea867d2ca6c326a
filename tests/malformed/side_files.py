"""Files beside sessions: annotations, studies, and cassettes of language models."""

from __future__ import annotations

import json
import random
from pathlib import Path


def make_annotations(folder: Path) -> None:
    from dorothie_gym.lab.annotation.formats import Format, export_annotation
    from dorothie_gym.lab.annotation.links import keep_links
    from dorothie_gym.lab.annotation.workplace import Seat, SeatKind
    from tests.lab.annotation.builders import annotate, random_annotation, recorded

    one, text = recorded(folder / "one")
    for seed, name in enumerate(("anna", "ben", "adjudicated")):
        annotate(folder / "one", text, name, random_annotation(text, random.Random(seed), complete=True))
    keep_links(folder, [Seat("anna", SeatKind.ANNOTATOR, "secret"), Seat("carol", SeatKind.ADJUDICATOR, "other")])
    for to in (Format.JSONL, Format.ELAN):
        export_annotation(one, random_annotation(text, random.Random(7)), "carl", folder / f"carl{to.suffix}", to)


def read_annotations(folder: Path) -> None:
    from dorothie_gym.archive import Corpus
    from dorothie_gym.errors import DorothieGymError
    from dorothie_gym.lab.annotation.corpus_agreement import corpus_agreement
    from dorothie_gym.lab.annotation.formats import import_annotation
    from dorothie_gym.lab.annotation.links import read_links
    from dorothie_gym.session.recording import Session

    refusals: list[DorothieGymError] = []
    session = None
    try:
        session = Session.load(folder / "one")
        corpus_agreement(Corpus.load(folder).entries, with_alpha=False)
    except DorothieGymError as error:
        refusals.append(error)
    try:
        read_links(folder)
    except DorothieGymError as error:
        refusals.append(error)
    for name in ("carl.jsonl", "carl.eaf"):
        try:
            if session is not None:
                import_annotation(session, folder / name)
        except DorothieGymError as error:
            refusals.append(error)
    if refusals:
        raise refusals[0]


def make_cassette(folder: Path) -> None:
    from dorothie_gym.policies.language_model.cassette import Cassette, Reply
    from dorothie_gym.policies.language_model.chat_endpoint import Tokens
    from dorothie_gym.policies.language_model.faults import Fault
    from dorothie_gym.policies.language_model.usage import ModelUsage

    tape = Cassette(folder / "tape.jsonl")
    tape.add({"model": "m", "seed": 1}, Reply(answer='{"drive": "Stop"}', tokens=Tokens(900, 20), latency=0.5))
    tape.add({"model": "m", "seed": 2}, Reply(fault=Fault.TIMEOUT, reason="no answer", retried=True, latency=30.0))
    usage = ModelUsage(model="m", calls=2, answers=1, cost=0.01, silences={"timeout": 1})
    (folder / "usage.json").write_text(json.dumps({"co_wizard": usage.to_json()}))


def read_cassette(folder: Path) -> None:
    from dorothie_gym.evaluation.closed_loop.usage import read_usage
    from dorothie_gym.policies.language_model.cassette import Cassette

    Cassette(folder / "tape.jsonl").find({"model": "m", "seed": 1})
    read_usage(folder)


def make_study(folder: Path) -> None:
    from importlib.resources import files

    example = files("dorothie_gym.lab.studies") / "data" / "example.yaml"
    (folder / "study.yaml").write_text(example.read_text(encoding="utf-8"), encoding="utf-8")


def read_study(folder: Path) -> None:
    from dorothie_gym.lab.studies.assignment import Assigner
    from dorothie_gym.lab.studies.study_file import check_sources, read_study

    file = folder / "study.yaml"
    study = read_study(file)
    Assigner(study).slot(3)
    check_sources(study, file)
