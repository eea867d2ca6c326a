from __future__ import annotations

import json
from pathlib import Path

import pytest

from dorothie_gym.archive import Task
from dorothie_gym.evaluation.teacher_forced import (
    COLUMNS,
    CorpusLabels,
    ModelVerdict,
    ResultsTable,
    evaluate_files,
    evaluate_predictions,
    labels_of,
    predict_floor,
    write_predictions,
)
from dorothie_gym.ontology import PhysicalAction
from tests.evaluation.teacher_forced.corpora import corpus, oracle, wrong_moves
from tests.session.recording.builders import physical, write
from tests.session.recording.dialogues import talk


@pytest.fixture(scope="module")
def labels(tmp_path_factory: pytest.TempPathFactory) -> CorpusLabels:
    return labels_of(corpus(tmp_path_factory.mktemp("corpus")))


def tables(labels: CorpusLabels) -> ResultsTable:
    return evaluate_predictions(
        [
            *oracle(labels, "ours"),
            *(wrong_moves(labels, "E.T.", seed, share) for seed, share in enumerate((0.5, 0.75))),
            *oracle(labels, "TOTO", shift=1),
        ],
        labels,
        missing={"HuBERT Only": "no audio"},
        about={"ours": {"encoder": "hashing"}},
    )


def test_models_stand_in_the_papers_order_and_others_after_them(labels: CorpusLabels) -> None:
    assert tables(labels).models == ("TOTO", "HuBERT Only", "E.T.", "ours")


def test_figures_are_means_over_seeds(labels: CorpusLabels) -> None:
    # The first half (three quarters) of 8 points is right: all 4 seen ones, and 0 (2) of the 4 unseen ones.
    table = tables(labels)
    assert table.estimate("E.T.", "seen", "ufn_move_accuracy").values == {0: 1.0, 1: 1.0}
    unseen = table.estimate("E.T.", "unseen", "ufn_move_accuracy")
    assert unseen.values == {0: 0.0, 1: 0.5} and unseen.mean == 0.25
    assert table.estimate("E.T.", "seen", "nfd_joint_accuracy").seeds == 0


def test_json_has_models_parts_and_metrics_by_name(labels: CorpusLabels) -> None:
    page = json.loads(json.dumps(tables(labels).to_json(), allow_nan=False))
    ours = page["models"]["ours"]
    assert sorted(ours) == ["seen", "unseen"]
    for key in COLUMNS:
        for name in (key, f"{key}_paper"):
            assert ours["unseen"][name] == {"mean": 1.0, "half_width": None, "seeds": 1, "values": {"0": 1.0}}
    assert "HuBERT Only" not in page["models"] and page["missing"] == {"HuBERT Only": "no audio"}
    assert page["paper"]["models"]["TOTO"]["seen"]["ufn_move_accuracy"] == {"mean": 0.409, "half_width": 0.039}
    assert page["about"] == {"ours": {"encoder": "hashing"}}
    assert sum(row["flagged"] for row in page["corpus"]["points"].values()) == 5 * 12


def test_json_has_classes_confusion_and_handled_exceptions(labels: CorpusLabels) -> None:
    page = tables(labels).to_json()
    assert page["per_class"]["ours"]["seen"]["ufn"]["Instruct"]["mean"] == 1.0
    assert "Align" not in page["per_class"]["ours"]["seen"]["ufn"], "it does not occur"
    assert sum(map(sum, page["confusion"]["E.T."]["seen"]["ufn"])) == 4 * 2, "the seeds are summed"
    assert len(page["classes"]["ufn"]) == 15 and len(page["classes"]["nfd"]) == 6
    kinds = page["by_handling"]["ours"]["seen"]
    assert sum(kind["points"]["nfd"] for kind in kinds.values()) == 5


def test_the_best_is_the_highest_mean_as_printed(labels: CorpusLabels) -> None:
    table = tables(labels)
    assert table.best("seen", "ufn_move_accuracy") == {"ours", "E.T."}
    assert table.best("unseen", "ufn_move_accuracy") == {"ours"}


