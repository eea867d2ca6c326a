"""Which metrics each task has, under which keys, and which of them are the columns of the paper's table."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, Final

from dorothie_gym.evaluation.metrics import (
    ActionAccuracy,
    ActionMetric,
    ActMetric,
    ArgumentAccuracy,
    ArgumentAccuracyPaper,
    JointAccuracy,
    JointAccuracyPaper,
    Metric,
    MoveAccuracy,
    SlotF1,
    SlotScorePaper,
)
from dorothie_gym.sessions import Task

PAPER_SUFFIX: Final = "_paper"
"""Ends the key of a metric that is computed as the paper's code does it."""

ACT_METRICS: Final[Mapping[str, ActMetric]] = MappingProxyType(
    {
        "move_accuracy": MoveAccuracy(),
        "slot_f1": SlotF1(),
        "slot_f1_macro": SlotF1(average="macro"),
        "slot_f1_type": SlotF1(average="type"),
        "move_accuracy_paper": MoveAccuracy(),
        "slot_f1_paper": SlotScorePaper(),
    }
)
"""Metrics of UfN and RfN. The paper's protocol takes moves as we do; its slot score is no F1."""

ACTION_METRICS: Final[Mapping[str, ActionMetric]] = MappingProxyType(
    {
        "action_accuracy": ActionAccuracy(),
        "argument_accuracy": ArgumentAccuracy(),
        "joint_accuracy": JointAccuracy(),
        "action_accuracy_paper": ActionAccuracy(),
        "argument_accuracy_paper": ArgumentAccuracyPaper(),
        "joint_accuracy_paper": JointAccuracyPaper(),
    }
)
"""Metrics of NfD. The paper's protocol takes actions as we do."""

COLUMNS: Final = (
    "ufn_move_accuracy", "ufn_slot_f1", "rfn_move_accuracy", "rfn_slot_f1", "nfd_action_accuracy", "nfd_joint_accuracy",
)  # fmt: skip
"""The six columns of the paper's table, in its order."""

SHOWN: Final = (
    "ufn_move_accuracy", "ufn_slot_f1", "ufn_slot_f1_paper", "rfn_move_accuracy", "rfn_slot_f1", "rfn_slot_f1_paper",
    "nfd_action_accuracy", "nfd_joint_accuracy", "nfd_joint_accuracy_paper",
)  # fmt: skip
"""The columns of our table: the paper's, and beside those that it computes otherwise its own protocol."""

TASK_NAMES: Final[Mapping[Task, str]] = MappingProxyType({Task.UFN: "UfN", Task.RFN: "RfN", Task.NFD: "NfD"})
"""How the paper writes the tasks."""


def metrics_of(task: Task) -> Mapping[str, Metric[Any, Any]]:
    """Returns the metrics of a task by their keys, which lack the task's name: `move_accuracy`, ..."""
    return ACTION_METRICS if task is Task.NFD else ACT_METRICS


def keys_of(task: Task) -> tuple[str, ...]:
    """Returns the keys of a task's metrics with the task's name: `ufn_move_accuracy`, ..."""
    return tuple(f"{task.value}_{key}" for key in metrics_of(task))


def title_of(key: str) -> str:
    """Returns what people call the metric of a key with the task's name: "UfN slot F1 (macro)"."""
    return f"{task_of(key)} {metric_title(key.partition('_')[2])}"


def task_of(key: str) -> str:
    """Returns the name of the task of a key: "UfN"."""
    return TASK_NAMES[Task(key.partition("_")[0])]


def metric_title(name: str) -> str:
    """Returns what people call the metric of a key without the task's name: "slot F1 (macro)"."""
    base = name.removesuffix(PAPER_SUFFIX)
    words = _SHORT.get(base) or base.replace("_", " ")
    return f"{words} (paper)" if name.endswith(PAPER_SUFFIX) else words


def shown_title(key: str) -> str:
    """Returns the heading of a column of our table, without the task: "slot F1", "slots (paper)"."""
    return _HEADINGS[key.partition("_")[2]]


def has_paper_figure(key: str) -> bool:
    """Whether a column of our table is computed as the paper's figures are."""
    return key in SHOWN and key + PAPER_SUFFIX not in SHOWN


_SHORT: Final = {"slot_f1": "slot F1", "slot_f1_macro": "slot F1 (macro)", "slot_f1_type": "slot F1 (by slot type)"}
_HEADINGS: Final = {
    "move_accuracy": "move acc.",
    "slot_f1": "slot F1",
    "slot_f1_paper": "slots (paper)",
    "action_accuracy": "action acc.",
    "joint_accuracy": "joint acc.",
    "joint_accuracy_paper": "joint (paper)",
}
