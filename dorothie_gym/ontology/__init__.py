"""Closed vocabularies: roles, dialogue moves, slots, actions, exceptions, and their spellings in files.

Depends on the standard library only; all other packages depend on this one.

The vocabularies are closed: moves, slot values and actions keep the numbers of SDN, so that the same models read its
corpus and ours, and spaces have one entry for each member. Landmark kinds are closed for the same reason. When a list
grows:

- Models with an input or output for each member become incompatible. The shipped models that read moves, landmarks or
  weather are refused until they are trained again (`python benchmarks/pretrained.py`).
- Scripted roles and storyboards draw from the lists: the sessions of a seed change.
- Recordings have a column for each weather parameter; those without the new one are refused.
- New members go to the end, with a number that no recording, model or layout of SDN uses.

A table with an entry for each member is made with `labelled_enums.complete`. Importing its module then fails with an
error that names the missing member and the file. docs/changes.md lists the files of each change.
"""

from dorothie_gym.errors import OntologyError
from dorothie_gym.ontology.actions import (
    ADAPTIVE_ACTIONS,
    EPISTEMIC_ACTIONS,
    LANE_SWITCH_LEFT,
    LANE_SWITCH_RIGHT,
    NAVIGATION_ACTIONS,
    SPEED_STEP,
    U_TURN_ANGLE,
    ActionGroup,
    ArgumentKind,
    MentalAction,
    PhysicalAction,
)
from dorothie_gym.ontology.dialogue_acts import (
    DECISION_TREE,
    LABEL_INDEX,
    LABELS,
    MOVE_GROUPS,
    SLOT_SPANS,
    VECTOR_SLOTS,
    Answer,
    DialogueAct,
    DialogueMove,
    DialogueUnit,
    MoveGroup,
    Node,
    Question,
    TreePath,
    UnitEnd,
    decode_slots,
    encode_slots,
    groups_of,
    in_label_order,
    path_to,
    paths,
    walk,
)
from dorothie_gym.ontology.roles import (
    AGENT_ROLES,
    Capability,
    Role,
    Sight,
)
from dorothie_gym.ontology.slots import (
    ARRIVAL_DISTANCE,
    SLOT_VALUES,
    ActionValue,
    GoalStatus,
    LandmarkName,
    ObjectClass,
    Slot,
    SlotValue,
    StreetName,
)
from dorothie_gym.ontology.spellings import (
    parse_act,
    parse_action_value,
    parse_exception,
    parse_goal_status,
    parse_landmark,
    parse_mental_action,
    parse_move,
    parse_object_class,
    parse_physical_action,
    parse_prop,
    parse_role,
    parse_sensor,
    parse_slot,
    parse_slot_value,
    parse_street,
    parse_weather_parameter,
)
from dorothie_gym.ontology.world_exceptions import (
    ExceptionKind,
    PropKind,
    Sensor,
    WeatherParameter,
)

__all__ = [
    "ADAPTIVE_ACTIONS",
    "AGENT_ROLES",
    "ARRIVAL_DISTANCE",
    "DECISION_TREE",
    "EPISTEMIC_ACTIONS",
    "LABELS",
    "LABEL_INDEX",
    "LANE_SWITCH_LEFT",
    "LANE_SWITCH_RIGHT",
    "MOVE_GROUPS",
    "NAVIGATION_ACTIONS",
    "SLOT_SPANS",
    "SLOT_VALUES",
    "SPEED_STEP",
    "U_TURN_ANGLE",
    "VECTOR_SLOTS",
    "ActionGroup",
    "ActionValue",
    "Answer",
    "ArgumentKind",
    "Capability",
    "DialogueAct",
    "DialogueMove",
    "DialogueUnit",
    "ExceptionKind",
    "GoalStatus",
    "LandmarkName",
    "MentalAction",
    "MoveGroup",
    "Node",
    "ObjectClass",
    "OntologyError",
    "PhysicalAction",
    "PropKind",
    "Question",
    "Role",
    "Sensor",
    "Sight",
    "Slot",
    "SlotValue",
    "StreetName",
    "TreePath",
    "UnitEnd",
    "WeatherParameter",
    "decode_slots",
    "encode_slots",
    "groups_of",
    "in_label_order",
    "parse_act",
    "parse_action_value",
    "parse_exception",
    "parse_goal_status",
    "parse_landmark",
    "parse_mental_action",
    "parse_move",
    "parse_object_class",
    "parse_physical_action",
    "parse_prop",
    "parse_role",
    "parse_sensor",
    "parse_slot",
    "parse_slot_value",
    "parse_street",
    "parse_weather_parameter",
    "path_to",
    "paths",
    "walk",
]
