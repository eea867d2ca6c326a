"""Measures the talk of the Co-Wizard in rollouts: truth, yes and no, and relevance of its own utterances.

The checks are those of `dorothie-gym stats --talk`, which counts both speakers, restricted to one of them.
"""

import json
from collections import Counter
from pathlib import Path
from typing import Annotated

import typer

from dorothie_gym.archive import Corpus
from dorothie_gym.dialogue import Predicate
from dorothie_gym.evaluation.analysis.truth_checks import TalkChecks, checks
from dorothie_gym.evaluation.analysis.truth_checks.session_world import SessionWorld
from dorothie_gym.evaluation.analysis.truth_checks.truth import is_true
from dorothie_gym.maps.catalogue import find_town
from dorothie_gym.ontology import Role
from dorothie_gym.session.recording import MoveRecord, Session

FIGURES = ("truth", "yes_no_answers", "relevance")


def main(
    rollouts: Annotated[list[Path], typer.Argument(help="folders of rollouts")],
    role: Annotated[str, typer.Option(help="co_wizard or participant")] = Role.CO_WIZARD.value,
    maps: Annotated[Path | None, typer.Option(help="folder of the OpenDRIVE files of imported towns")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="print one JSON object")] = False,
) -> None:
    """Prints shares and numbers of cases, and errors by predicate."""
    for folder in rollouts:
        found, wrong = TalkChecks(), Counter[str]()
        for entry in Corpus.load(folder / "sessions", maps=maps).entries:
            session = entry.load()
            town = find_town(session.header.town, entry.maps)
            if town is None:
                raise SystemExit(f"{session.name}: there is no map of {session.header.town}; give its folder by --maps")
            _add_statements(found, wrong, SessionWorld(session, town), Role(role))
            _add_answers(found, wrong, session, Role(role))
        figures = {name: found.share(name) for name in FIGURES} | {f"{name}_n": found.cases[name] for name in FIGURES}
        if as_json:
            print(json.dumps({"folder": str(folder), **figures, "wrong": dict(wrong.most_common())}))
            continue
        print(folder)
        for name in FIGURES:
            share = found.share(name)
            print(f"  {name}: {'-' if share is None else f'{100 * share:.0f} %'} of {found.cases[name]}")
        print("  wrong:", ", ".join(f"{name} {count}" for name, count in wrong.most_common()) or "nothing")


def _add_statements(found: TalkChecks, wrong: Counter[str], world: SessionWorld, role: Role) -> None:
    """Compares the role's statements with the world; arrival times are omitted, as in `dorothie-gym stats --talk`."""
    for move in world.session.moves(role):
        for said in move.meaning if move.act.move in checks._FACTUAL else ():
            right = is_true(world, said, move.start, role)
            if said.predicate is not Predicate.ARRIVES_IN:
                found.add("truth", right)
                if right is False:
                    wrong[f"{said.predicate} (untrue)"] += 1
            if move.act.move in checks._YES_NO:
                found.add("yes_no_answers", right)


def _add_answers(found: TalkChecks, wrong: Counter[str], session: Session, role: Role) -> None:
    """Checks whether the answers of the role are about the question."""
    asked: MoveRecord | None = None
    for move in session.moves():
        if move.act.move in checks._QUESTIONS and move.meaning:
            asked = move
        elif asked is not None and move.speaker is not asked.speaker and move.act.move in checks._ANSWERS:
            if not move.meaning:
                continue
            if move.speaker is role and move.start - asked.end <= checks.ANSWERED_WITHIN:
                right = checks._is_about(move.meaning[0], checks._as_said(asked))
                found.add("relevance", right)
                if not right:
                    wrong[f"{move.meaning[0].predicate} to {asked.meaning[0].predicate} (irrelevant)"] += 1
            asked = None


if __name__ == "__main__":
    typer.run(main)
