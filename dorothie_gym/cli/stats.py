"""`dorothie-gym stats`: statistics of a corpus, beside those of the paper."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated

import typer
from rich.table import Table

from dorothie_gym import archive
from dorothie_gym.cli.options import OWN_NAME, AsJson, Maps
from dorothie_gym.cli.output import (
    Facts,
    check_picture,
    coefficient,
    fail,
    print_json,
    reporting_errors,
    session_progress,
    stdout,
)
from dorothie_gym.cli.speech_table import show_speech
from dorothie_gym.evaluation import analysis
from dorothie_gym.evaluation.analysis import truth_checks
from dorothie_gym.support.installation import pip_install

PICTURE = Path("statistics.png")
"""Default file of `--picture`."""

FAULTS_SHOWN = 5
"""Number of faults that are printed for a session; --json has all."""

_ROWS = (
    ("sessions", "sessions"),
    ("control stream (hours)", "control_hours"),
    ("participants' speech (hours)", "audio_hours"),
    ("utterances", "utterances"),
    ("words", "words"),
    ("vocabulary", "vocabulary"),
    ("transactions", "transactions"),
    ("exchanges", "exchanges"),
    ("dialogue moves", "moves"),
    ("slot values", "slot_values"),
    ("physical actions", "physical_actions"),
)
_ANCHORS = (
    ("commonest move of the participant (UfN)", "commonest_human_move"),
    ("commonest car move (RfN)", "commonest_car_move"),
    ("commonest navigation (NfD)", "commonest_navigation_action"),
    ("moves of the participant without slot", "human_moves_without_slot"),
    ("car moves without slot", "car_moves_without_slot"),
)
_NOT_PER_SESSION = ("sessions", "vocabulary")


def stats(
    folder: Annotated[
        Path | None, typer.Argument(metavar="DIR", help="A corpus, a folder of sessions, or one session.")
    ] = None,
    as_json: AsJson = False,
    picture: Annotated[
        Path | None,
        typer.Option(metavar="[FILE.png]", help=f"Draw moves and slots by speaker and exception; else {PICTURE}."),
    ] = None,
    phenomena: Annotated[
        bool, typer.Option("--phenomena", help="Number of sessions with each of the 24 dialogue phenomena.")
    ] = False,
    behaviour: Annotated[
        bool, typer.Option("--behaviour", help="Test the claims of the paper about the behaviour of speakers.")
    ] = False,
    talk: Annotated[
        bool, typer.Option("--talk", help="Truth, reasons, arrival times and answers of what is said.")
    ] = False,
    speech: Annotated[
        bool, typer.Option("--speech", help="Audio hours, overlap, gaps, speaking rates and word error rates.")
    ] = False,
    check: Annotated[
        bool, typer.Option("--check", help="Check the consistency of the annotation; exit code 1 if it has faults.")
    ] = False,
    kappa: Annotated[
        tuple[Path, Path] | None,
        typer.Option(metavar="A B", help="Cohen's kappa of two annotations of one session."),
    ] = None,
    maps: Maps = None,
) -> None:
    """Print statistics of a corpus: table 2 of the paper, majority baselines and diversity, from the events."""
    _check_choice(
        folder,
        kappa,
        picture=picture is not None,
        phenomena=phenomena,
        behaviour=behaviour,
        talk=talk,
        speech=speech,
        check=check,
    )
    if picture is not None:
        picture = PICTURE if picture == Path(OWN_NAME) else picture
        check_picture(picture)
    with reporting_errors():
        if kappa is not None:
            _kappa(*kappa, maps, as_json=as_json)
            return
        if folder is None:
            fail("give a corpus, a folder of sessions, or one session: dorothie-gym stats DIR")
        corpus = archive.Corpus.load(folder, maps=maps)
        if check:
            _check(corpus, as_json=as_json)
        elif phenomena:
            _phenomena(corpus, as_json=as_json)
        elif behaviour:
            _behaviour(corpus, as_json=as_json)
        elif talk:
            _talk(corpus, as_json=as_json)
        elif speech:
            show_speech(corpus, as_json=as_json)
        else:
            _count(corpus, picture, as_json=as_json)


def _check_choice(folder: Path | None, kappa: object, **chosen: bool) -> None:
    chosen = {"kappa": kappa is not None, **chosen}
    given = [f"--{name}" for name, is_given in chosen.items() if is_given]
    if len(given) > 1:
        fail(f"{' and '.join(given)} exclude each other; give one of them")
    if kappa is not None and folder is not None:
        fail(f"{folder}: --kappa compares the two sessions that follow it; omit the folder")


# --- table 2 --------------------------------------------------------------------------------------------------------


def _count(corpus: archive.Corpus, picture: Path | None, *, as_json: bool) -> None:
    census = analysis.corpus_stats_of(corpus)
    if picture is not None:
        analysis.draw_profiles(census.profiles, census.counts.heading, corpus.root.resolve().name, picture)
    table = census.to_json()
    if as_json:
        print_json(table)
        return
    console = stdout()
    console.print(_table2(table))
    console.print()
    console.print(_folds(table["folds"]))
    console.print()
    console.print(_anchors(table["anchors"]))
    console.print()
    console.print(_diversity(table["diversity"]))
    if census.incomplete:
        console.print(f"Incomplete, but counted: {', '.join(census.incomplete)}.", style="yellow", markup=False)
    if picture is not None:
        console.print(f"Picture: {picture}", style="dim", markup=False, soft_wrap=True)


def _table2(table: Facts) -> Table:
    """Returns the figures of the corpus beside the paper's; on narrow terminals the titles fold, not the figures."""
    shown = Table(box=None, pad_edge=False)
    shown.add_column("")
    for title in ("here", "paper", "per session here", "in the paper"):
        shown.add_column(title, justify="right", no_wrap=True)
    for title, key in _ROWS:
        mine, paper = table[key], analysis.PAPER[key]
        row = [title, _figure(mine), _figure(paper)]
        if key not in _NOT_PER_SESSION:
            row += [_per_session(mine, table["sessions"], key), _per_session(paper, analysis.PAPER["sessions"], key)]
        shown.add_row(*row)
    return shown


