import gc
import os
import random
import re
import subprocess
import sys
import warnings
from typing import NamedTuple

import numba
import numpy as np
import pytest
from numba.core import event
from numba.core.compiler import Flags

from dorothie_gym.support.compilation import allocating, cache, compiled, direct, fixed, inlined
from dorothie_gym.support.compilation.cache import compiled_folder
from dorothie_gym.support.compilation.dispatcher import OwnFlags
from dorothie_gym.support.compilation.records import Float, by_reference, empty_records
from tests.plain_python import printed_compiled_and_plain
from tests.support.cache_damage import DAMAGES


@pytest.mark.parametrize("kind", [allocating, compiled, inlined])
def test_function_is_compiled_and_cached_where_numba_can_write(kind):
    @kind
    def double(x: float) -> float:
        return 2 * x

    assert double(2.5) == 5.0


def test_function_that_makes_arrays_needs_counts():
    def made(count):
        return np.zeros(count)

    def made_without_counts(count):  # another one, as both would have the same place in the cache
        return np.zeros(count)

    assert allocating(made)(2).tolist() == [0.0, 0.0]
    if not numba.config.DISABLE_JIT:
        with pytest.raises(numba.core.errors.NumbaError):
            compiled(made_without_counts)(2)


@pytest.mark.parametrize("kind", [allocating, compiled, inlined])
def test_unwritable_cache_costs_time_and_one_warning_but_no_result(monkeypatch, tmp_path, kind):
    file = tmp_path / "file"
    file.touch()
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(file / "folder"))
    monkeypatch.setattr(cache, "_warned", False)

    @kind
    def half(x):
        return x / 2

    @kind
    def third(x):
        return x / 3

    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        assert half(3.0) == 1.5
        assert third(3.0) == 1.0
    if not numba.config.DISABLE_JIT:
        assert [warning.category for warning in caught] == [RuntimeWarning]
        assert "NUMBA_CACHE_DIR" in str(caught[0].message)


@pytest.fixture
def collector():
    """Restores the state of the garbage collector."""
    was_enabled = gc.isenabled()
    yield
    (gc.enable if was_enabled else gc.disable)()


@pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason="nothing is compiled")
@pytest.mark.parametrize("enabled", [True, False])
def test_collector_is_off_during_a_compilation_and_afterwards_as_before(collector, enabled, monkeypatch, tmp_path):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))  # nothing is compiled yet
    states = []

    class Listener(event.Listener):
        def on_start(self, event):
            states.append(gc.isenabled())

        def on_end(self, event):
            states.append(gc.isenabled())

    @compiled
    def increased(x):
        return x + 1

    @compiled
    def broken(x):
        return x.nothing

    (gc.enable if enabled else gc.disable)()
    with event.install_listener("numba:compile", Listener()):
        assert increased(2) == 3
        assert states == [False, False] and gc.isenabled() == enabled
        with pytest.raises(numba.core.errors.TypingError):
            broken(2)
    assert gc.isenabled() == enabled


CALLEE = """
from dorothie_gym.support.compilation import compiled

@compiled
def factor(x):
    {doc}
    return {factor} * x
"""

CALLER = """
import callee
from dorothie_gym.support.compilation import compiled
from callee import factor

@compiled
def square(x):
    return factor(x) * x

print(square(3), sum(square.stats.cache_hits.values()))
"""


