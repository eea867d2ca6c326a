"""Generates pages, figures and pictures of the documentation.

python docs/pages.py environments         # `environments/*.md`, from the spaces and docstrings of the environments
python docs/pages.py frames               # their pictures
python docs/pages.py transcripts          # simulates sessions until three fit; a few seconds each
python docs/pages.py figures CORPUS       # statistics of a corpus made by `dorothie-gym generate`
python docs/pages.py understanding        # `understanding.md`, from the parser
python docs/pages.py modules              # `modules.md`, from the docstrings of all modules
python docs/pages.py models               # the shipped models in `models.md`, from their cards
python docs/pages.py curves ppo=DIR,DIR maskable_ppo=DIR,DIR   # one run of `dorothie-gym train-rl` per seed
"""

from __future__ import annotations

import argparse
import itertools
import json
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import environment_animations
import environment_pages
import module_page
import understanding_page

from dorothie_gym.archive import Corpus
from dorothie_gym.envs.duo_wizard_v0 import DuoWizardEnv
from dorothie_gym.evaluation.analysis import (
    PAPER,
    Handled,
    Units,
    corpus_stats_of,
    handling,
    inconsistencies,
    phenomena_of,
    verdicts_of,
)
from dorothie_gym.evaluation.analysis.exception_attribution import kind_of
from dorothie_gym.evaluation.analysis.transcript import markdown
from dorothie_gym.evaluation.rollout import play_session
from dorothie_gym.ontology import AGENT_ROLES, Role
from dorothie_gym.pictures.chart_style import SHEET, SOFT, empty_figure, hexadecimal
from dorothie_gym.pictures.palette import CAR, INK_SOFT, LIGHT_GREEN, NOTE, PROP
from dorothie_gym.policies import make_policy, pretrained_card, pretrained_names
from dorothie_gym.policies.pretrained import CardFigure, pretrained_size
from dorothie_gym.session.recording import EventType, Session

DOCS = Path(__file__).parent
TRANSCRIPTS, DATA_SHEET, CURVES = DOCS / "transcripts.md", DOCS / "data-sheet.md", DOCS / "navigation_curve.png"
MODELS = DOCS / "models.md"
BEGIN, END = "<!-- figures: written by docs/pages.py -->", "<!-- end of the figures -->"

LONGEST = 420.0
"""Longest session on the page of transcripts [s]."""

TRIES = 200
"""Seeds tried for each transcript."""


@dataclass(frozen=True, kw_only=True)
class Wanted:
    """Requirements for one of the transcripts.

    Attributes:
        title: title of its section.
        town: name of the town.
        ad_wizard: policy of the Ad-Wizard.
        fits: predicate that selects a session.
    """

    title: str
    town: str
    ad_wizard: str
    fits: Callable[[Session], bool]


def _handles(session: Session, kind: Handled, times: int) -> bool:
    """Returns whether at least `times` exchanges handle an exception of a kind."""
    return list(handling(Units(session)).values()).count(kind) >= times


def _has_task_change(session: Session) -> bool:
    kinds = [kind_of(event) for event in session.of_type(EventType.EXCEPTION)]
    return any(kind is not None and kind.is_task for kind in kinds)


WANTED = (
    Wanted(title="An easy drive", town="brookside", ad_wizard="silent", fits=lambda session: True),
    Wanted(
        title="A drive with environmental exceptions",
        town="midtown",
        ad_wizard="scripted",
        fits=lambda session: _handles(session, Handled.ENVIRONMENTAL, 3) and not _has_task_change(session),
    ),
    Wanted(
        title="A drive on which the errands change",
        town="millbrook",
        ad_wizard="scripted",
        fits=lambda session: _handles(session, Handled.TASK, 2),
    ),
)


def played(wanted: Wanted, first_seed: int) -> tuple[Session, int]:
    """Simulates seeds from `first_seed` on and returns the first session that fits, succeeds and is short enough."""
    env = DuoWizardEnv(wanted.town)
    for seed in range(first_seed, first_seed + TRIES):
        names = {role: wanted.ad_wizard if role is Role.AD_WIZARD else "scripted" for role in AGENT_ROLES}
        policies = {role: make_policy(name, role, env.limits) for role, name in names.items()}
        with tempfile.TemporaryDirectory() as folder:
            summary = play_session(env, policies, seed=seed, folder=Path(folder) / "session")
            session = Session.load(Path(folder) / "session")
        if summary["success"] and session.duration <= LONGEST and wanted.fits(session):
            return session, seed
    raise SystemExit(f"none of {TRIES} sessions fits: {wanted.title}")


