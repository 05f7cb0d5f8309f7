"""The work of `khala try`: ask a model once with each form of answers, and show what the host reads of its replies.

The prompts are real ones: a task begins on this machine, one of its agents is asked in some of its first steps, and the
host judges what it says. `khala_sc2.cli` above has the options.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import re
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any, Final, get_args

import typer
from rich import box
from rich.table import Table
from rich.text import Text

from khala_agents.answers.form import AnswerForm
from khala_agents.config import load_model
from khala_agents.llm.client import LLMError, RequestRefused, TryTimeout, Unauthorized, Unreachable, estimated_tokens
from khala_agents.llm.money import SharedBudget
from khala_agents.llm_policy import LLMPolicy
from khala_agents.policy import Context, Decision
from khala_orchestrator.config import MatchConfig, change, load_task
from khala_orchestrator.console import stderr_console, stdout_console
from khala_protocol.errors import ConfigError
from khala_protocol.visible import visible_line
from khala_sc2.commands.exit_codes import FAILED
from khala_sc2.playing.minds import Minds, groups_of, scripted_endpoint
from khala_sc2.playing.seats import SeatedMatch, seats_of, without_time_limit

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from khala_agents.config import ModelConfig
    from khala_agents.policy import Said
    from khala_protocol.messages import AgentReport, ModelCall
    from khala_sc2.playing.seats import SeatsTurn, Seen

FORMS: Final[tuple[AnswerForm, ...]] = get_args(AnswerForm)
FIELDS: Final = {
    "json": {"response_format", "output_config", "text"},
    "tools": {"tools"},
    "grammar": {"grammar", "structured_outputs"},
}
"""By form, the fields of a request that ask for it; one that an endpoint refuses is left out from then on."""
STEP_LOOPS: Final = 8
"""Game loops between two of the steps, so that they are much alike."""
LONGEST_WALK: Final = 12
"""Steps that are waited for an enemy to come into sight: an agent that sees none may rightly order nothing."""
LONGEST_REPLY: Final = 4_000
"""Characters of a reply that are printed."""


@dataclass(frozen=True, slots=True)
class WantedTrial:
    """What the command line says; names are those of its options."""

    model: str
    task: str
    base_url: str | None
    answer: str | None
    timeout_s: float
    game: str


@dataclass(slots=True)
class FormTrial:
    """What became of the request with one form.

    Attributes:
        form: of the answer that was asked for.
        state: `held`, if the answer has the form; `ignored`, if it has another one; `refused` by the endpoint, which
            answered without it; `not offered` for its profile; `no words`, if there are none in it; `failed`, if there
            is no answer.
        why: what went wrong, and what to do.
        reply: the model's words.
        cut: whether they ended at the limit of tokens.
        carried_out, refused: calls, as the host reads them; refused ones with its reasons.
        estimated_tokens, prompt_tokens, answer_tokens: the prompt's by our estimate, and the endpoint's own counts.
        seconds: that the answer took.
        usd: its price; None if it is unknown.
        left_out: parts of the prompt that did not fit the model's context.
    """

    form: AnswerForm
    state: str = "failed"
    why: str = ""
    reply: str = ""
    cut: bool = False
    carried_out: tuple[str, ...] = ()
    refused: tuple[str, ...] = ()
    estimated_tokens: int = 0
    prompt_tokens: int | None = None
    answer_tokens: int | None = None
    seconds: float = 0.0
    usd: float | None = None
    left_out: tuple[str, ...] = ()

    @property
    def usable(self) -> bool:
        """Whether at least one of its orders was carried out."""
        return bool(self.carried_out)


@dataclass(frozen=True, slots=True)
class ModelTrial:
    """What was found of a model; the first form is the one of its file."""

    named: str
    """As on the command line."""
    model: str
    endpoint: str
    task: str
    agent: str
    context: int | None
    forms: Sequence[FormTrial]


def run_trial(wanted: WantedTrial, *, as_json: bool) -> None:
    """Ask a model, print what was found, and end with 1 if nothing that it said in its own form was carried out."""
    trial = asyncio.run(try_model(wanted))
    if as_json:
        typer.echo(json.dumps(asdict(trial)))
    else:
        print_trial(trial)
    if not trial.forms[0].usable:
        raise typer.Exit(FAILED)


async def try_model(wanted: WantedTrial) -> ModelTrial:
    """Return what was found of a model.

    Raises:
        KhalaError: the model file, a key or the task is wrong.
    """
    file = load_model(wanted.model)
    minds = Minds(model=wanted.model, base_url=wanted.base_url)
    forms = _forms(file, wanted.answer)
    minds.check()
    task = without_time_limit(change(load_task(wanted.task), rule="frozen", step_loops=STEP_LOOPS, scenes="none"))
    seats = seats_of(task)
    async with contextlib.AsyncExitStack() as stack:
        address = await scripted_endpoint(stack, groups_of(task, {side.side: minds for side in task.per_side()}))

        def policy(form: AnswerForm) -> LLMPolicy:
            answering = replace(minds, answer=form)
            (made,) = answering.policies([seats[0].agent], address, SharedBudget(None)).values()
            assert isinstance(made, LLMPolicy)
            return made

        config = MatchConfig(task=task, run="trial")
        match = await stack.enter_async_context(SeatedMatch(config, seats, game=wanted.game))
        found, context = await _ask_in_each_form(match, forms, file, policy, wanted.timeout_s)
        client = policy(forms[0]).client
        named = " --base-url ".join(filter(None, (wanted.model, wanted.base_url)))
        return ModelTrial(named, client.model, client.endpoint, task.name, seats[0].agent, context, found)


def _forms(file: ModelConfig, only: str | None) -> list[AnswerForm]:
    """Return the forms to ask for, first the one of the model file.

    Raises:
        ConfigError: there is no such form.
    """
    if only is None:
        return [file.answer.form, *(form for form in FORMS if form != file.answer.form)]
    form = next((form for form in FORMS if form == only), None)
    if form is None:
        raise ConfigError(f"there is no form '{only}': write {', '.join(FORMS)}", source="--answer")
    return [form]


async def _ask_in_each_form(
    match: SeatedMatch,
    forms: Sequence[AnswerForm],
    file: ModelConfig,
    policy_of: Callable[[AnswerForm], LLMPolicy],
    timeout_s: float,
) -> tuple[list[FormTrial], int | None]:
    """Return what became of each form, and the size of the context if it is known by then."""
    first = match.seats[0]
    found = [FormTrial(form) for form in forms]
    context: int | None = None
    for trial in found:
        if trial.form not in file.forms:
            trial.state = "not offered"
            trial.why = f"endpoints of profile {file.profile} take no {trial.form}"
            continue
        turn = await _turn_with_enemies(match)
        seen = turn.asked[first]
        policy = policy_of(trial.form)
        stderr_console().print(Text(f"asking {file.model}: {trial.form} …", "dim"))
        try:
            said = await _ask(policy, seen, trial, timeout_s)
            await policy.window.ask()
            context = policy.window.tokens
        finally:
            await policy.close()
        for seat in turn.asked:
            match.act(seat, said if seat == first else "")
        _note_report(trial, (await match.turn()).reports, first.agent)
        if trial.state == "failed" and trial is found[0]:  # the others would fail as well
            return found[:1], context
    return found, context


async def _turn_with_enemies(match: SeatedMatch) -> SeatsTurn:
    """Return the next turn in which the first agent sees an enemy; after `LONGEST_WALK` turns any in which it is asked.

    Raises:
        ConfigError: it is not asked.
    """
    first = match.seats[0]
    for walked in range(LONGEST_WALK + 1):
        turn = await match.turn()
        seen = turn.asked.get(first)
        if seen and (walked == LONGEST_WALK or any(team.enemies for team in seen.observation.view.teams)):
            return turn
        for seat in turn.asked:
            match.act(seat, "")
    raise ConfigError(f"{first} is not asked in the first steps of this task: take another with --task")


async def _ask(policy: LLMPolicy, seen: Seen, trial: FormTrial, timeout_s: float) -> Said:
    """Return the model's decision, and note what the request took."""
    calls: list[ModelCall] = []
    try:
        await policy.check()
        policy.try_timeout_s = timeout_s
        context = Context(seen.briefing, seen.observation, trace=calls.append)
        said = await policy.decide(context)
    except LLMError as error:
        trial.why = f"{error}{await _advice(policy, error)}"
        said = Decision("", "failed", error.status, str(error))
    if calls:
        call = calls[-1]
        trial.estimated_tokens = estimated_tokens(call.prompt)
        trial.seconds = call.latency_s
        trial.usd = call.usage.cost_usd
        trial.left_out = call.left_out
        if not call.usage.unknown_requests and call.completion is not None:
            trial.prompt_tokens = call.usage.prompt_tokens
            trial.answer_tokens = call.usage.completion_tokens
    decision = Decision(said) if isinstance(said, str) else said
    trial.reply = decision.text
    trial.cut = decision.cut
    if decision.status == "ok":
        trial.state = _state(policy, trial)
    elif decision.status != "failed":
        trial.state = "no words"
        trial.why = decision.reason
    return said


