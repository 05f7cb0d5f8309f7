"""The words about the game: complete, with their numbers filled in, and without contradictions."""

from __future__ import annotations

import re
from fnmatch import fnmatchcase

import pytest

from khala_bridge.errors import CatalogueError
from khala_bridge.knowledge import VERSIONS, abilities, advice, knowledge, short, upgrades
from khala_bridge.knowledge.facts import ability_facts, buff_facts, unit_facts, upgrade_facts
from khala_bridge.knowledge.load import ability_words, unit_words, upgrade_words
from khala_bridge.knowledge.words import PLACEHOLDER, Filler, join_names, price, round_number

BY_THEIR_ABILITIES = {
    ("HighTemplar", "Mutalisk"), ("HighTemplar", "Viper"), ("HighTemplar", "Medivac"), ("HighTemplar", "Raven"),
    ("HighTemplar", "Phoenix"), ("Phoenix", "SiegeTank"), ("Ravager", "LiberatorAG"),
}  # fmt: skip
"""Pairs in which it is a storm, a beam or bile that wins, not a weapon."""
CASTERS_AND_THE_LIKE = {
    "Disruptor", "Observer", "Oracle", "ShieldBattery", "Bunker", "Raven", "WidowMineBurrowed", "BanelingBurrowed",
    "Infestor", "Overseer", "SwarmHost", "Viper",
}  # fmt: skip
"""Types that counter others without a weapon of their own."""

every_version = pytest.mark.parametrize("version", VERSIONS)


@every_version
def test_every_unit_type_has_words(version: str) -> None:
    assert {name for name, kind in knowledge(version).items() if not kind.about.endswith(".")} == set()
    assert unit_words().keys() == knowledge(version).keys()


@every_version
def test_every_ability_of_melee_games_has_a_sentence(version: str) -> None:
    melee = [known for known in abilities(version).values() if known.melee]
    assert len(melee) > 500
    assert {known.name for known in melee if not known.about.endswith(".")} == set()


@every_version
def test_every_upgrade_has_exactly_one_sentence(version: str) -> None:
    for name, known in upgrades(version).items():
        assert known.about.endswith("."), name
        assert len([heading for heading in upgrade_words() if fnmatchcase(name, heading)]) == 1, name


@every_version
def test_types_that_fight_or_cast_in_melee_games_have_advice(version: str) -> None:
    fighters = [k for k in knowledge(version).values() if k.melee and k.supply and not (k.structure or k.burrowed)]
    growing = {kind.name for kind in fighters if kind.name.endswith("Cocoon")}
    assert {kind.name for kind in fighters if not kind.uses} <= growing


@every_version
def test_no_placeholder_is_left_and_no_word_is_broken(version: str) -> None:
    texts = [text for kind in knowledge(version).values() for text in (kind.about, kind.uses, *kind.abilities.values())]
    texts += [known.about for known in abilities(version).values()]
    texts += [known.about for known in upgrades(version).values()]
    assert [text for text in texts if re.search(r"[{}<>\n]|  |None|\.\.|;;| ;| ,|--", text)] == []


def test_no_sentence_has_a_number_that_is_a_fact() -> None:
    """Digits stand only where no fact has them: everything else is filled in."""
    sentences = [t for w in unit_words().values() for t in (w.about, w.uses, *w.traits.values())]
    sentences += [words.about for words in ability_words().values()] + list(upgrade_words().values())
    typed = [s for s in sentences if re.search(r"\d", PLACEHOLDER.sub("", s).replace("KD8", ""))]
    assert typed == []


def test_no_words_are_written_about_what_does_not_exist() -> None:
    facts = [known for version in VERSIONS for known in ability_facts(version).values()]
    headings = {known.name for known in facts} | {f"<{known.does}>" for known in facts}
    assert ability_words().keys() - headings == set()
    names = {name for version in VERSIONS for name in upgrade_facts(version)}
    assert [heading for heading in upgrade_words() if not any(fnmatchcase(n, heading) for n in names)] == []


def test_counters_are_types_that_exist_and_are_told_in_both_directions() -> None:
    for name, kind in knowledge().items():
        assert all(name in knowledge()[other].countered_by for other in kind.counters), name
        assert all(name in knowledge()[other].counters for other in kind.countered_by), name
        assert len(set(kind.counters)) == len(kind.counters), name


def test_no_two_types_counter_each_other() -> None:
    pairs = {(name, other) for name, kind in knowledge().items() for other in kind.counters}
    assert {pair for pair in pairs if pair[::-1] in pairs} == set()


