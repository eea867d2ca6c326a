"""`dorothie-gym study init|check|run|invite|readmit|export|delete`: studies with people."""

from __future__ import annotations

import contextlib
import logging
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated

import typer

from dorothie_gym.cli.options import AsJson
from dorothie_gym.cli.output import FAILED, Facts, fail, print_json, reporting_errors, stdout
from dorothie_gym.cli.serving import LOCAL, PORT, Host, Port, address, check_libraries, listen, serve
from dorothie_gym.cli.tier_options import TierName, tier_of
from dorothie_gym.cli.warm_up import compile_first
from dorothie_gym.lab import studies
from dorothie_gym.support.files import write_atomically

study = typer.Typer(help="Studies with people in the browser, from consent to completion code.", no_args_is_help=True)

StudyFile = Annotated[Path, typer.Argument(metavar="STUDY.yaml", help="File of the study.")]
Data = Annotated[Path, typer.Argument(metavar="DIR", help="Folder of the study's data.")]

Participant = Annotated[
    str, typer.Argument(metavar="PARTICIPANT", help="Number in the data, or id of the recruiting platform.")
]
Site = Annotated[str, typer.Option("--address", metavar="URL", help="Address of the study for its people.")]


@study.command()
def init(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="New file, such as study.yaml.")],
    tier: TierName = None,
) -> None:
    """Write an example study to change: two conditions, consent, instructions, questionnaires, debriefing.

    With --tier, people play the Co-Wizard with the settings, partners and towns of that tier.
    """
    if file.exists():
        fail(f"{file}: exists; give the name of a new file")
    found = tier_of(tier)
    with reporting_errors():
        from importlib.resources import files

        example = files("dorothie_gym.lab.studies") / "data" / "example.yaml"
        text = example.read_text(encoding="utf-8")
        write_atomically(file, text if found is None else studies.tier_study(text, found))
    stdout().print(f"{file} is an example. Change it, then: dorothie-gym study check {file}", soft_wrap=True)


@study.command()
def check(file: StudyFile, as_json: AsJson = False) -> None:
    """Check a study file, and the towns, storyboards and policies that it names; print the order of conditions."""
    with reporting_errors():
        found = studies.read_study(file)
        studies.check_sources(found, file)
    facts = _facts(found)
    if as_json:
        print_json(facts)
        return
    screen = stdout()
    screen.print(f"{file}: {facts['title']}", soft_wrap=True)
    screen.print(f"People play: {', '.join(facts['people'])}. Sessions of each group: {facts['sessions_each']}.")
    screen.print(f"The first block has {facts['block_size']} groups:")
    for number, slot in enumerate(facts["first_block"], start=1):
        screen.print(f"  {number}  {'; '.join(slot)}", soft_wrap=True)
    for note in facts["notes"]:
        screen.print(f"Note: {note}", soft_wrap=True)


def _facts(found: studies.Study) -> Facts:
    assigner = studies.Assigner(found)
    slots = [assigner.slot(number) for number in range(assigner.block_size)]
    return {
        "title": found.title,
        "people": [role.value for role in found.people],
        "sessions_each": found.sessions_each,
        "block_size": assigner.block_size,
        "first_block": [
            [
                f"{condition} in {scenario.town}" + (f" ({scenario.storyboard})" if scenario.storyboard else "")
                for condition, scenario in zip(slot.conditions, slot.scenarios, strict=True)
            ]
            for slot in slots
        ],
        "notes": list(_notes(found)),
    }


def _notes(found: studies.Study) -> Iterator[str]:
    """Yields what a researcher may have forgotten."""
    ways = found.recruitment
    if ways.completion.code is None:
        yield "recruitment.completion has no code: people see none at the end."
    if ways.no_partner.code is None and len(found.people) > 1:
        yield "recruitment.no_partner has no code: people for whom nobody comes see none at the end."


@study.command()
def run(
    file: StudyFile,
    out: Annotated[Path, typer.Option(metavar="DIR", help="Folder of the data; an interrupted study goes on.")],
    host: Host = LOCAL,
    port: Port = PORT,
    as_json: AsJson = False,
) -> None:
    """Run a study: print the links for its people and the experimenter, and serve it until Ctrl-C.

    After a crash or Ctrl-C, the same command goes on: people are where they were.
    """
    check_libraries("study run")
    with reporting_errors():
        studies.check_sources(studies.read_study(file), file)
    compile_first(pictures=studies.read_study(file).session.pictures)
    with reporting_errors(), studies.running_study(file, out) as (found, records):
        server = studies.StudyServer(found, file.parent, records)
        listener = listen(host, port)
        link = f"{address(host, listener.getsockname()[1])}/"
        experimenter = f"{link}experimenter#{server.experimenter.token}"
        if as_json:
            print_json({"link": link, "experimenter": experimenter, "data": str(out)})
        else:
            logging.basicConfig(format="%(asctime)s %(message)s", datefmt="%H:%M:%S")
            logging.getLogger("dorothie_gym.lab.studies").setLevel(logging.INFO)
            _print_links(found, link, out)
            stdout().print(f"Experimenter (works once): {experimenter}", soft_wrap=True)
        try:
            serve(server.app(), listener, host)
        finally:
            if not as_json:
                stdout().print("The server has stopped. The same command goes on with the study.", soft_wrap=True)


