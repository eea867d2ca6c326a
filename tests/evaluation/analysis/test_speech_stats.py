"""Statistics of speech: durations, silences, rates, word errors by class, and lost meanings."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest
from typer.testing import CliRunner

from dorothie_gym.cli import app
from dorothie_gym.dialogue import Loudness, WordClass
from dorothie_gym.evaluation.analysis.lost_meaning import lost_meanings
from dorothie_gym.evaluation.analysis.speech_stats import PUBLISHED, SpeechStats, figure_at
from dorothie_gym.evaluation.analysis.word_errors import WordErrorCounts, errors_of
from dorothie_gym.ontology import ActionValue, LandmarkName, Role
from dorothie_gym.session.recording import Event, Session
from tests.evaluation.analysis.builders import M, car, human
from tests.session.recording.builders import write


def said(event: Event, start: float, end: float, recognised: str | None = None) -> Event:
    heard = {} if recognised is None else {"recognised": recognised}
    return replace(event, data={**event.data, "start": start, "end": end, **heard})


def recorded(folder: Path, *events: Event) -> Session:
    write(folder, list(events))
    return Session.load(folder)


def test_durations_silences_and_rates_are_those_of_the_utterances(tmp_path: Path) -> None:
    session = recorded(
        tmp_path / "s",
        *(said(event, 0.0, 2.0) for event in human(2.0, "go left at the KFC", M.INSTRUCT, ActionValue.J_TURN)),
        *(said(event, 2.5, 3.5) for event in car(3.5, "okay", M.ACKNOWLEDGE)),
        *(said(event, 3.0, 4.5) for event in human(4.5, "and then right", M.INSTRUCT, ActionValue.J_TURN)),
        *(said(event, 6.0, 7.0) for event in human(7.0, "please", M.IRRELEVANT)),
    )
    stats = SpeechStats()
    stats.add(session)
    figures = stats.to_json()
    assert stats.speech == {Role.PARTICIPANT: 4.5, Role.CO_WIZARD: 1.0}
    assert stats.any_speech == pytest.approx(5.0) and stats.overlap == pytest.approx(0.5)
    assert stats.gaps == pytest.approx([0.5, -0.5]) and stats.pauses == pytest.approx([1.5])
    assert stats.overlapping == 1
    assert stats.rates[Role.PARTICIPANT][0] == pytest.approx(60 * 7 / 2)  # "k f c" are three words
    assert figures["recognition"] is None, "nothing was recognised"
    assert figure_at(figures, "gaps.quantiles.0.5") == pytest.approx(0.0)
    assert all(
        figure_at({**figures, "recognition": {"word_error_rate": 0.1}}, each.figure) is not None for each in PUBLISHED
    )


def test_errors_belong_to_the_class_of_the_spoken_word() -> None:
    found = errors_of(
        "Take me to the KFC on Baits Street, it's turquoise.", "take me to the k f c on beats street the it's"
    )
    name, rare = found[WordClass.NAME], found[WordClass.RARE]
    assert (name.substitutions, name.words) == (1, 5), "k, f, c, Baits, Street"
    assert rare.deletions + rare.substitutions == 1, "turquoise"
    assert sum(each.errors for each in found.values()) == 3


@pytest.mark.parametrize(("speed", "noise"), [(0.0, Loudness.QUIET), (10.0, Loudness.MODERATE), (17.0, Loudness.LOUD)])
def test_noise_follows_the_speed_of_the_car(tmp_path: Path, speed: float, noise: Loudness) -> None:
    session = recorded(
        tmp_path / "s", *(said(event, 0.0, 1.0, "go lift") for event in human(1.0, "go left", M.INSTRUCT))
    )
    rows = session.trajectory.copy()
    rows["speed"] = speed
    counts = WordErrorCounts()
    counts.add(replace(session, trajectory=rows))
    assert set(counts.noises) == {noise} and counts.total.errors == 1
    assert set(counts.speakers) == {Role.PARTICIPANT}


def test_meaning_is_lost_with_a_detail_and_repaired_by_asking_or_saying_it_again(tmp_path: Path) -> None:
    def lost(*after: Event, heard: str) -> list[bool]:
        name = str(len(list(tmp_path.iterdir())))
        first = (
            said(event, 0.0, 1.0, heard) for event in human(1.0, "to the KFC please", M.INSTRUCT, LandmarkName.KFC)
        )
        return [each.is_repaired for each in lost_meanings(recorded(tmp_path / name, *first, *after))]

    okay = [said(event, 2.0, 3.0) for event in car(3.0, "okay", M.ACKNOWLEDGE)]
    assert lost(*okay, heard="to the KFC please") == [] == lost(*okay, heard="to the KFC cheese")
    assert lost(*okay, heard="to the key please") == [False]
    asks = [said(event, 2.0, 3.0) for event in car(3.0, "say again?", M.CONFUSE)]
    assert lost(*asks, heard="to the key please") == [True]
    again = [said(event, 5.0, 6.0, "the KFC") for event in human(6.0, "the KFC", M.CLARIFY, LandmarkName.KFC)]
    assert lost(*okay, *again, heard="to the key please") == [True]
    late = [said(event, 50.0, 51.0, "the KFC") for event in human(51.0, "the KFC", M.CLARIFY, LandmarkName.KFC)]
    assert lost(*okay, *late, heard="to the key please") == [False]


def test_command_prints_tables_and_json(tmp_path: Path) -> None:
    for seed in range(2):
        events = [
            said(event, 0.0, 2.0, "go right at the KFC") for event in human(2.0, "go left at the KFC", M.INSTRUCT)
        ]
        write(tmp_path / "corpus" / "train" / f"seed_{seed}", events, seed=seed)
    shown = CliRunner().invoke(app, ["stats", str(tmp_path / "corpus"), "--speech"])
    assert shown.exit_code == 0, shown.output
    assert "14.3 %" in shown.output and "Stivers" in shown.output and "None has audio" in shown.output
    figures = json.loads(CliRunner().invoke(app, ["stats", str(tmp_path / "corpus"), "--speech", "--json"]).output)
    assert figures["recognition"]["word_error_rate"] == pytest.approx(2 / 14, abs=1e-4)
    assert figures["sessions"] == 2 and figures["audio_hours"] == pytest.approx(4 / 3600, abs=1e-4)
    failed = CliRunner().invoke(app, ["stats", str(tmp_path / "corpus"), "--speech", "--talk"])
    assert failed.exit_code == 2 and "exclude each other" in failed.output