def _figure(value: float) -> str:
    return f"{value:,}" if isinstance(value, int) else f"{value:.2f}"


def _per_session(value: float, sessions: float, key: str) -> str:
    if not sessions:
        return ""
    each = value / sessions
    return f"{3600 * each:.0f} s" if key.endswith("_hours") else f"{each:.2f}"


def _folds(folds: Mapping[str, int]) -> Table:
    shown = Table(box=None, pad_edge=False)
    for title in ("fold", "sessions", "paper"):
        shown.add_column(title, justify="left" if title == "fold" else "right")
    for fold, paper in archive.PAPER_FOLDS.items():
        shown.add_row(fold.value, str(folds.get(fold.value, 0)), str(paper))
    return shown


def _anchors(anchors: Facts) -> Table:
    shown = Table(box=None, pad_edge=False)
    shown.add_column("majority baselines")
    for title in ("here", "allowed", "paper", "unseen"):
        shown.add_column(title, justify="right", no_wrap=True)
    shown.add_column("")
    for title, key in _ANCHORS:
        row = anchors[key]
        note = row.get("label") or ""
        if row["within"] is False:
            note += f"{', ' if note else ''}out of range"
        low, high = row["paper"] - analysis.ANCHOR_TOLERANCE, row["paper"] + analysis.ANCHOR_TOLERANCE
        allowed = f"{100 * low:.1f} to {100 * high:.1f} %"
        shown.add_row(
            title, _percent(row["share"]), allowed, _percent(row["paper"]), _percent(row["paper_unseen"]), note
        )
    return shown


def _diversity(diversity: Facts) -> Table:
    shown = Table(box=None, pad_edge=False)
    shown.add_column("diversity of the dialogue")
    shown.add_column("", justify="right")
    shown.add_column("")
    shown.add_row("distinct utterances", _percent(diversity["distinct_utterance_ratio"]), "")
    commonest = diversity["commonest_utterance"]
    note = "" if commonest is None else f'"{commonest}"'
    shown.add_row("commonest utterance", _percent(diversity["commonest_utterance_share"]), note)
    perplexity = diversity["perplexity"]
    lacking = "" if analysis.has_language_models() else f"needs nltk: {pip_install('statistics')}"
    note = lacking or ("needs utterances in train and test" if perplexity is None else "")
    shown.add_row("trigram perplexity, train on test", "-" if perplexity is None else f"{perplexity:.1f}", note)
    return shown


def _percent(share: float | None) -> str:
    return "-" if share is None else f"{100 * share:.1f} %"


# --- phenomena, consistency, agreement ------------------------------------------------------------------------------