def _state(policy: LLMPolicy, trial: FormTrial) -> str:
    """Return whether an answer has the form that was asked for."""
    quirks = getattr(policy.client, "quirks", None)
    if quirks is not None and quirks.left_out & FIELDS.get(trial.form, set()):
        return "refused"
    return "held" if trial.cut or _HAS_FORM[trial.form](trial.reply) else "ignored"


def _is_object(reply: str) -> bool:
    with contextlib.suppress(ValueError):
        return isinstance(json.loads(reply), dict)
    return False


def _calls_tools(reply: str) -> bool:
    return any('"name"' in line and _is_object(line) for line in reply.splitlines())


_HAS_FORM: Final[dict[AnswerForm, Callable[[str], bool]]] = {
    "text": lambda _: True,
    "json": _is_object,
    "tools": _calls_tools,
    "grammar": lambda reply: reply.startswith("Analysis: "),
}


async def _advice(policy: LLMPolicy, error: LLMError) -> str:
    """Return what to do about an error, where its own words do not say it."""
    match error:
        case Unauthorized():
            return ""
        case RequestRefused():
            names = await _models(policy)
            return f"; it has {', '.join(names)}: name one of them, such as {names[0]}" if names else ""
        case Unreachable():
            return "; start the server, or name its address with --base-url"
        case TryTimeout():
            return "; give it more time with --timeout, or fewer tokens with max_tokens in the model file"
    return ""


