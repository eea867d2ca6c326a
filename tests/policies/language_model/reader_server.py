"""Serves the rule programs of the three roles as a language model, over OpenAI's chat interface.

The answers come from nothing but the prompts. The server stands for a language model that makes good use of its prompt,
in rollouts and cross-play on a machine without one: `python -m tests.policies.language_model.reader_server`.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping
from typing import Annotated, Any

import typer

from dorothie_gym.ontology import Role
from dorothie_gym.policies.language_model.role_interface import system_prompt
from tests.policies.language_model.fake_server import FakeServer
from tests.policies.language_model.prompt_reader import CoWizardReader
from tests.policies.language_model.simple_readers import Interferer, guide


def answer_by_role(request: Mapping[str, Any]) -> Mapping[str, str]:
    """Returns the answer to the last page by the program of the role that the system prompt states."""
    programs: dict[Role, Callable[[str], dict[str, str]]] = {
        Role.CO_WIZARD: CoWizardReader(),
        Role.PARTICIPANT: guide,
        Role.AD_WIZARD: Interferer(),
    }
    system = request["messages"][0]["content"]
    program = next(program for role, program in programs.items() if system.startswith(system_prompt(role)))
    contents = [message["content"] for message in request["messages"] if message["role"] == "user"]
    texts = [content if isinstance(content, str) else content[0]["text"] for content in contents]
    return program([text for text in texts if text.startswith("Time: ")][-1])


def main(port: Annotated[int, typer.Option(help="port on the loopback interface")] = 8011) -> None:
    """Serves until it is interrupted."""
    try:
        server = FakeServer(answer_by_role, port)
    except OSError as error:
        raise SystemExit(f"port {port}: {error.strerror}; choose another by --port") from None
    server.requests, server.headers = deque(maxlen=1), deque(maxlen=1)  # not kept
    print(f"--llm-url {server.url}", flush=True)
    try:
        server.serve_forever()
    except KeyboardInterrupt:
        server.server_close()


if __name__ == "__main__":
    typer.run(main)
