"""Where vehicles may appear."""

from __future__ import annotations

import numpy as np

from dorothie_gym.world.town.model import Town


def free_places(town: Town, rng: np.random.Generator, count: int) -> list[tuple[int, float]]:
    """Places on lanes outside junctions, drawn evenly along the road, candidates for spawning."""
    lanes = [lane for lane in town.lanes if not lane.in_junction and lane.length > 12.0]
    weights = np.array([lane.length for lane in lanes])
    chosen = rng.choice(len(lanes), size=count, p=weights / weights.sum())
    shares = rng.uniform(size=count)
    return [
        (lanes[int(i)].id, float(5.0 + share * (lanes[int(i)].length - 10.0)))
        for i, share in zip(chosen, shares, strict=True)
    ]
