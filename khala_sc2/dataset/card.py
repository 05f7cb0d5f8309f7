"""The README of a data set, as the Hugging Face hub reads it: YAML in front, then words.

Each form is a data set of its own, because `datasets` reads one kind of file from a directory.

Names in a recording may be anyone's: in the words they cannot end a cell or begin a tag, and none is in the YAML.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import yaml

from khala_protocol.visible import visible_line
from khala_sc2 import __version__
from khala_sc2.dataset.choose import ExampleRule, RowChoice, Split
from khala_sc2.dataset.files import RowForm
from khala_sc2.dataset.lengths import Lengths, token_counter
from khala_sc2.dataset.repeats import RepeatedRows

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from khala_agents.detail import Detail
    from khala_sc2.dataset.row import Row

NAME = "README.md"
_SIZES = {
    1_000: "n<1K", 10_000: "1K<n<10K", 100_000: "10K<n<100K", 1_000_000: "100K<n<1M", 10_000_000: "1M<n<10M",
}  # fmt: skip
MOST_LISTED = 50
"""Names or seeds that the card lists of one kind."""


@dataclass
class Contents:
    """What went into a data set, counted row by row."""

    rows: Counter[str] = field(default_factory=Counter)
    """By split."""
    left_out: Counter[str] = field(default_factory=Counter)
    """Decisions that are no row, by reason."""
    unread: int = 0
    """Files in the given directories that are no recordings of a match."""
    recordings: int = 0
    pictures: int = 0
    rebuilt: int = 0
    """Rows whose prompt no model got."""
    unrewarded: int = 0
    tasks: Counter[tuple[str, str, str]] = field(default_factory=Counter)
    """Rows by task, variant and map."""
    models: Counter[str] = field(default_factory=Counter)
    versions: set[str] = field(default_factory=set)
    seeds: dict[str, set[int]] = field(default_factory=lambda: defaultdict(set))
    """By split."""
    outcomes: Counter[str] = field(default_factory=Counter)
    repeats: RepeatedRows = field(default_factory=RepeatedRows)
    shared: int = 0
    """Prompts that seeds (runs, tasks) of several splits have."""
    moved: int = 0
    """Rows that are in another split than their seed (run, task), because they have such a prompt."""
    lengths: Lengths = field(default_factory=lambda: Lengths(token_counter(None)))

    def add(self, split: str, row: Row) -> None:
        """Count a row."""
        self.rows[split] += 1
        self.pictures += len(row.pictures)
        self.rebuilt += not row.prompt_recorded
        self.unrewarded += row.reward.reward is None
        self.tasks[row.task, row.variant, row.map_name] += 1
        self.models[row.model] += 1
        self.versions.add(f"{row.game}, Khala {row.versions.get('khala', 'unknown')}")
        self.seeds[split].add(row.seed)
        self.outcomes[row.outcome] += 1
        self.lengths.add(row)


@dataclass(frozen=True, slots=True)
class Recipe:
    """How a data set was made."""

    formats: tuple[RowForm, ...] = tuple(RowForm)
    choice: RowChoice = field(default_factory=RowChoice)
    split: Split = field(default_factory=Split)
    gamma: float = 0.99
    """Discount of the reward-to-go."""
    images: bool = True
    example: ExampleRule = "weighted"
    detail: Detail | None = None
    """How much prompts say; None for what they said when they were sent."""
    dedupe: bool = False
    """Whether a row whose prompt and reply came before is left out."""
    tokenizer: str | None = None
    """What counts tokens for the card, see `khala_sc2.dataset.lengths`; None: Khala's estimate."""
    horizon_s: float | None = None
    """Seconds of the game to the next observation, in a data set of dynamics; None for one of decisions."""

    @property
    def title(self) -> str:
        """What the data set holds."""
        return "Decisions of StarCraft II agents" if self.horizon_s is None else "Dynamics of StarCraft II"


def card(contents: Contents, recipe: Recipe, form: RowForm, fingerprint: str) -> str:
    """Return the README of one form.

    Args:
        contents: what is in the data set.
        recipe: how it was made.
        form: of the rows.
        fingerprint: of the files. Without it in the YAML, `datasets` takes all local data sets whose folders and files
            have the same names for one, and gives rows of the first one from its cache.
    """
    front = yaml.safe_dump(_front(contents, recipe, form, fingerprint), sort_keys=False)
    return f"---\n{front}---\n\n" + "\n".join(_body(contents, recipe, form))


