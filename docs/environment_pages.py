"""Pages of the environments, generated from their docstrings and the specifications of their spaces.

`pages()` returns the text of each page in `docs/environments`: `python docs/pages.py environments`. The animations on
them are drawn by `environment_animations.py`.
"""

from __future__ import annotations

import enum
import inspect
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import gymnasium as gym
from environment_tables import (
    LIMITS,
    field_tables,
    kinematics,
    meta_actions,
    navigation_actions,
    pedal_actions,
    role_comparison,
    table,
    vector_table,
    weight_table,
)
from vocabulary_page import GENERATED, anchors, vocabularies

import dorothie_gym
from dorothie_gym.archive import Task
from dorothie_gym.envs.history_space import act_fields, decision_fields, history_fields
from dorothie_gym.envs.navigation_continuous_v0 import CONTINUOUS_FIELD_SPECS
from dorothie_gym.ontology import Role
from dorothie_gym.policies.navigation import FIELD_SPECS
from dorothie_gym.session.spaces import action_fields, observation_fields

FOLDER = Path(__file__).parent / "environments"

SECTIONS = (
    "Description", "Agents", "Observation Space", "Action Space", "Rewards", "Episode End", "Arguments",
    "Version History",
)  # fmt: skip
"""Sections of the docstring of an environment, in the order of the pages."""


# --- Pages ----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, kw_only=True)
class EnvironmentPage:
    """Content of a page that is not in the docstring of the environment.

    Attributes:
        name: name of the file, without suffix.
        id: id of the environment, without namespace.
        cls: class of the environment.
        summary: first paragraph.
        snippet: lines of code between the imports and `env.close()`.
        observations: lines after the section "Observation Space" of the docstring.
        actions: lines after the section "Action Space".
        rewards: lines after the section "Rewards".
        guide: page that explains the environment, and its title.
        pettingzoo: whether the environment is one of PettingZoo.
    """

    name: str
    id: str
    cls: type[Any]
    summary: str
    snippet: str
    observations: Callable[[], list[str]]
    actions: Callable[[], list[str]]
    rewards: Callable[[], list[str]] = list
    guide: tuple[str, str]
    pettingzoo: bool = False

    @property
    def fixed(self) -> Mapping[str, Any]:
        """Arguments that the id sets."""
        return {} if self.pettingzoo else gym.spec(f"dorothie_gym/{self.id}").kwargs


SAMPLE = """\
observation, info = env.reset(seed=0)
observation, reward, terminated, truncated, info = env.step(env.action_space.sample())"""

MASKED = SAMPLE.replace(".sample()", '.sample(mask=info["action_mask"])')

PARALLEL = """\
observations, infos = env.reset(seed=0)
actions = {agent: env.action_space(agent).sample(mask=infos[agent]["action_mask"]) for agent in env.agents}
observations, rewards, terminations, truncations, infos = env.step(actions)"""

ANIMATIONS: Mapping[str, str] = {
    "duo_wizard": "A session from above, with errands and dialogue at the right",
    "participant": "What the participant observes: all places, its errands, the objects in sight",
    "co_wizard": "What the Co-Wizard observes: the places on its map, the objects in sight",
    "ad_wizard": "What the Ad-Wizard observes: all places, the errands, its obstacles",
    "navigation": "A drive by discrete actions, with the instructions at the right",
    "navigation_continuous": "A drive by throttle, steering and brake, with the instructions at the right",
    "ufn": "Utterances of the participant in a recorded session, and the act of each",
    "rfn": "The dialogue of a recorded session, and the act that the Co-Wizard says next",
    "nfd": "A recorded session, and the action that the Co-Wizard carries out next",
    "town": "The ego (green) among traffic in midtown, in highway-env's viewer",
}
"""What the animation on each page shows."""

ROLE_SUMMARIES = {
    Role.PARTICIPANT: "The agent is the participant: it knows the errands and the whole map and guides the Co-Wizard by"
    " speech. Scripted policies play the Co-Wizard and the Ad-Wizard by default.",
    Role.CO_WIZARD: "The agent is the Co-Wizard: it drives the car and talks to the participant, without knowledge of"
    " the errands and of hidden landmarks. Scripted policies play the participant and the Ad-Wizard by default.",
    Role.AD_WIZARD: "The agent is the Ad-Wizard: it changes the weather, places obstacles, disturbs sensors and changes"
    " errands. Scripted policies play the participant and the Co-Wizard by default.",
}

