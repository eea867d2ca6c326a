import pickle

from dorothie_gym.ontology import DialogueMove


def test_ids_run_from_0_to_14_in_sdn_order() -> None:
    spec = (
        "Irrelevant Instruct Explain Align Check QueryYN QueryW Acknowledge Confuse "
        "Clarify Confirm ReplyY ReplyN ReplyU ReplyW"
    )
    assert [(int(move), move.label) for move in DialogueMove] == list(enumerate(spec.split()))


def test_move_is_found_by_number_and_survives_pickling() -> None:
    assert DialogueMove(5) is DialogueMove.QUERY_YN
    assert pickle.loads(pickle.dumps(DialogueMove.REPLY_U)) is DialogueMove.REPLY_U
