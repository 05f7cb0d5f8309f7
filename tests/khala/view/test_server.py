"""The server as a browser meets it, and as others do, who are refused."""

from __future__ import annotations

import contextlib
import hashlib
import json
from typing import TYPE_CHECKING, Any

import aiohttp
import pytest
from aiohttp import encode_basic_auth, web

from khala_protocol.codec import encode
from khala_protocol.messages import Scene, Terrain
from khala_protocol.recording import Recorder
from khala_sc2.view.guard import policy_of, view_door
from khala_sc2.view.library import run_id
from khala_sc2.view.server import NO_PAGE, Server
from khala_sc2.view.sources import Sources
from khala_sc2.view.wire import (
    MOST_SCENES,
    DecisionTexts,
    Library,
    RecordingProgress,
    RunView,
    Scenes,
    StepView,
    Timeline,
)
from tests.khala.view.made import AGENT, PICTURE, STEPS, begin, key_of, make, put, step_of

if TYPE_CHECKING:
    from collections.abc import AsyncIterator
    from pathlib import Path

    from pydantic import BaseModel

    from khala_sc2.doors.rules import Door
    from khala_sc2.view.wire import AdviceNote


class Browser:
    """A client that opened the address that `khala view` prints."""

    def __init__(self, session: aiohttp.ClientSession, base: str, run: str, door: Door) -> None:
        self.session, self.base, self.run, self.door = session, base, run, door

    async def enter(self) -> None:
        async with self.session.get(f"{self.base}/", params={"token": self.door.token}) as page:
            assert page.status == 200

    async def get(self, path: str, **options: Any) -> tuple[int, str]:
        async with self.session.get(self.base + path, **options) as answer:
            return answer.status, await answer.text()

    async def whole(self) -> None:
        """Wait until the recording is indexed."""
        async with self.session.ws_connect(f"{self.base}/api/runs/{self.run}/live", origin=self.base) as socket:
            async for message in socket:
                if RecordingProgress.model_validate_json(message.data).indexed >= 1.0:
                    return


@contextlib.asynccontextmanager
async def browser(path: Path, door: Door | None = None, **options: Any) -> AsyncIterator[Browser]:
    door = door or view_door()
    runner = web.AppRunner(Server(Sources("made", None, [path], **options), door, advised).application())
    await runner.setup()
    site = web.TCPSite(runner, "127.0.0.1", 0)
    await site.start()
    jar = aiohttp.CookieJar(unsafe=True)
    try:
        async with aiohttp.ClientSession(cookie_jar=jar) as session:
            yield Browser(session, f"http://127.0.0.1:{runner.addresses[0][1]}", run_id(path), door)
    finally:
        await runner.cleanup()


NOTES: list[AdviceNote] = []


async def advised(run: str, note: AdviceNote) -> None:
    NOTES.append(note)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return make(tmp_path / "made.mcap")


async def test_every_answer_is_what_its_model_says(path: Path) -> None:
    async with browser(path) as page:
        await page.enter()
        await page.whole()
        run = f"/api/runs/{page.run}"
        models: dict[str, type[BaseModel]] = {
            "/api/library": Library, run: RunView, f"{run}/episodes/0/timeline": Timeline,
            f"{run}/episodes/0/terrain": Terrain, f"{run}/episodes/0/scenes?from=0&to=15": Scenes,
            f"{run}/episodes/0/steps/7": StepView, f"{run}/episodes/0/steps/7/agents/blue/{AGENT}": DecisionTexts,
        }  # fmt: skip
        for name, model in models.items():
            status, text = await page.get(name)
            assert status == 200, text
            model.model_validate_json(text)


async def test_a_run_view_says_who_plays_and_what_with(path: Path) -> None:
    async with browser(path) as page:
        await page.enter()
        await page.whole()
        view = json.loads((await page.get(f"/api/runs/{page.run}"))[1])
    assert view["indexed"] == 1.0
    assert view["scenes"] == "whole"
    assert view["line"]["outcomes"] == {"blue": ["win"]}
    assert view["episodes"][0]["steps"] == STEPS
    assert [(one["name"], one["model"]) for one in view["agents"]] == [(AGENT, "qwen-2.5")]


async def test_a_picture_is_found_by_its_hash_alone(path: Path) -> None:
    async with browser(path) as page:
        await page.enter()
        await page.whole()
        digest = hashlib.sha256(PICTURE).hexdigest()
        async with page.session.get(f"{page.base}/api/runs/{page.run}/images/{digest}") as answer:
            assert (answer.content_type, await answer.read()) == ("image/png", PICTURE)
        assert (await page.get(f"/api/runs/{page.run}/images/{'0' * 64}"))[0] == 404


async def test_without_the_token_nothing_is_answered(path: Path) -> None:
    async with browser(path) as page:
        for name in ("/", "/api/library", f"/api/runs/{page.run}", f"/api/runs/{page.run}/live"):
            assert (await page.get(name))[0] == 401
            assert (await page.get(name, params={"token": "guessed"}))[0] in {401, 429}
            assert (await page.get(name, cookies={page.door.cookie: "guessed"}))[0] in {401, 429}


