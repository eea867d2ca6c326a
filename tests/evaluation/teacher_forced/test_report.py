from __future__ import annotations

import io
import json
from dataclasses import replace
from pathlib import Path

import pytest
from rich.console import Console

from dorothie_gym.evaluation.teacher_forced import CorpusLabels, ResultsTable, evaluate_predictions, labels_of
from dorothie_gym.evaluation.teacher_forced.report import escape_tex, file_name, markdown, tex, write_report
from dorothie_gym.evaluation.teacher_forced.terminal import print_details, print_table
from tests.evaluation.teacher_forced.corpora import corpus, oracle, wrong_moves


@pytest.fixture(scope="module")
def table(tmp_path_factory: pytest.TempPathFactory) -> ResultsTable:
    labels: CorpusLabels = labels_of(corpus(tmp_path_factory.mktemp("corpus")))
    predictions = [
        *oracle(labels, "a|b_c", 0),
        *oracle(labels, "a|b_c", 1),
        *(wrong_moves(labels, "TOTO", seed, share) for seed, share in enumerate((0.25, 0.5))),
        *(wrong_moves(labels, "TOTO (- Action History)", seed, 0.25) for seed in range(2)),
    ]
    return evaluate_predictions(predictions, labels, missing={"HuBERT Only": "no audio"})


def test_markdown_has_ours_in_bold_where_best_and_the_papers_beside(table: ResultsTable) -> None:
    text = markdown(table)
    (row,) = [line for line in text.splitlines() if line.startswith("| TOTO |")][:1]
    # Right of the 4 seen points: 2 and 4, so 75 per cent; t(0.975, 1) = 12.706 x 0.3536 / sqrt(2).
    assert row.split(" | ")[1:3] == ["TOTO", "75.0 ± 317.7 / 40.9 ± 3.9"]
    assert "| a/b_c | – | **100.0 ± 0.0** |" in text
    assert "| HuBERT Only (not run: no audio) | HuBERT Only | – / 35.7 ± 3.4 |" in text


def test_columns_of_the_papers_protocol_alone_have_its_figures(table: ResultsTable) -> None:
    lines = [line for line in markdown(table).splitlines() if line.startswith(("| model", "| TOTO |"))]
    heads, row = (line.split(" | ") for line in lines[:2])
    cells = dict(zip(heads, row, strict=True))
    assert "/" not in cells["UfN slot F1"] and cells["UfN slots (paper)"].endswith("/ 36.9 ± 0.0")
    assert "/" not in cells["NfD joint acc."]


def test_markdown_lists_findings_and_points(table: ResultsTable) -> None:
    text = markdown(table)
    assert "**Action history matters most" in text
    assert "UfN move accuracy, TOTO minus TOTO (- Action History): +25.0 ± 317.7, expected above 0: undecided" in text
    assert "Text alone leads" not in text, "none of its figures is there"
    assert "| sum | 5 | 60 | 20 | 15 | 25 | 0 |" in text


def test_markdown_names_corpus_and_encoder_of_each_training(table: ResultsTable) -> None:
    runs = {
        "0": {"corpus": "c0ffee", "encoder": "hashing", "epochs": 3},
        "1": {"corpus": "c0ffee", "encoder": "hashing"},
    }
    page = markdown(replace(table, about={"TOTO": runs}))
    assert page.count("Trained on the corpus c0ffee; text encoder hashing.") == 1
    assert "Trained on" not in markdown(replace(table, about={"ours": {"epochs": 3}}))


def test_latex_has_as_many_cells_in_each_row_and_escapes_names(table: ResultsTable) -> None:
    text = tex(table)
    rows = [line for line in text.splitlines() if line.endswith(r"\\") and "multicolumn" not in line]
    assert {line.count(" & ") for line in rows} == {9}
    assert r"a|b\_c" in text and r"TOTO ($-$ Action History)" in text
    assert r"$\mathbf{100.0_{\pm 0.0}}$" in text and r"\textcolor{gray}{$40.9_{\pm 3.9}$}" in text
    assert text.count(r"\begin{") == text.count(r"\end{") and r"\toprule" in text
    assert text.replace(r"\_", "").count("{") == text.count("}")


def test_letters_that_latex_reads_otherwise_are_escaped() -> None:
    assert escape_tex(r"50 % of a_b & c\d") == r"50 \% of a\_b \& c\textbackslash{}d"


def test_names_become_files() -> None:
    assert file_name("TOTO (- Action History)") == "toto-without-action-history"
    assert file_name("E.T. (+ Fine-tuned BERT)") == "e-t-with-fine-tuned-bert"  # a name of a user
    assert file_name("***") == "model"


def test_report_is_written_with_its_pictures(table: ResultsTable, tmp_path: Path) -> None:
    one = replace(table, runs=tuple(run for run in table.runs if run.model == "TOTO"))
    written = write_report(one, tmp_path / "new")
    names = [path.name for path in written]
    assert names == ["table.md", "table.tex", "table.json", "table.png", "confusion-toto.png"]
    for path in written[3:]:
        assert path.read_bytes().startswith(b"\x89PNG")
    page = json.loads((tmp_path / "new/table.json").read_text())
    assert page["models"]["TOTO"]["seen"]["ufn_move_accuracy"]["seeds"] == 2


def shown(table: ResultsTable, model: str | None = None, width: int = 150) -> str:
    console = Console(width=width, record=True, file=io.StringIO())
    if model is None:
        print_table(table, console)
    else:
        print_details(table, model, console)
    return console.export_text()


def test_terminal_shows_the_table_and_the_papers_figures_below(table: ResultsTable) -> None:
    text = shown(table)
    assert "Seen towns" in text and "Unseen towns" in text
    assert "100.0 ±0.0" in text and "40.9 ±3.9" in text and "not run: no audio" in text
    assert "undecided" in text and "flagged events" in text


def test_terminal_shows_classes_and_exceptions_of_a_model(table: ResultsTable) -> None:
    text = shown(table, "TOTO")
    assert "environmental exceptions, seen" in text and "UfN, right of" in text


def test_narrow_terminals_lose_nothing(table: ResultsTable) -> None:
    for model in (None, "TOTO"):
        assert "…" not in shown(table, model, width=80)


def test_every_form_names_the_row_of_the_paper_beside_a_model_that_is_called_otherwise(table: ResultsTable) -> None:
    runs = tuple(replace(run, model="Objects Only") if run.model == "TOTO" else run for run in table.runs)
    renamed = replace(table, runs=runs)
    (row,) = [line for line in markdown(renamed).splitlines() if line.startswith("| Objects Only |")][:1]
    assert row.split(" | ")[1:3] == ["Deformable-DETR Only", "75.0 ± 317.7 / 31.5 ± 0.0"]
    assert r"\textcolor{gray}{paper: Deformable-DETR Only}" in tex(renamed)
    assert r"\textcolor{gray}{paper} &" in tex(renamed), "TOTO (- Action History) is called so there, too"
    assert "paper: Deformable-DETR Only" in shown(renamed)
    assert renamed.to_json()["paper"]["rows"]["Objects Only"] == "Deformable-DETR Only"  # type: ignore[index]


def test_tables_without_figures_of_the_paper_have_no_column_for_its_rows(table: ResultsTable) -> None:
    own = replace(table, runs=tuple(run for run in table.runs if run.model == "a|b_c"), missing={})
    assert "the paper's row" not in markdown(own) and "the paper's row" in markdown(table)