async def _models(policy: LLMPolicy) -> list[str]:
    """Return the first models that the endpoint lists, if it does not have ours."""
    read = getattr(policy.client, "read", None)
    said: Any = await read("/models") if read else None
    entries = said.get("data") if isinstance(said, dict) else None
    names = [str(entry["id"]) for entry in entries or () if isinstance(entry, dict) and "id" in entry]
    return [] if policy.client.model in names else names[:5]


def _note_report(trial: FormTrial, reports: Sequence[Any], agent: str) -> None:
    """Note what the host made of the reply."""
    mine: list[AgentReport] = [each for report in reports for each in report.agents if each.agent == agent]
    if mine:
        trial.carried_out = mine[-1].accepted
        trial.refused = tuple(
            ": ".join(filter(None, (f"{rejection.team or ''} {rejection.text}".strip(), rejection.message)))
            for rejection in mine[-1].rejections
        )


# --- on the screen ------------------------------------------------------------------------------------


def print_trial(trial: ModelTrial) -> None:
    """Print what was found as a person reads it."""
    screen = stdout_console()
    first = trial.forms[0]
    facts = {
        "model": f"{trial.model} at {trial.endpoint}",
        "prompt": f"{trial.agent} of the task {trial.task}, {_prompt_tokens(first)}",
        "context": _context(trial),
    }
    for name, fact in facts.items():
        screen.print(Text(f"{name:8} {visible_line(fact)}"), soft_wrap=True)
    screen.print(_table(trial.forms))
    for form in trial.forms:
        if form.why:
            color = "red" if form.state == "failed" else "dim"
            screen.print(Text(visible_line(f"{form.form}: {form.why}"), color), soft_wrap=True)
    if first.reply:
        more = " …" if len(first.reply) > LONGEST_REPLY else ""
        screen.print(Text(f"\nThe reply in {first.form}, {first.answer_tokens or 'unknown'} tokens", "bold"))
        screen.print(Text(_BLANKS.sub(" … ", first.reply[:LONGEST_REPLY].strip()) + more), soft_wrap=True)
        screen.print(Text("\nWhat the host read of it", "bold"))
        for call in first.carried_out:
            screen.print(Text(f"carried out  {call}", "green"), soft_wrap=True)
        for refusal in first.refused:
            screen.print(Text(f"refused      {visible_line(refusal)}", "yellow"), soft_wrap=True)
    screen.print(Text(f"\n{_verdict(trial)}", "bold green" if first.usable else "bold red"), soft_wrap=True)


