"""`dorothie-gym towns`, `storyboards`, `envs` and `policies`: lists of what can be named on the command line."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Final

import typer
from rich.table import Table
from rich.text import Text

from dorothie_gym import maps as town_maps
from dorothie_gym import pictures as drawing
from dorothie_gym import policies as players
from dorothie_gym import tasks
from dorothie_gym._registration import environments
from dorothie_gym.cli.completion import complete_town
from dorothie_gym.cli.options import OWN_NAME
from dorothie_gym.cli.output import Facts, check_file, check_picture, fail, print_json, reporting_errors, stderr, stdout
from dorothie_gym.ontology.roles import AGENT_ROLES
from dorothie_gym.session.recording.files import safe_name

FAULTY = 1
"""Exit code for a town that has faults."""

ENOUGH_PLACES = 12
"""Number of places that suffices for the landmarks of every session."""

NOTES_SHOWN = 10
"""Number of notes of each kind that are printed."""


def towns(
    town: Annotated[
        str | None,
        typer.Argument(
            help="Name of a town, or a file (.xodr, .yaml; .osm with --out); default: list all.",
            autocompletion=complete_town,
        ),
    ] = None,
    check: Annotated[
        bool, typer.Option("--check", help="Report faults of the map; exit code 1 if there are any.")
    ] = False,
    picture: Annotated[
        Path | None,
        typer.Option(help="Draw the map into this PNG file; default: named after the town."),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(help="Write the town as OpenDRIVE into this file (.xodr); makes a town of an OpenStreetMap file."),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON and nothing else.")] = False,
) -> None:
    """List the shipped towns, or describe, check, draw or write one."""
    if town is None:
        _list_towns(check, picture, out, as_json)
        return
    if out is not None:
        _check_map(town, out)
    if picture == Path(OWN_NAME):
        picture = Path(f"{safe_name(Path(town).stem)}.png")
    if picture is not None:
        check_picture(picture)
    with reporting_errors():
        town = _converted(town, out)
        loaded = town_maps.load_town(town)
        facts = town_maps.describe(loaded)
        faults = town_maps.check_town(loaded) if check else ()
        notes = town_maps.import_report(town) if check else ()
        if picture is not None:
            with stderr().status(f"drawing {loaded.name}, a few seconds"):
                drawing.town_picture(loaded, picture, fold=town_maps.fold_of(loaded.name))
        if out is not None and town != str(out):
            _write(loaded, out)
    if as_json:
        print_json(_check_report(loaded, faults, notes) if check else facts)
    else:
        if check:
            _show_check(loaded, facts, faults, notes)
        else:
            _show_town(facts, _places(loaded))
        if picture is not None:
            stdout().print(f"Map: {picture}", markup=False, soft_wrap=True)
        if out is not None:
            stdout().print(f"OpenDRIVE: {out}", markup=False, soft_wrap=True)
    if faults:
        raise typer.Exit(FAULTY)


def _check_map(town: str, path: Path) -> None:
    """Fails if no OpenDRIVE file of a town can be written at `path`, or if it is the town's own."""
    if path.suffix.lower() != ".xodr":
        fail(f"{path}: a town is written as OpenDRIVE; give a name that ends in .xodr")
    check_file(path)
    if path.exists() and Path(town).exists() and path.samefile(town):
        fail(f"{path}: is the file of the town itself; give another name")


def _converted(town: str, out: Path | None) -> str:
    """Makes a town of an OpenStreetMap file; returns the file of the town, or other names as they are."""
    if out is None or not town_maps.is_street_map(town):
        return town
    with stderr().status(f"converting {town}, a few seconds"):
        town_maps.convert_street_map(town, out)
    return str(out)


def _write(town: town_maps.Town, out: Path) -> None:
    with stderr().status(f"writing {town.name}, a few seconds"):
        town_maps.write_opendrive(town, out)


def _list_towns(check: bool, picture: Path | None, out: Path | None, as_json: bool) -> None:
    """Lists the shipped towns with their folds."""
    if check:
        fail("--check looks at one town; name it: dorothie-gym towns --check NAME (or a file, .xodr or .yaml)")
    if picture is not None:
        fail("--picture draws one town; name it: dorothie-gym towns NAME --picture")
    if out is not None:
        fail("--out writes one town; name it: dorothie-gym towns NAME --out town.xodr")
    with reporting_errors():
        rows = [
            {**town_maps.describe(town_maps.load_town(name)), "fold": town_maps.fold_of(name)}
            for name in town_maps.town_names()
        ]
    print_json(rows) if as_json else _show_towns(rows)


