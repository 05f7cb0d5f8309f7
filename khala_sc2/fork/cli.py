"""The command `khala fork`, which `khala_sc2.cli` mounts."""

from pathlib import Path
from typing import Annotated

import typer

from khala_agents.cli import Trust
from khala_orchestrator.cli import Json
from khala_protocol.errors import ConfigError
from khala_sc2.commands.run_options import BaseUrl, Fallback, Game, Latency, Mind, ModelName, PolicyName, SideModel

FORK_EPILOG = """
Examples:\n
    khala fork runs/first/recording.mcap --at 20\n
    khala fork runs/first/recording.mcap --at 20 --model deepseek --times 20 --budget-usd 2\n
    khala fork runs/first --at 20 --model openai --agent Commander=anthropic\n
    khala fork runs/first --at 20 --model openai --advise "Commander: fall back and wait for reinforcements"\n
    khala fork runs/duel --at 40 --blue openai --red skilled\n
    khala fork runs/first --scan --model skilled --every 10
"""
TIMES = 20


def fork(
    recording: Annotated[Path, typer.Argument(help="A recording, or the directory of its run.", metavar="RECORDING")],
    *,
    at: Annotated[
        int | None,
        typer.Option(
            min=0, help="First step that the other agents decide; `khala replay` shows the steps.", metavar="STEP"
        ),
    ] = None,
    scan: Annotated[
        bool, typer.Option("--scan", help="Fork at many steps, and rank them by how much the outcome differs.")
    ] = False,
    every: Annotated[
        int | None, typer.Option(min=1, help="With --scan: steps from one fork to the next.", show_default="a twelfth")
    ] = None,
    episode: Annotated[int, typer.Option(min=0, help="Episode to fork.", metavar="N")] = 0,
    times: Annotated[
        int | None,
        typer.Option(min=1, help="Forks at a step.", show_default=f"{TIMES}, with --scan 1", metavar="N"),
    ] = None,
    model: Annotated[
        str | None,
        typer.Option(
            help="Model that decides from the step on; recorded plays the recorded future once more.",
            metavar="NAME",
            show_default="recorded",
        ),
    ] = None,
    model_name: ModelName = None,
    base_url: BaseUrl = None,
    policy: PolicyName = None,
    fallback: Fallback = None,
    agent: Annotated[
        list[str] | None,
        typer.Option(help="Model of a single agent; may be given several times.", metavar="NAME=MODEL"),
    ] = None,
    blue: Mind = None,
    red: Mind = None,
    side_model: SideModel = None,
    advise: Annotated[
        list[str] | None,
        typer.Option(
            help="What an adviser says before the step: 'Commander: attack', 'everyone: attack'; may be repeated.",
            metavar="WHO: TEXT",
        ),
    ] = None,
    memory: Annotated[
        str | None,
        typer.Option(
            help="Past steps in the prompt, recorded ones too: a number, or a rule such as steps=4,summary=20.",
            show_default="as recorded",
            metavar="RULE",
        ),
    ] = None,
    budget_usd: Annotated[
        float | None,
        typer.Option(min=0, help="Limit for all forks together, in US dollars; each fork gets an equal part."),
    ] = None,
    latency: Latency = 0.0,
    game: Game = "simulator",
    trust: Trust = False,  # noqa: ARG001  # its callback has done it
    jobs: Annotated[
        int | None, typer.Option(min=1, help="Forks at once.", show_default="by cores and memory", metavar="N")
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            help="Directory in which each fork gets its own directory.", show_default="runs/RUN-forks", metavar="DIR"
        ),
    ] = None,
    as_json: Json = False,
) -> None:
    """Replay a recorded match up to a step, and let other agents play on from there.

    The match is played again with its recorded decisions up to the step; each observation must match the recorded
    one. From the step to the end other agents decide, in --times forks. Each fork is recorded like any match. A table
    compares the forks with the recorded future.

    The game is deterministic, so forks differ only by their decisions. A model that chooses its words by chance
    (temperature) makes each fork different. A scripted player, or any policy that answers the same text the same way,
    makes all forks alike, and --times 1 is enough.

    Only matches on the simulator can be forked, and none with the clock realtime.
    """
    from khala_protocol.trust import trust_named  # noqa: PLC0415
    from khala_sc2.fork import commands  # noqa: PLC0415  # PySC2 takes a second that --help need not wait for
    from khala_sc2.playing.minds import Minds, named_sides  # noqa: PLC0415

    if (at is None) != scan:
        raise ConfigError("say where to fork: --at STEP, or --scan for many steps")
    sides = named_sides(side_model or (), blue=blue, red=red)
    trunk = commands.open_trunk(recording, episode)
    changes = {
        "--policy": policy, "--model-name": model_name, "--base-url": base_url, "--fallback": fallback,
        "--agent": agent, "the model of a side": sides, "--advise": advise, "--memory": memory,
    }  # fmt: skip
    changed = [option for option, value in changes.items() if value]
    if model == "recorded" or (model is None and not changed and at is not None):
        if changed or at is None:
            what = ", ".join(changed) or "--scan"
            raise ConfigError(f"the recorded future cannot be changed: leave out {what}, or say --model")
        commands.repeat(trunk, at, game, as_json=as_json)
        return
    common = None
    if model or policy:
        common = Minds(model or "scripted", model_name, base_url, policy, budget_usd, latency, fallback)
    elif about_a_model := [option for option in ("--model-name", "--base-url", "--fallback") if option in changed]:
        raise ConfigError(f"{about_a_model[0]} is for a model: name the model with --model")
    trust_named(policy, fallback, *sides.values(), *(said.partition("=")[2] for said in agent or ()))
    plan = commands.make_plan(trunk, out, common, sides, agent or (), advise or (), memory)
    if at is not None:
        commands.fork_at(plan, at, times or TIMES, jobs=jobs, budget_usd=budget_usd, game=game, as_json=as_json)
    else:
        commands.scan(plan, every, times or 1, jobs=jobs, budget_usd=budget_usd, game=game, as_json=as_json)