def _print_links(found: studies.Study, link: str, out: Path) -> None:
    screen, names = stdout(), found.recruitment.parameters
    if found.recruitment.admission is studies.Admission.INVITED:
        screen.print(f"Invitations: dorothie-gym study invite {out} --address {link} --count N", soft_wrap=True)
    else:
        query = "&".join(f"{name}={{{{%{name}%}}}}" for name in names)
        screen.print(f"Link for people: {link}{f'?{query}' if query else ''}", soft_wrap=True)
    screen.print(f"Data are in {out}. Ctrl-C stops the server; the same command goes on.", soft_wrap=True)


@study.command()
def invite(
    folder: Data,
    count: Annotated[int, typer.Option(min=1, max=10_000, help="Number of invitations.")] = 1,
    site: Site = f"http://{LOCAL}:{PORT}/",
    as_json: AsJson = False,
) -> None:
    """Print links of which each admits one person once; only their hashes are stored."""
    with reporting_errors():
        studies.check_folder(folder)
        with contextlib.closing(studies.StudyRecords(folder)) as records:
            links = [f"{site.rstrip('/')}/#{token}" for token in records.invite(count)]
    if as_json:
        print_json({"links": links})
    else:
        for link in links:
            stdout().print(link, soft_wrap=True)


@study.command()
def readmit(
    folder: Data,
    participant: Participant,
    site: Site = f"http://{LOCAL}:{PORT}/",
    as_json: AsJson = False,
) -> None:
    """Print a link with which a person goes on in another browser, once; the old browser is then shut out."""
    with reporting_errors():
        studies.check_folder(folder)
        with contextlib.closing(studies.StudyRecords(folder)) as records:
            token = studies.Entrance(studies.read_study(folder / studies.STUDY_FILE), records).readmit(participant)
    if token is None:
        fail(f"{folder}: has no participant {participant!r}; give the number or the id of the recruiting platform")
    link = f"{site.rstrip('/')}/#{token}"
    if as_json:
        print_json({"link": link})
    else:
        stdout().print(link, soft_wrap=True)


@study.command()
def export(
    folder: Data,
    out: Annotated[Path, typer.Option(metavar="FOLDER", help="Folder of the tables.")],
    as_json: AsJson = False,
) -> None:
    """Write pseudonymous tables as CSV, and as Parquet: participants, answers, stages, sessions, utterances."""
    with reporting_errors():
        rows = studies.export_study(folder, out)
    if as_json:
        print_json({"folder": str(out), "rows": rows})
    else:
        stdout().print(f"{out}: {', '.join(f'{count} {name}' for name, count in rows.items())}", soft_wrap=True)


@study.command()
def delete(
    folder: Data,
    participant: Participant,
    as_json: AsJson = False,
) -> None:
    """Delete everything of a person; the server must be stopped. Exports made before still have the person."""
    with reporting_errors(), studies.open_study(folder) as records:
        unfinished = studies.is_unfinished(records)
        left = studies.finish_erasures(records)
        key = next(iter(studies.read_study(folder / studies.STUDY_FILE).recruitment.parameters), None)
        name = records.find_person(participant, key)
        if name is None and not unfinished:
            fail(f"{folder}: has no participant {participant!r}")
        sessions: list[str] = []
        if name is not None:
            ids = [] if key is None else records.platform_ids(name, key)
            sessions, left = studies.erase(records, name)
            left += studies.find_traces(records, [name, *ids], sessions)
    _print_deletion(name, sessions, left, as_json)


def _print_deletion(name: str | None, sessions: list[str], left: list[str], as_json: bool) -> None:
    if as_json:
        print_json({"participant": name, "deleted_sessions": sessions, "left": left})
    else:
        taken = f", and the records of {', '.join(sessions)}" if sessions else ""
        subject = "An interrupted deletion" if name is None else f"The deletion of {name}"
        done = "An interrupted deletion is finished." if name is None else f"Everything of {name} is deleted{taken}."
        screen = stdout()
        screen.print(f"{subject} left something behind:" if left else done, soft_wrap=True)
        for each in left:
            screen.print(f"  {each}", soft_wrap=True)
    if left:
        raise typer.Exit(FAILED)
