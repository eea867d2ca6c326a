"""`python -m benchmarks release`: figures of one file, and the pages that state them."""

from __future__ import annotations

import json
import re
import subprocess
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from benchmarks.commands import app
from benchmarks.release import figures, quotes, running
from benchmarks.release.figures import Figure, Measurement
from benchmarks.release.quotes import Quote, QuoteError, QuoteFile
from benchmarks.release.running import Build, measure, outdated
from benchmarks.release.steps import STEPS, Step, driver_figures, rollout_figures, spoilt_figures
from dorothie_gym import EnvConfig
from dorothie_gym.errors import InputFileError, ProcessError
from dorothie_gym.evaluation.closed_loop import RolloutSettings, roll_out
from dorothie_gym.evaluation.tiers import EARS, ROUGH, STANDARD
from dorothie_gym.ontology.roles import Role

BUILD = Build(commit="0123abcd", package="4567cdef", changes=())


@pytest.fixture
def page(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A page in a folder that stands for the checkout."""
    monkeypatch.setattr(quotes, "ROOT", tmp_path)
    file = tmp_path / "page.md"
    file.write_text("# Sixty 60\n\n1. A car drives [43 of\n48](a-4.md) errands, **65 % [49, 82]**, since 2022.\n")
    return file


QUOTES = QuoteFile(
    complete=("page.md",),
    quotes=(
        Quote(page="page.md", text="drives [{drive.done} of {drive.all}]"),
        Quote(page="page.md", text="errands, **{drive.share:percent}**"),
    ),
    stated={"page.md": ["since 2022"]},
)
FIGURES = {
    "drive.done": Figure(value=43.0),
    "drive.all": Figure(value=48.0),
    "drive.share": Figure(value=0.65, low=0.49, high=0.82),
}


def test_readme_and_docs_state_the_figures_of_the_file() -> None:
    assert list(QuoteFile.load().differences(figures.by_name(figures.load()))) == []


@pytest.mark.parametrize("page", QuoteFile.load().complete)
def test_every_number_of_a_page_is_measured_or_a_definition(page: str) -> None:
    assert QuoteFile.load().uncovered(page) == []


def test_every_figure_that_a_page_states_is_measured_by_a_step() -> None:
    named = {name for quote in QuoteFile.load().quotes for name in re.findall(r"\{([\w-]+)\.", quote.text)}
    assert named and named <= set(STEPS) and set(figures.load()) <= set(STEPS)


def test_readme_states_the_tiers_as_they_are_defined() -> None:
    text = (running.ROOT / "README.md").read_text(encoding="utf-8")
    for name, tier in (("standard", STANDARD), ("ears", EARS), ("rough", ROUGH)):
        assert f"| `{name}` | {100 * tier.config.word_error_rate:.0f} % word errors" in text


def test_pages_are_compared_across_line_breaks_and_renewed(page: Path) -> None:
    assert list(QUOTES.differences(FIGURES)) == []
    newer = FIGURES | {"drive.done": Figure(value=1234.0), "drive.share": Figure(value=0.7, low=0.6, high=0.8)}
    assert [line.split(" in: ")[0] for line in QUOTES.differences(newer)] == [
        "page.md: '43' must be '1234'",
        "page.md: '65 % [49, 82]' must be '70 % [60, 80]'",
    ]
    assert QUOTES.renew(newer) == ["page.md"] and list(QUOTES.differences(newer)) == []
    assert "[1234 of\n48](a-4.md) errands, **70 % [60, 80]**" in page.read_text()
    assert QUOTES.renew(newer) == []


def test_a_number_that_is_neither_measured_nor_a_definition_is_found(page: Path) -> None:
    assert QUOTES.uncovered("page.md") == []
    page.write_text(page.read_text() + "It takes 3.5 s.\n")
    assert [words.split()[-2:] for words in QUOTES.uncovered("page.md")] == [["3.5", "s."]]


def test_a_quote_that_is_not_on_its_page_and_an_unknown_figure_are_named(page: Path) -> None:
    with pytest.raises(QuoteError, match="page.md has 0 times: walks"):
        Quote(page="page.md", text="walks {drive.done} times").found(page.read_text())
    with pytest.raises(QuoteError, match="there is no figure drive.none"):
        Quote(page="page.md", text="drives [{drive.none} of").values(FIGURES)


@pytest.mark.parametrize(
    ("figure", "layout", "shown"),
    [
        (Figure(value=0.651, low=0.49, high=0.82), "percent", "65 % [49, 82]"),
        (Figure(value=0.651, low=0.49, high=0.82), "share", "65 %"),
        (Figure(value=187400.0), ",.0f", "187,400"),
        (Figure(value=16.0), "", "16"),
        (Figure(value=0.31), "", "0.31"),
    ],
)
def test_figures_are_shown_as_pages_state_them(figure: Figure, layout: str, shown: str) -> None:
    assert figure.shown(layout) == shown


def test_file_of_figures_is_read_as_written(tmp_path: Path) -> None:
    written = {"b": Measurement(commands=("x",), commit="c", build="d", date="2026-01-02", figures=FIGURES)}
    figures.save(written, tmp_path / "figures.json")
    assert figures.load(tmp_path / "figures.json") == written
    (tmp_path / "figures.json").write_text('{"format": 1, "measurements": {"b": {"commit": "c"}}}')
    with pytest.raises(InputFileError, match="commands"):
        figures.load(tmp_path / "figures.json")


def _first(folder: Path) -> dict[str, Figure]:
    return {"count": Figure(value=float(json.loads((folder / "0.json").read_text())["count"]))}


def test_an_interrupted_step_goes_on_after_its_last_command(tmp_path: Path) -> None:
    (tmp_path / "count.py").write_text("open('runs', 'a').write('x')\nprint('{\"count\": 3}')\n")
    (tmp_path / "fail.py").write_text("import pathlib, sys\nsys.exit(not pathlib.Path('ok').exists())\n")
    commands = f"python {tmp_path}/count.py --json", f"python {tmp_path}/fail.py"
    step = Step(name="two", commands=commands, read=_first, minutes=1.0)
    ran: list[str] = []
    with pytest.raises(ProcessError, match="exit code 1"):
        measure(step, BUILD, tmp_path, ran.append)
    folder = tmp_path / BUILD.package / "two"
    (folder / "ok").touch()
    found = measure(step, BUILD, tmp_path, ran.append)
    assert (folder / "runs").read_text() == "x" and len(ran) == 3
    assert found.figures == {"count": Figure(value=3.0)} and found.commit == BUILD.commit and found.machine
    assert outdated({"two": found}, ["two", "three"], BUILD) == ["three"]
    newer = Build(commit="1", package="2", changes=())
    assert outdated({"two": found}, ["two"], newer) == ["two"]


def test_changed_files_of_a_checkout_are_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(running, "ROOT", tmp_path)
    with pytest.raises(ProcessError, match="figures are measured in a checkout"):
        Build.of_checkout()
    (tmp_path / "dorothie_gym").mkdir()
    (tmp_path / "dorothie_gym" / "a.py").touch()
    who = ("-c", "user.name=a", "-c", "user.email=a@example.org")
    for words in (("init", "-q"), ("add", "."), (*who, "commit", "-qm", "x")):
        subprocess.run(["git", *words], cwd=tmp_path, check=True)
    first = Build.of_checkout()
    assert first.changes == () and len(first.package) == 12
    (tmp_path / "dorothie_gym" / "a.py").write_text("1\n")
    (tmp_path / "notes.md").touch()
    assert Build.of_checkout().changes == ("dorothie_gym/a.py",)


def test_figures_of_a_rollout_are_read(tmp_path: Path) -> None:
    cast: dict[Role, Any] = {Role.CO_WIZARD: "scripted", Role.PARTICIPANT: "scripted", Role.AD_WIZARD: "silent"}
    settings = RolloutSettings(cast=cast, towns=("brookside",), sessions=2, config=EnvConfig(max_seconds=8.0))
    result = roll_out(settings, tmp_path / "rollout")
    (tmp_path / "0.json").write_text(json.dumps(result.to_json()))
    found = rollout_figures(tmp_path)
    assert found["sessions"].value == 2.0 and found["successes"].value == 0.0 and found["red_lights"].value == 0.0
    assert found["success"].value == 0.0 and found["success"].high is not None and found["success"].high > 0.5


def test_figures_of_trained_drivers_are_read(tmp_path: Path) -> None:
    for seed, reached in ((0, 40.0), (1, 52.4), (2, 30.0)):
        (tmp_path / f"seed-{seed}").mkdir()
        rows = [
            {"success": 0.2, "seconds": 9.0},
            {"success": 0.97, "seconds": reached},
            {"success": 0.95, "seconds": 70.0},
        ]
        (tmp_path / f"seed-{seed}" / "progress.jsonl").write_text("\n".join(map(json.dumps, rows)) + "\n")
    found = driver_figures(tmp_path)
    assert found["seconds_to_90_percent"].value == 52.0 and found["least_success"].value == 0.95


def test_figures_of_spoilt_answers_are_read(tmp_path: Path) -> None:
    usual = {"sessions": 18, "reached": 46, "live": 57, "success": 0.7222, "pass_k": 0.3333}
    players = "scripted", "reader", "reader, 5% spoilt", "reader, 20% spoilt"
    (tmp_path / "0.json").write_text(json.dumps([{"player": player, **usual} for player in players]))
    found = spoilt_figures(tmp_path)
    assert found["rate_5_success"].shown("share") == "72 %" and found["rate_20_pass_k"].shown("share") == "33 %"
    assert found["rate_0_reached"].shown() == "46"


def test_steps_are_listed_and_an_unknown_one_is_named() -> None:
    listed = CliRunner().invoke(app, ["release", "--list"])
    assert listed.exit_code == 0 and all(name in listed.stdout for name in STEPS)
    wrong = CliRunner().invoke(app, ["release", "sped-world"])
    assert wrong.exit_code == 2 and "did you mean 'speed-world'" in wrong.stderr