def storyboards(
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON and nothing else.")] = False,
) -> None:
    """List the shipped storyboards, with their stories as templates."""
    with reporting_errors():
        templates = [tasks.load_template(name) for name in tasks.template_names()]
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


def envs(
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON and nothing else.")] = False,
) -> None:
    """List the environments, with the call that makes each."""
    rows = [{"id": env.id, "api": env.api, "description": env.description, "make": env.call} for env in environments()]
    if as_json:
        print_json(rows)
        return
    console = stdout()
    for row in rows:
        console.print(Text.assemble((row["id"], "bold"), f"  {row['description']} ({row['api']})"))
        console.print(f"  {row['make']}", style="dim", soft_wrap=True)
    console.print("Import gymnasium, pettingzoo and dorothie_gym first.", style="dim")


_DESCRIPTIONS: Final = {
    "scripted": "Rules; speaks by grammar",
    "silent": "Does nothing",
    "random": "Samples the action space",
    "lane-follow": "Drives on, never talks",
    "client": "Talk tasks: one request, and replies",
    "street-closer": "Talk tasks: closes the street",
    "talk-oracle": "Talk tasks: weighs words and map",
    "always-asks": "Talk tasks: asks, then obeys",
    "never-asks": "Talk tasks: obeys",
    "says-yes": "Talk tasks: promises, then obeys",
    "keyword-rule": "Talk tasks: reacts to single words",
}


def policies(
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON and nothing else.")] = False,
) -> None:
    """List the policies by name, with size, validation figures and training of the models that are shipped."""
    with reporting_errors():
        rows = _policy_rows()
    if as_json:
        print_json(rows)
        return
    table = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0))
    table.add_column("Policy", style="bold", no_wrap=True)
    table.add_column("Roles")
    table.add_column("Size", justify="right", no_wrap=True)
    table.add_column("Success")
    table.add_column("Description")
    for row in rows:
        size = "" if row["bytes"] is None else f"{row['bytes'] / 1e6:.2f} MB"
        roles = "all" if len(row["roles"]) == len(AGENT_ROLES) else ", ".join(row["roles"])
        table.add_row(row["name"], roles, size, _success(row["validation"]), row["description"])
    console = stdout()
    console.print(table)
    console.print(
        "Success, with its 95 % interval, is that of validation sessions. Shipped models need dorothie-gym[baselines]. "
        "Other models are given by the path of their folder. Training of the shipped ones:",
        style="dim",
    )
    for row in rows:
        for command in row["training"]:
            console.print(f"  {row['name']}: {command}", style="dim", soft_wrap=True)


def _policy_rows() -> list[Facts]:
    """Returns the policies with their roles; shipped models with their cards."""
    roles: dict[str, list[str]] = {}
    for role in AGENT_ROLES:
        for name in players.policy_names(role):
            roles.setdefault(name, []).append(str(role))
    rows = []
    for name, played in roles.items():
        row: Facts = {"name": name, "roles": played, "description": _DESCRIPTIONS.get(name, "")}
        row |= {"bytes": None, "training": [], "validation": None}
        if name in players.pretrained_names():
            card = players.pretrained_card(name)
            validation = {"command": card.rollout, "sessions": card.sessions}
            validation |= {key: asdict(figure) for key, figure in card.figures.items()}
            row |= {"description": card.description, "bytes": players.pretrained_size(name)}
            row |= {"training": list(card.commands), "validation": validation}
        rows.append(row)
    return rows


def _success(validation: Facts | None) -> str:
    if validation is None:
        return ""
    mean, low, high = (100 * validation["success"][key] for key in ("mean", "low", "high"))
    return f"{mean:.0f} % [{low:.0f}, {high:.0f}]"