def _front(contents: Contents, recipe: Recipe, form: RowForm, fingerprint: str) -> dict[str, object]:
    splits = [name for name in recipe.split.names if contents.rows[name]]
    tasks = ["text-generation", "reinforcement-learning"]
    is_dynamics = recipe.horizon_s is not None
    return {
        "pretty_name": recipe.title,
        "license": "other",
        "license_name": "see-licence-below",
        "license_link": "#licence",
        "language": ["en"],
        "task_categories": [*tasks, "image-text-to-text"] if contents.pictures else tasks,
        "tags": ["starcraft-ii", "llm-agents", "multi-agent", "khala", *(["world-model"] if is_dynamics else [])],
        "size_categories": [_size(contents.rows.total())],
        "configs": [
            {
                "config_name": "default",
                "description": f"files {fingerprint}",
                "data_files": [{"split": name, "path": f"{name}.{form.suffix}"} for name in splits],
            }
        ],
    }


def _size(rows: int) -> str:
    return next((words for most, words in _SIZES.items() if rows < most), "n>10M")


def _body(contents: Contents, recipe: Recipe, form: RowForm) -> Iterator[str]:
    is_dynamics = recipe.horizon_s is not None
    yield f"# {recipe.title}\n"
    yield (
        f"{contents.rows.total()} {'observations' if is_dynamics else 'decisions'} of agents that play StarCraft II "
        f"over a message bus, exported by Khala {__version__} from {_plural(contents.recordings, 'recording')}. "
        f"{_ROW_OF_DYNAMICS if is_dynamics else _ROW}\n"
    )
    yield "## Contents\n"
    yield from _table(("split", "rows", "seeds"), _splits(contents, recipe))
    tasks = [(*played, count) for played, count in contents.tasks.most_common()]
    yield from _table(("task", "variant", "map", "rows"), tasks)
    models = [(name or "none: a scripted player or a policy", count) for name, count in contents.models.most_common()]
    if not is_dynamics:
        yield from _table(("model", "rows"), models)
    yield from _table(("outcome of the episode", "rows"), contents.outcomes.most_common())
    yield "Games and versions: " + "; ".join(map(_cell, sorted(contents.versions)[:MOST_LISTED])) + ".\n"
    yield "## Lengths\n"
    yield from _length_words(contents)
    yield "## Repeats\n"
    yield from _repeat_words(contents, recipe)
    yield "## How it was made\n"
    yield from _making(contents, recipe)
    yield "## Columns\n"
    yield DYNAMICS_COLUMNS if is_dynamics and form is RowForm.PARQUET else COLUMNS[form].format(gamma=recipe.gamma)
    yield "## Training\n"
    yield TRAINING[form]
    yield "## Licence\n"
    yield LICENCE


def _splits(contents: Contents, recipe: Recipe) -> Iterator[Sequence[object]]:
    for name in recipe.split.names:
        seeds = sorted(contents.seeds.get(name, ()))
        more = f" and {len(seeds) - MOST_LISTED} more" if len(seeds) > MOST_LISTED else ""
        yield name, contents.rows[name], ", ".join(map(str, seeds[:MOST_LISTED])) + more


def _length_words(contents: Contents) -> Iterator[str]:
    fields = contents.lengths.fields()
    yield (
        f"Tokens, {_cell(contents.lengths.counter.name)}: of the texts alone, without pictures and what a chat "
        "template adds.\n"
    )
    yield from _table(
        ("field", "median", "95 % have at most", "longest", "share of all"),
        ((name, of.median, of.p95, of.longest, f"{of.share:.1%}") for name, of in fields.items()),
    )
    yield (
        f"A trainer must keep more than {fields['row'].longest} tokens of a row (`max_length`, `sequence_len`, "
        "`cutoff_len`): what it cuts is the end, where the reply is.\n"
    )