def _phenomena(corpus: archive.Corpus, *, as_json: bool) -> None:
    rows = analysis.phenomena_of(corpus)
    if as_json:
        print_json({"sessions": len(corpus), "phenomena": rows})
        return
    shown = Table(box=None, pad_edge=False)
    for title in ("", "phenomenon", "cause in", "occurs in", "share", "forms"):
        shown.add_column(title, justify="left" if title in ("phenomenon", "forms") else "right")
    for row in rows:
        forms = ", ".join(f"{form} {count}" for form, count in row["forms"].items())
        style = "yellow" if row["share"] is not None and row["share"] < 0.05 else ""
        counts = (str(row["sessions"]), str(row["occurs"]), _percent(row["share"]))
        shown.add_row(str(row["number"]), row["title"], *counts, forms, style=style)
    stdout().print(shown)


def _behaviour(corpus: archive.Corpus, *, as_json: bool) -> None:
    verdicts = analysis.verdicts_of(corpus)
    if as_json:
        print_json({"sessions": len(corpus), "behaviour": [verdict.to_json() for verdict in verdicts]})
        return
    shown = Table(box=None, pad_edge=False)
    shown.add_column("what the paper reports")
    for title in ("difference", "95 % interval", ""):
        shown.add_column(title, justify="right" if title else "left", no_wrap=True)
    for verdict in verdicts:
        interval = "-" if verdict.low is None else f"{verdict.low:+.3f} to {verdict.high:+.3f}"
        difference = "-" if verdict.difference is None else f"{verdict.difference:+.3f}"
        verdict_text, style = ("holds", "") if verdict.holds else ("does not hold", "yellow")
        shown.add_row(verdict.claim.title, difference, interval, verdict_text, style=style)
    console = stdout()
    console.print(shown)
    console.print(
        f"{len(corpus)} sessions, drawn {analysis.RESAMPLES:,} times; docs/statistics.md defines the comparisons.",
        style="dim",
    )


def _talk(corpus: archive.Corpus, *, as_json: bool) -> None:
    with session_progress(quiet=as_json) as on_session:
        found = truth_checks.talk_checks_of(corpus, on_session)
    if as_json:
        print_json({"sessions": len(corpus), **found.to_json()})
        return
    shown = Table(box=None, pad_edge=False)
    shown.add_column("what is said")  # folds on narrow terminals, where figures are not cut
    for title in ("right", "of"):
        shown.add_column(title, justify="right", no_wrap=True)
    for title, right, cases in found.rows():
        shown.add_row(title, "-" if right is None else f"{100.0 * right:.1f} %", str(cases))
    console = stdout()
    console.print(shown)
    console.print(f"{len(corpus)} sessions; docs/statistics.md defines the figures.", style="dim")


def _check(corpus: archive.Corpus, *, as_json: bool) -> None:
    found = analysis.faults_of_corpus(corpus)
    faulty = {name: faults for name, faults in found.items() if faults}
    if as_json:
        print_json({"sessions": len(found), "consistent": len(found) - len(faulty), "faults": _listed(faulty)})
    else:
        _show_faults(faulty, len(found))
    if faulty:
        raise typer.Exit(1)


def _listed(faulty: Mapping[str, Sequence[str]]) -> dict[str, list[str]]:
    return {name: list(faults) for name, faults in faulty.items()}


def _show_faults(faulty: Mapping[str, Sequence[str]], sessions: int) -> None:
    console = stdout()
    for name, faults in faulty.items():
        console.print(f"{name}: {len(faults)} fault{'' if len(faults) == 1 else 's'}", style="bold", markup=False)
        for fault in faults[:FAULTS_SHOWN]:
            console.print(f"  {fault}", markup=False, soft_wrap=True)
        if len(faults) > FAULTS_SHOWN:
            console.print(f"  and {len(faults) - FAULTS_SHOWN} more (--json has all)", style="dim")
    console.print(f"{sessions - len(faulty)} of {sessions} sessions are annotated consistently.")


def _kappa(first: Path, second: Path, maps: Path | None, *, as_json: bool) -> None:
    found = analysis.agreement(archive.read_session(first, maps=maps), archive.read_session(second, maps=maps))
    if as_json:
        print_json({"moves": found.moves, "slots": found.slots, "pieces": found.pieces, "utterances": found.utterances})
        return
    shown = Table(box=None, pad_edge=False)
    for title in ("Cohen's kappa", "here", "paper"):
        shown.add_column(title, justify="left" if title.startswith("Cohen") else "right")
    shown.add_row("dialogue moves", coefficient(found.moves), "0.77")
    shown.add_row("dialogue slots", coefficient(found.slots), "0.85")
    console = stdout()
    console.print(shown)
    console.print(f"{found.utterances} utterances, {found.pieces} pieces that neither annotation splits", style="dim")
