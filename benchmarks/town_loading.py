"""Loading time of towns: compiled from the file and read from the cache, each in a new process."""

import json
import os
import statistics
import subprocess
import sys
import tempfile
from typing import Annotated

import typer
from rich.console import Console
from rich.table import Table

from dorothie_gym.maps import load_town, town_names
from dorothie_gym.support.user_cache import CACHE_VARIABLE

# The clock starts after the imports, which are the same for both.
LOAD = """
import sys, time
from dorothie_gym.maps import load_town
start = time.perf_counter()
load_town(sys.argv[1])
print(time.perf_counter() - start)
"""


def main(
    towns: Annotated[list[str] | None, typer.Argument(help="names or files of towns; by default all that ship")] = None,
    repeats: Annotated[int, typer.Option(help="processes of each kind")] = 5,
    as_json: Annotated[bool, typer.Option("--json")] = False,
) -> None:
    """Times `load_town` without and with the cache and prints medians."""
    rows = []
    for town in towns or town_names():
        with tempfile.TemporaryDirectory() as folder:
            seconds(town, folder)  # fills the cache, and warms the disk for both
            compiled = statistics.median(seconds(town, "") for _ in range(repeats))
            cached = statistics.median(seconds(town, folder) for _ in range(repeats))
        rows.append(
            {
                "town": load_town(town).name,
                "lanes": len(load_town(town).lanes),
                "cached_milliseconds": round(cached * 1e3, 1),
                "compiled_milliseconds": round(compiled * 1e3, 1),
                "ratio": round(compiled / cached, 1),
            }
        )
    if as_json:
        print(json.dumps(rows))
        return
    table = Table("town", "lanes", "from the cache [ms]", "compiled [ms]", "ratio")
    for row in rows:
        table.add_row(*(str(value) for value in row.values()))
    Console().print(table)


def seconds(town: str, cache: str) -> float:
    """Returns the time of a new process to load a town; `cache` is the cache folder, or empty for none."""
    command = [sys.executable, "-c", LOAD, town]
    environment = {**os.environ, CACHE_VARIABLE: cache}
    return float(subprocess.run(command, env=environment, capture_output=True, check=True, text=True).stdout)


if __name__ == "__main__":
    typer.run(main)
