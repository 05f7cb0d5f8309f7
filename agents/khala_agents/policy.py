"""How an agent decides: what a user writes, and what is made of it.

    async def decide(briefing, observation) -> str          a function, `async` or not
    class Mine(Policy):
        async def decide(self, context) -> str: ...         with pictures, the deadline and a trace of requests

The worker (`khala_agents.worker`) is above: it owns the bus and the deadline, and cancels a decision that is late. A
policy that raises, or answers too late, costs its agent that step and no more. The policy that asks a language
model is `khala_agents.llm_policy.LLMPolicy`; shipped doubles are in `khala_agents.scripted`.
"""

from __future__ import annotations

import asyncio
import contextvars
import inspect
import threading
from abc import ABC, abstractmethod
from collections.abc import Awaitable
from concurrent.futures import Future
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ParamSpec, TypeAlias, TypeVar

from khala_agents.pictures import PictureStore
from khala_agents.time_to_decide import time_to_decide_s
from khala_protocol.messages import Usage

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from khala_protocol.messages import Briefing, ModelCall, Observation, Pace, ReplyStatus

P = ParamSpec("P")
T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Decision:
    """A reply with information about it; a policy may return one instead of the bare text.

    Attributes:
        text: the reply.
        status: `ok` if the agent decided; what kept it from deciding if not.
        detail: why it did not decide, in a few words that are the same each time: decisions are counted by them.
        reason: the same in the words of whoever failed, such as an endpoint.
        hopeless: whether it will never decide, because its endpoint refuses its key or its model, or is not there.
        cut: whether its model reached its limit of tokens within the text.
        attempts, usage: its cost; the worker counts requests that a policy traces (`Context.trace`).
    """

    text: str
    status: ReplyStatus = "ok"
    detail: str = ""
    reason: str = ""
    hopeless: bool = False
    cut: bool = False
    attempts: int = 0
    usage: Usage = field(default_factory=Usage)


Said: TypeAlias = str | Decision
"""What `decide` returns: a reply, or a reply with information about it."""


def _drop(exchange: ModelCall) -> None:
    """Drop an exchange that is not traced."""


def _now() -> float:
    return asyncio.get_running_loop().time()


@dataclass(frozen=True, slots=True)
class Context:
    """The context of one decision. The worker makes it; a test can: `Context(briefing, observation)`.

    Attributes:
        briefing: who the agent is and what it may do, in this episode.
        observation: the observation to answer.
        pictures: the store of the observation's pictures.
        trace: call it with each request to a model as soon as the request is over; it is published, recorded and
            counted in the reply.
        arrived: when the observation arrived, on the clock of the event loop.
        reserve_s: seconds of the time that are for another policy, should this one fail.
        refused: the reply that the observation's verdict is on; "" if this process did not give it.
    """

    briefing: Briefing
    observation: Observation
    pictures: PictureStore = field(default_factory=PictureStore)
    trace: Callable[[ModelCall], None] = _drop
    arrived: float = field(default_factory=_now)
    reserve_s: float = 0.0
    refused: str = ""

    @property
    def time_s(self) -> float | None:
        """Seconds that the decision may take in all; None for no limit."""
        time_s = time_to_decide_s(self.observation.answer_within_s)
        return None if time_s is None else max(time_s - self.reserve_s, 0.0)

    @property
    def deadline(self) -> float | None:
        """When the decision is cancelled, on the clock of the event loop; None for never."""
        return None if self.time_s is None else self.arrived + self.time_s

    @property
    def time_left_s(self) -> float | None:
        """Seconds until the deadline, not below 0; None if there is no deadline."""
        return None if self.deadline is None else max(self.deadline - _now(), 0.0)


