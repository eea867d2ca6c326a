"""`dorothie-gym convert`: conversion of sessions between layouts."""

from __future__ import annotations

import enum
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from dorothie_gym import archive
from dorothie_gym.archive import sdn
from dorothie_gym.cli.options import AsJson, Maps
from dorothie_gym.cli.output import Facts, fail, print_json, reporting_errors, stderr, stdout
from dorothie_gym.errors import SessionError, TownError
from dorothie_gym.evaluation import rollout as rollouts
from dorothie_gym.ontology.roles import Role
from dorothie_gym.session import recording

if TYPE_CHECKING:
    from collections.abc import Callable


class TargetLayout(enum.StrEnum):
    """Layout to write."""

    SDN = "sdn"
    NATIVE = "native"
    TABLES = "tables"
    MINARI = "minari"
    HUGGING_FACE = "hf"


class Storage(enum.StrEnum):
    """Format of the files of a dataset for Minari."""

    HDF5 = "hdf5"
    ARROW = "arrow"


class ExportedRole(enum.StrEnum):
    """Role whose view is exported."""

    PARTICIPANT = "participant"
    CO_WIZARD = "co_wizard"
    AD_WIZARD = "ad_wizard"


def convert(
    source: Annotated[Path, typer.Argument(metavar="IN", help="A session, or a folder of sessions or of folds.")],
    out: Annotated[Path, typer.Argument(metavar="OUT", help="Folder to write, without sessions of these names.")],
    to: Annotated[
        TargetLayout, typer.Option("--to", help="Layout: SDN release, native, two Parquet tables, or a role's view.")
    ],
    role: Annotated[
        ExportedRole, typer.Option(help="Role whose observations, actions and rewards --to minari and hf write.")
    ] = ExportedRole.CO_WIZARD,
    storage: Annotated[
        Storage, typer.Option(help="Files that --to minari writes; TorchRL reads HDF5 only.")
    ] = Storage.HDF5,
    field: Annotated[
        list[str] | None,
        typer.Option(help="Field of the action that --to minari keeps, more than once; all data are then vectors."),
    ] = None,
    maps: Maps = None,
    as_json: AsJson = False,
) -> None:
    """Convert sessions between SDN (release, sample or hub layout) and the native layout, with a report of losses.

    With --to tables it writes utterances.parquet and decision_points.parquet, for pandas and datasets. With --to minari
    or hf, sessions of this package are simulated again and written as one role lived through them, with a card.

    The files of IN determine its layout. Unreadable sessions are listed, and the exit code is then 2.
    """
    if to is not TargetLayout.MINARI and (field or storage is not Storage.HDF5):
        fail("--storage and --field belong to --to minari")
    if maps is not None and not maps.is_dir():
        fail(f"{maps}: there is no such folder; give one with maps (.xodr)")
    with reporting_errors():
        corpus = archive.Corpus.load(source, maps=maps)
        _check_out(source, out)
        if to is TargetLayout.TABLES:
            _write_tables(corpus, out, as_json=as_json)
            return
        if to in (TargetLayout.MINARI, TargetLayout.HUGGING_FACE):
            _write_role(corpus, out, to, role, maps, storage, field or [], as_json=as_json)
            return
        is_one = [entry.path for entry in corpus.entries] == [source]
        rows = _convert(corpus, out, to, maps, is_one=is_one, quiet=as_json)
    failed = {row["path"]: row["error"] for row in rows if "error" in row}
    if is_one and failed:
        fail(*failed.values())
    if as_json:
        print_json({"to": to.value, "in": str(source), "out": str(out), "sessions": rows})
    else:
        _show(rows, out)
    if failed:
        first = next(iter(failed.values()))
        fail(f"{len(failed)} of {len(rows)} sessions could not be converted; the first: {first}")


def _check_out(source: Path, out: Path) -> None:
    inside, whole = out.resolve(), source.resolve()
    if inside == whole or whole in inside.parents:
        fail(f"{out}: lies within {source}; choose a folder outside of it")
    if out.exists() and not out.is_dir():
        fail(f"{out}: is a file; choose a folder")


def _write_tables(corpus: archive.Corpus, out: Path, *, as_json: bool) -> None:
    """Writes the tables of all sessions; an unreadable session fails the command."""
    paths = [str(path) for path in corpus.export(out)]
    if as_json:
        print_json({"to": TargetLayout.TABLES.value, "in": str(corpus.root), "out": str(out), "tables": paths})
    else:
        stdout().print(f"{len(corpus)} sessions: {', '.join(paths)}", markup=False, soft_wrap=True)


