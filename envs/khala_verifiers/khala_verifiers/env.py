"""How a team plays one game: a seat of verifiers for each agent, and the game between them."""

from __future__ import annotations

import asyncio
from contextlib import AsyncExitStack
from dataclasses import asdict
from typing import TYPE_CHECKING, Any, Final

import verifiers.v1 as vf

from khala_bridge.game.processes import IdleGames
from khala_protocol.errors import ConfigError
from khala_sc2.dataset.credit import PARTS, WEIGHTS, by_agent, own_reward, rewards_to_go
from khala_sc2.rollout import TeamRollout

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from verifiers.v1.agent import Agents, Interaction

    from khala_sc2.dataset.credit import AgentTurn
    from khala_sc2.rollout import AgentPrompt
    from khala_verifiers.taskset import KhalaTask

GAMMA: Final = 0.99
"""Discount of the rewards-to-go, from one turn of an agent to its next."""
_GAMES: Final = 8
"""Processes of the game that wait for the next episode."""
_SEAT: Final = vf.AgentConfig(runtime=vf.SubprocessConfig())
"""The program of a seat is a request from this process: it needs no sandbox."""


class KhalaTeamConfig(vf.EnvConfig):
    """The seats of a team, in the order of the task's agents; `--env.agent-2.model` is the model of the second."""

    max_concurrent_agents: int | None = None
    """Agents of an episode that think at the same time: all."""
    agent_1: vf.AgentConfig = _SEAT
    agent_2: vf.AgentConfig = _SEAT
    agent_3: vf.AgentConfig = _SEAT
    agent_4: vf.AgentConfig = _SEAT
    agent_5: vf.AgentConfig = _SEAT
    agent_6: vf.AgentConfig = _SEAT
    agent_7: vf.AgentConfig = _SEAT
    agent_8: vf.AgentConfig = _SEAT


SEATS: Final = tuple(name for name in KhalaTeamConfig.model_fields if name.startswith("agent_"))


class KhalaTeamEnv(vf.Env[KhalaTeamConfig]):
    """One game: agents are asked when the game asks them, and each has a trace of its own."""

    async def start(self) -> None:
        """Keep processes of the game from one episode to the next."""
        self._games = IdleGames(_GAMES)

    async def stop(self) -> None:
        """End them."""
        if hasattr(self, "_games"):
            await asyncio.to_thread(self._games.close)

    async def run(self, task: KhalaTask, agents: Agents) -> None:
        """Play the game of a row."""
        async with TeamRollout(task.data.spec, self._games) as rollout, AsyncExitStack() as stack:
            if len(rollout.agents) > len(SEATS):
                raise ConfigError(
                    f"{task.data.battle} has {len(rollout.agents)} agents, and there are {len(SEATS)} seats"
                )
            seats = {name: getattr(agents, seat) for name, seat in zip(rollout.agents, SEATS, strict=False)}
            players: dict[str, _Player] = {}
            prompts = await rollout.begin()
            while prompts:
                for name in prompts.keys() - players.keys():
                    own = task.with_system_prompt(prompts[name].messages[0].content)
                    players[name] = _Player(await stack.enter_async_context(seats[name].interaction(own)))
                said = await asyncio.gather(*(players[name].answer(prompt) for name, prompt in prompts.items()))
                replies = dict(zip(prompts, said, strict=True))
                if all(player.is_over for player in players.values()):
                    break
                prompts = await rollout.reply({name: reply for name, reply in replies.items() if reply is not None})
            for name, turns in by_agent(rollout.turns).items():
                players[name].account(name, turns, rollout)


class _Player:
    """One agent of an episode, and its exchange with its model."""

    def __init__(self, exchange: Interaction) -> None:
        self.is_over = False
        self._exchange = exchange
        self._nodes: dict[int, int] = {}
        """By step of the match, the node of the trace with the reply."""

    async def answer(self, prompt: AgentPrompt) -> str | None:
        """Return the model's reply; None once a limit of the run has ended the exchange."""
        if self.is_over:
            return None
        trace = self._exchange.trace
        whole = not trace.task.data.history or not self._nodes
        messages = prompt.messages[1:] if whole else prompt.messages[-1:]
        segment = await self._exchange.turn([{"role": said.role, "content": said.content} for said in messages])
        self.is_over = segment.terminated
        if segment.terminated:
            return None
        self._nodes[prompt.step] = max(index for index, node in enumerate(trace.nodes) if node.sampled)
        return segment.last_reply

    def account(self, name: str, turns: Sequence[AgentTurn], rollout: TeamRollout) -> None:
        """Write on the trace what the turns were worth, before it is scored."""
        values = [own_reward(turn) for turn in turns]
        result = rollout.result
        self._exchange.trace.info["khala"] = {
            "agent": name,
            "outcome": result.outcome if result else "cut",
            "rewards": _summed(turns),
            "turns": [
                asdict(turn) | {"reward": value, "reward_to_go": to_go, "node": self._nodes.get(turn.step)}
                for turn, value, to_go in zip(turns, values, rewards_to_go(values, GAMMA), strict=True)
            ],
        }


def _summed(turns: Sequence[AgentTurn]) -> Mapping[str, float]:
    return {name: sum(WEIGHTS[name] * part(turn) for turn in turns) for name, part in PARTS.items()}


def load_environment(**options: Any) -> KhalaTeamEnv:
    """Return the environment.

    Args:
        options: fields of `KhalaTasksetConfig`, such as `battle`, and, under `agent_1` and so on, of `AgentConfig`.

    Raises:
        ValidationError: an option is wrong.
    """
    seats = {name: options.pop(name) for name in SEATS if name in options}
    config = vf.resolve_env_config({"taskset": {"id": "khala-verifiers", **options}, **seats})
    env = vf.load_environment(config)
    assert isinstance(env, KhalaTeamEnv)
    return env
