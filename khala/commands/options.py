"""Options of the command line that several commands have: what is played, and how its agents decide.

Above: `khala.cli` with `run` and `host`, and `khala.service.cli` with `submit`.
"""

from pathlib import Path
from typing import Annotated

import typer

from khala_protocol.clock_rule import ClockRule

Task = Annotated[
    str | None, typer.Argument(help="A task, see `khala tasks`, or a path to a .yaml file.", metavar="TASK")
]
Resume = Annotated[
    Path | None,
    typer.Option(
        help="Instead of a task: go on with a match whose host was lost; its recording, or the directory of its run.",
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
MaxWait = Annotated[float | None, typer.Option(min=0.01, help="Longest wait for the agents of a step, in seconds.")]
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
Speed = Annotated[float | None, typer.Option(min=0.01, help="Clock realtime: speed of the game; 1 is that of ladders.")]
Grace = Annotated[
    float | None, typer.Option(min=0, help="How long a required agent may be away before the match ends, in seconds.")
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
Memory = Annotated[
    str | None,
    typer.Option(
        help="What agents know of the steps before: a number of steps, or such as steps=4,summary=20,notes=8.",
        show_default="as the task says",
        metavar="RULE",
    ),
]
Assemble = Annotated[float, typer.Option(min=0.1, help="How long to wait for the agents at the start, in seconds.")]
Out = Annotated[Path, typer.Option(help="Directory in which the run gets its own directory.", metavar="DIR")]
Model = Annotated[
    str, typer.Option(help="Model to ask: scripted, openai, deepseek, …, or a YAML file.", metavar="NAME")
]
ModelName = Annotated[
    str | None,
    typer.Option(help="Another model of the endpoint; scripted has skilled, focus-fire, random-legal, silent."),
]
BaseUrl = Annotated[str | None, typer.Option(help="Another endpoint of the same kind.")]
PolicyName = Annotated[
    str | None, typer.Option(help="Decide without a model, with your own code.", metavar="MODULE:NAME")
]
Fallback = Annotated[
    str | None,
    typer.Option(
        help="Policy where the model has no reply: silent, skilled, focus-fire, random-legal, or module:name.",
        metavar="NAME",
    ),
]
Mind = Annotated[
    str | None,
    typer.Option(
        help="Model of this side instead of --model, in a match of two: openai, scripted/skilled, a file, a policy.",
        metavar="MODEL",
    ),
]
SideModel = Annotated[
    list[str] | None,
    typer.Option(help="The same for a side of any name; may be given several times.", metavar="SIDE=MODEL"),
]
BudgetUsd = Annotated[
    float | None,
    typer.Option(min=0, help="Limit of all agents together in US dollars; two sides may spend half of it each."),
]
Latency = Annotated[float, typer.Option(min=0, help="Seconds that the scripted model takes to answer.")]