TASK_SUMMARIES = {
    Task.UFN: "Understanding from navigation: the agent infers move and slots of each utterance of the participant in"
    " recorded sessions.",
    Task.RFN: "Response from navigation: the agent predicts move and slots of the next utterance of the Co-Wizard in"
    " recorded sessions.",
    Task.NFD: "Navigation from dialogue: the agent predicts the next navigation action of the Co-Wizard and its angle"
    " in recorded sessions.",
}


def _pages() -> Iterator[EnvironmentPage]:
    weights = dorothie_gym.RewardWeights()
    roles = ("../roles.md", "Roles, observations and actions")
    yield EnvironmentPage(
        name="duo_wizard", id="DuoWizard-v0", cls=dorothie_gym.DuoWizardEnv, pettingzoo=True,
        summary="All three roles through the parallel API of PettingZoo (also AEC).",
        snippet=PARALLEL, guide=roles,
        observations=lambda: [
            "The table shows the fields that each role observes, with their shapes. The pages of the roles describe the"
            " fields.",
            "", *role_comparison(observation_fields),
        ],
        actions=lambda: [
            "The pages of the roles describe the fields.", "", *role_comparison(action_fields),
        ],
        rewards=lambda: weight_table({"weight": weights}),
    )  # fmt: skip
    for role, env_id in ((Role.PARTICIPANT, "Participant"), (Role.CO_WIZARD, "CoWizard"), (Role.AD_WIZARD, "AdWizard")):
        yield EnvironmentPage(
            name=str(role), id=f"{env_id}-v0", cls=dorothie_gym.SingleRole, guide=roles,
            summary=ROLE_SUMMARIES[role], snippet=MASKED,
            observations=lambda role=role: field_tables(observation_fields(role, LIMITS)),
            actions=lambda role=role: field_tables(action_fields(role, LIMITS)),
            rewards=lambda: weight_table({"weight": weights}),
        )  # fmt: skip
    navigation = ("../navigation.md", "Navigation environments")
    named_weights = {
        name: gym.make("dorothie_gym/Navigation-v0", reward=name).unwrapped.config.weights  # type: ignore[attr-defined]
        for name in ("dense", "careful", "sparse")
    }
    yield EnvironmentPage(
        name="navigation", id="Navigation-v0", cls=dorothie_gym.NavigationEnv, guide=navigation,
        summary="Driving with given directions, by discrete actions.", snippet=MASKED,
        observations=lambda: vector_table(FIELD_SPECS),
        actions=navigation_actions,
        rewards=lambda: weight_table(named_weights),
    )  # fmt: skip
    yield EnvironmentPage(
        name="navigation_continuous", id="Navigation-continuous-v0", cls=dorothie_gym.NavigationContinuousEnv,
        summary="Driving with given directions, by throttle, steering and brake.", guide=navigation,
        snippet=SAMPLE,
        observations=lambda: vector_table(CONTINUOUS_FIELD_SPECS),
        actions=pedal_actions,
    )  # fmt: skip
    classes = {Task.UFN: dorothie_gym.UfNEnv, Task.RFN: dorothie_gym.RfNEnv, Task.NFD: dorothie_gym.NfDEnv}
    for task, cls in classes.items():
        yield EnvironmentPage(
            name=task.value, id=f"{cls.__name__.removesuffix('Env')}-v0", cls=cls, summary=TASK_SUMMARIES[task],
            snippet=SAMPLE, guide=("../tasks.md", "The three tasks"),
            observations=lambda task=task: field_tables(history_fields(task, LIMITS)),
            actions=lambda task=task: field_tables(decision_fields() if task is Task.NFD else act_fields()),
        )  # fmt: skip
    yield EnvironmentPage(
        name="town", id="Town-v0", cls=dorothie_gym.TownEnv, snippet=SAMPLE, guide=("../towns.md", "Towns and maps"),
        summary="A plain environment of highway-env in any town, without roles, dialogue and errands.",
        observations=kinematics, actions=meta_actions,
    )  # fmt: skip


