"""A small recording, told to a person and as data."""

from __future__ import annotations

import hashlib
from typing import TYPE_CHECKING

import pytest

from khala_orchestrator.past.transcript import StepSelection, save_pictures, summary, transcript
from khala_orchestrator.roster import Seat
from khala_protocol.codec import encode
from khala_protocol.errors import ConfigError, RecordingError
from khala_protocol.keys import RUN_TOPICS, Topic, agent_key, image_key, run_key
from khala_protocol.messages import (
    AgentReport,
    Briefing,
    Casualties,
    ImageRef,
    Message,
    Observation,
    Received,
    Rejection,
    Reply,
    Report,
    Result,
    Run,
    Timings,
    View,
)
from khala_protocol.recording import Recorder

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from khala_protocol.messages import Wire

    Printed = Callable[..., list[str]]

RUN = "test"
PICTURES = (b"a map", b"a screen")


def image(data: bytes, name: str, media_type: str = "image/png") -> ImageRef:
    fields = {"width": 512, "height": 256, "bytes": len(data) * 1000, "title": f"What is on the {name}"}
    return ImageRef.model_validate(
        {"name": name, "media_type": media_type, "sha256": hashlib.sha256(data).hexdigest()} | fields
    )


def seen(step: int, agent: str, text: str, *images: ImageRef) -> Observation:
    return Observation(
        run=RUN, side="blue", agent=agent, episode=0, step=step, game_loop=224 * step, answer_within_s=10, text=text,
        view=View(time_s=0.0), images=images,
    )  # fmt: skip


def said(step: int, agent: str, text: str) -> Reply:
    return Reply(run=RUN, side="blue", agent=agent, episode=0, step=step, text=text)


def report(step: int, *agents: AgentReport) -> Report:
    return Report(run=RUN, episode=0, step=step, game_loop=224 * step, agents=agents, score=5.0 * step)


FAULT = Rejection(reason="unknown_target", message="There is no unit 0x9 in sight.", text="<Attack_Unit(0x9)>", start=0)
RESULT = Result(
    run=RUN, episode=0, outcome="draw", cause="step limit", steps=2, env_steps=2, game_loop=448, game_s=20.0,
    wall_s=1.0, killed=Casualties(), lost=Casualties(), kd=None,
)  # fmt: skip


@pytest.fixture
def path(tmp_path: Path, card: Callable[..., Run]) -> Path:
    """Two steps of two agents: one sees a picture, one is late."""
    said_to = Message(
        run=RUN, side="blue", agent="Zealots", episode=0, step=0, recipient="Stalkers", text="Attack\n  0xb now."
    )
    messages: list[Wire | bytes] = [
        card(),
        Briefing(run=RUN, side="blue", agent="Stalkers", episode=0, role="You command."),
        PICTURES[0],
        seen(0, "Stalkers", "Game:\n  nothing", image(PICTURES[0], "minimap")),
        seen(0, "Zealots", "Nothing."),
        said(0, "Stalkers", "Actions:\n<Stop()>"),
        said(0, "Zealots", "<MessageTo(Stalkers, 'Attack 0xb now.')>"),
        said_to,
        report(
            0,
            AgentReport(
                agent="Stalkers", side="blue", status="ok", latency_s=0.25, accepted=("Stalker-1 <Stop()>",), ignored=2
            ),
            AgentReport(agent="Zealots", side="blue", status="ok", latency_s=1.0, rejections=(FAULT,)),
        ).model_copy(update={"messages": (Received(sender="Zealots", recipient="Stalkers", text=said_to.text),)}),
        PICTURES[1],
        seen(1, "Stalkers", "Still nothing.", image(PICTURES[1], "screen", "image/jpeg")),
        said(1, "Stalkers", ""),
        b"no message",
        report(
            1,
            AgentReport(agent="Stalkers", side="blue", status="fallback", detail="http 500", latency_s=3.0),
            AgentReport(agent="Zealots", side="blue", status="late", detail="no reply before the deadline"),
        ),
        RESULT,
    ]
    with Recorder(tmp_path / "run.mcap") as recorder:
        for message in messages:
            recorder.write(key_of(message), message if isinstance(message, bytes) else encode(message))
    return recorder.path


def key_of(message: Wire | bytes) -> str:
    if isinstance(message, bytes):
        is_picture = message in PICTURES
        return image_key(RUN, "blue", "Stalkers", 0) if is_picture else agent_key(RUN, "blue", "Zealots", Topic.REPLY)
    data = message.model_dump()
    topic = Topic(data["kind"])
    return run_key(RUN, topic) if topic in RUN_TOPICS else agent_key(RUN, "blue", data["agent"], topic)


