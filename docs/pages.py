"""Writes the pages that show what was played: `transcripts.md`, and the figures of `data-sheet.md`.

python docs/pages.py transcripts          # plays three sessions, some seconds each
python docs/pages.py figures CORPUS       # counts a corpus that `dorothie-gym generate` made
python docs/pages.py curves ppo=DIR,DIR maskable_ppo=DIR,DIR   # draws runs of `dorothie-gym train-rl`, a seed each
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

from dorothie_gym.analysis import (
    PAPER,
    Handled,
    Units,
    census_of,
    handling,
    inconsistencies,
    phenomena_of,
    verdicts_of,
)
from dorothie_gym.analysis.exception_attribution import kind_of
from dorothie_gym.analysis.transcript import markdown
from dorothie_gym.envs.duo_wizard_v0 import DuoWizardEnv
from dorothie_gym.ontology import AGENT_ROLES, Role
from dorothie_gym.policies import make_policy
from dorothie_gym.recording import Corpus, EventType, Session
from dorothie_gym.rendering.charts import SHEET, SOFT, empty_figure, hexadecimal
from dorothie_gym.rendering.palette import CAR, INK_SOFT, LIGHT_GREEN, NOTE, PROP
from dorothie_gym.rollout import play_session

DOCS = Path(__file__).parent
TRANSCRIPTS, DATA_SHEET, CURVES = DOCS / "transcripts.md", DOCS / "data-sheet.md", DOCS / "navigation_curve.png"
BEGIN, END = "<!-- figures: written by docs/pages.py -->", "<!-- end of the figures -->"

LONGEST = 420.0
"""A session that is shown is no longer than this [s]."""

TRIES = 200


@dataclass(frozen=True, kw_only=True)
class Wanted:
    """What one of the sessions on the page is to be.

    Attributes:
        title: of its section.
        town: name of its town.
        ad_wizard: policy of the Ad-Wizard.
        fits: whether a session is of that kind.
    """

    title: str
    town: str
    ad_wizard: str
    fits: Callable[[Session], bool]


def _handles(session: Session, kind: Handled, times: int) -> bool:
    """Whether at least so many exchanges handle an exception of a kind."""
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
    """Plays seeds from the first on until a session is of the kind that is wanted, ends well and is not too long."""
    env = DuoWizardEnv(wanted.town)
    for seed in range(first_seed, first_seed + TRIES):
        names = {role: wanted.ad_wizard if role is Role.AD_WIZARD else "scripted" for role in AGENT_ROLES}
        policies = {role: make_policy(name, role, env.limits) for role, name in names.items()}
        with tempfile.TemporaryDirectory() as folder:
            summary = play_session(env, policies, seed=seed, folder=Path(folder) / "session")
            session = Session.load(Path(folder) / "session")
        if summary["success"] and session.duration <= LONGEST and wanted.fits(session):
            return session, seed
    raise SystemExit(f"no session of {TRIES} is: {wanted.title}")


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
        "Played by the scripted three. This page is written by `python docs/pages.py transcripts"
        f" --first-seed {first_seed}`, which takes the first\nseed of each kind; nothing in it is edited. Acts stand in"
        " brackets behind their words; exchanges that handle an\nexception are marked; what is not said is slanted."
        " Phenomena have the numbers of [the statistics](statistics.md).\n"
    )
    return "\n".join([top, *sections])


# --- figures of the data sheet --------------------------------------------------------------------------------------


def figures(root: Path) -> str:
    """Returns the figures of a corpus as Markdown."""
    corpus = Corpus.load(root)
    facts = census_of(corpus).to_json()
    made = json.loads((root / "generation.json").read_text(encoding="utf-8"))
    consistent = sum(not inconsistencies(session) for session in corpus)
    command = f"dorothie-gym generate --sessions {made['sessions']} --seed {made['seed']} --out CORPUS"
    lines = [
        f"Of the corpus that `{command}` makes with version {made['package_version']}.",
        "",
        *_table(_counts(facts), "figure", "here", "paper"),
        "",
        *_table(_shares(facts), "share", "here", "paper (seen)"),
        "",
        f"Annotated consistently: {consistent} of {len(corpus)} sessions.",
        "",
        *_table(_behaviour(corpus), "behaviour that the paper reports", "difference", "95 % interval", "holds"),
        "",
        *_table(_phenomena(corpus), "no.", "phenomenon", "sessions with its cause", "it occurs in"),
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
    yield "share of the commonest utterance", _shown(diversity["commonest_utterance_share"]), ""
    yield "trigram perplexity, train on test", _shown(diversity["perplexity"]), ""


def _shares(facts: dict[str, Any]) -> Iterator[tuple[str, ...]]:
    for name, row in facts["anchors"].items():
        label = f" ({row['label']})" if row.get("label") else ""
        yield name.replace("_", " ") + label, _shown(row["share"]), _shown(row["paper"])


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


def curves(runs: dict[str, list[Path]]) -> str:
    """Draws success over steps, a thin line for each run and a thick one for their mean; returns it as a table."""
    colours = [hexadecimal(colour) for colour in (CAR, PROP, NOTE, INK_SOFT, LIGHT_GREEN)]
    rows, episodes = [], 0
    with empty_figure(7.0, 4.0) as figure:
        figure.set_layout_engine("constrained")
        axes = figure.add_subplot(facecolor=SHEET)
        for colour, (name, folders) in zip(itertools.cycle(colours), runs.items(), strict=False):
            told = [[json.loads(line) for line in (each / "progress.jsonl").open(encoding="utf-8")] for each in folders]
            shared = list(zip(*told, strict=False))  # as far as all of them got
            steps = [now[0]["steps"] / 1e3 for now in shared]
            for run in told:
                axes.plot([row["steps"] / 1e3 for row in run], [row["success"] for row in run], color=colour, lw=0.8)
            means = [sum(row["success"] for row in now) / len(now) for now in shared]
            seeds = "1 seed" if len(told) == 1 else f"{len(told)} seeds"
            axes.plot(steps, means, color=colour, lw=2.4, marker="o", ms=3, label=f"{name}, {seeds}")
            episodes = told[0][0]["episodes"]
            rows += [(name, f"{at:.0f}", *(f"{100 * row['success']:.0f} % ({row['seconds']:.0f} s)" for row in now))
                     for at, now in zip(steps, shared, strict=True)]  # fmt: skip
        axes.axhline(0.8, color=SOFT, lw=0.8, ls="--")
        axes.set(ylim=(-0.02, 1.02), xlabel="thousand steps", ylabel=f"success of {episodes} episodes")
        axes.legend(frameon=False, loc="lower right")
        figure.savefig(CURVES, format="png", dpi=150)
    seeds = (f"seed {k}" for k in range(max(map(len, runs.values()))))
    return "\n".join(_table(iter(rows), "", "thousand steps", *seeds))


def main(arguments: list[str]) -> None:
    """Writes a page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(dest="command", required=True)
    commands.add_parser("transcripts").add_argument("--first-seed", type=int, default=1)
    commands.add_parser("figures").add_argument("corpus", type=Path)
    commands.add_parser("curves").add_argument("runs", nargs="+", metavar="NAME=DIR,DIR,...")
    given = parser.parse_args(arguments)
    if given.command == "curves":
        named = dict(run.split("=", 1) for run in given.runs)
        print(curves({name: [Path(each) for each in folders.split(",")] for name, folders in named.items()}))
        return
    if given.command == "transcripts":
        TRANSCRIPTS.write_text(transcripts(given.first_seed), encoding="utf-8", newline="\n")
        return
    page = DATA_SHEET.read_text(encoding="utf-8")
    before, after = page.split(BEGIN)[0], page.split(END)[1]
    text = f"{before}{BEGIN}\n\n{figures(given.corpus)}\n\n{END}{after}"
    DATA_SHEET.write_text(text, encoding="utf-8", newline="\n")


if __name__ == "__main__":
    main(sys.argv[1:])
