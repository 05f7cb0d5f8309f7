"""Options of the command line that several commands have: what is played, and how its agents decide.

A command that takes `MatchOptions` or `MindOptions` as a parameter gets an option for each field by `with_options`.
Above: `khala_sc2.cli` with `run` and `host`, and `khala_sc2.service.cli` with `submit`.
"""

import dataclasses
import inspect
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, TypeVar

import typer

from khala_protocol.clock_rule import ClockRule
from khala_protocol.rethinks import MAX_RETHINKS

Task = Annotated[
    str | None, typer.Argument(help="A task, see `khala tasks`, or a path to a .yaml file.", metavar="TASK")
]
Resume = Annotated[
    Path | None,
    typer.Option(
        help="Instead of a task: resume a match whose host was lost, from its recording or the directory of its run.",
        metavar="RUN",
    ),
]
Game = Annotated[
    str,
    typer.Option(help="Game to use: simulator, starcraft2 (at SC2PATH), or a directory of either.", metavar="GAME"),
]
Seed = Annotated[
    int | None, typer.Option(min=0, help="Seed of the first episode; each further one adds 1.", show_default="1")
]
Episodes = Annotated[int | None, typer.Option(min=1, help="Number of episodes.", show_default="1")]
RunName = Annotated[
    str | None,
    typer.Option(envvar="KHALA_RUN", help="Name of the run.", show_default="task, time, digits", metavar="NAME"),
]
MaxWait = Annotated[
    float | None, typer.Option("--max-wait", min=0.01, help="Longest wait for the agents of a step, in seconds.")
]
StepLoops = Annotated[int | None, typer.Option(min=1, help="Game loops between two observations.")]
Rhythm = Annotated[
    str | None,
    typer.Option(
        metavar="own|paper",
        help="paper: one decision a game second at most, and workers trained by the host, as in LLM-PySC2.",
        show_default="as the task says",
    ),
]
Rule = Annotated[
    ClockRule | None,
    typer.Option(
        "--clock",
        help="Time that thinking costs: frozen (none), budget (always the same), token (by tokens), realtime.",
        show_default="as the task says",
    ),
]
ThinkingLoops = Annotated[
    int | None, typer.Option(min=0, help="Clock budget: game loops that each decision costs; 22.4 are a second.")
]
Speed = Annotated[float | None, typer.Option(min=0.01, help="Clock realtime: speed of the game; 1 is ladder speed.")]
Grace = Annotated[
    float | None,
    typer.Option("--grace", min=0, help="How long a required agent may be away before the match ends, in seconds."),
]
MaxSteps = Annotated[int | None, typer.Option(min=1, help="End an episode after this many steps.")]
ExecutorName = Annotated[
    str | None, typer.Option(help="raw (one env step a turn) or screen (as in the paper).", metavar="EXECUTOR")
]
Images = Annotated[
    str | None,
    typer.Option(
        help="Pictures for all agents: paper (those of their kind), none, or a list such as screen,minimap.",
        show_default="as the task says",
        metavar="LIST",
    ),
]
Opponent = Annotated[
    str | None,
    typer.Option(
        help="Who the agents play: computer, guest (a bot that joins), guest:COMMAND (starts it), lan:127.0.0.1:PORT.",
        show_default="as the task says",
        metavar="WHO",
    ),
]
Level = Annotated[
    int | None,
    typer.Option(
        min=1, max=10, help="Level of the computer: 1 very easy, 5 hard, 7 very hard, 10 cheats.",
        show_default="as the task says",
    ),
]  # fmt: skip
Memory = Annotated[
    str | None,
    typer.Option(
        help="What agents know of earlier steps: a number of steps, or a rule such as steps=4,summary=20,notes=8.",
        show_default="as the task says",
        metavar="RULE",
    ),
]
Assemble = Annotated[
    float, typer.Option("--assemble", min=0.1, help="How long to wait for the agents at the start, in seconds.")
]
Out = Annotated[Path, typer.Option(help="Directory in which the run gets its own directory.", metavar="DIR")]
Model = Annotated[
    str,
    typer.Option(
        help="Model to ask: scripted, openai, openai/gpt-5, ollama/qwen3:8b, …, or a YAML file.", metavar="MODEL"
    ),
]
ModelName = Annotated[
    str | None,
    typer.Option(
        help="Another model at the endpoint; the scripted model plays skilled, focus-fire, random-legal or silent."
    ),
]
BaseUrl = Annotated[str | None, typer.Option(help="Another endpoint of the same kind.")]
PolicyName = Annotated[
    str | None, typer.Option(help="Decide without a model, with your own code.", metavar="MODULE:NAME")
]
AgentsPath = Annotated[
    Path | None,
    typer.Option(
        "--agents", help="YAML file with the models and policies of single agents; the others get --model.",
        metavar="FILE",
    ),
]  # fmt: skip
Fallback = Annotated[
    str | None,
    typer.Option(
        help="Policy for when the model has no reply: silent, skilled, focus-fire, random-legal, or module:name.",
        metavar="NAME",
    ),
]
Rethink = Annotated[
    int,
    typer.Option(
        min=0,
        max=MAX_RETHINKS,
        help="How often a model is asked again in a step if nothing of its answer is possible.",
        metavar="N",
    ),
]
Answer = Annotated[
    str | None,
    typer.Option(
        help="Form that the endpoint holds answers to; `khala try` says which of them it takes.",
        show_default="as the model file says",
        metavar="text|json|tools|grammar",
    ),
]
Mind = Annotated[
    str | None,
    typer.Option(
        help="Model of this side, instead of --model: openai, scripted/skilled, a file, a policy.",
        metavar="MODEL",
    ),
]
SideModel = Annotated[
    list[str] | None,
    typer.Option(help="Model of a side of any name; may be given several times.", metavar="SIDE=MODEL"),
]
BudgetUsd = Annotated[
    float | None,
    typer.Option(min=0, help="Limit for all agents together, in US dollars; each of two sides may spend half."),
]
Latency = Annotated[float, typer.Option("--latency", min=0, help="Seconds that the scripted model takes to answer.")]


