"""`dorothie-gym annotate`: annotation of sessions in the browser."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated

import typer

from dorothie_gym.cli.annotations import CorpusOrSession, load_corpus
from dorothie_gym.cli.options import AsJson, Maps
from dorothie_gym.cli.output import fail, print_json, reporting_errors, stdout
from dorothie_gym.cli.serving import LOCAL, Host, Port, address, check_libraries, listen, serve
from dorothie_gym.cli.warm_up import compile_first
from dorothie_gym.lab import annotation as marking

PORT = 8024
"""Usual port of the annotation tool."""


def annotate(
    path: CorpusOrSession,
    annotator: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME", help="Name of an annotator; may be given several times, for a link each."),
    ] = None,
    adjudicator: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="Name of the person who sees all annotations and decides on the final one."),
    ] = None,
    pre_annotation: Annotated[
        bool, typer.Option(help="Begin with marks of the classifier, which the annotator accepts or corrects.")
    ] = True,
    new_links: Annotated[
        bool, typer.Option("--new-links", help="Give everybody a new link; links given before stop working.")
    ] = False,
    maps: Maps = None,
    host: Host = LOCAL,
    port: Port = PORT,
    as_json: AsJson = False,
) -> None:
    """Annotate sessions in the browser: prints a link for each annotator, who do not see each other's marks.

    Marks are written at once into the folder annotations of each session; the session itself is never changed.
    Links go on working when the server is started again; only hashes of their secrets are kept.
    """
    check_libraries("annotate")
    with reporting_errors():
        people = _people(annotator or ([] if adjudicator is not None else ["annotator"]), adjudicator)
        entries = load_corpus(path, maps).entries
        seats = marking.seats_of(path, people, renew=new_links)
        workplace = marking.Workplace(entries, seats, maps=maps, pre_annotate=pre_annotation)
        if len(entries) == 1:
            workplace.open(0)  # a session that cannot be annotated is refused here
    compile_first(pictures=True)
    listener = listen(host, port)
    server = address(host, listener.getsockname()[1])
    with reporting_errors():
        marking.keep_links(path, seats, renew=new_links)
    links = {seat.name: f"{server}/annotate#{seat.token}" if seat.token else None for seat in seats}
    if as_json:
        print_json({"address": f"{server}/annotate", "links": links, "sessions": len(entries)})
    else:
        for name, link in links.items():
            stdout().print(f"{name:<13} {link or f'has a link: {server}/annotate# and the secret'}", soft_wrap=True)
        if None in links.values():
            stdout().print("Links given before still work; --new-links replaces them.", soft_wrap=True)
        stdout().print("Marks are saved at once. Ctrl-C ends the server.", soft_wrap=True)
    serve(marking.AnnotationServer(workplace).app(), listener, host)


def _people(annotators: Sequence[str], adjudicator: str | None) -> list[tuple[str, marking.SeatKind]]:
    people = [(marking.check_name(name), marking.SeatKind.ANNOTATOR) for name in annotators]
    if adjudicator is not None:
        people.append((marking.check_name(adjudicator), marking.SeatKind.ADJUDICATOR))
    names = [name.lower() for name, _ in people]
    if len(set(names)) < len(names):
        fail("two people have the same name; give each a name of its own")
    return people