async def test_the_token_leaves_the_address_for_a_cookie_that_scripts_cannot_read(path: Path) -> None:
    async with browser(path) as page:
        options: dict[str, Any] = {"params": {"token": page.door.token, "run": "x"}, "allow_redirects": False}
        async with page.session.get(f"{page.base}/", **options) as answer:
            assert (answer.status, answer.headers["Location"]) == (303, "/?run=x")
            cookie = answer.headers["Set-Cookie"]
    assert "HttpOnly" in cookie
    assert "SameSite=Strict" in cookie


@pytest.mark.parametrize("host", ["evil.example", "evil.example:80", "127.0.0.1.evil.example", ""])
async def test_another_name_for_this_machine_is_refused(path: Path, host: str) -> None:
    async with browser(path) as page:
        await page.enter()
        assert (await page.get("/api/library", headers={"Host": host}))[0] == 403


@pytest.mark.parametrize("origin", ["http://evil.example", "null", "http://127.0.0.1:1", None])
async def test_another_page_gets_no_websocket(path: Path, origin: str | None) -> None:
    async with browser(path) as page:
        await page.enter()
        with pytest.raises(aiohttp.WSServerHandshakeError) as refused:
            await page.session.ws_connect(f"{page.base}/api/runs/{page.run}/live", origin=origin)
        assert refused.value.status == 403


async def test_another_page_may_not_write(path: Path) -> None:
    async with browser(path) as page:
        await page.enter()
        async with page.session.post(f"{page.base}/api/library", headers={"Origin": "http://evil.example"}) as answer:
            assert answer.status == 403


ODD = (
    "/api/runs/../../etc/passwd", "/api/runs/%2e%2e%2f%2e%2e%2fetc%2fpasswd", "/../../etc/passwd", "/assets/../cli.py",
    "/api/runs/made.mcap", "/api/runs/{run}/episodes/0/steps/-1", "/api/runs/{run}/episodes/0/steps/99999999999999",
    "/api/runs/{run}/episodes/x/timeline", "/api/runs/{run}/images/../../made.mcap", "/api/experiments/..%2f..",
    "/api/runs/{run}/episodes/0/steps/1/agents/blue/..%2f..%2fetc", "/api/runs/{run}/episodes/9/terrain",
    "/api/runs/{run}/episodes/0/steps/1/agents/blue/'%20or%201=1--",
)  # fmt: skip


async def test_paths_that_name_nothing_here_find_nothing(path: Path) -> None:
    async with browser(path) as page:
        await page.enter()
        await page.whole()
        for name in ODD:
            status, text = await page.get(name.format(run=page.run))
            assert status == 404, name
            assert "root:" not in text


@pytest.mark.parametrize(
    "query", [f"from=0&to={MOST_SCENES}", "from=0&to=999999999", "from=5&to=4", "from=-1&to=3", "from=0", "from=a&to=b"]
)
async def test_too_many_scenes_at_once_are_refused(path: Path, query: str) -> None:
    async with browser(path) as page:
        await page.enter()
        status, text = await page.get(f"/api/runs/{page.run}/episodes/0/scenes?{query}")
        assert status == 400
        assert text.endswith("\n")


async def test_every_answer_forbids_what_a_page_of_answers_never_needs(path: Path) -> None:
    async with browser(path) as page:
        await page.enter()
        for name in ("/", "/api/library", "/nothing"):
            async with page.session.get(page.base + name) as answer:
                assert answer.headers["Content-Security-Policy"].startswith("default-src 'none'")
                assert answer.headers["X-Content-Type-Options"] == "nosniff"
                assert answer.headers["Referrer-Policy"] == "no-referrer"
                assert answer.headers["Cache-Control"] == "no-store"


async def test_a_password_opens_a_server_that_other_machines_reach(path: Path) -> None:
    async with browser(path, view_door(password="secret", is_near=False)) as page:
        assert (await page.get("/api/library", headers={"Host": "table.example"}))[0] == 401
        assert (await page.get("/api/library", headers={"Authorization": encode_basic_auth("me", "wrong")}))[0] == 401
        assert (await page.get("/api/library", headers={"Authorization": encode_basic_auth("me", "secret")}))[0] == 200


async def test_whoever_knew_the_password_once_has_the_cookie_and_does_not_wait_for_the_guesses_of_others(
    path: Path,
) -> None:
    async with browser(path, view_door(password="secret", is_near=False)) as page:
        assert (await page.get("/api/library", headers={"Authorization": encode_basic_auth("me", "secret")}))[0] == 200
        async with aiohttp.ClientSession(headers={"Authorization": encode_basic_auth("me", "wrong")}) as guesser:
            statuses, said = [], [("", "")]
            for _ in range(8):
                async with guesser.get(f"{page.base}/api/library") as answer:
                    statuses.append(answer.status)
                    said.append((answer.headers.get("Retry-After", ""), (await answer.text()).partition(",")[0]))
        assert (await page.get("/api/library"))[0] == 200
    assert statuses == [401] * 5 + [429] * 3
    assert said[-1] == ("1", "too many wrong tries: wait 1 s")


