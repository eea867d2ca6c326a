"""Errors and times of synthesis, recognition and understanding on the talk of sessions that nothing was fitted to."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Sequence
from typing import Final

import numpy as np
from rapidfuzz.distance import Levenshtein

from benchmarks.timing import Figures, Progress, ignore_progress, machine, rounded
from dorothie_gym.dialogue import Span, Utterance, guess_act
from dorothie_gym.evaluation.rollout.corpus_generation import plan_corpus
from dorothie_gym.evaluation.rollout.play import play_session
from dorothie_gym.maps import load_town
from dorothie_gym.ontology import Slot, SlotValue
from dorothie_gym.policies import ALL_SCRIPTED
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.session.session_engine import SessionEngine
from dorothie_gym.speech import (
    Recognition,
    find_recognizer,
    find_synthesizer,
    pink_noise,
    say,
    spoken_words,
    understand_speech,
)
from dorothie_gym.support.audio import SAMPLE_RATE, Samples

SEED: Final = 31000
"""Seed of the sessions; those of the language model have 21001 (`benchmarks/speech_transcripts.py`)."""

RATIOS: Final[Sequence[tuple[str, float | None]]] = (("clean", None), ("20db", 20.0), ("10db", 10.0))
"""Conditions: name, and ratio of speech to pink noise [dB]."""

_MARGIN: Final = 0.2  # noise before and behind a span [s]


def measure(
    *,
    sessions: int = 6,
    spans: int = 150,
    seed: int = SEED,
    synthesizer: str = "hibari",
    recognizer: str = "pocketsphinx",
    progress: Progress = ignore_progress,
) -> Figures:
    """Speaks and recognises spans of played sessions, in CPU seconds of one thread.

    Args:
        sessions: number of sessions that are played.
        spans: number of spans that are drawn from them.
        seed: seed of the sessions, as of a corpus.
        synthesizer: name of the synthesiser.
        recognizer: name of the recogniser.
        progress: callback for the progress.

    Returns:
        `wer_clean`, `wer_20db`, `wer_10db`: word errors per spoken word, without noise and in pink noise; `slots_f1`
        and `names`: F1 of slot values, and share of names of landmarks and streets, understood from the recognised
        words, compared with the written ones; `slots_f1_annotated`: F1 compared with the acts; `moves` and
        `moves_written`: share of moves understood from recognised and from written words;
        `recognition_rtf`: processor time per second of clean audio; `synthesis_milliseconds`: median of a span.

    Raises:
        SpeechError: the extra `speech` is not installed, or there is no such synthesiser or recogniser.
    """
    speaker, listener = find_synthesizer(synthesizer), find_recognizer(recognizer)
    said = played_spans(sessions, spans, seed, progress)
    speaker.synthesize("Hello.")
    audio: list[Samples] = []
    times: list[float] = []
    for number, span in enumerate(said):
        begun = time.process_time()
        audio.append(say(speaker, span.text, seed=number))
        times.append(time.process_time() - begun)
        progress("synthesis", 0.3 + 0.1 * number / len(said))
    seconds = sum(map(len, audio)) / SAMPLE_RATE
    results: dict[str, list[Recognition]] = {}
    figures: Figures = {}
    for place, (name, ratio) in enumerate(RATIOS):
        begun = time.process_time()
        results[name] = [
            listener.recognize(_heard(samples, ratio, number), SAMPLE_RATE) for number, samples in enumerate(audio)
        ]
        if ratio is None:
            figures["recognition_rtf"] = rounded((time.process_time() - begun) / seconds)
        figures[f"wer_{name}"] = rounded(word_errors(said, results[name]))
        progress("recognition", 0.4 + 0.2 * (place + 1))
    return {
        **figures,
        **_understood(said, results["clean"]),
        "synthesis_milliseconds": rounded(1000.0 * float(np.median(times))),
        "words_per_second": rounded(sum(len(spoken_words(span.text)) for span in said) / seconds),
        "synthesizer": synthesizer,
        "recognizer": recognizer,
        "sessions": sessions,
        "spans": len(said),
        "seed": seed,
        "audio_seconds": rounded(seconds),
        "machine": machine(),
    }


def played_spans(sessions: int, spans: int, seed: int, progress: Progress = ignore_progress) -> list[Span]:
    """Returns spans that scripted speakers say, drawn from the sessions of a corpus with an exact channel."""
    said: list[Utterance] = []
    config = EnvConfig(word_error_rate=0.0)
    for number, plan in enumerate(plan_corpus(sessions, seed)):
        engine = SessionEngine(load_town(plan.town), config=config)
        play_session(
            engine, {role: player.make(role, engine.limits) for role, player in ALL_SCRIPTED.items()}, seed=plan.seed
        )
        said += engine.session.dialogue.said
        progress("sessions", 0.3 * (number + 1) / sessions)
    found = [span for utterance in said for span in utterance.spans]
    order = np.random.default_rng(seed).permutation(len(found))[:spans]
    return [found[place] for place in order.tolist()]


def word_errors(said: Sequence[Span], heard: Sequence[Recognition]) -> float:
    """Returns the word error rate of recognised spans: edits of spoken words per word that was said."""
    edits = words = 0
    for span, recognition in zip(said, heard, strict=True):
        reference = spoken_words(span.text)
        edits += Levenshtein.distance(reference, recognition.text.split())
        words += len(reference)
    return edits / words


def _understood(said: Sequence[Span], heard: Sequence[Recognition]) -> dict[str, float]:
    written = [guess_act(span.text) for span in said]
    found = [understand_speech(recognition).act for recognition in heard]
    names = [(act, [value for value in act.slots if _is_name(value)]) for act in written]
    right = sum(name in act.slots for act, (_, listed) in zip(found, names, strict=True) for name in listed)
    return {
        "slots_f1": rounded(_f1([act.slots for act in written], [act.slots for act in found])),
        "slots_f1_annotated": rounded(_f1([span.act.slots for span in said], [act.slots for act in found])),
        "names": rounded(right / max(sum(len(listed) for _, listed in names), 1)),
        "moves": rounded(_share(lambda k: found[k].move is said[k].act.move, len(said))),
        "moves_written": rounded(_share(lambda k: written[k].move is said[k].act.move, len(said))),
    }


def _is_name(value: SlotValue) -> bool:
    return value.slot in (Slot.LANDMARK, Slot.STREET) and value.label not in ("Unknown", "Queried")


def _f1(wanted: Sequence[frozenset[SlotValue]], found: Sequence[frozenset[SlotValue]]) -> float:
    hits = sum(sum((Counter(first) & Counter(second)).values()) for first, second in zip(wanted, found, strict=True))
    total = sum(map(len, wanted)) + sum(map(len, found))
    return 2.0 * hits / total if total else 1.0


def _share(fits: Callable[[int], bool], count: int) -> float:
    return sum(map(fits, range(count))) / count


def _heard(samples: Samples, ratio: float | None, number: int) -> Samples:
    """Returns a span with faint or pink noise over and around it; the ratio is that of root mean squares."""
    rng = np.random.default_rng([number, 5])
    margin = np.zeros(round(_MARGIN * SAMPLE_RATE), dtype=np.float32)
    padded = np.concatenate([margin, samples, margin])
    noise = pink_noise(len(padded), rng)
    loud = samples[np.square(samples) > 1e-5]
    level = 1e-4 if ratio is None else float(np.sqrt(np.mean(np.square(loud)))) * 10.0 ** (-ratio / 20.0)
    return np.asarray(padded + noise * np.float32(level), dtype=np.float32)