def test_no_character_of_a_recording_acts_on_the_terminal(tmp_path: Path, printed: Printed) -> None:
    acting = "\x1b]0;t\x07\x1b[2J\x9b2J\u202e\u200b[red]"
    agent = AgentReport(
        agent="Stalkers",
        side="blue",
        status="ok",
        detail=acting,
        accepted=(acting,),
        rejections=(Rejection(reason="malformed", message=acting, text=acting, start=0),),
    )
    messages = [seen(0, "Stalkers", acting), said(0, "Stalkers", acting), report(0, agent)]
    with Recorder(tmp_path / "run.mcap") as recorder:
        for message in messages:
            recorder.write(key_of(message), encode(message))
    lines = printed(*transcript(recorder.path, StepSelection(), whole=True), width=200)
    shown = r"\x1b]0;t\x07\x1b[2J\x9b2J\u202e\u200b[red]"
    assert sum(line.count(shown) for line in lines) == 6
    assert all(line.isprintable() for line in lines)


# --- for a person -----------------------------------------------------------------------------------------


def test_a_recording_is_told_step_by_step(path: Path, printed: Printed) -> None:
    lines = printed(*transcript(path, StepSelection()), width=80)
    card, rest = lines[:6], lines[6:]
    assert card[0] == "╭──────────────────────────────────── test ────────────────────────────────────╮"
    end = next(number for number, line in enumerate(rest) if line.startswith("╭"))
    assert rest[:end] == [
        "  Zealots → Stalkers: Attack 0xb now.",
        "step 0  0:00  score 0",
        "  Stalkers: ok after 250 ms, 2 ignored",
        "    Stalker-1 <Stop()>",
        "  Zealots: ok after 1000 ms",
        "    <Attack_Unit(0x9)>  unknown_target (input-conflicting): There is no unit 0x9",
        "in sight.",
        "step 1  0:10  score 5",
        "  Stalkers: fallback (http 500) after 3000 ms",
        "  Zealots: late (no reply before the deadline)",
    ]
    assert rest[end] == "╭───────────────────────── cut at 2 steps (episode 0) ─────────────────────────╮"


def test_a_step_that_was_held_says_how_long(tmp_path: Path, printed: Printed) -> None:
    held = report(3).model_copy(update={"timings": Timings(wait_s=4.0, held_s=3.25)})
    with Recorder(tmp_path / "held.mcap") as recorder:
        recorder.write(f"khala/{RUN}/report", encode(held))
    assert printed(*transcript(tmp_path / "held.mcap", StepSelection())) == ["step 3  0:30  score 15  held for 3.2 s"]


def test_the_whole_transcript_has_every_word(path: Path, printed: Printed) -> None:
    lines = printed(*transcript(path, StepSelection(), whole=True), width=80)
    begin = lines.index("step 0, Stalkers sees")
    end = lines.index("step 0  0:00  score 0")
    assert lines[begin:end] == [
        "step 0, Stalkers sees",
        "  │ Game:",
        "  │   nothing",
        "  picture minimap (512 x 256 PNG, 5 kB): What is on the minimap",
        "step 0, Zealots sees",
        "  │ Nothing.",
        "step 0, Stalkers says",
        "  │ Actions:",
        "  │ <Stop()>",
        "step 0, Zealots says",
        "  │ <MessageTo(Stalkers, 'Attack 0xb now.')>",
        "  Zealots → Stalkers: Attack 0xb now.",
    ]


def test_a_part_is_told_when_a_part_is_asked_for(path: Path, printed: Printed) -> None:
    def body(agent: str | None, steps: str | None) -> list[str]:
        lines = printed(*transcript(path, StepSelection.of(agent, steps), whole=True))
        return [line for line in lines if line and line[0] not in "╭│╰"]

    assert body("Zealots", "1") == [
        "step 1  0:10  score 5",
        "  Zealots: late (no reply before the deadline)",
    ]
    assert body("Stalkers", "-0") == [
        "step 0, Stalkers sees",
        "  │ Game:",
        "  │   nothing",
        "  picture minimap (512 x 256 PNG, 5 kB): What is on the minimap",
        "step 0, Stalkers says",
        "  │ Actions:",
        "  │ <Stop()>",
        "step 0  0:00  score 0",
        "  Stalkers: ok after 250 ms, 2 ignored",
        "    Stalker-1 <Stop()>",
    ]
    assert body(None, "2-") == []


def test_what_is_no_recording_is_said(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match="there is no such file"):
        list(transcript(tmp_path / "missing.mcap", StepSelection()))


# --- which steps ------------------------------------------------------------------------------------------


