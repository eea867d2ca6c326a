"""Generation of towns: from a specification to a town in the town language."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from dorothie_gym.errors import TownError
from dorothie_gym.maps.driving_side import DrivingSide
from dorothie_gym.maps.generated.grid import draw_grid
from dorothie_gym.maps.generated.junction_control import control, ring_names, round_junctions, separate
from dorothie_gym.maps.generated.mixed import draw_mixed
from dorothie_gym.maps.generated.named_streets import MOST_STREETS, draw_names, join_streets
from dorothie_gym.maps.generated.organic import draw_organic
from dorothie_gym.maps.generated.radial import draw_radial
from dorothie_gym.maps.generated.road_classes import add_turn_lanes, classify, is_strongly_connected, round_bends
from dorothie_gym.maps.generated.specification import TownSize, TownSpecification, TownStyle
from dorothie_gym.maps.generated.town_draft import StreetDraft, TownDraft, town_text
from dorothie_gym.maps.yaml.compile import town_of_layout
from dorothie_gym.maps.yaml.layout import Layout, lay_out
from dorothie_gym.maps.yaml.schema import parse_plan
from dorothie_gym.support import portable_math as pm

if TYPE_CHECKING:
    from dorothie_gym.maps.generated.growth import Drawer
    from dorothie_gym.maps.generated.street_graph import StreetGraph
    from dorothie_gym.maps.import_notes import ImportNotes
    from dorothie_gym.maps.town import Town

JUNCTIONS = {TownSize.SMALL: (7, 10), TownSize.MEDIUM: (12, 21), TownSize.LARGE: (22, 34)}
"""Smallest and largest number of junctions of each size."""
MOST_ATTEMPTS = 150
"""Largest number of drafts of a town, of which about one in three is a town of its size and can be laid out."""
_SPEED = {TownSize.SMALL: 40, TownSize.MEDIUM: 40, TownSize.LARGE: 50}
_RADIUS = {TownStyle.GRID: 22, TownStyle.ORGANIC: 70, TownStyle.RADIAL: 120, TownStyle.MIXED: 40}
"""Largest radius of bends [m]."""
LARGEST_BLOCK = 52_000.0
"""Largest area of a block [m^2]: five hectares, about 200 m by 250 m."""
LONGEST_LINE = 420.0
"""Largest length of a street between two junctions [m]."""
CIRCUITY = {TownSize.SMALL: 1.25, TownSize.MEDIUM: 1.15, TownSize.LARGE: 1.15}
"""Largest sum of lengths between junctions, relative to the straight distances; a small town has more rim."""
_DRAWERS: dict[TownStyle, Drawer] = {
    TownStyle.GRID: draw_grid,
    TownStyle.ORGANIC: draw_organic,
    TownStyle.RADIAL: draw_radial,
    TownStyle.MIXED: draw_mixed,
}


def generate_town(specification: TownSpecification) -> tuple[Town, ImportNotes]:
    """Generates and compiles a town; also returns what was repaired, as for a file.

    Raises:
        TownError: no town was found.
    """
    _, layout = generate(specification)
    return town_of_layout(layout, str(specification), mirror=specification.traffic is DrivingSide.LEFT)


def generate(specification: TownSpecification) -> tuple[str, Layout]:
    """Generates a town: the first draft, in a series that the seed determines, that can be laid out.

    Returns:
        The town in the town language, and its layout for traffic on the right (`town_of_layout` mirrors it).

    Raises:
        TownError: no draft can be laid out.
    """
    name = str(specification)
    fault: TownError | None = None
    for attempt in range(MOST_ATTEMPTS):
        town = draft(specification, attempt)
        if town is None:
            continue
        text = town_text(town)
        try:
            return text, lay_out(parse_plan(text, name).right_handed())
        except TownError as error:  # streets that do not fit together: the next draft is another town
            fault = error
    raise TownError(name, "town", f"no town of this size and style was found; try another seed ({fault})")


def draft(specification: TownSpecification, attempt: int = 0) -> TownDraft | None:
    """Draws a draft of a town; None if its numbers of junctions or streets do not fit its size."""
    sizes, styles = list(TownSize), list(TownStyle)
    size_draw, style_draw = np.random.default_rng([specification.seed, 0]).integers((len(sizes), len(styles)))
    size, style = specification.size or sizes[int(size_draw)], specification.style or styles[int(style_draw)]
    rng = np.random.default_rng([specification.seed, 1 + sizes.index(size), styles.index(style), attempt])
    graph = _DRAWERS[style](rng, size)
    if not graph.places:
        return None
    rings = round_junctions(graph, rng, size, style)
    heights = separate(graph, rng, size, rings)
    least, most = JUNCTIONS[size]
    chains = join_streets(graph, MOST_STREETS - len(rings))
    if not least <= len(graph.places) <= most or len(chains) > MOST_STREETS - len(rings):
        return None
    if not _is_plausible(graph, size):
        return None
    town = TownDraft(
        name=str(specification),
        graph=graph,
        speed=_SPEED[size],
        streets=[StreetDraft(name="", chain=chain) for chain in chains],
        heights=heights,
        traffic=specification.traffic,
    )
    classify(town, rng, size)
    _name(town, rng, rings)
    control(town, rng)
    add_turn_lanes(town)
    round_bends(town, _RADIUS[style])
    return town if is_strongly_connected(town) else None


def _is_plausible(graph: StreetGraph, size: TownSize) -> bool:
    """Returns whether the blocks and streets are as large, and as straight, as those of a real town."""
    lengths = [graph.length(k) for k in graph.edges]
    straight = [pm.dist(graph.places[edge.start], graph.places[edge.end]) for edge in graph.edges.values()]
    if max(lengths) > LONGEST_LINE or sum(lengths) > CIRCUITY[size] * sum(straight):
        return False
    return max(graph.blocks()) <= LARGEST_BLOCK


def _name(town: TownDraft, rng: np.random.Generator, rings: dict[int, int]) -> None:
    """Draws the names of streets and roundabouts; the ring has as many lanes as the widest of its streets."""
    avenues = [k for k, street in enumerate(town.streets) if street.median]
    lengths = [street.chain.length(town.graph) for street in town.streets]
    for street, name in zip(town.streets, draw_names(rng, lengths, avenues), strict=True):
        street.name = name
    for (node, radius), name in zip(sorted(rings.items()), ring_names(rng, len(rings)), strict=True):
        lanes = max(town.streets[k].lanes for k in town.streets_at(node))
        town.roundabouts[node] = radius + (3 if lanes > 1 else 0), lanes, name
