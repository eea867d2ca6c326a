import hashlib
import inspect
import io
import json
import zipfile

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dorothie_gym.errors import TownArchiveError
from dorothie_gym.maps import Town, load_town, town_names
from dorothie_gym.maps import cache as archive_module
from dorothie_gym.maps.cache import PARTS, pack, unpack

from .opendrive_text import shared_map
from .same_town import town_bits, town_with_everything

PACKED = pack(town_with_everything(), "key")


def _sealed(body: bytes) -> bytes:
    """Bytes with the checksum that an archive ends with."""
    return body + hashlib.sha256(body).hexdigest().encode()


def _npz(**members: np.ndarray) -> bytes:
    """An `.npz` file with these members and a right checksum."""
    buffer = io.BytesIO()
    np.savez(buffer, **members)
    with zipfile.ZipFile(buffer, "a") as file:
        file.comment = bytes(64)
    return _sealed(buffer.getvalue()[:-64])


def _document(**changes: object) -> bytes:
    """The archive of the town with everything, with parts of its document changed, under a right checksum."""
    with np.load(io.BytesIO(PACKED)) as file:
        document, floats = json.loads(file["document"].tobytes()), file["floats"]
    text = json.dumps({**document, **changes}).encode()
    return _npz(document=np.frombuffer(text, np.uint8), floats=floats)


def test_an_archive_holds_all_parts_of_a_town() -> None:
    assert set(inspect.signature(Town).parameters) == {"name", "traffic", "cruise", "titled", *PARTS}


def test_a_town_with_all_parts_is_restored_bit_for_bit() -> None:
    assert town_bits(unpack(PACKED, "key")) == town_bits(town_with_everything())


def test_an_empty_town_is_restored() -> None:
    empty = Town(name="", lanes=[], links=[], junctions=[])
    assert town_bits(unpack(pack(empty, "key"), "key")) == town_bits(empty)


@pytest.mark.parametrize("cruise", ["40", True, "null"])
def test_a_cruise_speed_that_is_no_number_is_refused(cruise: object) -> None:
    with pytest.raises(TownArchiveError, match="cruise"):
        unpack(_document(cruise=cruise), "key")


@pytest.mark.parametrize("titled", [1, "yes", None])
def test_titles_that_are_no_truth_value_are_refused(titled: object) -> None:
    with pytest.raises(TownArchiveError, match="titles"):
        unpack(_document(titled=titled), "key")


@pytest.mark.parametrize("name", [*town_names(), "Town02", "Town05"])
def test_real_towns_are_restored_bit_for_bit(name: str) -> None:
    town = load_town(name if name in town_names() else shared_map(name))
    again = unpack(pack(town, "key"), "key")
    assert town_bits(again) == town_bits(town)
    assert [again.exits(lane.id) for lane in again.lanes] == [town.exits(lane.id) for lane in town.lanes]


def test_a_town_is_always_packed_alike() -> None:
    assert pack(town_with_everything(), "key") == PACKED
    assert pack(unpack(PACKED, "key"), "key") == PACKED


def test_an_archive_is_an_npz_file_without_pickles() -> None:
    with np.load(io.BytesIO(PACKED), allow_pickle=False) as file:
        assert {name: file[name].dtype.kind for name in file.files} == {"document": "u", "floats": "f"}


def test_any_changed_byte_is_noticed() -> None:
    for at in range(len(PACKED)):
        with pytest.raises(TownArchiveError, match="checksum"):
            unpack(PACKED[:at] + bytes([PACKED[at] ^ 0x10]) + PACKED[at + 1 :], "key")


def test_any_missing_or_added_end_is_noticed() -> None:
    for length in range(0, len(PACKED), 7):
        with pytest.raises(TownArchiveError):
            unpack(PACKED[:length], "key")
    with pytest.raises(TownArchiveError):
        unpack(PACKED + b"\0", "key")


@given(st.binary(max_size=300))
def test_damaged_bytes_raise_only_archive_errors(noise: bytes) -> None:
    for data in (noise, _sealed(noise)):
        with pytest.raises(TownArchiveError):
            unpack(data, "key")


def test_the_archive_of_another_town_is_refused() -> None:
    with pytest.raises(TownArchiveError, match="another"):
        unpack(PACKED, "another key")


def test_another_format_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(archive_module, "ARCHIVE_FORMAT", archive_module.ARCHIVE_FORMAT + 1)
    with pytest.raises(TownArchiveError, match="another format"):
        unpack(PACKED, "key")


def test_objects_that_would_have_to_be_unpickled_are_refused() -> None:
    with pytest.raises(TownArchiveError, match="allow_pickle"):
        unpack(_npz(document=np.array([{"format": 1}], dtype=object), floats=np.empty(0)), "key")


@pytest.mark.parametrize(
    "data",
    [
        _npz(anything=np.arange(3)),
        _npz(document=np.frombuffer(b"[1, 2]", np.uint8), floats=np.empty(0)),
        _npz(document=np.frombuffer(b"{}", np.uint8), floats=np.empty(0)),
        _npz(document=np.frombuffer(b"\xff\xfe", np.uint8), floats=np.empty(0)),
        _document(lanes=None),
        _document(links={"source": [0], "target": [], "type": []}),
        _document(links={"source": [0], "target": [1], "type": ["sideways"]}),
        _document(streets={"id": [0], "title": ["?"], "lanes": [[]]}),
        _document(crosswalks={"id": [], "outline": []}),
        _document(crosswalks={"id": [0], "outline": {"shapes": [[50, 2]]}}),
    ],
)
def test_content_without_a_town_is_refused_even_with_a_correct_checksum(data: bytes) -> None:
    with pytest.raises(TownArchiveError):
        unpack(data, "key")


def test_message_quotes_little_of_a_long_text() -> None:
    with pytest.raises(TownArchiveError) as caught:
        unpack(_document(links={"source": [0], "target": [1], "type": ["a" * 100_000]}), "key")
    assert len(str(caught.value)) < 1000


@pytest.mark.parametrize(
    ("number", "fault"), [(0.0, "two points of a line are in one place"), (1e8, "it is too large")]
)
def test_numbers_that_no_town_has_are_refused(number: float, fault: str) -> None:
    with np.load(io.BytesIO(pack(load_town("brookside"), "key"))) as file:
        document, floats = file["document"], file["floats"].copy()
    floats[:6] = [number, 0.0, 0.0, 0.0, 0.0, 1.0]  # the first two points of a lane
    with pytest.raises(TownArchiveError, match=fault):
        unpack(_npz(document=document, floats=floats), "key")


def test_a_town_with_something_unknown_in_it_is_not_packed() -> None:
    town = town_with_everything()
    town.name = {1, 2}  # type: ignore[assignment]  # a wrong type on purpose
    with pytest.raises(TypeError, match="cannot be archived with a set"):
        pack(town, "key")