def _show_towns(rows: Sequence[Facts]) -> None:
    table = Table(box=None, pad_edge=False, padding=(0, 1, 0, 0))
    table.add_column("Town", style="bold")
    table.add_column("Fold", no_wrap=True, min_width=11)
    for title in ("Lanes", "km", "Junctions", "Streets", "Signals", "Crosswalks", "Sites"):
        table.add_column(title, justify="right")
    for row in rows:
        table.add_row(
            row["name"],
            row["fold"] or "-",
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


def _places(town: town_maps.Town) -> str:
    """Returns the number of sites, and for few of them the numbers that storyboards need."""
    connected = len(town_maps.connected_sites(town))
    if connected >= ENOUGH_PLACES:
        return str(len(town.sites))
    needs = [tasks.needed_places(tasks.load_template(name)) for name in tasks.template_names()]
    fitting = sum(need <= connected for need in needs)
    return (
        f"{len(town.sites)}, of which cars can drive between {connected}; {fitting} of {len(needs)} storyboards fit,"
        f" which need {min(needs)} to {max(needs)} places"
    )


def _show_town(facts: Facts, places: str) -> None:
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
        elif key == "sites":
            text = places
        else:
            text = str(value)
        table.add_row(key.replace("_", " "), text)
    console = stdout()
    console.print(str(facts["name"]), style="bold", markup=False)
    console.print(table)


def _show_faults(facts: Facts, faults: Sequence[town_maps.Fault]) -> None:
    """Prints a line per fault with kind, position and message, or a summary without faults."""
    console = stdout()
    for fault in faults:
        x, y = fault.position
        console.print(f"{_words(fault.kind):<12}", style="red", markup=False, end="")
        console.print(f" at ({x:.1f}, {y:.1f}): ", style="dim", markup=False, end="")
        console.print(fault.message, markup=False, soft_wrap=True)
    if faults:
        counts = Counter(_words(fault.kind) for fault in faults)
        summary = ", ".join(f"{count} {kind}" for kind, count in counts.items())
        console.print(f"{facts['name']}: {_count(len(faults), 'fault')} ({summary})", style="bold", markup=False)
    else:
        numbers = f"{_count(facts['lanes'], 'lane')}, {_count(facts['links'], 'link')}"
        more = f"{_count(facts['junctions'], 'junction')}, {facts['kilometres']:.1f} km"
        console.print(f"{facts['name']}: no faults: {numbers}, {more}", markup=False)


def _show_check(
    town: town_maps.Town,
    facts: Facts,
    faults: Sequence[town_maps.Fault],
    notes: Sequence[town_maps.ImportNote],
) -> None:
    """Prints the side of the traffic, if it is the left, the notes of the import, and the faults."""
    if town.traffic is town_maps.DrivingSide.LEFT:
        stdout().print("left-hand traffic")
    _show_notes(notes)
    _show_faults(facts, faults)


def _show_notes(notes: Sequence[town_maps.ImportNote]) -> None:
    """Prints what the import dropped, repaired or assumed: for each kind the number, and the first elements."""
    console = stdout()
    groups: dict[tuple[str, str], list[town_maps.ImportNote]] = {}
    for note in notes:
        groups.setdefault((note.action, note.kind), []).append(note)
    for (action, kind), found in groups.items():
        console.print(f"{action}: {_count(len(found), kind)}", style="yellow", markup=False)
        for note in found[:NOTES_SHOWN]:
            console.print(f"  {note.element}: ", style="dim", markup=False, end="")
            console.print(note.message, markup=False, soft_wrap=True)
        if len(found) > NOTES_SHOWN:
            console.print(f"  and {len(found) - NOTES_SHOWN} more; --json lists all", style="dim", markup=False)


def _check_report(
    town: town_maps.Town, faults: Sequence[town_maps.Fault], notes: Sequence[town_maps.ImportNote]
) -> Facts:
    report: Facts = {"town": town.name, "traffic": str(town.traffic)}
    report["faults"] = [_fault_row(fault) for fault in faults]
    return report | {str(action): _note_rows(notes, action) for action in town_maps.NoteAction}


def _note_rows(notes: Sequence[town_maps.ImportNote], action: town_maps.NoteAction) -> Facts:
    """Returns the notes of an action by kind: elements and messages."""
    rows: Facts = {}
    for note in notes:
        if note.action is action:
            rows.setdefault(str(note.kind), []).append({"element": note.element, "message": note.message})
    return rows


def _fault_row(fault: town_maps.Fault) -> Facts:
    x, y = fault.position
    return {
        "kind": str(fault.kind),
        "lanes": list(fault.lanes),
        "position": [round(x, 2), round(y, 2)],
        "message": fault.message,
    }


def _words(kind: str) -> str:
    return kind.replace("_", " ")


def _count(number: int, noun: str) -> str:
    plural = f"{noun}es" if noun.endswith("s") else f"{noun}s"
    return f"{number} {noun if number == 1 else plural}"


def _sizes(sizes: Sequence[int]) -> str:
    """Returns the sizes of components with the number of each: "142, 3 of 1"."""
    counts = Counter(sizes)
    return ", ".join(f"{count} of {size}" if count > 1 else str(size) for size, count in counts.items())
