"""Room of one session: seats, arrivals and departures of people, the session's clock, and the messages to each seat."""

from __future__ import annotations

import logging
import secrets
from collections import deque
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import filterpy.kalman  # noqa: F401  # takes a second, for which nobody at a seat should wait: see `beliefs.refined`

from dorothie_gym.evaluation.rollout.replay import recorded_actions
from dorothie_gym.lab.console import messages as m
from dorothie_gym.lab.console.attendance import is_missing, is_ready, overdue, pause_reason
from dorothie_gym.lab.console.config import AfterAbsence, ConsoleConfig
from dorothie_gym.lab.console.connection import CloseCode, Connection, encode
from dorothie_gym.lab.console.inbox import SeatInbox
from dorothie_gym.lab.console.lane_lookup import lane_lookup
from dorothie_gym.lab.console.messages import MessageError
from dorothie_gym.lab.console.players import Players
from dorothie_gym.lab.console.resuming import SEATS, Resumed
from dorothie_gym.lab.console.room_calls import Arrival, Call, Departure, End, Receipt, Start
from dorothie_gym.lab.console.room_record import RoomRecord, free_folder
from dorothie_gym.lab.console.seat import EXPERIMENTER, SPECTATOR, Outgoing, PauseReason, RoomState, Seat
from dorothie_gym.lab.console.seat_frames import RoomStatus, SeatFrames
from dorothie_gym.lab.console.seating import Occupancy, SeatPlan, plan_labels
from dorothie_gym.lab.console.spectator_view import event_rows
from dorothie_gym.lab.console.speech_input import act_json, read_act, read_typed, with_session_names
from dorothie_gym.lab.console.talk_log import TalkLog
from dorothie_gym.lab.console.windscreen import Windscreen
from dorothie_gym.ontology.roles import AGENT_ROLES, Role
from dorothie_gym.session.recording.events import EndReason
from dorothie_gym.session.recording.files import safe_name
from dorothie_gym.session.recording.seat_log import SeatEvent, SeatEventKind

if TYPE_CHECKING:
    from dorothie_gym.session.session_engine import SessionEngine
    from dorothie_gym.session.spaces.actions import ActionMapping

logger = logging.getLogger(__name__)