class Policy(ABC):
    """The base class of policies, which decide for one agent. Only `decide` is required.

    Attributes:
        pace: how fast its model is, for the clock `token`; None: the task says.
        rethink: how often it wants to decide again on one observation, if nothing of its reply is possible. The
            observation then has a verdict.
        human: whether a person plays the agent.
    """

    pace: Pace | None = None
    rethink: int = 0
    human: bool = False

    async def check(self) -> None:  # noqa: B027  # a hook, not a duty
        """Look for what is wrong, before the agent joins a run.

        Raises:
            KhalaError: the user has to correct something.
        """

    async def prepare(self, briefing: Briefing) -> None:  # noqa: B027  # a hook
        """Get ready for an episode, before its first observation."""

    def remember(self, decisions: Sequence[tuple[Observation, str]]) -> None:  # noqa: B027  # a hook
        """Take in observations and replies of steps that were played before it came, as if it had decided them.

        Called before anything else, of an agent that goes on with a recorded match.
        """

    @abstractmethod
    async def decide(self, context: Context) -> Said:
        """Return the reply to an observation: free text with calls in it, see `khala_protocol.speech`.

        It may be cancelled at any moment: when its time is over or a newer observation arrives.
        """

    async def reflect(self, context: Context) -> None:  # noqa: B027  # a hook
        """Think on after a reply was sent, beside the next decisions; `context` is of that reply, with new time.

        It may be cancelled at any moment, and is when the worker ends.
        """

    async def close(self) -> None:  # noqa: B027  # a hook
        """Release all resources, when the worker ends."""


class FunctionPolicy(Policy):
    """A policy that decides with a function of briefing and observation.

    A function that is not `async` runs in a thread, where it may block. A thread cannot be cancelled: its result after
    the deadline is discarded. An `async` function runs on the loop of all agents of the process, and must not block.
    """

    def __init__(self, function: Callable[[Briefing, Observation], Said | Awaitable[Said]]) -> None:
        self._function = function

    async def decide(self, context: Context) -> Said:
        """Return what the function returns."""
        said: Said | Awaitable[Said]
        if inspect.iscoroutinefunction(self._function):
            said = self._function(context.briefing, context.observation)
        else:
            said = await _in_thread(self._function, context.briefing, context.observation)
        return await said if isinstance(said, Awaitable) else said


class ObjectPolicy(FunctionPolicy):
    """A policy around any object with `decide(briefing, observation)`; calls its `prepare` and `close` if it has them.

    Attributes:
        thing: the object.
    """

    def __init__(self, thing: Any) -> None:
        super().__init__(thing.decide)
        self.thing = thing

    async def prepare(self, briefing: Briefing) -> None:
        """Call `prepare(briefing)` of the object."""
        await self._call("prepare", briefing)

    async def close(self) -> None:
        """Call `close()` of the object."""
        await self._call("close")

    async def _call(self, name: str, *arguments: object) -> None:
        function = getattr(self.thing, name, None)
        if function is not None:
            returned = function(*arguments)
            if isinstance(returned, Awaitable):
                await returned


def as_policy(thing: object) -> Policy:
    """Return a policy unchanged; wrap a function or an object with a method `decide` in a policy.

    Raises:
        TypeError: it is none of these, or cannot be called with briefing and observation.
    """
    if isinstance(thing, Policy):
        return thing
    if hasattr(thing, "decide"):
        _check_parameters(thing.decide, "its `decide`")
        return ObjectPolicy(thing)
    if callable(thing):
        _check_parameters(thing, "it")
        return FunctionPolicy(thing)
    raise TypeError("it is no function and has no method `decide`")


def _check_parameters(function: Any, what: str) -> None:
    """Raise TypeError if a function is known to take something else than briefing and observation."""
    try:
        parameters = inspect.signature(function)
    except ValueError:  # some functions written in C do not say
        return
    except TypeError:
        raise TypeError(f"{what} is no function: write decide(briefing, observation)") from None
    try:
        parameters.bind("briefing", "observation")
    except TypeError:
        taken = ", ".join(parameters.parameters)
        raise TypeError(
            f"{what} takes ({taken}): a function of a policy takes (briefing, observation), and a policy that decides "
            "with a context is a subclass of khala_agents.policy.Policy"
        ) from None


async def _in_thread(function: Callable[P, T], *args: P.args, **kwargs: P.kwargs) -> T:
    """Return the result of `function`, from a thread that does not keep the process from ending."""
    future: Future[T] = Future()
    future.set_running_or_notify_cancel()  # from now on it cannot be cancelled, just as the thread cannot
    context = contextvars.copy_context()

    def run() -> None:
        try:
            result = context.run(function, *args, **kwargs)
        except BaseException as error:  # noqa: BLE001 - it is raised where the future is awaited
            future.set_exception(error)
        else:
            future.set_result(result)

    threading.Thread(target=run, name="policy", daemon=True).start()
    return await asyncio.wrap_future(future)
