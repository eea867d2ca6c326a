"""Programs that play a `TextSession`, and the sessions that they play."""

from __future__ import annotations

import json
import random
from collections.abc import Callable, Mapping
from typing import Any

from dorothie_gym.agents import Outcome, TextSession, Turn, merged_page
from dorothie_gym.ontology import Role
from tests.policies.language_model.prompt_reader import CoWizardReader
from tests.policies.language_model.simple_readers import Interferer, guide

Answerer = Callable[[str], Mapping[str, str]]


def reader_of(role: Role | str) -> Answerer:
    """The rule program that plays a role from its pages."""
    return {Role.CO_WIZARD: CoWizardReader, Role.PARTICIPANT: lambda: guide, Role.AD_WIZARD: Interferer}[Role(role)]()


def play(session: TextSession, answerer: Answerer, seed: int) -> Outcome:
    """Plays a session to its end; pages of changes are merged into whole ones."""
    turn, page = session.reset(seed), ""
    while not turn.done:
        page = merged_page(page, turn.page) if session.pages == "changes" and page else turn.page
        turn = session.answer(json.dumps(answerer(page)))
    return session.finish()


class Idler:
    """Does nothing."""

    def __call__(self, turn: Turn) -> Mapping[str, Any]:
        return {"again": turn.choices["again"][0]}


class Talker:
    """Talks, and never drives."""

    def __call__(self, turn: Turn) -> Mapping[str, Any]:
        return {"say": "Okay, we are on our way."}


class Gambler:
    """Draws any legal answer."""

    def __init__(self, seed: int) -> None:
        self._random = random.Random(seed)

    def __call__(self, turn: Turn) -> Mapping[str, Any]:
        return {name: self._random.choice(labels) for name, labels in turn.choices.items()}


class Keywords:
    """Drives to places whose name is said, and takes the steps of the route."""

    def __call__(self, turn: Turn) -> Mapping[str, Any]:
        said = [line for line in turn.page.splitlines() if line.startswith("- The passenger said")]
        answer: dict[str, Any] = {}
        for place in turn.choices["goal"][2:]:
            if said and place.lower() in said[-1].lower():
                answer |= {"goal": place, "say": f"Okay, to the {place}."}
        route = next((line for line in turn.page.splitlines() if line.startswith("Route: now: ")), "")
        step = route.removeprefix("Route: now: ")
        chosen = [label for label in turn.choices["drive"][1:] if step.startswith(label)]
        wants = "Start" if "Start" in turn.choices["drive"] and "goal" in answer else "none"
        return {**answer, "drive": max(chosen, key=len) if chosen else wants, "again": "2"}


def score(session: TextSession, player: Callable[[Turn], Mapping[str, Any]], seed: int) -> Outcome:
    """Plays a session by turns."""
    turn = session.reset(seed)
    while not turn.done:
        turn = session.answer(player(turn))
    return session.finish()