def _repeat_words(contents: Contents, recipe: Recipe) -> Iterator[str]:
    repeats, by = contents.repeats, recipe.split.by
    kept = "left out" if recipe.dedupe else "kept; `--dedupe` leaves them out"
    yield f"* Different prompts: {repeats.prompts}."
    yield f"* Rows whose prompt and reply came before: {repeats.duplicates}, {kept}."
    yield f"* Prompts with several different replies: {repeats.ambiguous}, kept."
    if len(recipe.split.names) > 1:
        yield (
            f"* Prompts that stood in a {by} of several splits: {contents.shared}. All their rows are in the first of "
            f"these splits, {_plural(contents.moved, 'row')} of them away from the split of their {by}."
        )
        yield "* The written files were read again: no prompt stands in two splits, word for word."
    yield ""


def _making(contents: Contents, recipe: Recipe) -> Iterator[str]:
    choice, split = recipe.choice, recipe.split
    agents = ", ".join(map(_cell, choice.agents)) or "all"
    shares = ", ".join(f"{name} {share:g}" for name, share in zip(split.names, split.shares, strict=True))
    yield f"* Filters: {', '.join(choice.only) or 'none'}. Agents: {agents}."
    yield f"* Splits by {split.by}: {shares}. Its hash says into which a {split.by} falls; see Repeats."
    if recipe.detail:
        yield f"* Prompts are made with `detail: {recipe.detail}`, whatever they were when they were sent."
    if recipe.horizon_s is not None:
        yield (
            f"* Next observation: the first one of the agent at least {recipe.horizon_s:g} s of the game later. "
            "The row says how much later it is."
        )
    else:
        yield f"* Worked example in the prompts: {_EXAMPLE_WORDS[recipe.example]}."
    left_out = ", ".join(f"{reason}: {count}" for reason, count in sorted(contents.left_out.items()) if count)
    yield f"* Left out: {left_out or 'none'}."
    if recipe.horizon_s is None:
        rebuilt = contents.rebuilt
        yield f"* Prompts of {rebuilt} rows were sent to no model: they are made as a model would have got them."
        yield f"* Pictures: {contents.pictures if recipe.images else 'not exported'}."
    if contents.unrewarded:
        yield f"* The recordings do not say what {_plural(contents.unrewarded, 'row')} gained: reward is null."
    if contents.unread:
        yield f"* Files that are no recordings of a match: {contents.unread}."
    yield ""


_ROW = "One row is one decision: the prompt, the reply, what became of its actions, and what they were worth."
_ROW_OF_DYNAMICS = (
    "One row is what an agent saw, the joint orders of its side after it, and what the agent saw next: a chat whose "
    "reply is the next observation."
)
_EXAMPLE_WORDS: Mapping[ExampleRule, str] = {
    "weighted": "kept, as the agent got it; its reply is not to be trained on",
    "none": "left out, so the prompts are not those that agents play with",
}

COLUMNS: Mapping[RowForm, str] = {
    RowForm.OPENAI: """\
* `messages`: the prompt, and the reply as its last message, in the form of OpenAI's fine-tuning. Pictures stand in the
  prompt as data URLs, each after its title. `weight` is 1 for the reply, and 0 for replies within the prompt: that of
  the worked example, and those of earlier steps.
""",
    RowForm.SHAREGPT: """\
* `id`: run, side, agent, episode and step of the decision.
* `conversations`: the prompt, and the reply as the last part. `<image>` stands for a picture, after its title;
  `< image>` is in a text that had the same word. `weight` is 1 for the reply, and 0 for replies within the prompt: that
  of the worked example, and those of earlier steps.
* `images`: the files of the pictures, in their order.
* `task`, `variant` (what its published `files` or its `paper` says), `seed`, `outcome` of the episode; `model` as its
  endpoint calls it, empty for a player without a model; `status` is `fallback` where another policy decided for it.
""",
    RowForm.TRL: """\
* `id`: run, side, agent, episode and step of the decision.
* `prompt`, `completion`: messages with `role` and `content`, as TRL's conversational prompt-completion data sets have
  them. With pictures, a `content` is a list of parts, and a part of type `image` stands for the next of `images`.
""",
    RowForm.PARQUET: """\
* `id`, `run`, `task`, `variant`, `map`, `game`, `seed`, `side`, `agent`, `episode`, `step`, `game_loop`: which decision
  it is. `variant` is `files` or `paper`: the task as its published files play it, or as its paper says.
* `prompt`: the messages, with `role` and `content`; `images` were sent with the last one, each after its title of
  `image_titles`. `prompt_recorded` is false where no model got it.
* `reply`: the words of the agent; `model` as its endpoint calls it; `status` is `fallback` where another policy
  decided for the model; `usage` in tokens and US dollars.
* `accepted`, `rejected`: the actions that were carried out, and those that were not, with the reason.
* `fate`: `fresh`, `stale`, `adapted`, `refused` or `dropped`; `age_loops`: game loops from observation to effect.
* `reward`: minerals + vespene of what the side destroyed, minus those of what it lost, from this decision up to the
  next decision of its side; agents that decide in the same step share it.
* `reward_to_go` = `reward` + {gamma:g} · `reward_to_go` of the next decision of the side, to the end of the episode.
* `own_reward`, `own_reward_to_go`: of the agent alone, between its own decisions: its kills and losses, the result,
  refused actions, messages that were acted on (`khala_sc2.dataset.credit`).
* `prompt_token_ids`, `reply_token_ids`, `reply_logprobs`: as far as the endpoint told them, else empty.
* `outcome`, `valid`: of the episode; `unfinished` if its recording ends before it does.
""",
}

