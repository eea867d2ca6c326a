"""`dorothie-gym annotations` and `agreement`: formats of annotations, and agreement of annotators."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table

from dorothie_gym import archive
from dorothie_gym.cli.options import AsJson, Maps
from dorothie_gym.cli.output import coefficient, fail, print_json, reporting_errors, stdout
from dorothie_gym.evaluation import analysis
from dorothie_gym.lab import annotation as marking
from dorothie_gym.support.installation import pip_install

if TYPE_CHECKING:
    from dorothie_gym.lab.annotation.corpus_agreement import CorpusAgreement


_FORMATS = ("native", "sdn", "jsonl", "elan")

CorpusOrSession = Annotated[
    Path, typer.Argument(metavar="CORPUS_OR_SESSION", help="A session of any layout, or a folder of sessions.")
]


def load_corpus(path: Path, maps: Path | None) -> archive.Corpus:
    """Returns the sessions of a command; fails if there are none, or no such folder of maps."""
    if maps is not None and not maps.is_dir():
        fail(f"{maps}: there is no such folder; give one with maps (.xodr)")
    return archive.Corpus.load(path, maps=maps)


annotations_app = typer.Typer(
    help="Export and import annotations: native, SDN, JSONL, ELAN.", no_args_is_help=True, rich_markup_mode="rich"
)


@annotations_app.command("export")
def export_annotations(
    path: CorpusOrSession,
    out: Annotated[Path, typer.Argument(metavar="OUT", help="New folder; files and sessions keep their folds.")],
    to: Annotated[str, typer.Option("--to", metavar="|".join(_FORMATS), help="Format to write.")] = "native",
    annotator: Annotated[
        str, typer.Option(metavar="NAME", help="Whose annotation; adjudicated is the final version.")
    ] = "adjudicated",
    maps: Maps = None,
    as_json: AsJson = False,
) -> None:
    """Write the annotations of one annotator; in native and SDN layout, a copy of the corpus with these labels.

    Sessions that NAME has not annotated are left out.
    """
    if to not in _FORMATS:
        fail(f"--to is {to!r}; it must be {' or '.join(_FORMATS)}")
    with reporting_errors():
        corpus = load_corpus(path, maps)
        if out.exists() and (not out.is_dir() or any(out.iterdir())):
            fail(f"{out}: exists already; choose another name, or remove it first")
        if corpus.root.resolve() in (out.resolve(), *out.resolve().parents):
            fail(f"{out}: lies within {path}; choose a folder outside of it")
        chosen = [entry for entry in corpus.entries if marking.log_path(entry.path, annotator).is_file()]
        if not chosen:
            fail(f"{path}: {annotator!r} has annotated no session; {_known(corpus)}")
        written = [_export(corpus, entry, annotator, out, marking.Format(to), maps) for entry in chosen]
    if as_json:
        print_json({"annotator": annotator, "to": to, "sessions": len(corpus), "written": written})
    else:
        stdout().print(f"{len(written)} of {len(corpus)} sessions written to {out}.", soft_wrap=True)


def _known(corpus: archive.Corpus) -> str:
    names = sorted({name for entry in corpus.entries for name in marking.annotators_of(entry.path)})
    return f"annotators are {', '.join(names)}" if names else "nobody has; run dorothie-gym annotate"


def _export(
    corpus: archive.Corpus, entry: archive.CorpusEntry, annotator: str, out: Path, to: marking.Format, maps: Path | None
) -> str:
    session = entry.load()
    annotation = marking.read_annotation(marking.SourceText.of(session), entry.path, annotator)
    inner = entry.path.relative_to(corpus.root)
    target = out / (inner if inner.parts else Path(session.name))
    target = target.with_name(target.name + to.suffix)
    target.parent.mkdir(parents=True, exist_ok=True)
    return str(marking.export_annotation(session, annotation, annotator, target, to, maps=maps))


@annotations_app.command("import")
def import_annotations(
    path: CorpusOrSession,
    source: Annotated[
        Path,
        typer.Argument(
            metavar="FILE_OR_FOLDER",
            help="For a session: a .jsonl or .eaf file, or a relabelled session. For a corpus: a folder of them.",
        ),
    ],
    annotator: Annotated[str, typer.Option(metavar="NAME", help="Name under which the annotation is stored.")],
    maps: Maps = None,
    as_json: AsJson = False,
) -> None:
    """Store annotations of other programs, or labels of other copies of sessions, as those of an annotator."""
    with reporting_errors():
        name = annotator if annotator == marking.ADJUDICATED else marking.check_name(annotator)
        corpus = load_corpus(path, maps)
        found = _sources(corpus, path, source)
        if not found:
            fail(f"{source}: holds no annotation of a session of {path}")
        read = []
        for entry, file in found:
            if marking.log_path(entry.path, name).exists():
                fail(f"{marking.log_path(entry.path, name)}: exists already; choose another name, or remove it first")
            session = entry.load()
            read.append(
                (entry, marking.SourceText.of(session), marking.import_annotation(session, file, maps=maps), file)
            )
        for entry, text, annotation, file in read:  # only if all of them could be read
            log = marking.AnnotationLog(text, entry.path, name)
            log.mark(annotation.difference(marking.Annotation.empty(text)), f"import {file.name}"[:80])
    if as_json:
        print_json({"annotator": name, "sessions": [entry.name for entry, _, _, _ in read]})
    else:
        stdout().print(f"Annotations of {len(read)} sessions stored as those of {name}.", soft_wrap=True)


def _sources(corpus: archive.Corpus, path: Path, source: Path) -> list[tuple[archive.CorpusEntry, Path]]:
    """Returns the file or folder with the annotation of each session that has one."""
    if [entry.path for entry in corpus.entries] == [path]:
        return [(corpus.entries[0], source)]
    found = []
    for entry in corpus.entries:
        inner = entry.path.relative_to(corpus.root)
        places = [source / inner, *(source / f"{inner}{suffix}" for suffix in (".jsonl", ".eaf"))]
        found += [(entry, place) for place in places if place.exists()][:1]
    return found


# --- Agreement --------------------------------------------------------------------------------------------------------


def agreement(
    path: CorpusOrSession,
    annotator: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME",
            help="Compare these annotators only; adjudicated: the final version, recorded: the labels of the sessions.",
        ),
    ] = None,
    maps: Maps = None,
    as_json: AsJson = False,
) -> None:
    """Print the agreement of annotators: spans; Cohen's kappa of moves, slots, and borders of units; alpha."""
    with reporting_errors():
        from dorothie_gym.lab.annotation.corpus_agreement import corpus_agreement

        found = corpus_agreement(load_corpus(path, maps).entries, annotator or (), with_alpha=analysis.has_alpha())
    if as_json:
        print_json(found.to_json())
    else:
        _show(found)


