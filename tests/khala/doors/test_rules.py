"""Which requests a door lets in, without a server: a table of heads and refusals, and the brake on a fake clock."""

from __future__ import annotations

import base64
from dataclasses import replace
from typing import Any

import pytest

from khala_protocol.errors import ConfigError
from khala_sc2.doors.brake import FORGET_S, FREE, FREE_TOGETHER, MOST_PEERS, Brake
from khala_sc2.doors.rules import Door, RequestHead, host_of, token_of

HOST = "127.0.0.1:8000"
NEAR = Door(command="khala openenv")
FAR = Door(command="khala openenv", is_near=False, token="t" * 24)
OPEN = Door(command="khala openenv", is_near=False)
PAGE = Door(command="khala view", token="t" * 24, has_page=True)
SECURE = Door(command="khala view", token="t" * 24, has_page=True, is_secure=True)


def head(
    *headers: tuple[str, str], method: str = "GET", host: str | None = HOST, query: str = "", peer: str = "127.0.0.1",
    path: str = "/reset",
) -> RequestHead:  # fmt: skip
    named = (("host", host),) if host is not None else ()
    return RequestHead(method, path, query, (*named, *headers), peer)


def status(door: Door, asked: RequestHead) -> int:
    refusal = door.check(asked)
    return 200 if refusal is None else refusal.status


def login(secret: str) -> tuple[str, str]:
    return "authorization", f"Basic {base64.b64encode(f'khala:{secret}'.encode()).decode()}"


def socket(*headers: tuple[str, str], **options: Any) -> RequestHead:
    return head(("connection", "Upgrade"), ("upgrade", "WebSocket"), *headers, **options)


TOKEN = f"token={'t' * 24}"


