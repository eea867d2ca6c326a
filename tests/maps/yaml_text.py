"""Town file with most features of the language, for tests that read, change or break it."""

from pathlib import Path

MIDTOWN = """\
name: midtown
speed: 50
junctions:
  cross: [0, 0]
  market: [200, 0]
  gate: [0, 200]
  corner: [200, 200]
  hill: [200, -150]
  circus: {at: [420, 0], roundabout: 30, lanes: 1, speed: 25}
streets:
  Grand Avenue: {through: [cross, market, circus], lanes: 2, median: 4, turn_lanes: [market], speed: 60}
  Ford Lane: [cross, gate]
  King Street: {through: [market, corner], one_way: true}
  South Road: {through: [gate, corner], sidewalk: 3}
  East Road: {through: [corner, [420, 200], circus], radius: 40}
  North Road: [circus, [420, -150], hill, [0, -150], cross]
  Market Street: {through: [hill, market], width: 3.25}
lights:
  - cross
  - at: market
    offset: 10
    phases:
      - {green: [Grand Avenue], seconds: 25}
      - {left: [Grand Avenue], seconds: 8}
      - {green: [Market Street], seconds: 15}
stops: [[corner, South Road]]
yields:
  - [hill, Market Street]
crosswalks: [[cross, Ford Lane]]
sites:
  - [100, 14]
  - [100, 188]
"""


def written(folder: Path, text: str | bytes) -> Path:
    """A town file with this text."""
    path = folder / "midtown.yaml"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path
