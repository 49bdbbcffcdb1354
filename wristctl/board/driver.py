"""The driver of the motor board: the same for a real one and an emulated one."""

import struct
from collections.abc import Callable, Sequence
from contextlib import suppress
from types import TracebackType
from typing import Any, Protocol, Self

from wristctl.board.board_errors import BoardError, Faulted, NoAnswer, Refused, Restarted, WrongFirmware
from wristctl.board.exchange import Exchange, Overheard, nobody
from wristctl.board.framing import crc
from wristctl.board.layout import ANSWER_TO, BOUND, COMMAND_OF, LAYOUTS
from wristctl.board.messages import (
    AXES,
    DICTIONARY_HASH,
    ENABLE_KEY,
    MAX_RATE,
    TOTAL_RATE,
    Command,
    Configure,
    Connect,
    Counters,
    Enable,
    Flag,
    Hello,
    Home,
    Jog,
    Limits,
    Pulls,
    Rate,
    Result,
    State,
    Status,
    Target,
    Turn,
)
from wristctl.board.transport import Transport

# Seconds for which a step rate lives where nobody says otherwise.
LEAST_LIFE: float = Rate._field_defaults["life"]

Axes = tuple[float, float, float, float]


def within_reach(rates: Sequence[float]) -> Axes:
    """Rates (steps/s) with each within MAX_RATE, and all scaled down together where they exceed TOTAL_RATE."""
    single = [max(-MAX_RATE, min(MAX_RATE, float(rate))) for rate in rates]
    total = sum(map(abs, single))
    return four([rate * min(1.0, TOTAL_RATE / total) if total else 0.0 for rate in single], float)


def four(values: Sequence[float], kind: Callable[[float], Any]) -> tuple[Any, Any, Any, Any]:
    """Four values as the messages have them. ValueError for another number."""
    first, second, third, fourth = (kind(value) for value in values)
    return first, second, third, fourth


# Times a command is sent before the driver gives up, all of them within the board's watchdog time.
ATTEMPTS = 3

_START_PATIENCE, _START_TIME = 0.1, 3.0
_FIRST_OF_HELLO = struct.Struct("<BI3B")  # protocol, dictionary, firmware: in this place in every version


class Cells(Protocol):
    """The load cells of the tendons, for whoever has some."""

    def take(self, pulls: Pulls) -> None:
        """Take in a reading; never raises."""

    def judge(self) -> None:
        """Raises what ends a wait beside motors that stand."""


def _status(content: tuple[Any, ...]) -> Status:
    return Status(*content[: len(Status._fields)])