def _prompt_tokens(form: FormTrial) -> str:
    if form.prompt_tokens is None:
        return f"about {form.estimated_tokens:,} tokens by Khala's estimate"
    factor = form.prompt_tokens / max(form.estimated_tokens, 1)
    ours = f"{form.estimated_tokens:,} by Khala's estimate, which is scaled by {factor:.2f} from now on"
    return f"{form.prompt_tokens:,} tokens ({ours})"


def _context(trial: ModelTrial) -> str:
    if trial.context is None:
        return "the endpoint does not tell; name it with `context` in a model file"
    left_out = trial.forms[0].left_out
    short = f"; the prompt was shortened, without {', '.join(left_out)}" if left_out else ""
    return f"{trial.context:,} tokens{short}"


def _table(forms: Sequence[FormTrial]) -> Table:
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, padding=(0, 2, 0, 0), collapse_padding=True)
    for name in ("form", "endpoint"):
        table.add_column(name, no_wrap=True)
    for name in ("orders", "refused", "tokens in", "out", "seconds", "USD"):
        table.add_column(name, justify="right", no_wrap=True)
    for form in forms:
        asked = form.seconds > 0
        out = "" if form.answer_tokens is None else f"{form.answer_tokens:,}{' cut' if form.cut else ''}"
        table.add_row(
            form.form,
            Text(form.state, _COLORS[form.state]),
            str(len(form.carried_out)) if form.reply else "",
            str(len(form.refused)) if form.reply else "",
            "" if form.prompt_tokens is None else f"{form.prompt_tokens:,}",
            out,
            f"{form.seconds:.1f}" if asked else "",
            ("?" if form.usd is None else f"{form.usd:.5f}") if asked and form.reply else "",
        )
    return table


_COLORS: Final = {
    "held": "green", "ignored": "yellow", "refused": "yellow", "no words": "red", "failed": "red", "not offered": "dim",
}  # fmt: skip
_BLANKS = re.compile(r"[^\S\n]{40,}")
"""Blanks that a small model may write until its limit of tokens."""


def _verdict(trial: ModelTrial) -> str:
    first = trial.forms[0]
    better = [form.form for form in trial.forms[1:] if form.usable and form.state == "held"]
    if first.usable:
        return f"It can play: khala run {trial.task} --model {trial.named}"
    if not first.reply:
        return "It has not answered."
    said = f"It has answered, and none of its orders in {first.form} was carried out."
    if better:
        return f"{said} It can play with: khala run {trial.task} --model {trial.named} --answer {better[0]}"
    if first.cut:
        return f"{said} Its answer was cut: raise max_tokens in its file."
    return f"{said} Try a larger model, or --answer grammar with llama.cpp or vLLM."