def test_files_of_several_seeds_make_one_row(labels: CorpusLabels, tmp_path: Path) -> None:
    paths = [write_predictions(tmp_path / f"{s}.parquet", oracle(labels, "ours", s, shift=s)) for s in (0, 1)]
    table = evaluate_files(paths, labels)
    assert table.models == ("ours",)
    assert table.estimate("ours", "seen", "nfd_action_accuracy").values == {0: 1.0, 1: 0.0}


def test_majority_by_hand(tmp_path: Path) -> None:
    path = corpus(tmp_path, ("train", "test/seen"))
    train, test = labels_of(path, "train"), labels_of(path)
    table = evaluate_predictions(predict_floor("majority", train, test), test)
    figures = {
        key: table.estimate("majority", "seen", key).mean for key in table.to_json()["models"]["majority"]["seen"]
    }
    # UfN: Instruct (2 of 4); each slot value occurs in 1 of 4: none is predicted, which is right once.
    assert (figures["ufn_move_accuracy"], figures["ufn_slot_f1"], figures["ufn_slot_f1_paper"]) == (0.5, 0.0, 0.25)
    # RfN: Acknowledge (2 of 3), no slots; one of the three has one.
    assert figures["rfn_move_accuracy"] == figures["rfn_slot_f1_paper"] == pytest.approx(2 / 3)
    # NfD: JTurn (2 of 5) at -179 (the smaller of two equally common angles, 88 and -179).
    assert (figures["nfd_action_accuracy"], figures["nfd_joint_accuracy"]) == (0.4, 0.2)


def test_a_task_without_anything_to_learn_from_is_left_out_with_the_reason(tmp_path: Path) -> None:
    (tmp_path / "train").mkdir()
    write(tmp_path / "train/silent", [physical(1, PhysicalAction.STOP)])
    (tmp_path / "test").mkdir()
    write(tmp_path / "test/one", talk())
    train, test = labels_of(tmp_path, "train"), labels_of(tmp_path)
    table = evaluate_predictions(predict_floor("random", train, test), test)
    assert table.points("random", "all", Task.UFN) == 0 and table.points("random", "all", Task.NFD) == 5
    assert table.estimate("random", "all", "ufn_move_accuracy").mean is None
    assert {skipped.reason for skipped in table.runs[0].left_out} == {
        "the sessions to learn from have no point of the task"
    }


def test_findings_know_models_in_any_case(labels: CorpusLabels) -> None:
    runs = [wrong_moves(labels, name, seed, 0.5) for seed in (0, 1) for name in ("toto", "toto (- current utterance)")]
    utterance = evaluate_predictions(runs, labels).findings()[1]
    assert utterance.claims[0].difference.values == {0: 0.0, 1: 0.0}


def test_toto_is_held_against_the_floors_and_others_against_toto(labels: CorpusLabels) -> None:
    runs = [run for seed in (0, 1) for name in ("TOTO", "mine") for run in oracle(labels, name, seed)]
    runs += [run for seed in (0, 1) for run in predict_floor("majority", labels, labels, seed)]
    verdicts = {(found.statement, found.part): found.verdict for found in evaluate_predictions(runs, labels).findings()}
    assert verdicts["TOTO is above majority", "seen"] is ModelVerdict.HOLDS
    assert verdicts["mine is above TOTO", "unseen"] is ModelVerdict.UNDECIDED


@pytest.mark.parametrize("name", ["Text Only (Trained Encoder)", "Fine-tuned BERT Only"])
def test_findings_are_about_the_model_that_was_run_under_its_own_name(labels: CorpusLabels, name: str) -> None:
    runs = [run for seed in (0, 1) for model in ("TOTO", name) for run in oracle(labels, model, seed)]
    found = evaluate_predictions(runs, labels).findings()[2]
    assert {claim.higher for claim in found.claims} == {name, "TOTO"} == {claim.lower for claim in found.claims}
    assert all(claim.difference.seeds == 2 for claim in found.claims)
