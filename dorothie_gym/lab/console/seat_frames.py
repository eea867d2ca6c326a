"""Messages to the seats: the full state to a new browser, then changes, and pictures."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from dorothie_gym.lab.console.asked_steps import AskedSteps
from dorothie_gym.lab.console.connection import Connection, changes, encode
from dorothie_gym.lab.console.seat import EXPERIMENTER, Outgoing, PauseReason, RoomState, Seat
from dorothie_gym.lab.console.seating import SeatPlan
from dorothie_gym.lab.console.spectator_view import spectator_view
from dorothie_gym.lab.console.views import role_view, static_view
from dorothie_gym.lab.console.vocabulary import vocabulary
from dorothie_gym.ontology.roles import AGENT_ROLES, Role
from dorothie_gym.ontology.slots import ARRIVAL_DISTANCE
from dorothie_gym.session.config import CameraConfig
from dorothie_gym.session.recording.events import EndReason
from dorothie_gym.sim.ego.limits import PLANNED_BRAKING

if TYPE_CHECKING:
    from dorothie_gym.lab.console.config import ConsoleConfig
    from dorothie_gym.lab.console.lane_lookup import LaneLookup
    from dorothie_gym.lab.console.windscreen import Windscreen
    from dorothie_gym.session.session_engine import SessionEngine


@dataclass(frozen=True, kw_only=True)
class RoomStatus:
    """State of a room at a tick.

    Attributes:
        state: state of the room.
        why: reason of a pause; None if there is none.
        plans: plan of the seat of each role.
        policies: roles that a policy currently plays.
    """

    state: RoomState
    why: PauseReason | None
    plans: Mapping[Role, SeatPlan]
    policies: frozenset[Role]


class SeatFrames:
    """Messages of a room to the browsers at its seats.

    Args:
        engine: engine of the sessions.
        seats: seats by name.
        config: settings.
        places: lanes of the town.
        windscreen: pictures; None if there is none.

    Attributes:
        events: events of the session in JSON types, for spectators.
        asked: steps that the participant has asked for, shown to the Co-Wizard.
    """

    def __init__(
        self,
        engine: SessionEngine,
        seats: Mapping[str, Seat],
        config: ConsoleConfig,
        places: LaneLookup,
        windscreen: Windscreen | None,
    ) -> None:
        self._engine, self._seats, self._config, self._places = engine, seats, config, places
        self._windscreen = windscreen
        self.events: list[dict[str, Any]] = []
        self.asked = AskedSteps(engine)

    def of(self, status: RoomStatus) -> Iterator[Outgoing]:
        """Yields the message to each browser at a tick; none if nothing has changed."""
        for seat in self._seats.values():
            if not seat.connections:
                continue
            view = {**self._view(seat), **self._state(seat, status)}
            for connection in seat.connections:
                if not connection.greeted:
                    yield Outgoing(connection, encode(self._hello(seat, connection)))
                frame = self._news(seat, connection, view)
                if frame:
                    yield Outgoing(connection, encode({"k": "frame", **frame}))
            seat.refused = []

    def _news(self, seat: Seat, connection: Connection, view: dict[str, Any]) -> dict[str, Any]:
        frame = changes(view, connection.shown)
        connection.shown = view
        if seat.done > connection.done:
            frame["done"] = connection.done = seat.done
        if seat.refused:
            frame["refused"] = seat.refused
        if connection.talk < len(seat.talk.entries):
            frame["talk"] = seat.talk.entries[connection.talk :]
            connection.talk = len(seat.talk.entries)
        if seat.role is None and connection.events < len(self.events):
            frame["events"] = self.events[connection.events :]
            connection.events = len(self.events)
        return frame

    def _view(self, seat: Seat) -> dict[str, Any]:
        if seat.role is None:
            return spectator_view(self._engine.session, self._places)
        observation = self._engine.observations[seat.role.value]
        view = role_view(seat.role, observation, self._engine.mask(seat.role), self._places)
        return {**view, "asked": self.asked.words} if seat.role is Role.CO_WIZARD else view

    def _state(self, seat: Seat, status: RoomStatus) -> dict[str, Any]:
        state: dict[str, Any] = {
            "state": status.state.value,
            "why": None if status.why is None else status.why.value,
            "outcome": self._outcome() if status.state is RoomState.OVER else None,
        }
        if seat.name == EXPERIMENTER:
            state["seats"] = [self._seat_row(role, status) for role in AGENT_ROLES]
        return state

    def _outcome(self) -> dict[str, Any]:
        summary = self._engine.summary()
        return {
            "success": summary["success"],
            "seconds": summary["seconds"],
            "subgoals": dict(summary["subgoals"]),
            "reason": summary.get("reason", EndReason.TECHNICAL.value),
        }

    def _seat_row(self, role: Role, status: RoomStatus) -> dict[str, Any]:
        seat = self._seats.get(role.value)
        present = seat is not None and seat.present
        return {
            "role": role.value,
            "plan": status.plans[role].label,
            "present": present,
            "by": "policy" if role in status.policies else "person" if present else "nobody",
        }

    def _hello(self, seat: Seat, connection: Connection) -> dict[str, Any]:
        connection.greeted = True
        connection.shown, connection.talk, connection.events = {}, 0, 0
        connection.done = seat.done = 0
        town = self._engine.town
        observed = self._engine.observations[(seat.role or Role.AD_WIZARD).value]
        return {
            "k": "hello",
            "seat": seat.name,
            "town": town.name,
            "traffic": str(town.traffic),
            "rate": self._config.decision_frequency,
            "pictures": self._windscreen is not None and seat.role is not Role.AD_WIZARD,
            "repeatable": self._config.repeatable,
            "speech": self._config.speech and seat.role in (Role.PARTICIPANT, Role.CO_WIZARD),
            "vocabulary": vocabulary(),
            "stop": {"within": ARRIVAL_DISTANCE, "braking": PLANNED_BRAKING},
            "camera": self._camera(),
            **static_view(observed, town),
        }

    def _camera(self) -> dict[str, float]:
        """Returns the geometry of the pictures: browsers mark places above them, nothing is drawn into them."""
        camera = self._engine.config.camera or CameraConfig()
        mount = camera.mount
        return {"view": camera.field_of_view, "forward": mount.forward, "up": mount.up, "pitch": mount.pitch}

    # --- pictures ---------------------------------------------------------------------------------------------------

    def pictures(self, *, advanced: bool) -> list[Outgoing]:
        """Returns the picture through the windscreen for each browser whose next picture is due.

        Args:
            advanced: whether a decision was played at this tick.
        """
        session = self._engine.session
        if self._windscreen is None:
            return []
        due = [
            connection
            for seat in self._seats.values()
            if seat.role is not Role.AD_WIZARD
            for connection in seat.connections
            if connection.rate and self._is_due(connection, advanced)
        ]
        if not due or not self._windscreen.is_ready(session):
            return []
        picture = self._windscreen.picture(session)
        for connection in due:
            connection.pictured = session.decisions
        return [Outgoing(connection, picture=picture) for connection in due]

    def _is_due(self, connection: Connection, advanced: bool) -> bool:
        """Returns whether to send a browser a picture: the first one, and then at its rate."""
        decision = self._engine.session.decisions
        if connection.pictured is None or connection.pictured > decision:
            return True
        every = self._config.decision_frequency / connection.rate
        return advanced and decision - connection.pictured >= every - 0.5