def test_steps_are_one_or_a_range_that_may_be_open(subtests: pytest.Subtests) -> None:
    for steps, held in (
        (None, [0, 6, 7, 8, 20, 21]),
        ("7", [7]),
        ("7-20", [7, 8, 20]),
        ("7-", [7, 8, 20, 21]),
        ("-7", [0, 6, 7]),
        ("20-7", []),
        ("0", [0]),
    ):
        with subtests.test(steps=steps):
            selection = StepSelection.of(None, steps)
            assert [step for step in (0, 6, 7, 8, 20, 21) if selection.holds(step)] == held


def test_a_selection_of_an_agent_holds_it_and_what_is_of_no_agent() -> None:
    selection = StepSelection.of("Stalkers", "7")
    assert selection.holds(7, Seat("blue", "Stalkers"))
    assert selection.holds(7)
    assert not selection.holds(7, Seat("blue", "Zealots"))
    assert not selection.holds(8, Seat("blue", "Stalkers"))


def test_an_agent_with_its_side_is_not_the_one_of_the_same_name() -> None:
    for name, sides in (("Captain", {"blue", "red"}), ("red/Captain", {"red"})):
        selection = StepSelection.of(name, None)
        assert {side for side in ("blue", "red") if selection.holds(0, Seat(side, "Captain"))} == sides


def test_what_names_no_steps_is_refused(subtests: pytest.Subtests) -> None:
    for steps in ("", "-", "soon", "1-2-3", "1,2", "--1", "9" * 10):
        with subtests.test(steps), pytest.raises(ConfigError) as raised:
            StepSelection.of(None, steps)
        assert str(raised.value) == f"--steps: {steps!r} does not name steps: write 7, 10-20, 10- or -20"


# --- as data ----------------------------------------------------------------------------------------------


def test_a_summary_has_the_card_the_reports_the_results_and_what_was_recorded(path: Path) -> None:
    found = summary(path, StepSelection())
    assert (found["run"]["run"], found["run"]["task"]) == (RUN, "2s3z_pair")
    assert [report["step"] for report in found["reports"]] == [0, 1]
    assert Result.model_validate(found["results"][0]) == RESULT
    root = "khala/test/blue"
    assert found["samples"] == {
        f"{root}/Stalkers/briefing": 1,
        f"{root}/Stalkers/image/0": 2,
        f"{root}/Stalkers/observation": 2,
        f"{root}/Stalkers/reply": 2,
        f"{root}/Zealots/message": 1,
        f"{root}/Zealots/observation": 1,
        f"{root}/Zealots/reply": 2,
        "khala/test/report": 2,
        "khala/test/result": 1,
        "khala/test/run": 1,
    }
    assert list(found["samples"]) == sorted(found["samples"])


def test_a_summary_of_some_steps_has_their_reports(path: Path) -> None:
    found = summary(path, StepSelection.of(None, "1-"))
    assert [report["step"] for report in found["reports"]] == [1]
    assert len(found["results"]) == 1


def test_a_summary_of_a_run_that_never_began_has_no_card(tmp_path: Path) -> None:
    Recorder(tmp_path / "empty.mcap").close()
    assert summary(tmp_path / "empty.mcap", StepSelection()) == {
        "run": None,
        "results": [],
        "reports": [],
        "samples": {},
    }


# --- pictures ---------------------------------------------------------------------------------------------


def test_pictures_are_written_under_the_step_and_the_agent_that_saw_them(path: Path, tmp_path: Path) -> None:
    directory = tmp_path / "deep" / "pictures"
    saved = save_pictures(path, StepSelection(), directory)
    assert [file.name for file in saved] == ["0-0000-Stalkers-minimap.png", "0-0001-Stalkers-screen.jpeg"]
    assert {file: file.read_bytes() for file in directory.iterdir()} == dict(zip(saved, PICTURES, strict=True))


def test_pictures_of_a_part_only(path: Path, tmp_path: Path) -> None:
    assert [file.name for file in save_pictures(path, StepSelection.of("Stalkers", "1"), tmp_path / "1")] == [
        "0-0001-Stalkers-screen.jpeg"
    ]
    assert save_pictures(path, StepSelection.of("Zealots", None), tmp_path / "none") == []


def test_a_picture_that_was_not_recorded_is_left_out(tmp_path: Path) -> None:
    with Recorder(tmp_path / "run.mcap") as recorder:
        lost = seen(0, "Stalkers", "", image(b"lost", "minimap"))
        recorder.write(key_of(lost), encode(lost))
    assert save_pictures(recorder.path, StepSelection(), tmp_path / "pictures") == []


def test_a_directory_that_cannot_be_made_is_named(path: Path, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(RecordingError) as raised:
        save_pictures(path, StepSelection(), tmp_path / "file")
    assert str(raised.value) == f"{tmp_path / 'file'} cannot be written: Not a directory"