class Board(Exchange):
    """A motor board behind a transport. As a context manager it connects, and stops the motors in the end.

    Commands are sent again when no answer comes, at most ATTEMPTS times within the watchdog time; all of them are
    absolute, so that the board may see one twice. `overheard` hears all bytes. Errors are those of `board_errors.py`.
    """

    def __init__(self, transport: Transport, overheard: Overheard = nobody) -> None:
        super().__init__(transport, overheard)
        self.hello: Hello | None = None
        self.cells: Cells | None = None
        """Load cells that are shown every reading: `read` and `turn` ask for them too, where there are any."""
        self._configured, self._limits, self._watchdog = Configure(), Limits(), Configure().watchdog
        self._connection = 0

    def __enter__(self) -> Self:
        try:
            self.connect()
        except BaseException:
            self.transport.close()
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close(emergency=error is not None)

    def connect(self) -> Hello:
        """Wait for the board, which may be starting, and see that it speaks by our message table."""
        self.transport.wait(self.transport.boot_time)
        payload = self._when_up(Command.HELLO)
        _protocol, dictionary, *version = _FIRST_OF_HELLO.unpack_from(payload, 1)
        if dictionary != DICTIONARY_HASH:
            raise WrongFirmware(self.transport.name, dictionary, tuple(version), DICTIONARY_HASH)
        hello = LAYOUTS[Hello].unpack(Hello, payload[1:])
        self._connection = (hello.connection + 1) & 0xFFFF
        self._ask(Command.CONNECT, LAYOUTS[Connect].pack(Connect(self._connection)))
        self.hello = hello
        return hello

    def set_up(self, settings: Configure, limits: Limits | None = None) -> Status:
        """Set ramps, watchdog, what the drives do in a fault, and soft limits; only while disabled."""
        self.send(settings)
        self._configured, self._watchdog = settings, settings.watchdog
        self._limits = limits or Limits()
        return self.send(self._limits)

    def enable(self) -> Status:
        """Switch the drives on, and wait until they hold; refused where others have set the board up meanwhile."""
        settings = b"".join(LAYOUTS[type(message)].pack(message) for message in (self._configured, self._limits))
        self.send(Enable(ENABLE_KEY, crc(settings)))
        return self.wait_while(Flag.SETTLING, timeout=2.0)

    def read(self) -> Status:
        """State, positions and rates; does not feed the watchdog."""
        return self.send(Command.STATUS if self.cells is None else Command.PULLS)

    def counters(self) -> Counters:
        """Counters of the board's traffic on the wire since its reset."""
        _result, counters = self._ask(Command.COUNTERS, b"")
        return Counters(*counters)

    def ping(self) -> None:
        """Feed the watchdog, and nothing else."""
        self._ask(Command.PING, b"")

    def turn(self, rates: Sequence[float], life: float = LEAST_LIFE) -> tuple[Axes, Status]:
        """Turn the axes at `rates` (steps/s), as far as the board can, for `life` s unless another call comes first.

        The rates really sent, and the status.
        """
        sent = within_reach(rates)
        return sent, self.send(self._turning(sent, life))

    def post_turn(self, rates: Sequence[float], life: float = LEAST_LIFE) -> tuple[Axes, float]:
        """As `turn`, but `answered` has the status later. The rates really sent, and when that was [s].

        What is lost on the way is not sent again: the next rates take its place.
        """
        sent = within_reach(rates)
        command, payload = self._packed(self._turning(sent, life))
        return sent, self.post(command, self._bound(command, payload))

    def answered(self, until: float) -> tuple[float, Status] | None:
        """When the next of the posted rates that are answered by `until` [s] were sent, and the status in the answer.

        None where no answer is on its way, or none comes by then.
        """
        arrived = self.arrived(until, self._patience * ATTEMPTS)
        if arrived is None:
            return None
        began, command, answer = arrived
        return began, self._seen(command, self._told(command, answer)[1])

    def jog(self, positions: Sequence[int]) -> Status:
        """Creep to `positions` (steps) before homing, and wait until the axes stand there."""
        return self._arrive(Jog(four(positions, int)))

    def go_to(self, positions: Sequence[int], rate: int) -> Status:
        """Go to `positions` (steps) no faster than `rate` (steps/s), and wait until the axes stand there."""
        return self._arrive(Target(four(positions, int), (rate, rate, rate, rate)))

    def home(self, positions: Sequence[int] = (0,) * AXES) -> Status:
        """Say where the axes stand (steps); positions are trusted from here on."""
        return self.send(Home(four(positions, int)))

    def stop(self) -> Status:
        """Ramp down to rest; the drives hold."""
        return self.send(Command.STOP)

    def emergency_stop(self) -> Status:
        """No further step, drives released, FAULT latched."""
        return self.send(Command.ESTOP)

    def stop_whatever_runs(self) -> Result:
        """Emergency stop without a session, until answered, of a board of any message table.

        Silent at first where opening the port has reset the board: it makes no steps then, and the stock boot loader
        would take the first byte for a program to come, and wait for it for 7 s.
        """
        self.transport.wait(self.transport.boot_time)
        return Result(self._when_up(Command.ESTOP)[0])

    def clear(self) -> Status:
        """Leave FAULT for DISABLED."""
        return self.send(Command.CLEAR)

    def disable(self) -> Status:
        """Ramp down and release the drives."""
        return self.send(Command.DISABLE)

    def wait_while(self, flag: Flag, timeout: float) -> Status:
        """Feed the watchdog until the status no longer has this flag. BoardError after `timeout` s."""
        deadline = self.transport.now() + timeout
        while flag in (status := self.read()).flags and status.state != State.FAULT:
            if self.transport.now() > deadline:
                raise BoardError("firmware", f"still {flag.name} after {timeout:g} s", self.transport.name)
            self.ping()
            self.transport.wait(self._watchdog / 4)
        if status.state == State.FAULT:
            raise self.faulted(status)
        return status

    def send(self, message: Command | tuple[Any, ...]) -> Status:
        """Send a command that is answered by the status."""
        command, payload = self._packed(message)
        return self._seen(command, self._ask(command, payload)[1])

    def close(self, emergency: bool = False) -> None:
        """Stop the motors (at once in an `emergency`), as far as the board can be reached, and let it go."""
        try:
            with suppress(BoardError):
                self.send(Command.ESTOP if emergency else Command.DISABLE)
        finally:
            self.transport.close()

    def _arrive(self, move: Jog | Target) -> Status:
        self.send(move)
        status = self.wait_while(Flag.MOVING, timeout=30.0)
        if status.position != move.position:
            self.see_restart()
            problem = f"the axes stand at {status.position}, not at {move.position}"
            raise BoardError("firmware", problem, self.transport.name, "home again")
        return status

    @property
    def _patience(self) -> float:
        """Seconds for which an answer is waited for before the command is sent again."""
        return self._watchdog / (ATTEMPTS + 1)

    def _turning(self, rates: Axes, life: float) -> Rate | Turn:
        return (Rate if self.cells is None else Turn)(rates, life)

    @staticmethod
    def _packed(message: Command | tuple[Any, ...]) -> tuple[Command, bytes]:
        if isinstance(message, Command):
            return message, b""
        return COMMAND_OF[type(message)], LAYOUTS[type(message)].pack(message)

    def _bound(self, command: Command, payload: bytes) -> bytes:
        """A payload with the number of the connection, where the board asks for it."""
        return self._connection.to_bytes(2, "little") + payload if command in BOUND else payload

    def _seen(self, command: Command, content: tuple[Any, ...]) -> Status:
        if self.cells is not None and ANSWER_TO[command] is Pulls:
            self.cells.take(Pulls(*content))
        return _status(content)

    def _ask(self, command: Command, payload: bytes) -> tuple[Result, tuple[Any, ...]]:
        answer = self.ask(command, self._bound(command, payload), self._patience, ATTEMPTS)
        return self._told(command, answer)

    def _told(self, command: Command, answer: bytes) -> tuple[Result, tuple[Any, ...]]:
        """Result and content of an answer. Raises Faulted, Restarted, Refused and BoardError."""
        result = Result(answer[0])
        kind = ANSWER_TO.get(command)
        if kind and len(answer) != 1 + LAYOUTS[kind].struct.size:
            raise BoardError("cable", f"{command.name} is answered by {len(answer)} bytes", self.transport.name)
        content: tuple[Any, ...] = LAYOUTS[kind].unpack(kind, answer[1:]) if kind else ()
        if result == Result.FAULTED:
            status = _status(content) if kind in (Status, Pulls) else self.read()
            raise self.faulted(status)
        if result != Result.OK:
            self.see_restart()
            raise Refused(self.transport.name, command, result)
        return result, content

    def _when_up(self, command: Command) -> bytes:
        """Send for as long as the board may be starting; what it answers."""
        deadline = self.transport.now() + _START_TIME
        while True:
            try:
                return self.ask(command, b"", _START_PATIENCE, attempts=1)
            except NoAnswer:
                if self.transport.now() > deadline:
                    sent, bytes_read = self.traffic.sent, self.traffic.bytes_read
                    raise NoAnswer(self.transport.name, command, sent, bytes_read) from None

    def faulted(self, status: Status) -> Faulted:
        """The error that tells of the faults of this status."""
        return Faulted(self.transport.name, status.faults, self.silence, self._watchdog)

    def see_restart(self) -> None:
        """Raises Restarted where the board is no longer the one that we have connected to."""
        if self.hello is None:
            return
        answer = self.ask(Command.HELLO, b"", _START_PATIENCE, ATTEMPTS)
        if LAYOUTS[Hello].unpack(Hello, answer[1:]).boot_nonce != self.hello.boot_nonce:
            raise Restarted(self.transport.name)
