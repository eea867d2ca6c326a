"""Environment for TRL's `GRPOTrainer`: its public methods are the tools of the model, and the score is the reward.

TRL needs nothing but such a class, so that this module imports nothing of it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from dorothie_gym.agents.curriculum import AgentTask, CurriculumStage, Split, tasks
from dorothie_gym.errors import AgentSessionError
from dorothie_gym.ontology.roles import Role
from dorothie_gym.policies.language_model.role_interface import system_prompt

if TYPE_CHECKING:
    from collections.abc import Mapping

    from dorothie_gym.agents.text_session import TextSession
    from dorothie_gym.agents.turn import Turn

_TOOLS: Final = (
    "You write no JSON object: call the tools. drive, set_goal and say fill the fields of their names, and wait "
    "carries out what you have chosen and lets time pass. set_goal also takes marks. There are no status and no notes."
)


class DorothieEnvironment:
    """Sessions of the Co-Wizard by tools: `GRPOTrainer(..., environment_factory=DorothieEnvironment)`.

    A mistake of the model is words in the result of the tool. Instances are kept by TRL, and reset for each rollout.
    """

    def __init__(self) -> None:
        self._sessions: dict[tuple[str, str], TextSession] = {}
        self._session: TextSession | None = None
        self._choices: Mapping[str, tuple[str, ...]] = {}

    def reset(self, seed: int, town: str, stage: str, **row: Any) -> str:
        """Begins a session, and returns its first page.

        Args:
            seed: seed of the session: rows of a group have equal ones, and so equal sessions.
            town: name of the town.
            stage: stage of the curriculum.
            row: other columns of the dataset, which have no effect.

        Raises:
            ValueError: there is no such stage or town, or the seed is none.
        """
        key = stage, town
        if key not in self._sessions:
            self._sessions = {key: AgentTask(stage=CurriculumStage(stage), town=town, seed=seed).session()}
        self._session = self._sessions[key]
        return self._shown(self._session.reset(seed))

    def get_reward(self) -> float:
        """Returns the score so far, in [0, 1]."""
        return self._begun().score

    def say(self, value: str) -> str:
        """Says a sentence to the passenger when time passes.

        Args:
            value: The sentence.

        Returns:
            A confirmation, or why it is refused.
        """
        return self._call("say", value=value)

    def drive(self, value: str) -> str:
        """Chooses what the car does.

        Args:
            value: One of the choices under "You can drive".

        Returns:
            A confirmation, or why it is refused.
        """
        return self._call("drive", value=value)

    def set_goal(self, value: str) -> str:
        """Sets the place that you drive to, or marks where you suppose it.

        Args:
            value: A place of the page, or none. For a place that is not on your map also "here", "20 m ahead",
                "beside PLACE" or "on STREET".

        Returns:
            A confirmation, or why it is refused.
        """
        marks = value in self._choices.get("mark", ()) and value not in self._choices.get("goal", ())
        return self._call("mark" if marks else "set_goal", value=value)

    def wait(self, seconds: float = 10.0) -> str:
        """Carries out what you have chosen, and lets time pass until something happens.

        Args:
            seconds: The longest time to wait, in seconds.

        Returns:
            What the driver sees and hears then.
        """
        return self._call("wait", seconds=seconds)

    def look(self) -> str:
        """Shows the page again, without time passing.

        Returns:
            What the driver sees and hears.
        """
        return self._call("look")

    def _call(self, name: str, **arguments: object) -> str:
        return self._shown(self._begun().tool(name, **arguments))

    def _shown(self, turn: Turn) -> str:
        self._choices = turn.choices
        return turn.page

    def _begun(self) -> TextSession:
        if self._session is None:
            raise AgentSessionError("no session has begun: call reset() first")
        return self._session


def rows(split: Split | str, stage: CurriculumStage | str | None = None) -> list[dict[str, Any]]:
    """Returns the rows of a dataset for `GRPOTrainer`: prompt, seed, town, stage, and the reference score.

    Args:
        split: "train" or "test".
        stage: stage of the tasks; None for all.

    Raises:
        ValueError: there is no such split or stage.
    """
    system = {"role": "system", "content": f"{system_prompt(Role.CO_WIZARD)}\n\n{_TOOLS}"}
    return [
        {
            "prompt": [system, {"role": "user", "content": "The session begins.\n"}],
            "seed": task.seed,
            "town": task.town,
            "stage": str(task.stage),
            "reference": task.reference,
        }
        for task in tasks(split, stage)
    ]