def _write_role(
    corpus: archive.Corpus, out: Path, to: TargetLayout, role: ExportedRole, maps: Path | None, storage: Storage,
    fields: list[str], *, as_json: bool,
) -> None:  # fmt: skip
    """Writes the view of a role on all sessions; a session that cannot be simulated again fails the command."""
    from dorothie_gym.evaluation.rollout.role_episodes import role_episodes

    whose = Role(role.value)
    with _progress(len(corpus), quiet=as_json) as advance:
        episodes = role_episodes(corpus.entries, whose, rollouts.ReplaySources(maps=maps))
        if to is TargetLayout.MINARI:
            name = rollouts.export_minari(episodes, whose, out, advance, storage=storage.value, fields=fields)
        else:
            name = str(rollouts.export_hugging_face(episodes, whose, out, advance))
    facts = {"to": to.value, "in": str(corpus.root), "out": str(out), "role": role.value, "dataset": name}
    if as_json:
        print_json({**facts, "sessions": len(corpus)})
    else:
        text = f"{len(corpus)} sessions of the {role.value}: dataset {name} in {out}"
        stdout().print(text, markup=False, soft_wrap=True)


def _convert(
    corpus: archive.Corpus, out: Path, to: TargetLayout, maps: Path | None, *, is_one: bool, quiet: bool
) -> list[Facts]:
    rows = []
    taken: set[Path] = set()
    with _progress(len(corpus), quiet=quiet) as advance:
        for number, entry in enumerate(corpus.entries):
            rows.append(_convert_one(corpus, entry, number, out, to, maps, taken, is_one=is_one))
            advance()
    return rows


def _convert_one(
    corpus: archive.Corpus,
    entry: archive.CorpusEntry,
    number: int,
    out: Path,
    to: TargetLayout,
    maps: Path | None,
    taken: set[Path],
    *,
    is_one: bool,
) -> Facts:
    """Converts a session; returns its row for --json."""
    path = entry.path.relative_to(corpus.root)
    row: Facts = {"path": str(path)}
    try:
        session = entry.load()
        target = out if is_one else out / path.with_name(_name(session, number, to, out / path.parent, taken))
        taken.add(target)
        written = sdn.write_sdn(session, target, maps=maps) if to is TargetLayout.SDN else session.save(target)
    except (SessionError, TownError) as error:
        return {**row, "error": str(error)}
    return {
        **row,
        "out": str(written),
        "complete": session.complete,
        "events": len(session.events),
        "frames": len(session.trajectory),
        "report": session.report.to_json(),
        "faults": list(session.check()),
    }


def _name(session: recording.Session, number: int, to: TargetLayout, folder: Path, taken: set[Path]) -> str:
    """Returns the name of the folder of a session: the original scripts look for `log_<number>`."""
    if to is TargetLayout.NATIVE or session.name.startswith("log_"):
        return session.name
    seed = session.header.seed
    name = f"log_{number if seed is None else seed}"
    return name if folder / name not in taken else f"log_{number:06d}{seed}"


@contextmanager
def _progress(total: int, *, quiet: bool) -> Iterator[Callable[[], None]]:
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn

    console = stderr()
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn())
    hidden = quiet or not console.is_terminal or total == 1
    with Progress(*columns, console=console, disable=hidden, transient=True) as progress:
        bar = progress.add_task("Converting", total=total)
        yield lambda: progress.advance(bar)


def _show(rows: list[Facts], out: Path) -> None:
    console = stdout()
    for row in rows:
        if "error" in row:
            console.print(f"{row['path']}: not converted: {row['error']}", style="yellow", markup=False, soft_wrap=True)
            continue
        console.print(_line(row), markup=False, soft_wrap=True)
        for line in (*recording.report_lines(row["report"]), *(f"fault: {fault}" for fault in row["faults"])):
            console.print(f"  {line}", style="dim", markup=False, soft_wrap=True)
    done = sum("error" not in row for row in rows)
    console.print(f"{done} of {len(rows)} sessions written to {out}.", markup=False, soft_wrap=True)


def _line(row: Facts) -> str:
    ending = "" if row["complete"] else ", not recorded to its end"
    layout = row["report"]["layout"]
    return f"{row['path']}: {layout}, {row['events']} events, {row['frames']} frames{ending} -> {row['out']}"
