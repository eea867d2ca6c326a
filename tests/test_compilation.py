import os
import subprocess
import sys
import warnings

import numba
import numpy as np
import pytest

from dorothie_gym.compilation import allocating, compiled, inlined


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
def test_unwritable_cache_falls_back_with_one_warning(monkeypatch, kind):
    njit = numba.njit

    def refusing(*args, cache=False, **options):
        if cache:
            return lambda function: (_ for _ in ()).throw(RuntimeError("cannot cache: no locator available for file"))
        return njit(*args, **options)

    monkeypatch.setattr(numba, "njit", refusing)
    monkeypatch.setattr(sys.modules[compiled.__module__], "_warned", False)
    with pytest.warns(RuntimeWarning, match="NUMBA_CACHE_DIR") as caught:
        half = kind(lambda x: x / 2)
    assert len(caught) == 1
    assert half(3.0) == 1.5
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        compiled(lambda x: x)
        allocating(lambda x: x)


def test_other_errors_of_numba_are_not_hidden(monkeypatch):
    def failing(**options):
        raise RuntimeError("something else")

    monkeypatch.setattr(numba, "njit", failing)
    with pytest.raises(RuntimeError, match="something else"):
        compiled(lambda x: x)


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
    outputs = []
    for disabled in ("0", "1"):
        environment = {**os.environ, "NUMBA_DISABLE_JIT": disabled}
        run = subprocess.run([sys.executable, "-c", program], env=environment, capture_output=True, text=True)
        assert run.returncode == 0, run.stderr
        outputs.append(run.stdout.replace("np.float64", "").replace("(", "").replace(")", ""))
    assert outputs[0] == outputs[1]
