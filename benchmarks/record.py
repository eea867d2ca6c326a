"""Runs `python -m benchmarks` and stores the figures with the date in `benchmarks/results/NAME.json`."""

import datetime
import json
import subprocess
import sys
from pathlib import Path
from typing import Annotated

import typer

ROOT = Path(__file__).parents[1]
RESULTS = ROOT / "benchmarks" / "results"
BENCHMARKS = {
    "world": ("world",),
    "world_100_vehicles": ("world", "--vehicles", "100", "--pedestrians", "50"),
    "env": ("env",),
    "vector": ("vector",),
    "rl": ("rl",),
    "rl_medium_traffic": ("rl", "--town", "midtown", "--traffic", "medium", "--exceptions", "2"),
    "rl_camera": ("rl", "--algorithm", "maskable_ppo", "--observation", "camera"),
    "sessions": ("sessions",),
    "camera": ("camera", "--cold"),
    "import": ("import",),
}


def main(
    names: Annotated[list[str] | None, typer.Argument(help=f"of {', '.join(BENCHMARKS)}; by default all")] = None,
    charts: Annotated[Path | None, typer.Option(help="folder for charts, bench_NAME.png")] = None,
) -> None:
    """Runs the benchmarks one after another; the machine should be idle."""
    RESULTS.mkdir(exist_ok=True)
    for name in names or list(BENCHMARKS):
        if name not in BENCHMARKS:
            raise typer.BadParameter(f"{name} is none of {', '.join(BENCHMARKS)}")
        picture = [] if charts is None else ["--picture", str(charts.absolute() / f"bench_{name}.png")]
        command = [sys.executable, "-m", "benchmarks", *BENCHMARKS[name], "--json", *picture]
        done = subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, check=True, text=True)
        figures = {"date": datetime.date.today().isoformat(), **json.loads(done.stdout)}
        path = RESULTS / f"{name}.json"
        path.write_text(json.dumps(figures, indent=2) + "\n", encoding="utf-8")
        print(path)


if __name__ == "__main__":
    typer.run(main)