def _table(*titles: str) -> Table:
    """Returns a table of pairs of annotators; on narrow terminals, names and titles fold."""
    table = Table(box=None, pad_edge=False)
    table.add_column("annotators")
    for title in titles:
        table.add_column(title, justify="right")
    return table


def _show(found: CorpusAgreement) -> None:
    labels = _table("sessions", "utterances", "spans (F1)", "moves (kappa)", "by piece", "slots (kappa)")
    units = _table("exchanges (kappa)", "transactions (kappa)")
    for (first, second), (sessions, pair) in found.pairs.items():
        figures = (pair.labels.spans, pair.labels.moves_of_equal_spans, pair.labels.moves, pair.labels.slots)
        name = f"{first}, {second}"
        labels.add_row(name, str(sessions), str(pair.labels.utterances), *map(coefficient, figures))
        units.add_row(name, coefficient(pair.exchanges.kappa), coefficient(pair.transactions.kappa))
    labels.add_row("the paper", "20", "1045", "", "0.77", "", "0.85")
    console = stdout()
    for table in (labels, units):
        console.print(table)
        console.print()
    if found.alpha is None:
        console.print(f"Krippendorff's alpha needs krippendorff: {pip_install('agreement')}", style="yellow")
    else:
        console.print(
            f"Krippendorff's alpha of {len(found.annotators)} annotators: moves {coefficient(found.alpha.moves)}, "
            f"slots {coefficient(found.alpha.slots)} ({found.alpha.pieces} pieces), "
            f"exchanges {coefficient(found.exchange_alpha)}, transactions {coefficient(found.transaction_alpha)}.",
            soft_wrap=True,
        )
