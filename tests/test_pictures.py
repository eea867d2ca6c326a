"""Committed pictures of the documentation show what the code draws today."""

from __future__ import annotations

import dataclasses
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from PIL import Image

DOCS = Path(__file__).parents[1] / "docs"
DRAWN = ("session", "midtown", "generated_towns", "windscreen", "camera", "dashboard")
"""Pictures that are drawn again: the versions of pygame and Pillow draw nearly the same pixels."""

DIFFERENT = 0.01
"""Largest share of clearly different pixels: another session differs in several per cent."""


@pytest.fixture(scope="module")
def pictures() -> Iterator[ModuleType]:
    sys.path.insert(0, str(DOCS))
    import pictures  # type: ignore[import-not-found]  # a script of docs

    yield pictures
    sys.path.remove(str(DOCS))


def pixels(path: Path) -> Any:
    with Image.open(path) as image:
        return np.asarray(image.convert("RGB"), dtype=np.int16)


def share_of_different_pixels(first: Path, second: Path) -> float:
    one, other = pixels(first), pixels(second)
    return 1.0 if one.shape != other.shape else float((np.abs(one - other).max(axis=2) > 60).mean())


@pytest.mark.long
@pytest.mark.parametrize("name", DRAWN)
def test_picture_is_up_to_date(name: str, pictures: ModuleType, tmp_path: Path) -> None:
    pictures.PICTURES[name](tmp_path / "now.png")
    share = share_of_different_pixels(DOCS / f"{name}.png", tmp_path / "now.png")
    assert share < DIFFERENT, f"docs/{name}.png is out of date: run python docs/pictures.py {name}"


def test_another_session_is_noticed(pictures: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pictures, "SESSION_SEED", pictures.SESSION_SEED + 1)
    pictures.draw_first_session(tmp_path / "other.png")
    assert share_of_different_pixels(DOCS / "session.png", tmp_path / "other.png") > 2 * DIFFERENT


def test_charts_show_the_recorded_figures(pictures: ModuleType) -> None:
    contents = {
        "bench_world": dataclasses.asdict(pictures.benchmark_report()),
        "leaderboard": [dataclasses.asdict(row) for row in pictures.leaderboard_rows()],
    }
    for name, content in contents.items():
        with Image.open(DOCS / f"{name}.png") as image:
            found = image.text.get(pictures.FINGERPRINT)  # type: ignore[attr-defined]  # of PNG files
        assert found == pictures.fingerprint(content), f"docs/{name}.png: run python docs/pictures.py {name}"


def test_every_picture_of_the_pages_is_drawn_by_a_command(pictures: ModuleType) -> None:
    from_runs = {"navigation_curve", "co_wizard_curve", "perception", "detections"}  # of trainings and benchmarks
    from_browser = {f"console_{seat}" for seat in ("participant", "co_wizard", "ad_wizard", "experimenter")}
    from_browser |= {
        "annotation_tool",
        "annotation_adjudication",
        "study_questionnaire",
        "study_experimenter",
        "console_film",
    }
    drawn = {path.stem for kind in ("png", "webp") for path in DOCS.glob(f"*.{kind}")}
    assert drawn == {*pictures.PICTURES, "corpus", *from_runs, *from_browser}


@pytest.mark.parametrize(("name", "size"), [("film", 2_000_000), ("console_film", 1_000_000)])
def test_films_are_small_and_move(name: str, size: int) -> None:
    path = DOCS / f"{name}.webp"
    assert path.stat().st_size < size
    with Image.open(path) as film:
        frames = int(getattr(film, "n_frames", 1))
        assert frames > 60 and film.width * 9 == film.height * 16
        first = np.asarray(film.convert("RGB"), dtype=np.int16)
        film.seek(frames - 1)
        assert (np.abs(first - np.asarray(film.convert("RGB"))).max(axis=2) > 60).mean() > 0.05


@pytest.mark.long
def test_film_shows_a_greeting_a_turn_an_exception_and_an_arrival(pictures: ModuleType) -> None:
    cut = sys.modules["film_cut"]
    session, _ = pictures.recorded_session(pictures.FILM_TOWN, pictures.FILM_SEED)
    parts, frames = cut.film_parts(session), cut.film_frames(session, pictures.FILM_RATE)
    assert set(parts) == {"greeting", "turn", "exception", "arrival"}
    assert len(frames) == 12 * pictures.FILM_RATE
    rows = {int(row["frame"]): row for row in session.trajectory}
    moving = {name: sum(rows[frame]["speed"] > 1.0 for frame in part) / len(part) for name, part in parts.items()}
    stops = [float(rows[frame]["speed"]) for frame in parts["arrival"]]
    assert moving["turn"] == 1.0 and stops[0] > 1.0 > stops[-1], "the car drives, and stops at the place"
    first, last = (rows[part] for part in (frames[0], frames[-1]))
    assert np.hypot(first["x"] - last["x"], first["y"] - last["y"]) > 100.0
    heard = {name: {u.text for u in session.utterances() if u.end * 30 <= part.stop} for name, part in parts.items()}
    assert len({len(said) for said in heard.values()}) == 4, "the talk goes on"
    turn = parts["turn"]
    headings = np.unwrap([rows[turn.start]["heading"], *(rows[frame]["heading"] for frame in turn)])
    assert np.degrees(np.ptp(headings)) > 45.0
    with Image.open(DOCS / "film.webp") as film:
        assert getattr(film, "n_frames", 1) == len(frames), "run python docs/pictures.py film"