def sections(cls: type[Any]) -> dict[str, str]:
    """Returns the sections of the docstring of an environment; "As of `Base`" inserts the section of the base class."""
    found: dict[str, str] = {}
    for base in reversed(cls.__mro__):
        if base.__module__.startswith("dorothie_gym") and base.__doc__ and "\n    ## " in base.__doc__:
            parts = re.split(r"^## (.*)\n", inspect.cleandoc(base.__doc__), flags=re.MULTILINE)[1:]
            for title, text in zip(parts[::2], parts[1::2], strict=True):
                text = re.split(r"^(?:Raises|Attributes):\n", text, flags=re.MULTILINE)[0].strip()
                inherited = re.match(r"As of `\w+`(?:, (with .*)|; (.*))?\.$", text, flags=re.DOTALL)
                if inherited and title in found:
                    addition = inherited[1] or inherited[2]
                    text = found[title] + (f"\n\n{addition[0].upper()}{addition[1:]}." if addition else "")
                found[title] = text
    return found


def _write(page: EnvironmentPage, links: Mapping[str, str]) -> str:
    docstring = sections(page.cls)
    package = "pettingzoo" if page.pettingzoo else "gymnasium as gym"
    corpus = ', corpus="corpus"' if page.cls.__name__ in ("UfNEnv", "RfNEnv", "NfDEnv") else ""
    make = 'pettingzoo.make("parallel", ' if page.pettingzoo else "gym.make("
    made = f'{make}"dorothie_gym/{page.id}"{corpus})'
    code = f"import {package}\n\nimport dorothie_gym\n\nenv = {made}\n{page.snippet}\nenv.close()"
    lines = [f"# {page.id}", "", GENERATED, "", page.summary, "", f"![{ANIMATIONS[page.name]}]({page.name}.webp)"]
    lines += ["", f"See also: [{page.guide[1]}]({page.guide[0]}).", "", "```python", code, "```"]
    after = {"Observation Space": page.observations, "Action Space": page.actions, "Rewards": page.rewards}
    for title in SECTIONS:
        text = docstring.get(title)
        if text is None:
            continue
        if title == "Arguments":
            text = _arguments(page, text)
        lines += ["", f"## {title}", "", _linked(text, links, page.name)]
        if extra := after.get(title, list)():
            lines += ["", *(_linked(line, links, page.name) for line in extra)]
    lines += ["", f"Class: `dorothie_gym.{page.cls.__name__}`."]
    return "\n".join(lines) + "\n"


def _arguments(page: EnvironmentPage, text: str) -> str:
    """Returns the section "Arguments" without arguments that the id sets, followed by the default values."""
    for name in page.fixed:
        text = re.sub(rf"^- `{name}`: .*\n(?:  .*\n)*", "", text, flags=re.MULTILINE)
    parameters = inspect.signature(page.cls.__init__).parameters.values()
    defaults = ", ".join(
        f"`{each.name}={str(each.default)!r}`"
        if isinstance(each.default, enum.Enum)
        else f"`{each.name}={each.default!r}`"
        for each in parameters
        if each.default is not each.empty and each.name not in page.fixed
    )
    return f"{text}\n\nDefault values: {defaults}."


def _linked(text: str, links: Mapping[str, str], own: str) -> str:
    """Links the names of environments and vocabularies in backticks."""

    def link(match: re.Match[str]) -> str:
        target = links.get(match[1])
        return match[0] if target is None or target == f"{own}.md" else f"[{match[0]}]({target})"

    return re.sub(r"(?<!\[)`([\w.]+)`", link, text)


def _index(all_pages: Iterable[EnvironmentPage]) -> str:
    rows = (
        (f"[`dorothie_gym/{page.id}`]({page.name}.md)", "PettingZoo" if page.pettingzoo else "Gymnasium", page.summary)
        for page in all_pages
    )
    return "\n".join([
        "# Environments",
        "",
        GENERATED,
        "",
        "Each page describes one environment with tables of the fields of its spaces. Shapes are those of the default"
        " `SpaceLimits`, which fit all shipped towns. Quantities without natural bounds have the bounds -1e6 and 1e6."
        " The unit 1 denotes dimensionless values and ids; [vocabularies](vocabularies.md) lists the meaning of ids.",
        "",
        *table(rows, "id", "API", "content"),
    ]) + "\n"  # fmt: skip


def pages() -> dict[str, str]:
    """Returns the text of all pages by file name."""
    all_pages = tuple(_pages())
    links = {page.cls.__name__: f"{page.name}.md" for page in all_pages if page.cls is not dorothie_gym.SingleRole}
    links |= {name: f"vocabularies.md#{anchor}" for name, anchor in anchors().items()}
    texts = {f"{page.name}.md": _write(page, links) for page in all_pages}
    return {"index.md": _index(all_pages), "vocabularies.md": vocabularies(), **texts}
