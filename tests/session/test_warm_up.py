"""Compilation ahead of the first session."""

import os
import subprocess
import sys

import pytest
from numba import typeof
from numba.core import event

from dorothie_gym.maps import load_town
from dorothie_gym.ontology import AGENT_ROLES, Role
from dorothie_gym.session.session_engine import SessionEngine
from dorothie_gym.session.spaces import noop
from dorothie_gym.session.warm_up import is_warm, warm_up
from dorothie_gym.sim.network.network import TownNetwork
from dorothie_gym.sim.state.town_arrays import empty_town, town_arrays


class Compilations(event.Listener):
    """Counts functions that are compiled."""

    def __init__(self):
        self.names = []

    def on_start(self, event):
        self.names.append(event.data["dispatcher"].py_func.__name__)

    def on_end(self, event):
        pass


def test_session_compiles_nothing_after_a_warm_up():
    warm_up()
    compilations = Compilations()
    with event.install_listener("numba:compile", compilations):
        engine = SessionEngine("midtown")
        engine.reset(seed=3)
        for _ in range(20):
            engine.step({str(role): noop(role, engine.limits) for role in AGENT_ROLES})
            engine.observations.of()
            engine.mask(Role.CO_WIZARD)
    assert compilations.names == []
    assert is_warm()


@pytest.mark.parametrize("town", ["brookside", "northgate"])
def test_arrays_of_all_towns_have_the_types_that_are_compiled_ahead(town):
    assert typeof(town_arrays(TownNetwork(load_town(town)))) == typeof(empty_town())


@pytest.mark.slow
def test_cold_warm_up_reports_each_function_and_leaves_a_warm_cache(tmp_path):
    program = """
from dorothie_gym.session.warm_up import is_warm, warm_up
assert not is_warm()
names = []
warm_up(lambda name, done, planned: names.append((name, done <= planned)))
assert "sim.step.step_share" in [name for name, _ in names] and all(fits for _, fits in names)
assert is_warm()
"""
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}
    run = subprocess.run([sys.executable, "-c", program], env=environment, capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
