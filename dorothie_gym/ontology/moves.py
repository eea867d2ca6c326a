"""The dialogue moves."""

from __future__ import annotations

from dorothie_gym.ontology.labelled import LabelledInt


class DialogueMove(LabelledInt):
    """What a span of an utterance does to the talk; ids as in SDN (moves after Carletta et al. 1997)."""

    IRRELEVANT = 0, "Irrelevant"
    INSTRUCT = 1, "Instruct"
    EXPLAIN = 2, "Explain"
    ALIGN = 3, "Align"
    CHECK = 4, "Check"
    QUERY_YN = 5, "QueryYN"
    QUERY_W = 6, "QueryW"
    ACKNOWLEDGE = 7, "Acknowledge"
    CONFUSE = 8, "Confuse"
    CLARIFY = 9, "Clarify"
    CONFIRM = 10, "Confirm"
    REPLY_Y = 11, "ReplyY"
    REPLY_N = 12, "ReplyN"
    REPLY_U = 13, "ReplyU"
    REPLY_W = 14, "ReplyW"