async def test_a_page_that_another_site_links_to_opens_and_answers_nothing_to_that_site(path: Path) -> None:
    async with browser(path) as page:
        linked = {"Sec-Fetch-Site": "cross-site", "Sec-Fetch-Mode": "navigate"}
        assert (await page.get("/", params={"token": page.door.token}, headers=linked))[0] == 200
        for headers in (
            {"Sec-Fetch-Site": "cross-site", "Sec-Fetch-Mode": "no-cors"},
            {"Origin": "http://evil.example"},
        ):
            assert (await page.get("/api/library", headers=headers))[0] == 403


@pytest.mark.parametrize("loop", ["null", "2.5", '"x"', "-1"])
@pytest.mark.parametrize("has_scenes", [True, False])
async def test_a_recording_with_a_wrong_game_loop_is_shown(tmp_path: Path, loop: str, has_scenes: bool) -> None:
    """Anybody may have written it; the time line needs a game loop for each step, and so does a map made of views."""
    path = tmp_path / "odd.mcap"
    with Recorder(path) as recorder:
        put(recorder, *begin())
        for message in (one for one in step_of(1) if has_scenes or not isinstance(one, Scene)):
            wrong = encode(message).replace(b'"game_loop":23', f'"game_loop":{loop}'.encode())
            recorder.write(key_of(message), wrong.replace(b'"game_loop":46', f'"game_loop":{loop}'.encode()))
    async with browser(path) as page:
        await page.enter()
        await page.whole()
        run = f"/api/runs/{page.run}"
        episode = f"{run}/episodes/0"
        for name in (run, f"{episode}/timeline", f"{episode}/scenes?from=0&to=1", f"{episode}/steps/1"):
            status, text = await page.get(name)
            assert status == 200, text


async def test_large_answers_travel_packed(path: Path) -> None:
    async with browser(path) as page:
        await page.enter()
        await page.whole()
        name = f"{page.base}/api/runs/{page.run}/episodes/0/scenes?from=0&to=15"
        async with page.session.get(name, auto_decompress=False) as answer:
            assert answer.headers["Content-Encoding"] == "gzip"


def test_the_policy_names_inline_parts_by_their_hashes_and_no_data() -> None:
    page = '<head><style>a{}</style><script type="module">go()</script><script type="application/json">{}</script>'
    rules = dict(rule.split(" ", 1) for rule in policy_of(page).split("; "))
    assert rules["script-src"].count("sha256-") == 1
    assert rules["style-src"].count("sha256-") == 1
    assert "unsafe" not in policy_of(page)
    assert policy_of(NO_PAGE).startswith("default-src 'none'; script-src 'none'")


async def test_a_growing_recording_says_that_there_is_more(tmp_path: Path) -> None:
    growing = tmp_path / "live.mcap"
    with Recorder(growing) as recorder:
        put(recorder, *begin())
        put(recorder, *step_of(0))
        async with browser(growing) as page:
            await page.enter()
            async with page.session.ws_connect(f"{page.base}/api/runs/{page.run}/live", origin=page.base) as socket:
                first = RecordingProgress.model_validate_json((await socket.receive(timeout=10)).data)
                assert first.live
                for step in (1, 2):
                    put(recorder, *step_of(step))
                    said = first
                    while said.steps < step + 1:
                        said = RecordingProgress.model_validate_json((await socket.receive(timeout=10)).data)
                    assert said.lag_s is not None
                    assert (await page.get(f"/api/runs/{page.run}/episodes/0/steps/{step}"))[0] == 200


async def test_advice_is_sent_only_by_a_view_that_may(path: Path) -> None:
    note = {"kind": "advice", "side": "blue", "recipient": AGENT, "text": "hold"}
    for adviser, ok in (("", False), ("Stranger", False), ("Coach", True)):
        NOTES.clear()
        async with browser(path, adviser=adviser) as page:
            await page.enter()
            async with page.session.ws_connect(f"{page.base}/api/runs/{page.run}/live", origin=page.base) as socket:
                await socket.send_json(note)
                while (said := json.loads((await socket.receive(timeout=10)).data))["kind"] != "note":
                    pass
        assert said["ok"] is ok
        assert [one.text for one in NOTES] == (["hold"] if ok else [])


async def test_nonsense_on_the_websocket_is_answered(path: Path) -> None:
    async with browser(path, adviser="Coach") as page:
        await page.enter()
        async with page.session.ws_connect(f"{page.base}/api/runs/{page.run}/live", origin=page.base) as socket:
            await socket.send_str("{")
            while (said := json.loads((await socket.receive(timeout=10)).data))["kind"] != "note":
                pass
    assert "this is no advice" in said["text"]
