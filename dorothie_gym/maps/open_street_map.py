"""Districts from OpenStreetMap as OpenDRIVE files, through SUMO's netconvert (extra `sumo`)."""

from __future__ import annotations

import importlib.util
import shutil
import subprocess
import tempfile
from pathlib import Path
from typing import Final

from dorothie_gym.errors import InputFileError, TownError
from dorothie_gym.maps import opendrive  # lazy: its parser is slow to import
from dorothie_gym.maps.street_map_facts import read_facts, rename_roads
from dorothie_gym.support.files import write_atomically
from dorothie_gym.support.input_files import MAX_OPENDRIVE, check_file
from dorothie_gym.support.installation import pip_install

SUFFIXES: Final = (".osm", ".osm.gz", ".osm.xml")
"""Ends of the names of OpenStreetMap files, in lower case."""

LONGEST: Final = 600.0
"""Time after which netconvert is stopped [s]; a district of 2 km takes seconds."""

OPTIONS: Final = (
    "--output.street-names",
    "--osm.lane-access",  # lanes for buses only
    "--osm.turn-lanes",
    "--osm.sidewalks",
    "--sidewalks.guess",
    "--geometry.remove",
    "--roundabouts.guess",
    "--ramps.guess",
    "--junctions.join",
    *("--default.junctions.radius", "8"),  # curves that a car can follow
    "--tls.guess-signals",  # lights on the streets that lead to a crossing belong to it
    "--tls.discard-simple",
    "--tls.join",
    *("--keep-edges.by-vclass", "passenger"),
    *("--keep-edges.components", "1"),  # the largest part of the streets
)
"""Options of netconvert (1.20 or later) beside the files."""


def is_street_map(path: str | Path) -> bool:
    """Returns whether a name is that of an OpenStreetMap file."""
    return str(path).lower().endswith(SUFFIXES)


def convert_street_map(path: str | Path, out: str | Path) -> None:
    """Writes the streets of an OpenStreetMap file as OpenDRIVE.

    Names of streets, lights, one-way streets, roundabouts, speed limits and numbers of lanes are kept; lanes for buses
    are kept from cars. Streets without a way to the largest part of the map are left out. Cars drive on the left where
    most roundabouts show it, and on the right otherwise. Names in letters that pictures cannot draw become those in
    Latin letters (`name:en`), if the map has them.

    Args:
        path: XML file of OpenStreetMap (`.osm`, also compressed as `.osm.gz`).
        out: OpenDRIVE file to write, whole or not at all.

    Raises:
        TownError: netconvert is not installed, cannot read the file, or finds no street that a car can drive on.
        OSError: `out` cannot be written.
    """
    source = Path(path)
    try:
        check_file(source, MAX_OPENDRIVE)
    except OSError as error:
        raise TownError(str(path), "file", f"cannot be read ({error.strerror}); check the path") from error
    except InputFileError as error:
        raise TownError(str(path), "file", error.reason) from None
    facts = read_facts(source)
    side = ["--lefthand"] if facts.left_hand else []
    with tempfile.TemporaryDirectory(prefix="dorothie-gym-") as folder:
        found = Path(folder) / f"{Path(out).stem}.xodr"
        files = ["--osm-files", str(source.resolve()), "--opendrive-output", str(found)]
        _run([_netconvert(str(path)), *files, *OPTIONS, *side], str(path))
        if not found.is_file():
            raise TownError(str(path), "file", "has no streets for cars")
        found.write_bytes(rename_roads(found.read_bytes(), facts.latin_names))
        try:
            opendrive.import_opendrive(found)
        except TownError as error:
            raise TownError(str(path), "streets", f"make no town: {error.reason}") from error
        write_atomically(Path(out), found.read_bytes())


def _netconvert(source: str) -> str:
    """Returns the program, from the package `eclipse-sumo` or from the search path."""
    spec = importlib.util.find_spec("sumo")
    places = [] if spec is None else list(spec.submodule_search_locations or ())
    for place in places:
        program = shutil.which("netconvert", path=str(Path(place) / "bin"))
        if program is not None:
            return program
    program = shutil.which("netconvert")
    if program is None:
        reason = f"is converted by netconvert, which is not installed: {pip_install('sumo')}"
        raise TownError(source, "file", reason)
    return program


def _run(command: list[str], source: str) -> None:
    """Runs netconvert; its first error is the reason of the exception."""
    try:
        done = subprocess.run(
            command,
            capture_output=True,
            text=True,
            errors="replace",
            timeout=LONGEST,
            check=False,
            stdin=subprocess.DEVNULL,
        )
    except subprocess.TimeoutExpired:
        reason = f"netconvert has not finished after {LONGEST:g} s; export a smaller district"
        raise TownError(source, "file", reason) from None
    except OSError as error:
        raise TownError(source, "file", f"netconvert cannot be started: {error.strerror or error}") from error
    if done.returncode != 0:
        lines = [line.removeprefix("Error:").strip() for line in done.stderr.splitlines()]
        said = next((line for line in lines if line and not line.startswith("Warning")), f"exit code {done.returncode}")
        raise TownError(source, "file", f"cannot be converted by netconvert: {said[:200]}")
