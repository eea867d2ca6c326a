import pytest
import torch
from torch.nn import functional as F

from dorothie_gym.baselines.toto.layers import Block, Dropout, GraphAttention, segment_softmax, time_encoding


@pytest.fixture(autouse=True)
def seeded():
    torch.manual_seed(0)


def test_time_encoding_uses_all_channels_and_is_unique():
    codes = time_encoding(torch.arange(0, 900, 0.5), 64)  # a session of 15 minutes
    assert codes.shape == (1800, 64)
    assert (codes.std(0)[:16] > 0.1).all()
    apart = torch.cdist(codes, codes) + 10 * torch.eye(1800)
    assert apart.min() > 0.1


def test_dropout_keeps_the_mean_and_drops_its_share():
    dropout = Dropout(0.1)
    dropped = dropout(torch.ones(400, 1000))
    assert abs(float((dropped == 0).float().mean()) - 26 / 256) < 2e-3
    assert abs(float(dropped.mean()) - 1) < 2e-3
    assert torch.equal(dropout.eval()(torch.ones(5)), torch.ones(5))


def test_graph_attention_equals_a_dense_implementation():
    graph = GraphAttention(6, 8, 2, 3).eval()
    nodes = torch.randn(5, 6)
    edges, kinds = torch.tensor([[0, 1, 2, 4, 3], [1, 2, 0, 0, 0]]), torch.tensor([0, 1, 2, 0, 1])
    found = graph(nodes, edges, kinds)
    hidden = graph.project(nodes).view(5, 2, 4)
    for target in range(5):
        sources = [*[(int(a), int(k)) for a, b, k in zip(*edges, kinds, strict=True) if b == target], (target, 3)]
        scores = torch.stack(
            [
                F.leaky_relu(
                    (hidden[a] * graph.to_source).sum(-1)
                    + (hidden[target] * graph.to_target).sum(-1)
                    + graph.of_edge.weight[k],
                    0.2,
                )
                for a, k in sources
            ]
        )
        weights = scores.softmax(0)  # (sources, heads)
        summed = sum(weights[row][:, None] * hidden[a] for row, (a, _) in enumerate(sources))
        torch.testing.assert_close(found[target], F.elu(summed.flatten() + graph.bias))


def test_graph_attention_of_two_graphs_in_one_is_that_of_each_alone():
    graph = GraphAttention(6, 8, 2, 3).eval()
    one, two = torch.randn(4, 6), torch.randn(7, 6)
    edges = torch.tensor([[0, 1, 2], [1, 2, 3]])
    kinds = torch.tensor([0, 1, 2])
    together = graph(torch.cat((one, two)), torch.cat((edges, edges + 4), 1), torch.cat((kinds, kinds)))
    torch.testing.assert_close(together[:4], graph(one, edges, kinds))
    torch.testing.assert_close(together[4:], graph(two, edges, kinds))


def test_softmax_of_segments_adds_up_to_one_even_where_scores_are_huge():
    scores = torch.tensor([[1e4], [1e4], [-1e4], [3.0]])
    share = segment_softmax(scores, torch.tensor([0, 0, 0, 1]), 2)
    torch.testing.assert_close(share, torch.tensor([[0.5], [0.5], [0.0], [1.0]]))


@pytest.mark.parametrize("dropout", [0.0, 0.2])
def test_masked_tokens_are_not_attended_to(dropout):
    block = Block(8, 2, 16, 0.0, dropout)
    tokens, mask = torch.randn(3, 6, 8), torch.ones(3, 6, dtype=torch.bool)
    mask[:, 4:] = False
    other = tokens.clone()
    other[:, 4:] = 100.0
    found = []
    for given in (tokens, other):
        torch.manual_seed(1)
        found.append(block(given, mask)[:, :4])
    torch.testing.assert_close(found[0], found[1])


def test_one_query_gives_the_same_token_as_all_queries():
    block = Block(8, 2, 16, 0.1, 0.1).eval()
    tokens, mask = torch.randn(3, 6, 8), torch.rand(3, 6) < 0.8
    mask[:, 0] = True
    torch.testing.assert_close(block(tokens, mask, tokens[:, :1]), block(tokens, mask)[:, :1])


def test_both_ways_of_attention_agree():
    slow, fast = Block(8, 2, 16, 0.0, 0.5), Block(8, 2, 16, 0.0, 0.0)
    fast.load_state_dict(slow.state_dict())
    tokens, mask = torch.randn(2, 5, 8), torch.tensor([[True] * 5, [True] * 3 + [False] * 2])
    mean = torch.stack([slow._attend(tokens, tokens, mask) for _ in range(600)]).mean(0)
    assert (mean - fast._attend(tokens, tokens, mask)).abs().max() < 0.1
