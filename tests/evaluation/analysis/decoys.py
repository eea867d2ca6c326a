"""Talk that looks like a phenomenon, and is not; and the forms that the first examples have not."""

from __future__ import annotations

from dorothie_gym.ontology import (
    LandmarkName,
    MentalAction,
    PhysicalAction,
    StreetName,
)
from tests.evaluation.analysis.builders import (
    BAITS,
    CAR,
    COCO,
    FULLER,
    HOUSE,
    HUMAN,
    IKEA,
    KFC,
    OBJ,
    TURNED,
    A,
    M,
    Make,
    S,
    act,
    believed,
    car,
    did,
    exception,
    hazard,
    human,
    said,
    subgoal,
    talk,
)

SKY = exception(1.0, "weather", parameter="fog_density", value=80.0)
CLEAR = exception(30.0, "weather", parameter="fog_density", value=2.0)
CHANGED = exception(1.0, "task_change", subgoal=0, landmark="Coco", status="Ongoing")

OTHERS: list[tuple[int, str, Make]] = [
    (5, "yes", lambda: talk(car(1.0, "on we go", M.QUERY_YN, A.LANE_FOLLOW), human(3.0, "sure", M.REPLY_Y))),
    (6, "confirmed", lambda: talk(car(1.0, "KFC, then", M.CHECK, KFC), human(3.0, "that one", M.CONFIRM))),
    (7, "understood", lambda: talk(human(1.0, "got me", M.ALIGN), car(3.0, "I have", M.ACKNOWLEDGE))),
    (9, "instructed", lambda: talk(
        exception(1.0, "place_prop", x=60.0, y=0.0),
        car(8.0, "something lies across our lane", M.EXPLAIN, OBJ.STATIC),
        human(11.0, "round it over Fuller", M.INSTRUCT, FULLER),
        did(15.0, PhysicalAction.U_TURN),
    )),
    (10, "lights", lambda: talk(
        exception(1.0, "weather", parameter="sun_altitude_angle", value=-40.0),
        human(4.0, "and the lights", M.QUERY_YN, A.LIGHT_CHANGE),
        car(6.0, "they are on", M.REPLY_Y),
    )),
    (11, "taken up", lambda: talk(
        exception(1.0, "task_trigger", subgoal=1, landmark="Ikea", status="Ongoing"),
        human(4.0, "Ikea has to be fitted in", M.EXPLAIN, IKEA),
        car(7.0, "noted", M.ACKNOWLEDGE),
    )),
    (12, "in two steps", lambda: talk(
        CHANGED,
        human(3.0, "no Ikea today", M.EXPLAIN, IKEA, S.ABANDONED),
        car(6.0, "no Ikea", M.ACKNOWLEDGE),
        human(9.0, "Coco it is", M.INSTRUCT, COCO),
        car(12.0, "fine", M.ACKNOWLEDGE),
    )),
    (13, "given up", lambda: talk(
        exception(1.0, "task_delete", subgoal=0, landmark="KFC", status="Abandoned"),
        human(4.0, "leave KFC out", M.INSTRUCT, KFC, S.ABANDONED),
    )),
    (14, "asked", lambda: talk(
        subgoal(5.0, "KFC", "Complete"), car(7.0, "and now", M.QUERY_W, LandmarkName.QUERIED),
        human(9.0, "Ikea", M.REPLY_W, IKEA),
    )),
    (15, "seen", lambda: talk(human(1.0, "is it red", M.QUERY_YN, OBJ.TRAFFIC_LIGHT), car(3.0, "it is", M.REPLY_Y))),
    (18, "answered", lambda: talk(
        did(5.0, PhysicalAction.J_TURN, angle=80.0),
        human(8.0, "you missed the turn", M.EXPLAIN),
        car(10.0, "sorry", M.ACKNOWLEDGE),
    )),
    (20, "car", lambda: talk(car(1.0, "people like my voice", M.IRRELEVANT))),
    (21, "dropped", lambda: talk(
        car(1.0, "which way", M.QUERY_W, A.QUERIED), car(20.0, "a lorry ahead", M.EXPLAIN, OBJ.VEHICLES)
    )),
    (22, "car", lambda: talk(car(1.0, "shall I stop on the other side", M.QUERY_YN, A.STOP))),
    (23, "accepted", lambda: talk(
        said(3.0, CAR, ("Fuller is shorter", act(M.EXPLAIN, FULLER)), ("do we take it", act(M.QUERY_YN, FULLER))),
        human(6.0, "by all means", M.REPLY_Y),
    )),
    (24, "not understood", lambda: talk(
        human(1.0, "drive up to ikea", M.INSTRUCT, IKEA, recognised="drive up to a key"),
        car(4.0, "to what", M.CONFUSE),
        human(7.0, "I said ikea", M.INSTRUCT, IKEA),
    )),
]  # fmt: skip
"""The forms that `PRESENT` has not."""

