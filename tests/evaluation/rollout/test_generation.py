from __future__ import annotations

import json
import os
import signal
import time
from pathlib import Path

import pytest

from dorothie_gym.archive import Corpus
from dorothie_gym.errors import SessionError
from dorothie_gym.evaluation.rollout import generate_corpus
from dorothie_gym.session.config import EnvConfig
from tests.evaluation.rollout.killing import begin, contents, kill_again_and_again

SHORT = EnvConfig(max_seconds=8.0)


@pytest.fixture(scope="module")
def corpus(tmp_path_factory: pytest.TempPathFactory) -> Path:
    root = tmp_path_factory.mktemp("corpus") / "undisturbed"
    made = generate_corpus(root, sessions=6, seed=5, config=SHORT)
    assert made.played == 6
    return root


def test_corpus_is_whole_and_has_its_hashes(corpus: Path) -> None:
    found = Corpus.load(corpus)
    assert len(found) == 6 and found.verify() == ()
    assert all(session.complete and session.decisions is not None for session in found)
    assert all(len(session.scene.actors) and len(session.scene.weather) for session in found)
    assert sorted(path.name for path in corpus.iterdir() if path.is_file()) == ["generation.json", "manifest.json"]
    assert not list(corpus.glob(".*"))


def test_what_is_there_is_not_played_again(corpus: Path) -> None:
    before = contents(corpus)
    steps: list[tuple[int, int]] = []
    made = generate_corpus(
        corpus, sessions=6, seed=5, config=SHORT, on_session=lambda done, total: steps.append((done, total))
    )
    assert made.played == 0 and steps == [(k, 6) for k in range(7)]
    assert contents(corpus) == before


def test_missing_session_is_played_again_with_the_same_bytes(corpus: Path, tmp_path: Path) -> None:
    before = contents(corpus)
    victim = Corpus.load(corpus).entries[2].path
    victim.rename(tmp_path / "gone")
    (corpus / "manifest.json").unlink()
    (corpus / ".parts" / victim.name).mkdir(parents=True)
    (corpus / ".parts" / victim.name / "session.json").write_text("torn")
    assert generate_corpus(corpus, sessions=6, seed=5, config=SHORT).played == 1
    assert contents(corpus) == before


@pytest.mark.long
def test_corpus_with_word_errors_has_transcripts_and_says_so(tmp_path: Path) -> None:
    settings = EnvConfig(max_seconds=40.0, word_error_rate=0.4)
    process = begin(tmp_path / "one", sessions=2, seconds=40.0, workers=1, more={"word-errors": 0.4})
    _, errors = process.communicate()
    assert process.returncode == 0, errors
    made = generate_corpus(tmp_path / "two", sessions=2, seed=5, config=settings)
    assert made.played == 2 and contents(tmp_path / "one") == contents(tmp_path / "two")
    moves = [move for session in Corpus.load(tmp_path / "two") for move in session.moves()]
    assert all(move.recognised is not None for move in moves)
    assert any(move.recognised != move.text for move in moves)


@pytest.mark.parametrize("change", [{"seed": 6}, {"sessions": 7}, {"config": EnvConfig(max_seconds=9.0)}])
def test_corpus_of_other_settings_is_not_gone_on_with(corpus: Path, change: dict[str, object]) -> None:
    settings: dict[str, object] = {"sessions": 6, "seed": 5, "config": SHORT, **change}
    with pytest.raises(SessionError, match=f"has {next(iter(change))} .* choose another folder"):
        generate_corpus(corpus, **settings)  # type: ignore[arg-type]  # settings of several types


def test_folder_of_something_else_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").write_text("dear")
    with pytest.raises(SessionError, match=r"holds something else \(thesis.tex\)"):
        generate_corpus(tmp_path, sessions=1, seed=0)
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.tex"]


def test_two_at_once_are_kept_apart(tmp_path: Path) -> None:
    def meanwhile(done: int, total: int) -> None:
        with pytest.raises(SessionError, match="another process"):
            generate_corpus(tmp_path, sessions=1, seed=0, config=SHORT)

    generate_corpus(tmp_path, sessions=1, seed=0, config=SHORT, on_session=meanwhile)


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_run_killed_at_random_moments_gives_the_bytes_of_an_undisturbed_run(tmp_path: Path) -> None:
    kill_again_and_again(tmp_path, times=6, sessions=6, seconds=60.0, longest=3.0)


@pytest.mark.long
def test_two_workers_make_the_same_bytes_and_ctrl_c_prints_how_to_resume(corpus: Path, tmp_path: Path) -> None:
    out = tmp_path / "two"
    process = begin(out, sessions=6, seconds=8, workers=2)
    while process.poll() is None and not list(out.glob("[tv]*/**/session.json")):
        time.sleep(0.05)
    os.killpg(process.pid, signal.SIGINT)
    _, errors = process.communicate()
    if process.returncode:  # it may have been faster
        assert process.returncode == 130
        assert (
            errors.count("\n") == 1
            and f"resume with: dorothie-gym generate --sessions 6 --seed 5 --out {out}" in errors
        )
    made = generate_corpus(out, sessions=6, seed=5, config=SHORT)
    assert made.played < 6 and contents(out) == contents(corpus)
    assert (
        json.loads(made.manifest.read_text())["sessions"]
        == json.loads((corpus / "manifest.json").read_text())["sessions"]
    )