@every_version
def test_who_counters_another_type_can_hit_it(version: str) -> None:
    known = knowledge(version)
    pairs = {(name, other) for name, kind in known.items() for other in kind.counters}
    missing = {(a, b) for a, b in pairs if not known[a].hits(known[b].planes) and a not in CASTERS_AND_THE_LIKE}
    assert missing == BY_THEIR_ABILITIES


@every_version
def test_every_armed_type_of_melee_games_is_countered_by_something(version: str) -> None:
    armed = [k for k in knowledge(version).values() if k.melee and k.weapons and not k.structure]
    alone = {kind.name for kind in armed if not kind.countered_by and not kind.name.startswith("Changeling")}
    assert alone == set()


@pytest.mark.parametrize(
    ("text", "filled"),
    [
        ("{range} and {energy}", "9 and 75"),
        ("{damage}, {search_period_s} s", "10, 0.41 s"),
        ("{searches*damage}", "70"),
        ("{Zergling.health}, {Zergling.weapons.0.range}", "35, 0.1"),
        ("{1442.figures.distance}", "8"),
        ("{buff.Slow.speed%}", "50%"),
        ("{-3753.figures.armor}", "3"),
        ("a{needs}.", "a; needs PsiStorm."),
        ("{cost}", "nothing"),
        ("no   blanks\n left", "no blanks left"),
    ],
)
def test_placeholders_are_filled_in_from_the_facts(text: str, filled: str) -> None:
    filler = Filler(unit_facts("4.10"), ability_facts("4.10"), buff_facts("4.10"))
    assert filler.fill(text, ability_facts("4.10")[1036]) == filled


@pytest.mark.parametrize("wrong", ["{reach}", "{Zerglin.health}", "{1.figures.damage}", "{buff.Fast.speed}", "{name}"])
def test_a_placeholder_without_a_fact_is_an_error_that_names_both(wrong: str) -> None:
    filler = Filler(unit_facts("4.10"), ability_facts("4.10"), buff_facts("4.10"))
    with pytest.raises(
        CatalogueError, match=re.escape(f"the words about Effect_PsiStorm speak of {wrong}: no such fact")
    ):
        filler.fill(f"It is {wrong}.", ability_facts("4.10")[1036])


@pytest.mark.parametrize(
    ("value", "said"), [(10.714, "10.7"), (1440, "1440"), (0.41, "0.41"), (107.14, "107"), (8, "8")]
)
def test_numbers_are_said_with_three_digits(value: float, said: str) -> None:
    assert round_number(value) == said


def test_prices_and_lists_are_said_in_words() -> None:
    assert price(125, 50, 2) == "125 minerals, 50 vespene, 2 supply"
    assert price(0, 0) == "nothing"
    lists = ((), ("A",), ("A", "B"), ("A", "B", "C"))
    assert [join_names(names) for names in lists] == ["", "A", "A and B", "A, B and C"]


def test_the_lines_of_a_prompt_say_what_a_type_is_and_what_it_does() -> None:
    _, body, weapon, counters = short("SiegeTankSieged", frozenset({"Marine", "Immortal", "Carrier"}))
    assert body == "armored, mechanical, on the ground; health 175, armor 1, does not move"
    assert weapon == (
        "hits ground, range 13 but not nearer than 2, damage 40 (+30 against armored) every 2.14 s, "
        "18.7 damage per second (32.7 against armored), splash within 1.25"
    )
    assert counters == "good against Marine; beaten by Immortal, Carrier"
    assert short("Observer", frozenset())[1:] == (
        "light, mechanical, flying; health 40, shield 20, speed 3.01, detects within 11, cloaked",
    )
    assert short("Something of a later version") == ()


def test_without_types_in_sight_a_prompt_names_some_units_of_each_race() -> None:
    *_, last = short("Marine")
    good, beaten = last.removeprefix("good against ").split("; beaten by ")
    for names in (good, beaten):
        kinds = [knowledge()[name] for name in names.split(", ")]
        assert len(kinds) == 6
        assert {kind.race for kind in kinds} == {"protoss", "terran", "zerg"}
        assert not any(kind.structure for kind in kinds)


def test_advice_is_about_ones_own_units() -> None:
    use, blink = advice("Stalker")
    assert use.startswith("Use: Shoot, step back")
    assert blink == "Blink: Jumps up to 8 to a place that it can see; ready again after 7.14 s; needs Blink."
    assert advice("Something of a later version") == ()


@every_version
def test_the_lines_of_every_type_are_lines(version: str) -> None:
    for name in knowledge(version):
        lines = (*short(name), *advice(name))
        assert all(line == line.strip() and "\n" not in line for line in lines), name
        assert len(short(name)) >= 2, name
