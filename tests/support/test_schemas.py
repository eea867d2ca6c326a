import subprocess
import sys
from dataclasses import dataclass

import msgspec
import pytest

from dorothie_gym.support.schemas import convert, decoder

MEETING = """
import sys
import threading
from dataclasses import make_dataclass

from dorothie_gym.support.schemas import convert, decoder

sys.setswitchinterval(1e-6)
fields = [(f"size_{number}", float, 0.0) for number in range(8)]
for number in range(400):
    part = make_dataclass(f"Part{number}", fields)
    whole = make_dataclass(f"Whole{number}", [("part", part | None, None), *fields])
    start, found = threading.Barrier(3), []

    def read(read_value):
        start.wait()
        found.append(read_value())

    readers = [
        threading.Thread(target=read, args=(value,))
        for value in (
            lambda: convert({"part": {"size_1": 2.0}, "size_3": 4.0}, whole),
            lambda: decoder(whole).decode('{"part": {"size_1": 2}, "size_3": 4}'),
            lambda: whole(part=convert({"size_1": 2.0}, part), size_3=4.0),
        )
    ]
    for reader in readers:
        reader.start()
    for reader in readers:
        reader.join()
    assert found == [whole(part=part(size_1=2.0), size_3=4.0)] * 3, found
"""


@dataclass(frozen=True)
class Size:
    metres: float = 1.0


def test_threads_that_meet_a_type_at_the_same_moment_get_equal_values():
    done = subprocess.run([sys.executable, "-c", MEETING], capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr[-2000:]


def test_a_decoder_is_made_once_and_checks_its_type():
    assert decoder(Size) is decoder(Size)
    assert decoder(Size).decode('{"metres": 2}') == convert({"metres": 2}, Size) == Size(2.0)
    with pytest.raises(msgspec.ValidationError, match="metres"):
        convert({"metres": "two"}, Size)
