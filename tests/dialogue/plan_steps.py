"""Steps of plans as tests write them, and the plan of a text."""

from dorothie_gym.dialogue import DrivingPlan, understand

AT = "at"


def step(action, relation=None, where=None, **fields):
    condition = {} if relation is None else {"condition": {"relation": relation, "place": where}}
    return {"action": action, **fields, **condition}


def planned(text):
    return understand(text).plan


def matches(text, *steps):
    assert planned(text) == DrivingPlan.from_json(list(steps)), (text, planned(text).describe())


PERSON = {"landmark": "Person"}
KFC, IKEA, SHELL = {"landmark": "KFC"}, {"landmark": "Ikea"}, {"landmark": "Shell"}
LIGHTS, BRIDGE = {"object": "TrafficLight"}, {"object": "Bridge"}