def transcripts(first_seed: int) -> str:
    """Returns the page of transcripts."""
    sections = []
    for wanted in WANTED:
        session, seed = played(wanted, first_seed)
        ad_wizard = "" if wanted.ad_wizard == "scripted" else f" --ad-wizard {wanted.ad_wizard}"
        command = f"dorothie-gym run --town {wanted.town} --seed {seed}{ad_wizard} --out S && dorothie-gym show S"
        head, body = markdown(session, wanted.title).split("\n\n", 1)
        sections.append(f"{head}\n\n```console\n{command}\n```\n\n{body}")
    top = (
        "# Three annotated transcripts\n\n"
        "Three sessions with scripted policies for all roles. This page is generated by"
        f" `python docs/pages.py transcripts --first-seed {first_seed}`,\nwhich selects the first seed of each kind;"
        " the sessions are not edited. Acts are shown in brackets after their words. Exchanges\nthat handle an"
        " exception are marked. Actions and events without speech are in italics. The numbers of the phenomena are\n"
        "those of the [statistics](statistics.md).\n"
    )
    return "\n".join([top, *sections])


# --- figures of the data sheet --------------------------------------------------------------------------------------


def figures(root: Path) -> str:
    """Returns the figures of a corpus as Markdown."""
    corpus = Corpus.load(root)
    facts = corpus_stats_of(corpus).to_json()
    made = json.loads((root / "generation.json").read_text(encoding="utf-8"))
    consistent = sum(not inconsistencies(session) for session in corpus)
    command = f"dorothie-gym generate --sessions {made['sessions']} --seed {made['seed']} --out CORPUS"
    lines = [
        f"These figures describe the corpus generated by `{command}` with version {made['package_version']}.",
        "",
        *_table(_counts(facts), "figure", "here", "paper"),
        "",
        *_table(_shares(facts), "share", "here", "paper (seen)"),
        "",
        f"Sessions with a consistent annotation: {consistent} of {len(corpus)}.",
        "",
        *_table(_behaviour(corpus), "behaviour reported in the paper", "difference", "95 % interval", "holds"),
        "",
        *_table(_phenomena(corpus), "no.", "phenomenon", "sessions with its cause", "sessions with the phenomenon"),
    ]
    return "\n".join(lines)


def _table(rows: Iterator[tuple[str, ...]], *head: str) -> list[str]:
    return ["| " + " | ".join(row) + " |" for row in (head, tuple("---" for _ in head), *rows)]


def _counts(facts: dict[str, Any]) -> Iterator[tuple[str, ...]]:
    for key, paper in PAPER.items():
        value = facts[key]
        yield key, f"{value:,}" if isinstance(value, int) else f"{value:.2f}", f"{paper:,}"
    for fold, count in facts["folds"].items():
        yield f"sessions in {fold}", f"{count:,}", ""
    diversity = facts["diversity"]
    yield "distinct_utterance_ratio", _shown(facts["distinct_utterance_ratio"]), ""
    yield "share of the most frequent utterance", _shown(diversity["commonest_utterance_share"]), ""
    yield "trigram perplexity, train on test", _shown(diversity["perplexity"]), ""


def _shares(facts: dict[str, Any]) -> Iterator[tuple[str, ...]]:
    for name, row in facts["anchors"].items():
        label = f" ({row['label']})" if row.get("label") else ""
        speaker = name.replace("human", "participant")  # the paper's word; here the participant may be a script
        yield speaker.replace("_", " ") + label, _shown(row["share"]), _shown(row["paper"])


def _shown(value: float | None) -> str:
    return "-" if value is None else f"{value:.3g}"


def _behaviour(corpus: Corpus) -> Iterator[tuple[str, ...]]:
    for verdict in verdicts_of(corpus):
        interval = "-" if verdict.low is None else f"{verdict.low:+.3f} to {verdict.high:+.3f}"
        difference = "-" if verdict.difference is None else f"{verdict.difference:+.3f}"
        yield verdict.claim.title, difference, interval, "yes" if verdict.holds else "no"


def _phenomena(corpus: Corpus) -> Iterator[tuple[str, ...]]:
    for row in phenomena_of(corpus):
        share = "-" if row["share"] is None else f"{row['occurs']} ({100 * row['share']:.0f} %)"
        yield str(row["number"]), row["title"], str(row["sessions"]), share


# --- Shipped models ---------------------------------------------------------------------------------------------------


def models() -> str:
    """Returns the cards of the shipped models as Markdown."""
    cards = {name: pretrained_card(name) for name in pretrained_names()}
    rows = (
        (
            f"`{name}`",
            card.description,
            f"{pretrained_size(name) / 1e6:.2f} MB",
            _percent(card.figures["success"]),
            _percent(card.figures["driving_score"]),
            f"{card.steps:,}",
        )
        for name, card in cards.items()
    )
    commands = (command for card in cards.values() for command in (*card.commands, card.rollout))
    return "\n".join(
        [
            *_table(rows, "name", "model", "size", "success", "driving score", "training steps"),
            "",
            "The models were trained and measured by:",
            "",
            "```bash",
            *dict.fromkeys(commands),
            "```",
        ]
    )


