import pytest

from dorothie_gym.ontology import PropKind


def test_names_are_those_of_the_original_tool() -> None:
    assert {kind.value for kind in PropKind} == {
        "tree", "constructioncone", "dumpster", "streetbarrier", "trafficcone", "trafficsign",
    }  # fmt: skip


@pytest.mark.parametrize("kind", PropKind)
def test_sizes_are_those_of_street_furniture(kind: PropKind) -> None:
    assert 0.05 < kind.length < 4 and 0.05 < kind.width < 4 and 0.3 < kind.height < 10


def test_barrier_blocks_with_its_width() -> None:
    assert PropKind.STREET_BARRIER.width > 2 > PropKind.STREET_BARRIER.length


def test_kind_is_found_by_name() -> None:
    assert PropKind("trafficcone") is PropKind.TRAFFIC_CONE
    assert PropKind.TRAFFIC_CONE.blueprint == "static.prop.trafficcone"