@pytest.mark.parametrize(
    ("door", "asked", "expected"),
    [
        # programs of this machine need nothing
        (NEAR, head(), 200),
        (NEAR, head(method="POST", host="localhost:8000"), 200),
        (NEAR, socket(host="[::1]:8000", peer="::1"), 200),
        (NEAR, head(host="127.9.9.9"), 200),
        # another name, also one that somebody points at this machine; another machine
        (NEAR, head(host="evil.example"), 403),
        (NEAR, head(host="evil.example:8000"), 403),
        (NEAR, head(host="127.0.0.1.evil.example"), 403),
        (NEAR, head(host="localhost.evil.example:8000"), 403),
        (NEAR, head(host="127.0.0.1:8000@evil.example"), 403),
        (NEAR, head(host=""), 403),
        (NEAR, head(host=None), 403),
        (NEAR, head(("host", "evil.example")), 400),
        (NEAR, head(("host", HOST)), 400),
        (NEAR, head(peer="10.0.0.9"), 403),
        (NEAR, head(("x-forwarded-for", "127.0.0.1"), peer="10.0.0.9"), 403),
        (NEAR, head(("x-forwarded-host", HOST), host="evil.example"), 403),
        (NEAR, head(("forwarded", f"host={HOST}"), host="evil.example"), 403),
        # pages
        (NEAR, head(("origin", f"http://{HOST}"), method="POST"), 200),
        (NEAR, head(("origin", "http://evil.example"), method="POST"), 403),
        (NEAR, head(("origin", "http://evil.example")), 403),
        (NEAR, socket(("origin", "http://evil.example")), 403),
        (NEAR, head(("origin", "null"), method="POST"), 403),
        (NEAR, head(("origin", "http://127.0.0.1:9"), method="POST"), 403),
        (NEAR, head(("origin", "http://localhost:9"), host="localhost:8000"), 403),
        (NEAR, head(("origin", f"https://{HOST}")), 403),
        (NEAR, head(("origin", f"http://{HOST}"), ("origin", "http://evil.example")), 403),
        (NEAR, head(("sec-fetch-site", "cross-site")), 403),
        (NEAR, head(("sec-fetch-site", "same-site")), 403),
        (NEAR, head(("sec-fetch-site", "cross-site"), ("sec-fetch-mode", "navigate")), 403),
        (NEAR, head(("sec-fetch-site", "none")), 200),
        # sizes
        (NEAR, head(("content-length", "16384"), method="POST"), 200),
        (NEAR, head(("content-length", "16385"), method="POST"), 413),
        (NEAR, head(("content-length", "9" * 5000), method="POST"), 413),
        (NEAR, head(("content-length", "-1"), method="POST"), 400),
        (NEAR, head(("content-length", "1e3"), method="POST"), 400),
        (NEAR, head(("content-length", "1"), ("content-length", "2"), method="POST"), 400),
        # a server that other machines reach asks for the token, wherever it stands
        (FAR, head(), 401),
        (FAR, head(query=TOKEN, host="trainer.example", peer="10.0.0.9"), 200),
        (FAR, head(("authorization", f"Bearer {'t' * 24}"), host="trainer.example"), 200),
        (FAR, head(login("t" * 24), host="trainer.example"), 200),
        (FAR, head(("cookie", f"a=b; {FAR.cookie}={'t' * 24}")), 200),
        (FAR, head(("authorization", "Bearer wrong")), 401),
        (FAR, head(("authorization", "Basic %%%")), 401),
        (FAR, head(("authorization", f"Digest {'t' * 24}x")), 401),
        (FAR, head(("cookie", f"{FAR.cookie}=wrong")), 401),
        (FAR, head(query="token=wrong"), 401),
        (FAR, head(query="token=%FF%FE"), 401),
        (FAR, head(query=f"token={'t' * 23}"), 401),
        (FAR, head(("origin", "http://evil.example"), query=TOKEN, host="trainer.example"), 403),
        # without a token nothing tells a foreign page under its own name from ours: no page may ask
        (OPEN, head(host="trainer.example", peer="10.0.0.9"), 200),
        (OPEN, head(("origin", "http://evil.example:8000"), host="evil.example:8000"), 403),
        (OPEN, head(("sec-fetch-site", "same-origin"), host="evil.example:8000"), 403),
        # a page asks for its answers with its own origin, and is opened from anywhere
        (PAGE, head(query=TOKEN), 200),
        (PAGE, head(("sec-fetch-site", "cross-site"), ("sec-fetch-mode", "navigate"), query=TOKEN), 200),
        (PAGE, head(("sec-fetch-site", "cross-site"), ("sec-fetch-mode", "no-cors"), query=TOKEN), 403),
        (PAGE, head(("sec-fetch-site", "cross-site"), ("sec-fetch-mode", "navigate"), query=TOKEN, method="POST"), 403),
        (PAGE, socket(query=TOKEN), 403),
        (PAGE, socket(("origin", f"http://{HOST}"), query=TOKEN), 200),
        (PAGE, head(query=TOKEN, method="POST"), 403),
        (SECURE, socket(("origin", f"https://{HOST}"), query=TOKEN), 200),
        (SECURE, socket(("origin", f"http://{HOST}"), query=TOKEN), 403),
    ],
)
def test_a_door_lets_in_what_its_rules_say(door: Door, asked: RequestHead, expected: int) -> None:
    assert status(replace(door, brake=Brake()), asked) == expected


@pytest.mark.parametrize(
    ("door", "asked", "says"),
    [
        (NEAR, head(host="evil.example"), "under this name: open the address that `khala openenv` printed"),
        (NEAR, head(peer="10.0.0.9"), "`khala openenv` serves this machine alone: say otherwise when you start it"),
        (NEAR, head(("host", "x")), "the request names two hosts: send one Host header"),
        (NEAR, head(("origin", "null")), "another page asked this: only the page of `khala openenv` may"),
        (NEAR, head(("content-length", "20000")), "longer than 16384 bytes: send less at a time"),
        (FAR, head(), "the token is missing or wrong: open the address that `khala openenv` printed"),
    ],
)
def test_a_refusal_says_what_to_do(door: Door, asked: RequestHead, says: str) -> None:
    refusal = door.check(asked)
    assert refusal is not None
    assert refusal.text.endswith(says)


def test_a_program_that_looks_whether_the_server_is_there_needs_no_token() -> None:
    door = Door(command="khala openenv", is_near=False, token="t" * 24, open_paths=frozenset({"/health"}))
    assert status(door, head(path="/health")) == 200
    assert status(door, head(path="/health/")) == 401
    assert status(door, head(("origin", "http://evil.example"), path="/health")) == 403


@pytest.mark.parametrize(
    ("header", "name"),
    [("localhost:80", "localhost"), ("LOCALHOST", "localhost"), ("[::1]:80", "::1"), ("[::1]", "::1"), ("", "")],
)
def test_the_name_of_a_host_stands_before_its_port(header: str, name: str) -> None:
    assert host_of(header) == name