def _percent(figure: CardFigure) -> str:
    return f"{100 * figure.mean:.0f} % [{100 * figure.low:.0f}, {100 * figure.high:.0f}]"


BEFORE: dict[str, list[tuple[float, float]]] = {
    "ppo": [(153, 0.13), (299, 0.37), (438, 0.64), (566, 0.94), (703, 0.97), (832, 0.98)],
    "maskable_ppo": [(143, 0.13), (271, 0.87), (395, 0.97), (534, 0.93)],
}
"""Seconds and mean success of the trainings of three seeds at 2f9abde, with single environments on two cores."""


def curves(runs: dict[str, list[Path]]) -> str:
    """Draws success over time, with a thin line per run and a thick line for their mean; returns a table."""
    colours = [hexadecimal(colour) for colour in (CAR, PROP, NOTE, INK_SOFT, LIGHT_GREEN)]
    rows, episodes = [], 0
    with empty_figure(7.0, 4.0) as figure:
        figure.set_layout_engine("constrained")
        axes = figure.add_subplot(facecolor=SHEET)
        for colour, (name, folders) in zip(itertools.cycle(colours), runs.items(), strict=False):
            logs = [[json.loads(line) for line in (each / "progress.jsonl").open(encoding="utf-8")] for each in folders]
            shared = list(zip(*logs, strict=False))  # truncated to the shortest run
            for run in logs:
                axes.plot([row["seconds"] for row in run], [row["success"] for row in run], color=colour, lw=0.8)
            means = [sum(row["success"] for row in now) / len(now) for now in shared]
            times = [sum(row["seconds"] for row in now) / len(now) for now in shared]
            seeds = "1 seed" if len(logs) == 1 else f"{len(logs)} seeds"
            axes.plot(times, means, color=colour, lw=2.4, marker="o", ms=3, label=f"{name}, {seeds}")
            if name in BEFORE:
                axes.plot(*zip(*BEFORE[name], strict=True), color=colour, lw=1.6, ls="--", label=f"{name}, before")
            episodes = logs[0][0]["episodes"]
            rows += [
                (
                    name,
                    f"{now[0]['steps'] / 1e3:.0f}",
                    *(f"{100 * row['success']:.0f} % ({row['seconds']:.0f} s)" for row in now),
                )
                for now in shared
            ]
        axes.axhline(0.8, color=SOFT, lw=0.8, ls="--")
        axes.set(ylim=(-0.02, 1.02), xscale="log", xlabel="training time [s]", ylabel=f"success of {episodes} episodes")
        axes.set_xticks([10, 20, 50, 100, 200, 500, 1000], labels=["10", "20", "50", "100", "200", "500", "1000"])
        axes.legend(frameon=False, loc=(0.42, 0.06))
        figure.savefig(CURVES, format="png", dpi=150)
    seeds = (f"seed {k}" for k in range(max(map(len, runs.values()))))
    return "\n".join(_table(iter(rows), "", "thousand steps", *seeds))


def main(arguments: list[str]) -> None:
    """Runs one of the commands."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(dest="command", required=True)
    commands.add_parser("environments")
    commands.add_parser("frames")
    commands.add_parser("transcripts").add_argument("--first-seed", type=int, default=1)
    commands.add_parser("figures").add_argument("corpus", type=Path)
    commands.add_parser("models")
    commands.add_parser("modules")
    commands.add_parser("understanding")
    commands.add_parser("curves").add_argument("runs", nargs="+", metavar="NAME=DIR,DIR,...")
    given = parser.parse_args(arguments)
    if given.command == "environments":
        for name, text in environment_pages.pages().items():
            (environment_pages.FOLDER / name).write_text(text, encoding="utf-8", newline="\n")
        return
    if given.command == "understanding":
        understanding_page.PAGE.write_text(understanding_page.understanding(), encoding="utf-8", newline="\n")
        return
    if given.command == "modules":
        module_page.PAGE.write_text(module_page.modules(), encoding="utf-8", newline="\n")
        return
    if given.command == "frames":
        environment_animations.draw_animations()
        return
    if given.command == "curves":
        named = dict(run.split("=", 1) for run in given.runs)
        print(curves({name: [Path(each) for each in folders.split(",")] for name, folders in named.items()}))
        return
    if given.command == "transcripts":
        TRANSCRIPTS.write_text(transcripts(given.first_seed), encoding="utf-8", newline="\n")
        return
    page, text = (MODELS, models()) if given.command == "models" else (DATA_SHEET, figures(given.corpus))
    written = page.read_text(encoding="utf-8")
    before, after = written.split(BEGIN)[0], written.split(END)[1]
    page.write_text(f"{before}{BEGIN}\n\n{text}\n\n{END}{after}", encoding="utf-8", newline="\n")


if __name__ == "__main__":
    main(sys.argv[1:])