def square(folder, *, factor, doc="'One.'", seconds):
    """Writes the two files as of a moment [s], runs them, and returns the square and the loads from the cache."""
    for name, text in {"callee": CALLEE.format(factor=factor, doc=doc), "caller": CALLER}.items():
        (folder / f"{name}.py").write_text(text)
        os.utime(folder / f"{name}.py", (seconds, seconds))
    path = os.pathsep.join([str(folder), *filter(None, sys.path)])
    environment = {**os.environ, "PYTHONPATH": path, "NUMBA_CACHE_DIR": str(folder / "cache"), "NUMBA_DISABLE_JIT": "0"}
    environment["PYTHONDONTWRITEBYTECODE"] = "1"
    run = subprocess.run([sys.executable, "caller.py"], cwd=folder, env=environment, capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    result, loads = run.stdout.split()
    return int(result), int(loads)


def test_caller_of_a_changed_function_is_compiled_again(tmp_path):
    assert square(tmp_path, factor=2, seconds=1000) == (18, 0)
    assert square(tmp_path, factor=2, seconds=1000) == (18, 1)
    assert square(tmp_path, factor=5, seconds=1000) == (45, 0)


def test_only_content_decides_whether_a_function_is_compiled_again(tmp_path):
    assert square(tmp_path, factor=2, seconds=1000) == (18, 0)
    assert square(tmp_path, factor=2, seconds=2000) == (18, 1)
    assert square(tmp_path, factor=2, doc="'Another docstring.'", seconds=3000) == (18, 1)


@pytest.mark.long
def test_damaged_machine_code_is_compiled_again(tmp_path):
    assert square(tmp_path, factor=2, seconds=1000) == (18, 0)
    for file in (tmp_path / "cache").iterdir():
        file.write_bytes(file.read_bytes()[:100])
    assert square(tmp_path, factor=2, seconds=1000) == (18, 0)
    assert square(tmp_path, factor=2, seconds=1000) == (18, 1)


def tripled(x):
    return 3 * x


def halved(x):
    return x / 2


@pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason="nothing is compiled")
@pytest.mark.skipif(os.name != "posix", reason="pipes of POSIX")
@pytest.mark.parametrize("kind", sorted(DAMAGES))
def test_machine_code_with_any_damage_is_compiled_again(tmp_path, monkeypatch, kind):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "code"))
    assert compiled(halved)(3.0) == 1.5
    halves = {path.name for path in (tmp_path / "code").iterdir()}
    assert compiled(tripled)(3.0) == 9.0
    threefold = {path.name for path in (tmp_path / "code").iterdir()} - halves
    for number, name in enumerate(sorted(threefold)):
        DAMAGES[kind](tmp_path / "code" / name, random.Random(number))
    for hits in (0, 1):
        again, other = compiled(tripled), compiled(halved)
        assert again.is_cached() == bool(hits)
        assert again(3.0) == 9.0 and other(3.0) == 1.5
        assert sum(again.stats.cache_hits.values()) == hits and sum(other.stats.cache_hits.values()) == 1
    assert {path.name for path in (tmp_path / "code").iterdir()} == halves | threefold


@pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason="nothing is compiled")
def test_machine_code_of_other_versions_is_deleted_when_nobody_uses_it(tmp_path, monkeypatch):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    compiled(tripled)(3.0)
    (path,) = set(tmp_path.glob("*tripled*"))
    stem = path.name.partition("tripled-")[0] + "tripled-"
    others = [
        f"{stem}0123.py311.{'0' * 16}.code",
        f"{stem}0123.py311.nbi",
        f"{stem}0123.py311.1.nbc",
        f"{stem}0123.part",
    ]
    for name in others:
        (tmp_path / name).touch()
    compiled(tripled)(3)  # of another type
    assert all((tmp_path / name).exists() for name in others), "another copy of the package uses them"
    for file in tmp_path.iterdir():
        os.utime(file, (0.0, 0.0))
    compiled(tripled)(np.float32(3.0))
    assert not any((tmp_path / name).exists() for name in others)
    assert path.exists() and len(set(tmp_path.glob("*tripled*"))) == 3


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has other permissions")
def test_machine_code_is_not_read_from_a_folder_that_others_can_write(tmp_path, monkeypatch):
    folder = tmp_path / "machine-code"
    folder.mkdir()
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(folder))
    assert compiled_folder() == folder
    folder.chmod(0o777)
    assert compiled_folder() is None


def test_folder_of_machine_code_is_private(tmp_path):
    square(tmp_path, factor=2, seconds=1000)
    assert (tmp_path / "cache").stat().st_mode & 0o077 == 0


@pytest.mark.long
def test_network_answers_the_same_without_compilation():
    program = """
import numpy as np
from dorothie_gym.sim.network.network import TownNetwork
from dorothie_gym.maps import Lane, Town
points = np.array([[0.0, 0, 0], [10, 0, 0], [17, 7, 0]])
lane = Lane(id=0, road_id=0, lane_id=-1, points=points, widths=np.full(3, 4.0), speed_limit=10.0)
network = TownNetwork(Town(name="one", lanes=[lane], links=[], junctions=[]))
print(network.get_closest_lane_index([5.0, 1.0], 0.1), network.lane_of(0).local_coordinates([12.0, 5.0]))
"""
    compiled, plain = printed_compiled_and_plain(program)
    assert re.sub(r"np\.float64|[()]", "", compiled) == re.sub(r"np\.float64|[()]", "", plain) != ""


