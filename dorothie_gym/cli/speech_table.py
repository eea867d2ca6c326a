"""`dorothie-gym stats --speech`: tables of the statistics of speech."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Final

from rich.table import Table

from dorothie_gym.cli.output import Facts, print_json, session_progress, wide_stdout
from dorothie_gym.evaluation import analysis

if TYPE_CHECKING:
    from dorothie_gym.archive.corpus import Corpus


_SHARES: Final = (
    ("somebody speaks, share of the time", "speech_share"),
    ("both speak, share of the speech", "overlap_share"),
    ("utterances that begin while the other speaks", "overlapping_utterances"),
)
_QUANTILES: Final = ("0.1", "0.5", "0.9")
_ERRORS: Final = (("speaker", "by_speaker"), ("noise", "by_noise"), ("word", "by_word_class"))


def show_speech(corpus: Corpus, *, as_json: bool) -> None:
    """Prints the statistics of a corpus."""
    with session_progress(quiet=as_json) as on_session:
        figures: Facts = analysis.speech_stats_of(corpus, on_session).to_json()
    if as_json:
        print_json(figures)
        return
    console = wide_stdout()
    for table in (_amounts(figures), _distributions(figures), _errors(figures), _published(figures)):
        if table is not None:
            console.print(table)
            console.print()
    note = "" if figures["sessions_with_audio"] else " None has audio; durations are those of the utterances."
    console.print(f"{figures['sessions']} sessions.{note} docs/speech.md defines the figures.", style="dim")


def _table(*titles: str) -> Table:
    shown = Table(box=None, pad_edge=False)
    for number, title in enumerate(titles):
        shown.add_column(title, justify="right" if number else "left", no_wrap=True)
    return shown


def _amounts(figures: Facts) -> Table:
    shown = _table("speech", "here")
    shown.add_row("hours", f"{figures['audio_hours']:.2f}")
    shown.add_row("hours of the participants", f"{figures['participant_hours']:.2f}")
    for title, key in _SHARES:
        shown.add_row(title, _percent(figures[key]))
    lost = figures["lost_meanings"]
    shown.add_row(f"lost meanings that were repaired (of {lost['utterances']})", _percent(lost["share"]))
    return shown


def _distributions(figures: Facts) -> Table:
    shown = _table("", "mean", "10 %", "median", "90 %", "number")
    rates: Mapping[str, Any] = figures["words_per_minute"]
    rows = {
        "gaps between speakers [s]": figures["gaps"],
        "pauses of one speaker [s]": figures["pauses"],
        "words per minute, participant": rates["participant"],
        "words per minute, Co-Wizard": rates["co_wizard"],
    }
    for title, row in rows.items():
        digits = 0 if title.startswith("words") else 2
        values = [row["mean"], *(row["quantiles"][name] for name in _QUANTILES)]
        shown.add_row(
            title, *("-" if value is None else f"{value:.{digits}f}" for value in values), f"{row['count']:,}"
        )
    return shown


def _errors(figures: Facts) -> Table | None:
    found: Mapping[str, Any] | None = figures["recognition"]
    if found is None:
        return None
    shown = _table("word errors", "rate", "substituted", "left out", "added", "words")
    rows = {"all": found} | {f"{title} {name}": row for title, key in _ERRORS for name, row in found[key].items()}
    for title, row in rows.items():
        kinds = (row["substitutions"], row["deletions"], row["insertions"], row["words"])
        shown.add_row(title.replace("_", "-"), _percent(row["word_error_rate"]), *(f"{count:,}" for count in kinds))
    return shown


def _published(figures: Facts) -> Table:
    shown = Table(box=None, pad_edge=False)
    for title in ("published", "there", "here"):
        shown.add_column(title, justify="left" if title == "published" else "right", no_wrap=title != "published")
    shown.add_column("source")
    for row in figures["published"]:
        here = analysis.figure_at(figures, row["figure"])
        name = (
            row["figure"].removeprefix("recognition.").replace(".quantiles.0.5", ", median").replace(".mean", ", mean")
        )
        remark = f" ({row['remark']})" if row["remark"] else ""
        shown.add_row(
            f"{name.replace('_', ' ')}: {row['corpus']}{remark}",
            f"{row['value']:g}",
            f"{here:.3g}" if isinstance(here, int | float) else "-",
            row["source"],
        )
    return shown


def _percent(share: float | None) -> str:
    return "-" if share is None else f"{100.0 * share:.1f} %"
