"""The closed vocabularies: roles, moves, slots, actions, exceptions, and how files spell them.

Standard library only; everything else in the package builds on this.
"""

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
from dorothie_gym.ontology.acts import (
    DialogueAct,
)
from dorothie_gym.ontology.decision_tree import (
    DECISION_TREE,
    MOVE_GROUPS,
    Answer,
    MoveGroup,
    Node,
    Path,
    Question,
    groups_of,
    path_to,
    paths,
    walk,
)
from dorothie_gym.ontology.errors import (
    OntologyError,
)
from dorothie_gym.ontology.exceptions import (
    ExceptionKind,
    Sensor,
)
from dorothie_gym.ontology.labels import (
    LABEL_INDEX,
    LABELS,
    SLOT_SPANS,
    VECTOR_SLOTS,
    decode_slots,
    encode_slots,
    in_label_order,
)
from dorothie_gym.ontology.moves import (
    DialogueMove,
)
from dorothie_gym.ontology.props import (
    PropKind,
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
from dorothie_gym.ontology.units import (
    DialogueUnit,
    UnitEnd,
)
from dorothie_gym.ontology.weather import (
    WeatherParameter,
)

__all__ = [
    "ADAPTIVE_ACTIONS",
    "AGENT_ROLES",
    "ARRIVAL_DISTANCE",
    "ActionGroup",
    "ActionValue",
    "Answer",
    "ArgumentKind",
    "Capability",
    "DECISION_TREE",
    "DialogueAct",
    "DialogueMove",
    "DialogueUnit",
    "EPISTEMIC_ACTIONS",
    "ExceptionKind",
    "GoalStatus",
    "LABELS",
    "LABEL_INDEX",
    "LANE_SWITCH_LEFT",
    "LANE_SWITCH_RIGHT",
    "LandmarkName",
    "MOVE_GROUPS",
    "MentalAction",
    "MoveGroup",
    "NAVIGATION_ACTIONS",
    "Node",
    "ObjectClass",
    "OntologyError",
    "Path",
    "PhysicalAction",
    "PropKind",
    "Question",
    "Role",
    "SLOT_SPANS",
    "SLOT_VALUES",
    "SPEED_STEP",
    "Sensor",
    "Sight",
    "Slot",
    "SlotValue",
    "StreetName",
    "U_TURN_ANGLE",
    "UnitEnd",
    "VECTOR_SLOTS",
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
