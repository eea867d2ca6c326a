"""Links of annotators: a private file with the hashes of their secrets, so that links outlive the server."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Final

import msgspec
from msgspec import Meta, Struct

from dorothie_gym.errors import AnnotationError, one_line
from dorothie_gym.lab.annotation.log_file import check_place
from dorothie_gym.lab.annotation.workplace import Seat, SeatKind
from dorothie_gym.session.recording.files import ANNOTATIONS_FOLDER
from dorothie_gym.support.files import make_folder, write_atomically
from dorothie_gym.support.input_files import MAX_SMALL_JSON, raising, read_file
from dorothie_gym.support.schemas import decoder

LINKS_FILE: Final = "links.json"
LINKS_VERSION: Final = 1


class LinkRow(Struct, forbid_unknown_fields=True, frozen=True):
    """Link of a person: name, kind of the seat, and SHA-256 of the secret in hexadecimal digits."""

    name: Annotated[str, Meta(min_length=1, max_length=40)]
    kind: SeatKind
    sha256: Annotated[str, Meta(pattern="^[0-9a-f]{64}$")]


class LinksPage(Struct, forbid_unknown_fields=True, frozen=True):
    """Content of the file: version of its format, and the links."""

    links_version: int
    links: Annotated[list[LinkRow], Meta(max_length=1000)]


def links_path(root: Path) -> Path:
    """Returns the file with the links of a session or corpus."""
    return root / ANNOTATIONS_FOLDER / LINKS_FILE


def seats_of(root: Path, people: Sequence[tuple[str, SeatKind]], *, renew: bool = False) -> list[Seat]:
    """Returns the seats of people; links of an earlier server remain valid. Nothing is written.

    Args:
        root: folder of the session or corpus.
        people: name and kind of each seat.
        renew: whether all links are replaced.

    Returns:
        Seats without a token for links that were given before: only their hashes are known.

    Raises:
        AnnotationError: the file with the links is damaged, or it or its folder is a link.
        OSError: it cannot be read.
    """
    known = {} if renew else {(row.name, row.kind): row.sha256 for row in read_links(root)}
    seats = [(name, kind, known.get((name, kind))) for name, kind in people]
    return [Seat(name, kind) if digest is None else Seat(name, kind, "", digest) for name, kind, digest in seats]


def read_links(root: Path) -> list[LinkRow]:
    """Returns the links of a session or corpus; none if there are none. Errors as in `seats_of`."""
    path = links_path(root)
    check_place(path)
    if not path.exists():
        return []
    with raising(AnnotationError):
        content = read_file(path, MAX_SMALL_JSON)
    remedy = "run annotate with --new-links, which replaces it"
    try:
        page = decoder(LinksPage).decode(content)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
        raise AnnotationError(f"{path}: {one_line(error)}; {remedy}") from None
    if page.links_version != LINKS_VERSION:
        raise AnnotationError(f"{path}: has version {page.links_version}, and {LINKS_VERSION} is read; {remedy}")
    return page.links


def keep_links(root: Path, seats: Sequence[Seat], *, renew: bool = False) -> None:
    """Writes the hashes of the secrets of seats, readable by the owner only.

    Args:
        root: folder of the session or corpus.
        seats: the seats.
        renew: whether links of other people also stop working; otherwise they work again when these people are named.

    Raises:
        AnnotationError: as in `seats_of`.
        OSError: the file cannot be written.
    """
    before = [] if renew else read_links(root)
    rows = {(row.name, row.kind): row for row in before}
    rows |= {(seat.name, seat.kind): LinkRow(seat.name, seat.kind, seat.digest) for seat in seats}
    path, links = links_path(root), list(rows.values())
    check_place(path)
    if links == before:
        return
    make_folder(path.parent)
    write_atomically(path, msgspec.json.encode(LinksPage(LINKS_VERSION, links)) + b"\n", shared=True, mode=0o600)