DYNAMICS_COLUMNS = """\
* `id`, `run`, `task`, `variant`, `map`, `game`, `seed`, `side`, `agent`, `episode`, `step`, `game_loop`: which
  observation it is. `variant` is `files` or `paper`: the task as its published files play it, or as its paper says.
* `prompt`: the request to a world model, with `role` and `content`: clock, observation, orders, time of the next one.
* `observation`, `next_observation`: what the agent was shown, in the fog of war, at `game_loop` and at
  `next_game_loop` (22.4 loops are a second) or `next_step`. `view` and `next_view`: the same as data, in JSON.
* `orders`: the actions of all agents of the side that took effect between the two, each with its game loop and agent;
  `rejected`: those that were refused, with the reason.
* `clock`: how thinking time maps to game time: its rule, and the game loops between observations.
* `fog`: the whole map as the side saw it: a byte for each cell, row after row from the north-west, 2 where it saw, 1
  where it once saw, 0 elsewhere, deflated (zlib), in base64. Null if the recording has no scenes.
* `reward`: minerals + vespene of what the side destroyed between the two, minus those of what it lost.
* `outcome`, `valid`: of the episode; `unfinished` if its recording ends before it does.
"""

_ONLY_LAST = "Train on the last reply alone: the replies within a prompt are the worked example, or rows of their own."

TRAINING: Mapping[RowForm, str] = {
    RowForm.OPENAI: f"""\
{_ONLY_LAST} OpenAI's fine-tuning obeys `weight`; Axolotl does with `message_field_training: weight`. TRL's
`assistant_only_loss` does not know it: take the form `trl`.
""",
    RowForm.SHAREGPT: f"""\
{_ONLY_LAST} LLaMA-Factory does with `mask_history: true`, Axolotl with `message_field_training: weight`.
""",
    RowForm.TRL: f"""\
{_ONLY_LAST} `SFTTrainer` does so by itself with these columns. Its `max_length` is 1024 unless you set it, shorter than
most rows: then nothing of the reply is left.
""",
    RowForm.PARQUET: f"""\
{_ONLY_LAST} For TRL, take the form `trl`, which has the same ids.
""",
}

LICENCE = """\
Three kinds of text meet here, and no one licence covers all of them:

* Prompts and reports are made by Khala, which is under Apache-2.0.
* Names and numbers of units, abilities and maps are those of StarCraft II, a trademark and a work of Blizzard
  Entertainment. Neither Khala nor this data set is connected with Blizzard; its terms for the game's content apply.
* Replies are outputs of the models in the table above. The terms of commercial models may forbid to train others with
  them, or ask to be named: read those of each model before you publish or train.
"""


def _table(head: Sequence[str], rows: Iterable[Sequence[object]]) -> Iterator[str]:
    yield f"| {' | '.join(head)} |"
    yield "|---" * len(head) + "|"
    for row in rows:
        yield f"| {' | '.join(map(_cell, row))} |"
    yield ""


_ESCAPES: Mapping[int, str] = str.maketrans({mark: f"&#{ord(mark)};" for mark in "&<>|`*[]\\"})


def _cell(value: object) -> str:
    """Return a value as Markdown shows it, whatever is in it."""
    return visible_line(str(value))[:100].translate(_ESCAPES)


def _plural(number: int, what: str) -> str:
    return f"{number} {what}" + ("" if number == 1 else "s")