@by_reference
class Numbers(NamedTuple):
    values: np.ndarray
    factor: float


@compiled
def scaled_sum(numbers, more, offset=0.0):
    total = more + offset
    for value in numbers.values:
        total += value * numbers.factor
    return total


def test_function_called_directly_gives_the_same_results():
    fast = direct(scaled_sum)
    for count in (3, 0, 5):
        numbers = Numbers(np.arange(count, dtype=np.float64), 2.0)
        for more in (1, 1.5):  # of two types
            assert fast(numbers, more) == scaled_sum(numbers, more) == more + count * (count - 1)
            assert fast(numbers, more, 4.0) == 4.0 + scaled_sum(numbers, more)


def test_function_called_directly_distinguishes_arrays_by_their_types():
    fast, numbers = direct(weighted_sum), np.arange(12)
    constant = numbers.astype(np.float32)
    constant.flags.writeable = False
    for array in (numbers, numbers.astype(np.float64), numbers[::2], numbers.reshape(3, 4)[:, 1], constant):
        assert fast(array) == (np.arange(len(array)) * array).sum()


def test_function_of_fixed_types_looks_at_them_once():
    fast = fixed(scaled_sum)
    for count in (3, 0, 5):
        numbers = Numbers(np.arange(count, dtype=np.float64), 2.0)
        numbers.values.flags.writeable = count == 0
        for more in (1.5, 1):  # a whole number where a number was
            assert fast(numbers, more, 4.0) == 4.0 + more + count * (count - 1)


@compiled
def weighted_sum(array):
    total = 0.0
    for k in range(len(array)):
        total += k * array[k]
    return total


@compiled
def doubled(number):
    return 2 * number


@compiled
def sum_of_doubled(small, byte):
    return doubled(small[0]) + doubled(byte[0]) + doubled(len(small)) + doubled(7)


@pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason="nothing is compiled")
def test_function_is_compiled_once_for_all_sizes_of_integers(monkeypatch, tmp_path):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    with event.install_recorder("numba:compile") as recorder:
        total = sum_of_doubled(np.array([2**30 + 1], dtype=np.int32), np.array([255], dtype=np.uint8))
    assert total == 2**31 + 2 + 510 + 2 + 14
    names = [found.data["dispatcher"].py_func.__name__ for _, found in recorder.buffer if found.is_start]
    assert sorted(names) == ["doubled", "sum_of_doubled"]


def test_field_with_the_name_of_an_attribute_of_numpy_is_refused():
    class Cell:
        size: Float

    with pytest.raises(TypeError, match=r"Cell\.size has the name of an attribute"):
        empty_records(Cell, 1)


def test_options_of_a_compilation_equal_those_of_numba_with_the_same_values() -> None:
    plain, own = Flags(), OwnFlags()
    plain.no_compile = plain.nrt = False
    assert own == plain and plain == own and hash(own) == hash(plain)
    own.nrt = True
    assert own != plain and plain != own
    plain.nrt = True
    plain.fastmath = True
    assert own != plain and plain != own
    assert own.copy() == own and hash(own.copy()) == hash(own)


@compiled
def digits(array, divisor):
    total, most, flags = 0.0, -1, 0
    for k in range(len(array)):
        value = array[k] // divisor - array[k] % divisor * abs(array[-1])
        total += max(value, 2) + min(value, divisor, 3.5) - (1 if bool(value) else 0) + int(value) ** 2
        if value > most:
            most, flags = int(value), flags ^ (k << 1) | 1
        rest = value - most  # not used after the loop
        total += rest / divisor if not rest < -4 else -rest
    return total + most, flags


def test_operators_and_built_in_functions_give_the_results_of_python_for_all_types():
    plain = getattr(digits, "py_func", digits)
    for values in ([7, -3, 12, 5], [7.5, -3.25, 0.0, -5.0]):
        for array in (np.array(values), np.array(values).astype(np.float32), np.array(values).astype(np.int32)):
            for divisor in (3, -2, 2.5):
                assert digits(array, divisor) == pytest.approx(plain(array.tolist(), divisor), rel=1e-5)


@pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason="nothing is compiled")
def test_operator_of_a_type_that_is_registered_later_is_found():
    class Pair(NamedTuple):
        one: float
        other: float

    @compiled
    def second(pair):
        return pair[1]

    assert second((1.0, 2.0)) == 2.0
    assert second(Pair(3.0, 4.0)) == 4.0
    assert second(np.array([5.0, 6.0])) == 6.0