def test_a_token_that_can_be_guessed_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    assert len(token_of("KHALA_TRY")) >= 32
    assert token_of("KHALA_TRY") != token_of("KHALA_TRY")
    monkeypatch.setenv("KHALA_TRY", "a" * 16)
    assert token_of("KHALA_TRY") == "a" * 16
    monkeypatch.setenv("KHALA_TRY", "hunter2")
    with pytest.raises(ConfigError, match=r"^KHALA_TRY: it can be guessed: take at least 16 characters"):
        token_of("KHALA_TRY")


# --- the brake ----------------------------------------------------------------------------------------


class Clock:
    def __init__(self) -> None:
        self.now_s = 1000.0

    def __call__(self) -> float:
        return self.now_s


@pytest.fixture
def clock() -> Clock:
    return Clock()


def locked(clock: Clock) -> Door:
    return Door(
        command="khala view", is_near=False, token="t" * 24, password="secret", has_page=True, brake=Brake(clock)
    )


def test_wrong_tries_of_a_peer_wait_each_time_longer_and_are_forgotten_in_the_end(clock: Clock) -> None:
    brake = Brake(clock)
    waits = []
    for _ in range(FREE + 12):
        brake.note_wrong("10.0.0.9")
        waits.append(brake.wait_s("10.0.0.9"))
        clock.now_s += waits[-1]
    assert waits == [0, 0, 0, 0, 1, 2, 4, 8, 16, 32, 64, 128, 256, 300, 300, 300, 300]
    assert brake.wait_s("10.0.0.10") == 0
    clock.now_s += FORGET_S
    brake.note_wrong("10.0.0.9")
    assert brake.wait_s("10.0.0.9") == 0


def test_a_guesser_is_not_told_whether_a_try_was_right_while_it_waits(clock: Clock) -> None:
    door = locked(clock)
    tries = [status(door, head(login(f"guess {number}"), peer="10.0.0.9")) for number in range(7)]
    assert tries == [401] * FREE + [429] * 2
    assert status(door, head(login("secret"), peer="10.0.0.9")) == 429
    clock.now_s += 1
    assert status(door, head(login("secret"), peer="10.0.0.9")) == 200
    assert status(door, head(login("wrong"), peer="10.0.0.9")) == 401, "its tries begin anew once it was right"


def test_the_holder_of_the_token_never_waits_for_guesses_from_its_own_address(clock: Clock) -> None:
    door = locked(clock)
    for number in range(200):
        door.check(head(query=f"token=guess{number}"))
    assert status(door, head(login("wrong"))) == 429
    assert status(door, head()) == 401, "a request without a token is no try"
    assert status(door, head(query=TOKEN)) == 200
    assert status(door, head(("cookie", f"{door.cookie}={'t' * 24}"))) == 200


def test_guesses_from_many_addresses_wait_together_but_not_those_who_were_right_before(clock: Clock) -> None:
    door = locked(clock)
    assert status(door, head(login("secret"), peer="10.1.1.1")) == 200
    for number in range(FREE_TOGETHER + 5):
        clock.now_s += door.brake.wait_s("10.9.9.9")
        assert status(door, head(login("wrong"), peer=f"10.0.0.{number}")) == 401
    assert status(door, head(login("secret"), peer="10.9.9.9")) == 429
    assert status(door, head(login("secret"), peer="10.1.1.1")) == 200
    clock.now_s += 10
    assert status(door, head(login("secret"), peer="10.9.9.9")) == 200, "a new honest peer waits ten seconds at most"


def test_addresses_of_one_network_are_one_peer_and_few_are_remembered(clock: Clock) -> None:
    brake = Brake(clock)
    for number in range(FREE):
        brake.note_wrong(f"2001:db8::{number + 1:x}")
    assert brake.wait_s("2001:db8::ffff") == 1
    assert brake.wait_s("2001:db8:0:1::1") == 0
    for _ in range(FREE):
        brake.note_wrong("::ffff:10.0.0.9")
    assert brake.wait_s("10.0.0.9") == 1
    for number in range(MOST_PEERS + 10):
        brake.note_wrong(f"peer {number}")
    assert len(brake._peers) == MOST_PEERS
