"""Results table of the benchmark: every model and metric over seeds, by part of the corpus."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.archive.visibility import Task
from dorothie_gym.evaluation.analysis.exception_attribution import Handled
from dorothie_gym.evaluation.analysis.intervals import Estimate
from dorothie_gym.evaluation.teacher_forced.labels import ALL, CorpusLabels, Split, labels_of
from dorothie_gym.evaluation.teacher_forced.metrics import COLUMNS, keys_of, per_class_accuracy
from dorothie_gym.evaluation.teacher_forced.paper_comparison import (
    ACTION_METRICS,
    FULL,
    MOVE_METRICS,
    NO_UTTERANCE,
    ModelFinding,
    above,
    findings,
    paper_figure,
    paper_figures,
    paper_name,
    paper_source,
)
from dorothie_gym.evaluation.teacher_forced.prediction_reader import read_predictions
from dorothie_gym.evaluation.teacher_forced.scoring import RunScore, Scores, class_labels, score_runs
from dorothie_gym.evaluation.teacher_forced.trivial_baselines import FLOORS

if TYPE_CHECKING:
    from dorothie_gym.archive.corpus import Corpus
    from dorothie_gym.evaluation.teacher_forced.predictions import TaskPredictions

TABLE_VERSION: Final = 1


@dataclass(frozen=True, eq=False, kw_only=True)
class ResultsTable:
    """Scores of models over seeds.

    Attributes:
        labels: labels of the corpus.
        runs: scores of each model and seed.
        missing: reason why a model could not be run ("no audio"), by name; it keeps its row.
        about: provenance of the predictions (encoders, configuration, hashes), by model or file, in JSON types.
    """

    labels: CorpusLabels
    runs: tuple[RunScore, ...]
    missing: Mapping[str, str] = field(default_factory=dict)
    about: Mapping[str, object] = field(default_factory=dict)

    @property
    def models(self) -> tuple[str, ...]:
        """Names of the models: those with a row in the paper, in its order, then the others in order of arrival."""
        names = dict.fromkeys([*(run.model for run in self.runs), *self.missing])
        order = list(paper_figures())
        known = sorted(
            (name for name in names if paper_name(name)), key=lambda name: order.index(paper_name(name) or "")
        )
        return (*known, *(name for name in names if paper_name(name) is None))

    @property
    def parts(self) -> tuple[str, ...]:
        """Parts of the corpus with scores."""
        return self.labels.parts

    @property
    def tasks(self) -> tuple[Task, ...]:
        """Tasks that at least one model predicted."""
        return tuple(task for task in Task if any(task in run.parts[ALL].points for run in self.runs))

    def runs_of(self, model: str) -> tuple[RunScore, ...]:
        """Returns the runs of a model, by seed."""
        return tuple(sorted((run for run in self.runs if run.model == model), key=lambda run: run.seed))

    def estimate(self, model: str, part: str, key: str, handled: Handled | None = None) -> Estimate:
        """Returns a figure over the seeds of a model, without any seed if it was not run or is undefined.

        Args:
            model: name of the model.
            part: part of the corpus.
            key: a metric with the task's name, like `ufn_move_accuracy`.
            handled: only points whose exchange handles this.
        """
        scores = {run.seed: _scores_of(run, part, handled) for run in self.runs_of(model)}
        return Estimate.of({seed: score.metrics[key] for seed, score in scores.items() if key in score.metrics})

    def best(self, part: str, key: str) -> frozenset[str]:
        """Returns the models with the highest mean of a figure, as it is printed: to a tenth of a per cent."""
        means = {model: self.estimate(model, part, key).mean for model in self.models}
        rounded = {model: round(100 * mean, 1) for model, mean in means.items() if mean is not None}
        return frozenset(model for model, mean in rounded.items() if mean == max(rounded.values()))

    def points(self, model: str, part: str, task: Task, handled: Handled | None = None) -> int:
        """Returns the number of points scored (of the first seed); 0 where the task was not predicted."""
        runs = self.runs_of(model)
        return _scores_of(runs[0], part, handled).points.get(task, 0) if runs else 0

    def confusion(self, model: str, part: str, task: Task) -> NDArray[np.int64] | None:
        """Returns the confusion matrix of a task, summed over seeds; None if it was not predicted."""
        found = [run.parts[part].confusion[task] for run in self.runs_of(model) if task in run.parts[part].confusion]
        return np.sum(found, axis=0, dtype=np.int64) if found else None

    def per_class(self, model: str, part: str, task: Task) -> dict[str, Estimate]:
        """Returns the accuracy of each class that occurs among the labels."""
        runs = [run for run in self.runs_of(model) if task in run.parts[part].confusion]
        shares = {run.seed: per_class_accuracy(run.parts[part].confusion[task]) for run in runs}
        names = class_labels(task)
        found = {
            name: Estimate.of({seed: float(share[k]) for seed, share in shares.items()}) for k, name in enumerate(names)
        }
        return {name: estimate for name, estimate in found.items() if estimate.seeds}

    def findings(self) -> tuple[ModelFinding, ...]:
        """Returns the outcomes of the paper's findings, and of those on TOTO, trivial baselines and other models.

        Others are the models that are neither the paper's nor floors nor ablations of TOTO.
        """
        names: dict[str, str] = {}
        for model in self.models:
            names.setdefault((paper_name(model) or model).casefold(), model)

        def called(model: str) -> str:
            return names.get((paper_name(model) or model).casefold(), model)

        found: list[ModelFinding] = []
        for part in self.parts:
            found += findings(self.estimate, part, called)
            found += [
                above(self.estimate, part, called(FULL), floor, (*MOVE_METRICS, *ACTION_METRICS))
                for floor in FLOORS
                if floor in self.models
            ]
            known = {*FLOORS, NO_UTTERANCE.casefold()}
            own = [model for model in self.models if paper_name(model) is None and model.casefold() not in known]
            found += [above(self.estimate, part, model, called(FULL)) for model in own]
        return tuple(found)

    def to_json(self) -> dict[str, object]:
        """Returns the whole table as JSON types; None where a figure is undefined.

        `models.<name>.<part>.<metric>` = {mean, half_width, seeds, values}; docs/predictions.md describes the rest.
        """
        return {
            "version": TABLE_VERSION,
            "corpus": self._corpus_json(),
            "models": {model: self._model_json(model) for model in self.models if model not in self.missing},
            "missing": dict(self.missing),
            "by_handling": self._each(self._handling_json),
            "per_class": self._each(self._per_class_json),
            "confusion": self._each(self._confusion_json),
            "classes": {task.value: list(class_labels(task)) for task in self.tasks},
            "left_out": {
                f"{run.model}, seed {run.seed}": [skipped.to_json() for skipped in run.left_out]
                for run in self.runs
                if run.left_out
            },
            "findings": [finding.to_json() for finding in self.findings()],
            "paper": {
                "source": paper_source(),
                "rows": {m: row for m in self.models if (row := paper_name(m))},
                "models": {m: self._paper_json(m) for m in self.models if paper_name(m)},
            },
            "about": dict(self.about),
        }

    def _corpus_json(self) -> dict[str, object]:
        labels = self.labels
        return {
            "folder": str(labels.root),
            "split": labels.split,
            "division": labels.division,
            "sessions": dict(labels.part_of),
            "sessions_incomplete": list(labels.incomplete),
            "sessions_unreadable": dict(labels.unreadable),
            "points": {fold or ALL: count.to_json() for fold, count in sorted(labels.counts.items())},
            "skipped": [skipped.to_json() for skipped in labels.skipped],
        }

    def _each(self, of: Callable[[str, str], dict[str, object]]) -> dict[str, object]:
        return {model: {part: of(model, part) for part in self.parts} for model in self.models if self.runs_of(model)}

    def _keys(self, model: str) -> tuple[str, ...]:
        tasks = {task for run in self.runs_of(model) for task in run.parts[ALL].points}
        return tuple(key for task in Task if task in tasks for key in keys_of(task))

    def _model_json(self, model: str) -> dict[str, object]:
        return {
            part: {key: self.estimate(model, part, key).to_json() for key in self._keys(model)} for part in self.parts
        }

    def _handling_json(self, model: str, part: str) -> dict[str, object]:
        return {
            kind.value: {
                "points": {task.value: self.points(model, part, task, kind) for task in self.tasks},
                **{key: self.estimate(model, part, key, kind).to_json() for key in self._keys(model)},
            }
            for kind in Handled
        }

    def _per_class_json(self, model: str, part: str) -> dict[str, object]:
        return {
            task.value: {name: estimate.to_json() for name, estimate in self.per_class(model, part, task).items()}
            for task in self.tasks
        }

    def _confusion_json(self, model: str, part: str) -> dict[str, object]:
        found = {task.value: self.confusion(model, part, task) for task in self.tasks}
        return {task: matrix.tolist() for task, matrix in found.items() if matrix is not None}

    def _paper_json(self, model: str) -> dict[str, object]:
        return {
            part: {
                key: {"mean": figure.mean, "half_width": figure.half_width}
                for key in COLUMNS
                if (figure := paper_figure(model, part, key)) is not None
            }
            for part in self.parts
        }


def evaluate_predictions(
    predictions: Iterable[TaskPredictions],
    corpus: CorpusLabels | Corpus | Path | str,
    split: Split = "test",
    *,
    missing: Mapping[str, str] | None = None,
    about: Mapping[str, object] | None = None,
) -> ResultsTable:
    """Scores predictions and gathers them in a table.

    Args:
        predictions: predictions of any number of models, seeds and tasks.
        corpus: the labels (`labels_of`), or the corpus whose split is taken.
        split: see `labels_of`.
        missing: why models could not be run, by name.
        about: origin of the predictions, by model or file.

    Raises:
        SessionError: the corpus cannot be read.
        PredictionError: the predictions do not match the corpus; see `score_runs`.
    """
    labels = corpus if isinstance(corpus, CorpusLabels) else labels_of(corpus, split)
    return ResultsTable(
        labels=labels, runs=score_runs(labels, predictions), missing=dict(missing or {}), about=dict(about or {})
    )


def evaluate_files(
    paths: Sequence[Path | str],
    corpus: CorpusLabels | Corpus | Path | str,
    split: Split = "test",
    *,
    missing: Mapping[str, str] | None = None,
) -> ResultsTable:
    """Scores files of predictions; see `evaluate_predictions` and `read_predictions`."""
    return evaluate_predictions(read_predictions(*paths), corpus, split, missing=missing)


def _scores_of(run: RunScore, part: str, handled: Handled | None) -> Scores:
    return run.parts[part] if handled is None else run.handled[part, handled]