@dataclasses.dataclass(frozen=True, slots=True)
class MatchOptions:
    """How a match is played; the names are those of `khala_sc2.playing.matches.new`."""

    opponent: Opponent = None
    level: Level = None
    seed: Seed = None
    episodes: Episodes = None
    executor: ExecutorName = None
    rule: Rule = None
    max_wait_s: MaxWait = None
    step_loops: StepLoops = None
    rhythm: Rhythm = None
    thinking_loops: ThinkingLoops = None
    speed: Speed = None
    grace_s: Grace = None
    max_steps: MaxSteps = None
    memory: Memory = None
    images: Images = None
    assemble_s: Assemble = 60.0


@dataclasses.dataclass(frozen=True, slots=True)
class MindOptions:
    """How agents decide: all of them, and those of single sides."""

    model: Model = "scripted"
    model_name: ModelName = None
    base_url: BaseUrl = None
    policy: PolicyName = None
    agents: AgentsPath = None
    fallback: Fallback = None
    rethink: Rethink = 0
    answer: Answer = None
    blue: Mind = None
    red: Mind = None
    side_model: SideModel = None
    budget_usd: BudgetUsd = None
    latency_s: Latency = 0.2

    def of_all(self) -> dict[str, Any]:
        """Return what holds for all sides, as `khala_sc2.playing.minds.Minds` takes it."""
        others = {"blue", "red", "side_model", "agents"}
        common = {name: value for name, value in dataclasses.asdict(self).items() if name not in others}
        if self.agents is None:
            return common
        from khala_sc2.playing.minds import agents_of  # noqa: PLC0415  # as in `of_sides`

        agents, budget_usd = agents_of(self.agents)
        return common | {"agents": agents} | ({"budget_usd": budget_usd} if self.budget_usd is None else {})

    def of_sides(self) -> dict[str, str]:
        """Return what single sides have instead, by their names."""
        from khala_sc2.playing.minds import named_sides  # noqa: PLC0415  # `--help` need not wait for it

        return named_sides(self.side_model or (), blue=self.blue, red=self.red)


Command = TypeVar("Command", bound=Callable[..., None])


def with_options(command: Command) -> Command:
    """Give a command an option for each field of the dataclasses among its parameters, in their place."""
    asked = inspect.signature(command, eval_str=True).parameters
    groups = {name: parameter.annotation for name, parameter in asked.items() if _is_group(parameter.annotation)}
    parameters: list[inspect.Parameter] = []
    for name, parameter in asked.items():
        if name not in groups:
            parameters.append(parameter)
            continue
        hints = inspect.get_annotations(groups[name], eval_str=True)
        parameters += [
            inspect.Parameter(field.name, parameter.KEYWORD_ONLY, default=field.default, annotation=hints[field.name])
            for field in dataclasses.fields(groups[name])
        ]

    def run(**given: Any) -> None:
        for name, group in groups.items():
            given[name] = group(**{field.name: given.pop(field.name) for field in dataclasses.fields(group)})
        command(**given)

    run.__name__, run.__doc__, run.__module__ = command.__name__, command.__doc__, command.__module__
    run.__annotations__ = {parameter.name: parameter.annotation for parameter in parameters}
    run.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]  # what typer reads
    return run  # type: ignore[return-value]  # it takes the same, option by option


def _is_group(annotation: Any) -> bool:
    return isinstance(annotation, type) and dataclasses.is_dataclass(annotation)