DECOYS: list[tuple[int, str, Make]] = [
    (1, "a place is given up", lambda: talk(
        human(1.0, "forget the KFC", M.INSTRUCT, KFC, S.ABANDONED), car(3.0, "forgotten", M.ACKNOWLEDGE))),
    (1, "the answer is to something else", lambda: talk(
        human(1.0, "KFC first", M.INSTRUCT, KFC), human(4.0, "slower", M.INSTRUCT, A.SPEED_CHANGE),
        car(6.0, "slower it is", M.ACKNOWLEDGE, A.SPEED_CHANGE))),
    (2, "speed is no step", lambda: talk(
        human(1.0, "slower", M.INSTRUCT, A.SPEED_CHANGE), car(3.0, "fine", M.ACKNOWLEDGE))),
    (3, "a cough is no act", lambda: talk(
        said(1.0, HUMAN, ("ahem", act(M.IRRELEVANT)), ("left", act(M.INSTRUCT, A.J_TURN))))),
    (4, "stopping is no way", lambda: talk(
        car(1.0, "what now", M.QUERY_W, A.QUERIED), human(3.0, "stop", M.REPLY_W, A.STOP), TURNED)),
    (4, "nobody answers", lambda: talk(car(1.0, "left or right", M.QUERY_W, A.QUERIED), TURNED)),
    (5, "the yes is to a check", lambda: talk(
        car(1.0, "drive on", M.QUERY_YN, A.LANE_FOLLOW), car(3.0, "to KFC", M.CHECK, KFC),
        human(5.0, "just so", M.CONFIRM))),
    (6, "the human checks", lambda: talk(human(1.0, "KFC, then", M.CHECK, KFC), car(3.0, "yes", M.CONFIRM))),
    (7, "nobody answers", lambda: talk(human(1.0, "got me", M.ALIGN))),
    (8, "the name once more describes nothing", lambda: talk(
        car(1.0, "I can't find your house", M.EXPLAIN, HOUSE, S.UNKNOWN),
        human(4.0, "well, the house", M.REPLY_W, HOUSE),
        believed(6.0, MentalAction.KNOWLEDGE_UPDATE, landmark="House", x=1.0, y=2.0))),
    (8, "the car guessed before it was told", lambda: talk(
        car(1.0, "I can't find your house", M.EXPLAIN, HOUSE, S.UNKNOWN),
        believed(3.0, MentalAction.KNOWLEDGE_UPDATE, landmark="House", x=1.0, y=2.0),
        human(20.0, "on Fuller", M.REPLY_W, FULLER))),
    (8, "the place is on the map", lambda: talk(
        car(1.0, "what is KFC doing", M.EXPLAIN, KFC, S.UNKNOWN),
        human(4.0, "on Fuller", M.REPLY_W, FULLER),
        believed(6.0, MentalAction.KNOWLEDGE_UPDATE, landmark="KFC", x=1.0, y=2.0))),
    (9, "there is nothing on the road", lambda: talk(
        car(8.0, "a sign", M.EXPLAIN, OBJ.TRAFFIC_SIGN), car(11.0, "left", M.QUERY_YN, A.J_TURN),
        human(14.0, "yes", M.REPLY_Y), did(16.0, PhysicalAction.J_TURN, angle=80.0))),
    (9, "it lies where the car never comes", lambda: talk(
        exception(1.0, "place_prop", x=-900.0, y=0.0),
        car(8.0, "a sign", M.EXPLAIN, OBJ.TRAFFIC_SIGN), car(11.0, "left", M.QUERY_YN, A.J_TURN),
        human(14.0, "yes", M.REPLY_Y), did(16.0, PhysicalAction.J_TURN, angle=80.0))),
    (10, "the fog has gone", lambda: talk(
        SKY, CLEAR, human(34.0, "slow down", M.INSTRUCT, A.SPEED_CHANGE), car(37.0, "fine", M.ACKNOWLEDGE))),
    (10, "faster is not slower", lambda: talk(
        SKY, human(4.0, "speed up", M.INSTRUCT, A.SPEED_CHANGE), car(7.0, "fine", M.ACKNOWLEDGE),
        did(8.0, PhysicalAction.SPEED_CHANGE, up=True))),
    (10, "a little mist", lambda: talk(
        exception(1.0, "weather", parameter="fog_density", value=5.0),
        human(4.0, "slow down", M.INSTRUCT, A.SPEED_CHANGE), car(7.0, "fine", M.ACKNOWLEDGE))),
    (11, "a question tells of nothing", lambda: talk(
        exception(1.0, "task_trigger", subgoal=1, landmark="Ikea", status="Ongoing"),
        human(4.0, "is that Ikea", M.QUERY_YN, IKEA), car(7.0, "yes", M.REPLY_Y))),
    (12, "other places are swapped", lambda: talk(
        CHANGED, human(4.0, "no Ikea but KFC", M.INSTRUCT, IKEA, KFC, S.ABANDONED, S.ONGOING),
        car(7.0, "KFC", M.CONFIRM, KFC))),
    (12, "nobody takes it up", lambda: talk(
        CHANGED, human(4.0, "no Ikea but Coco", M.INSTRUCT, IKEA, COCO, S.ABANDONED, S.ONGOING))),
    (13, "it was given up before", lambda: talk(
        human(1.0, "leave KFC out", M.EXPLAIN, KFC, S.ABANDONED),
        exception(10.0, "task_delete", subgoal=0, landmark="KFC", status="Abandoned"))),
    (14, "another place is done", lambda: talk(
        subgoal(5.0, "KFC", "Complete"), human(7.0, "Ikea is done", M.EXPLAIN, S.COMPLETE, IKEA))),
    (15, "the car asks", lambda: talk(car(1.0, "see him", M.QUERY_YN, OBJ.PEDESTRIAN), human(3.0, "yes", M.REPLY_Y))),
    (16, "why not is a proposal", lambda: talk(
        hazard(1.0), human(2.0, "why not take Baits", M.QUERY_YN, BAITS), car(4.0, "too long", M.EXPLAIN))),
    (16, "nobody answers", lambda: talk(hazard(1.0), human(2.0, "why are we standing", M.QUERY_W, A.STOP))),
    (17, "the answer tells no way", lambda: talk(
        human(1.0, "which way are we going", M.QUERY_W, A.QUERIED), car(3.0, "a good one", M.REPLY_W))),
    (18, "lunch was missed, no turn", lambda: talk(
        did(5.0, PhysicalAction.J_TURN, angle=80.0), human(8.0, "I missed lunch", M.EXPLAIN),
        car(10.0, "sorry", M.ACKNOWLEDGE))),
    (18, "talk of something else", lambda: talk(
        did(5.0, PhysicalAction.J_TURN, angle=80.0),
        said(8.0, HUMAN, ("that film went wrong", act(M.IRRELEVANT)), ("so long", act(M.EXPLAIN))),
        car(10.0, "sorry", M.ACKNOWLEDGE))),
    (19, "one of them is not answered", lambda: talk(
        human(1.0, "take Baits", M.INSTRUCT, BAITS), car(1.5, "what street", M.QUERY_W, StreetName.QUERIED),
        human(4.0, "Baits", M.REPLY_W, BAITS))),
    (21, "the session ends before", lambda: talk(car(55.0, "which way", M.QUERY_W, A.QUERIED))),
    (21, "a command answers", lambda: talk(
        car(1.0, "which way", M.QUERY_W, A.QUERIED), human(6.0, "left", M.INSTRUCT, A.J_TURN))),
    (22, "not there yet", lambda: talk(
        human(1.0, "we are almost there", M.EXPLAIN), car(4.0, "is there a jam", M.QUERY_YN))),
    (22, "talk of something else", lambda: talk(human(1.0, "my sister lives on the other side", M.IRRELEVANT))),
    (23, "the reason has nothing to do with it", lambda: talk(
        car(1.0, "the battery is full", M.EXPLAIN), car(5.0, "shall we use Fuller", M.QUERY_YN, FULLER),
        human(8.0, "no", M.REPLY_N))),
    (24, "the name had been said before", lambda: talk(
        human(1.0, "KFC is where we go", M.INSTRUCT, KFC, recognised="kfc is where we go"),
        human(6.0, "left", M.INSTRUCT, A.J_TURN, recognised="theft"),
        car(9.0, "left, on the way to KFC", M.CONFIRM, KFC),
        human(12.0, "left, yes", M.INSTRUCT, A.J_TURN))),
    (24, "it was heard right", lambda: talk(
        human(1.0, "drive up to ikea", M.INSTRUCT, IKEA, recognised="Drive up to IKEA."),
        car(4.0, "to KFC", M.CONFIRM, KFC), human(7.0, "no, ikea", M.CLARIFY, IKEA))),
]  # fmt: skip
"""Talk that looks like the phenomenon, and is not."""
