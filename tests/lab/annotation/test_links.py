"""Links of annotators: they outlive the server, only their hashes are kept, and they can be replaced."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

pytest.importorskip("uvicorn", reason="needs the extra console")

from dorothie_gym.errors import AnnotationError
from dorothie_gym.lab.annotation.links import keep_links, links_path, seats_of
from dorothie_gym.lab.annotation.workplace import SeatKind, digest_of
from tests.lab.annotation.builders import recorded
from tests.lab.annotation.serving import Served

ANNA, BEN, CAROL = ("anna", SeatKind.ANNOTATOR), ("ben", SeatKind.ANNOTATOR), ("carol", SeatKind.ADJUDICATOR)


def test_links_work_after_a_restart_until_they_are_replaced(tmp_path: Path) -> None:
    recorded(tmp_path / "c" / "one")
    first = seats_of(tmp_path / "c", [ANNA, CAROL])
    keep_links(tmp_path / "c", first)
    given = {seat.name: f"Bearer {seat.token}" for seat in first}
    again = seats_of(tmp_path / "c", [ANNA, BEN, CAROL])
    assert [bool(seat.token) for seat in again] == [False, True, False], "only Ben's secret is new"
    keep_links(tmp_path / "c", again)
    with Served(tmp_path / "c", seats={seat.name: seat for seat in again}) as running:
        for name, kind in (ANNA, CAROL):
            status, _, content = running.raw("/api/seat", name=None, Authorization=given[name])
            assert status == 200 and (json.loads(content)["name"], json.loads(content)["kind"]) == (name, kind)
        for token in ("", first[0].digest, again[0].digest):
            assert running.raw("/api/seat", name=None, Authorization=f"Bearer {token}")[0] == 401
    renewed = seats_of(tmp_path / "c", [ANNA], renew=True)
    keep_links(tmp_path / "c", renewed, renew=True)
    later = {seat.name: seat for seat in seats_of(tmp_path / "c", [ANNA, BEN, CAROL])}
    assert later["anna"].digest == renewed[0].digest != first[0].digest
    assert later["ben"].token and later["carol"].token, "links of those who are not named are gone, too"
    with Served(tmp_path / "c", seats=later) as running:
        assert running.raw("/api/seat", name=None, Authorization=given["anna"])[0] == 401
        assert running.raw("/api/seat", name=None, Authorization=f"Bearer {renewed[0].token}")[0] == 200


def test_a_link_keeps_its_kind_of_seat(tmp_path: Path) -> None:
    recorded(tmp_path / "one")
    keep_links(tmp_path / "one", first := seats_of(tmp_path / "one", [("carol", SeatKind.ADJUDICATOR)]))
    (seat,) = seats_of(tmp_path / "one", [("carol", SeatKind.ANNOTATOR)])
    assert seat.token and seat.digest != first[0].digest


def test_the_file_is_private_and_holds_hashes_only(tmp_path: Path) -> None:
    recorded(tmp_path / "one")
    seats = seats_of(tmp_path / "one", [ANNA, BEN])
    assert not links_path(tmp_path / "one").exists(), "nothing is written before links are given"
    keep_links(tmp_path / "one", seats)
    path = links_path(tmp_path / "one")
    assert path.stat().st_mode & 0o777 == 0o600
    content = path.read_text(encoding="utf-8")
    assert all(seat.token not in content and digest_of(seat.token) in content for seat in seats)
    path.chmod(0o640)
    keep_links(tmp_path / "one", [*seats, *seats_of(tmp_path / "one", [CAROL])])
    assert path.stat().st_mode & 0o777 == 0o600
    assert [each.name for each in path.parent.iterdir()] == ["links.json"]


@pytest.mark.parametrize(
    "content",
    [
        b"", b"{", b"[]", b"\xff", b"null", b'{"links_version":2,"links":[]}', b'{"links_version":1}',
        b'{"links_version":1,"links":[{"name":"anna","kind":"annotator","sha256":"12"}]}',
        b'{"links_version":1,"links":[{"name":"anna","kind":"cook","sha256":"' + b"0" * 64 + b'"}]}',
        b'{"links_version":1,"links":[],"more":1}', b"[" * 100_000, b" " * 2**21,
    ],
)  # fmt: skip
def test_a_damaged_file_is_named_and_replaced_on_request(content: bytes, tmp_path: Path) -> None:
    recorded(tmp_path / "one")
    links_path(tmp_path / "one").parent.mkdir()
    links_path(tmp_path / "one").write_bytes(content)
    with pytest.raises(AnnotationError, match=r"links\.json") as refused:
        seats_of(tmp_path / "one", [ANNA])
    assert "\n" not in str(refused.value)
    keep_links(tmp_path / "one", seats := seats_of(tmp_path / "one", [ANNA], renew=True), renew=True)
    assert seats_of(tmp_path / "one", [ANNA])[0].digest == seats[0].digest


@pytest.mark.parametrize("which", ["file", "folder"])
@pytest.mark.parametrize("renew", [False, True])
def test_links_are_not_written_elsewhere(which: str, renew: bool, tmp_path: Path) -> None:
    recorded(tmp_path / "one")
    outside = tmp_path / "outside"
    outside.mkdir()
    path = links_path(tmp_path / "one")
    if which == "file":
        path.parent.mkdir()
        path.symlink_to(outside / "links.json")
    else:
        path.parent.symlink_to(outside)
    with pytest.raises(AnnotationError, match="is a link"):
        keep_links(tmp_path / "one", seats_of(tmp_path / "one", [ANNA], renew=renew), renew=renew)
    assert not list(outside.iterdir())