class Room:
    """Room of one session after the other, with the same seats.

    The thread of the event loop calls `join`, `leave`, `receive`, `start` and `end`, which only append to a queue;
    all other work is done in `tick`, which one thread at a time may call.

    Args:
        engine: engine of the sessions.
        plans: plan of the seat of each role.
        config: settings.
        seed: seed of the first session; each further one has the next number.
        folder: folder in which each session is recorded in a folder of its own; None records nothing.
        name: name of the folder of a session; None names it by the town and a random number, since people at the seats
            may see the name, and storyboard and seed would reveal the errands.
        extra: further fields of the header of the record (JSON types).
        resumed: interrupted session that the first session resumes; the engine is then one of `begin_replay`.

    Attributes:
        engine: see above.
        config: see above.
        seats: seats by name; roles that a policy plays have none.
        state: state of the room.
        windscreen: pictures through the windscreen; None if there are none.
        record: record of the current session; None if it is not recorded.
        failed: whether an error of the program ended the room.
    """

    def __init__(
        self,
        engine: SessionEngine,
        plans: Mapping[Role, SeatPlan],
        config: ConsoleConfig,
        *,
        seed: int = 0,
        folder: Path | None = None,
        name: str | None = None,
        extra: Mapping[str, object] | None = None,
        resumed: Resumed | None = None,
    ) -> None:
        self.engine, self.config = engine, config
        self._plans, self._seed, self._folder, self._name = dict(plans), seed, folder, name
        self._extra = {**(extra or {}), SEATS: plan_labels(self._plans)}
        self._places = lane_lookup(engine.town_of(seed))
        self.seats = {seat.name: seat for seat in self._make_seats()}
        self.state = RoomState.WAITING
        self.windscreen = Windscreen(config) if config.pictures else None
        self._frames = SeatFrames(engine, self.seats, config, self._places, self.windscreen)
        self.record: RoomRecord | None = None
        self.failed = False
        self._early: list[SeatEvent] = []
        self._calls: deque[Call] = deque()
        self._held = self._started = False
        self._why: PauseReason | None = None
        self._stopped_at = 0.0
        self._players = Players(engine, self._plans)
        self._begin(resumed)

    def _make_seats(self) -> Iterator[Seat]:
        for role in AGENT_ROLES:
            plan = self._plans[role]
            if plan.occupancy is not Occupancy.POLICY:
                inbox = SeatInbox(role, self.engine.limits, self._places)
                yield Seat(role.value, role, plan, TalkLog(role), inbox)
        for name in (EXPERIMENTER, SPECTATOR):
            yield Seat(name, None, None, TalkLog(None))

    # --- calls of the event loop ------------------------------------------------------------------------------------

    def join(self, seat: Seat, connection: Connection) -> None:
        """Seats a browser at the next tick; at the seat of a role it replaces the one before."""
        self._calls.append(Arrival(seat, connection))

    def leave(self, seat: Seat, connection: Connection) -> None:
        """Records at the next tick that a connection has ended."""
        self._calls.append(Departure(seat, connection))

    def receive(self, seat: Seat, connection: Connection, message: m.Incoming) -> None:
        """Carries out a message at the next tick."""
        self._calls.append(Receipt(seat, connection, message))

    def start(self) -> None:
        """Begins the session at the next tick; policies play for the people who are missing."""
        self._calls.append(Start())

    def end(self, reason: EndReason) -> None:
        """Ends the session at the next tick, if it is not over; one that has not begun leaves no record."""
        self._calls.append(End(reason))

    def keep_audio(self, seat: Seat, flac: bytes) -> str | None:
        """Keeps the recording of a spoken turn with the session; returns its name, or None without a record."""
        record = self.record
        if record is None or self.state is RoomState.OVER:
            return None
        name = record.add_audio(seat.name, flac)
        if name is not None:
            seat.recordings.add(name)
        return name

    @property
    def wants_pictures(self) -> bool:
        """Whether a browser has requested pictures through the windscreen."""
        return any(connection.rate for seat in self._all() for connection in seat.connections)

    @property
    def is_quiet(self) -> bool:
        """Whether the session is idle and no browser watches it."""
        return self.state is not RoomState.RUNNING and not self._calls and not any(s.present for s in self._all())

    # --- a tick -----------------------------------------------------------------------------------------------------

    def tick(self, now: float) -> list[Outgoing]:
        """Handles incoming messages, steps the session by one decision if it runs, and returns outgoing messages.

        Args:
            now: clock that does not jump [s].
        """
        out: list[Outgoing] = []
        while self._calls:
            self._handle(self._calls.popleft(), now, out)
        self._update_state(now)
        advanced = self.state is RoomState.RUNNING
        if advanced:
            self._advance()
        status = self._status()
        out.extend(self._frames.of(status))
        out.extend(self._frames.pictures(advanced=advanced))
        return out

    def fail(self) -> list[Outgoing]:
        """Aborts the session after an internal error; its recording stays as it was at the last decision."""
        self.state, self.failed = RoomState.OVER, True
        if self.record is not None:
            try:
                self.record.close()
            except OSError as error:  # such as a full disk: people must be told in any case that the session has ended
                logger.warning("the record of a session that failed could not be closed: %s", error)
        return [Outgoing(each, code=CloseCode.FAILED) for seat in self._all() for each in seat.connections]

    def shut_down(self) -> list[Outgoing]:
        """Ends a session that is in progress because the program stops."""
        if self.state is not RoomState.OVER:
            self._break_off(EndReason.TECHNICAL)
        out = list(self._frames.of(self._status()))
        out += [Outgoing(each, code=CloseCode.RESTART) for seat in self._all() for each in seat.connections]
        return out

    def suspend(self) -> list[Outgoing]:
        """Interrupts a session that is in progress because the program stops: a new program can resume it."""
        if self.record is not None:
            self.record.close()
        return [Outgoing(each, code=CloseCode.RESTART) for seat in self._all() for each in seat.connections]

    # --- sessions ---------------------------------------------------------------------------------------------------

    def _begin(self, resumed: Resumed | None = None) -> None:
        """Begins a session, and its record; or plays an interrupted one again to where it was."""
        engine = self.engine
        if resumed is None:
            engine.reset(seed=self._seed)
        self._players.begin(self._seed)
        for seat in self._all():
            seat.talk = TalkLog(seat.role, engine.scenario.titles)
            seat.taken_over, seat.refused = False, []
            seat.recordings.clear()
            if seat.inbox is not None:
                seat.inbox.clear()
        self._frames.events.clear()
        self._frames.asked.begin(self._seed)
        self._hear()
        self.record, self._early = None, []
        if resumed is not None:
            self._catch_up(resumed)

    def _open_record(self) -> None:
        """Begins the record: when the session starts, so that a session without people leaves no files."""
        if self._folder is None or self.record is not None:
            return
        engine = self.engine
        name = self._name or f"{safe_name(engine.town.name)}_{secrets.token_hex(4)}"
        header = self._players.sign(engine.session_header())
        header = replace(header, extra={**header.extra, **self._extra})
        self.record = RoomRecord(engine, header, free_folder(self._folder, name))
        self.record.note(self._early)

    def _catch_up(self, resumed: Resumed) -> None:
        """Plays the recorded decisions of an interrupted session; talk and record are then as they were."""
        self._early = list(resumed.seat_events)
        self._open_record()
        if self.record is not None:
            self.record.adopt_audio(resumed.session.audio)
        for actions in recorded_actions(self.engine, resumed.session):
            if self.record is not None:
                for said in resumed.said(self.engine.session.world.frame):
                    self.record.say(*said)
            self.engine.step(actions)
            if self.record is not None:
                self.record.record(actions)
            self._frames.events += event_rows(self.engine.last_events)
            self._hear()
        if self.engine.over:
            self._finish()

    def _finish(self, *, broken_off: bool = False) -> None:
        """Closes the record of a session that has ended."""
        if self.record is not None:
            self.record.finish(broken_off=broken_off)
        self.state, self._why, self._held = RoomState.OVER, None, False

    def _break_off(self, reason: EndReason) -> None:
        self.engine.break_off(reason)
        self._frames.events += event_rows(self.engine.last_events)
        self._finish(broken_off=True)

    def _begin_again(self) -> None:
        self._seed += 1
        self._begin()
        self.state = RoomState.WAITING
        for seat in self._all():
            for connection in seat.connections:
                connection.greeted = False

    # --- the clock --------------------------------------------------------------------------------------------------

    def _update_state(self, now: float) -> None:
        if self.state is RoomState.OVER:
            return
        if self.state is RoomState.WAITING:
            if is_ready(self.seats.values(), started=self._started):
                self._open_record()
                self.state = RoomState.RUNNING
            return
        if self._mind_absences(now):
            return
        reason = self._pause_reason()
        if reason is not None and self.state is RoomState.RUNNING:
            self.state, self._why, self._stopped_at = RoomState.PAUSED, reason, now
            self._note(SeatEventKind.PAUSED, None, {"reason": reason.value})
        elif reason is None and self.state is RoomState.PAUSED:
            self.state, self._why = RoomState.RUNNING, None
            self._note(SeatEventKind.RESUMED, None, {"seconds": round(now - self._stopped_at, 1)})
        else:
            self._why = reason

    def _mind_absences(self, now: float) -> bool:
        """Applies the rules for people who are away; returns whether they ended the session."""
        rules = self.config.absence
        for seat in overdue(self.seats.values(), rules, now):
            if rules.then is AfterAbsence.END:
                self._break_off(EndReason.LEFT)
                return True
            if rules.then is AfterAbsence.SCRIPT:
                seat.taken_over = True
                self._take_over(seat)
        return False

    def _pause_reason(self) -> PauseReason | None:
        if self._held:
            return PauseReason.EXPERIMENTER
        return pause_reason(self.seats.values(), self.config.absence, started=self._started)

    def _take_over(self, seat: Seat) -> None:
        assert seat.role is not None and seat.plan is not None
        self._players.start(seat.role)
        if seat.inbox is not None:
            seat.inbox.clear()
        if seat.joined:
            self._note(SeatEventKind.TAKEN_OVER, seat.role, {"policy": seat.plan.player.name})

    def _advance(self) -> None:
        """Plays one decision."""
        engine = self.engine
        for seat in self._roles():
            assert seat.plan is not None and seat.role is not None
            if seat.plan.occupancy is Occupancy.OPEN and not seat.present and seat.role not in self._players:
                self._take_over(seat)
        played = self._players.actions()
        actions = {
            role.value: played[role.value] if role in self._players else self._typed_action(self.seats[role.value])
            for role in AGENT_ROLES
        }
        engine.step(actions)
        if self.record is not None:
            self.record.record(actions)
        self._frames.events += event_rows(engine.last_events)
        self._hear()
        for seat in self._roles():
            assert seat.role is not None
            if seat.role not in self._players:
                seat.refused += engine.session.log.refused[seat.role]
        if engine.over:
            self._finish()

    def _typed_action(self, seat: Seat) -> ActionMapping:
        assert seat.inbox is not None and seat.role is not None
        taken = seat.inbox.take(self.engine.observations[seat.role.value])
        seat.done = max(seat.done, taken.done)
        if taken.spoken is not None:
            self._note(SeatEventKind.SAID, seat.role, taken.spoken.to_json())
            if self.record is not None:
                self.record.say(seat.role, taken.spoken.text, taken.spoken.audio)
        return taken.action.encode(self.engine.limits)

    def _hear(self) -> None:
        session = self.engine.session
        observations = self.engine.observations.of(AGENT_ROLES)
        if Role.CO_WIZARD.value in self.seats:
            self._frames.asked.hear(observations[Role.CO_WIZARD.value])
        for seat in self._all():
            if seat.role is not None:
                seat.talk.hear(observations[seat.role.value])
            if seat.role in (None, Role.AD_WIZARD):
                seat.talk.read_messages(session.messages)
            seat.talk.read_own(session.dialogue.said, session.world.time)

    # --- people -----------------------------------------------------------------------------------------------------

    def _handle(self, call: Call, now: float, out: list[Outgoing]) -> None:
        if isinstance(call, Arrival):
            self._seat(call.seat, call.connection, now, out)
        elif isinstance(call, Departure):
            self._unseat(call.seat, call.connection, now)
        elif isinstance(call, Start):
            self._start_without_the_missing()
        elif isinstance(call, End):
            if self.state is not RoomState.OVER:
                self._break_off(call.reason)
        else:
            try:
                self._obey(call, out)
            except MessageError as error:
                n = getattr(call.message, "n", None)
                out.append(Outgoing(call.connection, encode({"k": "refused", "n": n, "reason": str(error)})))

    def _seat(self, seat: Seat, connection: Connection, now: float, out: list[Outgoing]) -> None:
        if seat.role is not None:
            for other in seat.connections:
                out.append(Outgoing(other, encode({"k": "replaced"}), code=CloseCode.REPLACED))
            replaced, seat.connections = bool(seat.connections), [connection]
            if seat.inbox is not None:
                seat.inbox.forget_numbers()
                if seat.role in self._players:
                    seat.inbox.start_turn()
            if not replaced:
                away = None if seat.away_since is None else round(now - seat.away_since, 1)
                self._note(SeatEventKind.JOINED, seat.role, {"seconds": away})
            seat.joined, seat.away_since, seat.taken_over = True, None, False
            self._players.stop(seat.role)
        else:
            seat.connections.append(connection)

    def _unseat(self, seat: Seat, connection: Connection, now: float) -> None:
        if connection not in seat.connections:
            return  # it was replaced
        seat.connections.remove(connection)
        if seat.role is not None:
            seat.away_since = now
            self._note(SeatEventKind.LEFT, seat.role, {})

    def _obey(self, call: Receipt, out: list[Outgoing]) -> None:
        titles = self.engine.scenario.titles
        seat, connection, message = call.seat, call.connection, with_session_names(call.message, titles)
        if connection not in seat.connections:
            return  # it was replaced
        if isinstance(message, m.Ping):
            out.append(Outgoing(connection, encode({"k": "pong", "c": message.c})))
        elif isinstance(message, m.View):
            connection.rate = message.rate
        elif isinstance(message, m.Control):
            self._control(seat, message)
        elif isinstance(message, m.Announce):
            self._announce(seat, message)
        elif isinstance(message, m.Parse):
            read = read_typed(message.text, seat.talk.awaiting)
            spans = [{"text": titles.shown(each.text), **act_json(each.act)} for each in read]
            out.append(Outgoing(connection, encode({"k": "parsed", "c": message.c, "spans": spans})))
        elif isinstance(message, m.Correct):
            self._correct(seat, message, out)
        elif isinstance(message, m.Join):
            raise MessageError("this connection has a seat already")
        elif seat.inbox is None:
            raise MessageError(f"the seat of the {seat.name} has no role")
        elif self.state is RoomState.OVER:
            raise MessageError("the session is over")
        elif isinstance(message, m.Say) and message.audio is not None and message.audio not in seat.recordings:
            raise MessageError("the seat has no recording of that name")
        else:
            seat.inbox.put(message, seat.talk.awaiting)

    def _control(self, seat: Seat, message: m.Control) -> None:
        if message.act == "again":
            if self.state is not RoomState.OVER:
                raise MessageError("the session is still in progress")
            if seat.name == SPECTATOR:
                raise MessageError("spectators begin no sessions")
            if not self.config.repeatable:
                raise MessageError("no other session follows")
            self._begin_again()
            return
        if seat.name != EXPERIMENTER:
            raise MessageError("only the experimenter controls the session")
        if self.state is RoomState.OVER:
            raise MessageError("the session is over")
        if message.act == "start":
            self._start_without_the_missing()
        elif message.act == "end":
            self._break_off(EndReason.ENDED)
        else:
            self._held = message.act == "pause"

    def _start_without_the_missing(self) -> None:
        self._started = True
        for each in self._roles():
            if is_missing(each):
                each.taken_over = True
                self._take_over(each)

    def _announce(self, seat: Seat, message: m.Announce) -> None:
        if seat.name != EXPERIMENTER:
            raise MessageError("only the experimenter writes to all seats")
        for each in self._all():
            each.talk.note(EXPERIMENTER, message.text, self.engine.session.world.time)
        self._note(SeatEventKind.ANNOUNCED, None, {"text": message.text})

    def _correct(self, seat: Seat, message: m.Correct, out: list[Outgoing]) -> None:
        if self.state is RoomState.OVER:
            raise MessageError("the session is over")
        entry = next((each for each in seat.talk.entries if each.get("utterance") == message.utterance), None)
        if seat.role is None or entry is None or message.span >= len(entry["spans"]):
            raise MessageError("that is no span of an own utterance")
        act = act_json(read_act(message.move, message.slots))
        data = {"utterance": message.utterance, "span": message.span, **act}
        entry["spans"][message.span] |= {**act, "corrected": True}
        self._note(SeatEventKind.CORRECTED, seat.role, data)
        out += [Outgoing(each, encode({"k": "corrected", **data})) for each in seat.connections]

    def _note(self, kind: SeatEventKind, role: Role | None, data: Mapping[str, object]) -> None:
        event = SeatEvent(frame=self.engine.session.world.frame, kind=kind, role=role, data=data)
        if self.state is RoomState.OVER:
            return
        if self.record is not None:
            self.record.note((event,))
        elif self.state is RoomState.WAITING:
            self._early.append(event)

    def _status(self) -> RoomStatus:
        return RoomStatus(state=self.state, why=self._why, plans=self._plans, policies=self._players.roles)

    # --- seats ------------------------------------------------------------------------------------------------------

    def _all(self) -> Iterator[Seat]:
        return iter(self.seats.values())

    def _roles(self) -> Iterator[Seat]:
        return (seat for seat in self.seats.values() if seat.role is not None)
