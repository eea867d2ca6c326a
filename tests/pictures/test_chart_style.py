"""Charts: what they show, read from the figure before it is written."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from matplotlib.figure import Figure

from benchmarks.report import world_report
from benchmarks.report_chart import draw
from dorothie_gym.archive import Corpus
from dorothie_gym.evaluation.analysis import corpus_stats_of
from dorothie_gym.evaluation.analysis.profile_charts import draw_profiles
from dorothie_gym.evaluation.rollout import play_session
from dorothie_gym.ontology import AGENT_ROLES
from dorothie_gym.policies import make_policy
from dorothie_gym.session.session_engine import SessionEngine

ROOT = Path(__file__).parents[2]


@pytest.fixture
def drawn(monkeypatch: pytest.MonkeyPatch) -> list[Figure]:
    """Figures in the order in which they were written."""
    found: list[Figure] = []
    write = Figure.savefig

    def savefig(self: Figure, *arguments: Any, **keywords: Any) -> None:
        found.append(self)
        write(self, *arguments, **keywords)

    monkeypatch.setattr(Figure, "savefig", savefig)
    return found


def test_legend_of_the_statistics_covers_no_tick_and_no_title(drawn: list[Figure], tmp_path: Path) -> None:
    engine = SessionEngine("brookside", max_cycles=80)
    policies = {role: make_policy("scripted", role, engine.limits) for role in AGENT_ROLES}
    play_session(engine, policies, seed=7, folder=tmp_path / "corpus" / "one")
    census = corpus_stats_of(Corpus.load(tmp_path / "corpus"))
    draw_profiles(census.profiles, census.counts.heading, "one", tmp_path / "c.png")
    (figure,) = drawn
    for axes in figure.axes:
        legend = axes.get_legend()
        if legend is None:
            continue
        box = legend.get_window_extent()
        labels = [label for each in figure.axes for label in (*each.get_yticklabels(), *each.get_xticklabels())]
        titles = [each._left_title for each in figure.axes]  # type: ignore[attr-defined]  # has no accessor
        for text in (*labels, *titles):
            if text.get_text():
                assert not box.overlaps(text.get_window_extent()), text.get_text()


def test_speeds_on_a_logarithmic_axis_are_dots(drawn: list[Figure], tmp_path: Path) -> None:
    figures = json.loads((ROOT / "benchmarks" / "results" / "world.json").read_text(encoding="utf-8"))
    draw(world_report(figures), tmp_path / "b.png")
    (figure,) = drawn
    (axes,) = figure.axes
    assert axes.get_xscale() == "log" and not axes.patches, "the length of a bar would mean nothing"
    width = figure.get_window_extent().width
    assert all(text.get_window_extent().x1 < width for text in (*figure.texts, *axes.texts))


def test_learning_curves_of_one_run_say_so(drawn: list[Figure], tmp_path: Path) -> None:
    pytest.importorskip("sb3_contrib", reason="needs the extra 'baselines'")
    from dorothie_gym.baselines.learning_curves import draw_reward_curve

    rows = [{"steps": 10, "low": 0.1, "high": 0.9, "success": 0.5, "episodes": 4, "reward": 1.0, "seconds": 60.0}]
    draw_reward_curve(rows, "ppo", tmp_path / "curve.png")
    assert "one seed" in drawn[0].axes[0].get_title()
