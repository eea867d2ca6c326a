"""`dorothie-gym towns` and `dorothie-gym storyboards`: what there is to play."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.table import Table

from dorothie_gym.cli.output import check_picture, fail, print_json, stdout, told_plainly


def towns(
    town: Annotated[
        str | None, typer.Argument(help="A town's name, or a file (.xodr, .yaml); without it, all are listed.")
    ] = None,
    picture: Annotated[Path | None, typer.Option(help="Draw the town's map into this PNG file.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Write JSON, and nothing else.")] = False,
) -> None:
    """List the towns that are shipped, or describe one: lanes, links, components, streets, signals."""
    if picture is not None:
        if town is None:
            fail("--picture draws one town; name it: dorothie-gym towns NAME --picture PICTURE.png")
        check_picture(picture)
    with told_plainly():
        from dorothie_gym.world.town import describe, load_town, town_names

        if town is None:
            rows = [describe(load_town(name)) for name in town_names()]
            print_json(rows) if as_json else _show_towns(rows)
            return
        loaded = load_town(town)
        facts = describe(loaded)
        if picture is not None:
            from dorothie_gym.world.graphics import town_picture

            town_picture(loaded, picture)
    if as_json:
        print_json(facts)
        return
    _show_town(facts)
    if picture is not None:
        stdout().print(f"Map: {picture}", markup=False, soft_wrap=True)


def storyboards(
    as_json: Annotated[bool, typer.Option("--json", help="Write JSON, and nothing else.")] = False,
) -> None:
    """List the storyboards that are shipped, with their stories as templates."""
    with told_plainly():
        from dorothie_gym.tasks import load_template, template_names

        templates = [load_template(name) for name in template_names()]
    if as_json:
        print_json([{"name": t.name, "subgoals": len(t.subgoals), "story": t.story} for t in templates])
        return
    table = Table(box=None, pad_edge=False, show_lines=False, padding=(0, 2, 1, 0))
    table.add_column("Storyboard", style="bold", no_wrap=True)
    table.add_column("Subgoals", justify="right")
    table.add_column("Story ($NAMES are filled in by the seed)")
    for template in templates:
        table.add_row(template.name, str(len(template.subgoals)), template.story)
    stdout().print(table)


def _show_towns(rows: Sequence[Mapping[str, Any]]) -> None:
    table = Table(box=None, pad_edge=False)
    table.add_column("Town", style="bold")
    for title in ("Lanes", "km", "Junctions", "Streets", "Signals", "Crosswalks", "Sites"):
        table.add_column(title, justify="right")
    for row in rows:
        table.add_row(
            row["name"],
            str(row["lanes"]),
            f"{row['kilometres']:.1f}",
            str(row["junctions"]),
            str(len(row["streets"])),
            str(row["signals"]),
            str(row["crosswalks"]),
            str(row["sites"]),
        )
    console = stdout()
    console.print(table)
    console.print("OpenDRIVE maps (.xodr) and town files (.yaml) can be given by their path.", style="dim")


def _show_town(facts: Mapping[str, Any]) -> None:
    table = Table(box=None, pad_edge=False, show_header=False)
    table.add_column(style="dim", no_wrap=True)
    table.add_column()
    for key, value in facts.items():
        if key == "name":
            continue
        if key.startswith("components"):
            text = _sizes(value)
        elif isinstance(value, list):
            text = ", ".join(value)
        else:
            text = str(value)
        table.add_row(key.replace("_", " "), text)
    console = stdout()
    console.print(str(facts["name"]), style="bold", markup=False)
    console.print(table)


def _sizes(sizes: Sequence[int]) -> str:
    """Sizes of components with how many there are of each: "142, 3 of 1"."""
    counts = Counter(sizes)
    return ", ".join(f"{count} of {size}" if count > 1 else str(size) for size, count in counts.items())
