"""How an agent decides: the one method that a user must write, and the policies that come with Khala.

    async def decide(briefing, observation) -> str

The worker (`agents.worker`) is above: it owns the bus, the deadline and the default reply, and cancels a
decision that is late. A policy that raises, or answers nothing in time, costs its agent that step and no more.
The policy that asks a language model is `agents.llm_policy.LLMPolicy`; shipped doubles are in `agents.scripted`.
"""

from __future__ import annotations

import asyncio
import contextvars
import inspect
import threading
from collections.abc import Awaitable
from concurrent.futures import Future
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal, ParamSpec, Protocol, TypeAlias, TypeVar, runtime_checkable

from protocol.messages import Usage

if TYPE_CHECKING:
    from collections.abc import Callable

    from agents.pictures import Pictures
    from protocol.messages import Briefing, Exchange, Observation

P = ParamSpec("P")
T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Decision:
    """A reply with what is to be known about it; a policy may return one instead of the bare text.

    Attributes:
        text: the reply.
        status: `fallback` if the policy knows that it failed.
        detail: why it is a fallback, in a few words.
        attempts, usage: what it took; requests that a policy traces (`Traced`) are counted by the worker.
    """

    text: str
    status: Literal["ok", "fallback"] = "ok"
    detail: str = ""
    attempts: int = 0
    usage: Usage = field(default_factory=Usage)


Answer: TypeAlias = str | Decision


class Policy(Protocol):
    """Decides for one agent."""

    async def decide(self, briefing: Briefing, observation: Observation) -> Answer:
        """The reply to an observation: free text with calls in it, see `protocol.speech`.

        It may be cancelled at any moment, when its time is over or a newer observation is there.
        """
        ...


@runtime_checkable
class Checked(Protocol):
    """A policy that can find out what is wrong with it before it joins a run."""

    async def check(self) -> None:
        """Raises a `KhalaError` for what the user has to mend."""
        ...


@runtime_checkable
class Prepared(Protocol):
    """A policy that wants to know of a briefing before the first observation; also at each new episode."""

    async def prepare(self, briefing: Briefing) -> None:
        """Gets ready."""
        ...


@runtime_checkable
class Closing(Protocol):
    """A policy that holds something open."""

    async def close(self) -> None:
        """Lets it go, when the worker ends."""
        ...


@runtime_checkable
class Traced(Protocol):
    """A policy that tells of its requests to a model as it makes them; the worker sets `trace`."""

    trace: Callable[[Exchange], None]


@runtime_checkable
class Seeing(Protocol):
    """A policy that looks at the pictures of its observations; the worker sets `pictures`."""

    pictures: Pictures


class FunctionPolicy:
    """Decides with a function. One that is not `async` runs in a thread, where it may block and holds nobody up.

    A thread cannot be cancelled: what it still does after the deadline is thrown away. An `async` function runs on
    the loop of all agents of the process, and must not block.
    """

    def __init__(self, function: Callable[[Briefing, Observation], Answer | Awaitable[Answer]]) -> None:
        self._function = function

    async def decide(self, briefing: Briefing, observation: Observation) -> Answer:
        """What the function returns."""
        answer: Answer | Awaitable[Answer]
        if inspect.iscoroutinefunction(self._function):
            answer = self._function(briefing, observation)
        else:
            answer = await _in_thread(self._function, briefing, observation)
        return await answer if isinstance(answer, Awaitable) else answer


async def _in_thread(function: Callable[P, T], *args: P.args, **kwargs: P.kwargs) -> T:
    """What `function` returns, from a thread that does not keep the process from ending."""
    future: Future[T] = Future()
    future.set_running_or_notify_cancel()  # from now on it cannot be cancelled, as the thread cannot
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
