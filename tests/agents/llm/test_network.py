"""The way to an endpoint: which proxy and certificates the environment names, and that this machine needs neither."""

from __future__ import annotations

import asyncio
import contextlib
import importlib.util
import random
import socket
import ssl
from functools import partial
from typing import TYPE_CHECKING

import pytest

from khala_agents.llm.address import checked_address, is_loopback, sends_openly
from khala_agents.llm.client import LLMError, MalformedCompletion, Request, RequestRefused, Unreachable
from khala_agents.llm.http import HttpEndpoint
from khala_agents.llm.network import find_trust, proxy_for
from khala_agents.llm.openai_compatible import OpenAICompatible
from khala_agents.llm.pricing import Prices
from khala_agents.llm.profiles import PROFILES
from khala_agents.llm.retry import RetryRule, with_retries
from khala_agents.scripted.canned import Canned, Given, completion
from khala_protocol.certificates import make_authority
from khala_protocol.errors import ConfigError
from khala_protocol.messages import ChatMessage

if TYPE_CHECKING:
    from collections.abc import AsyncIterator
    from pathlib import Path

GOOD = completion("go")
VARIABLES = ("HTTP_PROXY", "HTTPS_PROXY", "ALL_PROXY", "NO_PROXY")
CERTIFICATES = ("SSL_CERT_FILE", "SSL_CERT_DIR", "REQUESTS_CA_BUNDLE", "CURL_CA_BUNDLE")


@pytest.fixture(autouse=True)
def bare(monkeypatch: pytest.MonkeyPatch) -> None:
    """Forget the proxies and certificates of the machine that runs the tests."""
    for name in (*VARIABLES, *(name.lower() for name in VARIABLES), *CERTIFICATES):
        monkeypatch.delenv(name, raising=False)


async def ask(base_url: str) -> str:
    model = OpenAICompatible(PROFILES["compatible"], model="m", base_url=base_url, prices=Prices())
    try:
        return (await model.complete(Request((ChatMessage(role="user", content="Game"),), timeout_s=5.0))).text
    finally:
        await model.close()


# --- which proxy --------------------------------------------------------------------------------------

HERE = ["localhost", "LOCALHOST", "localhost.", "model.localhost", "127.0.0.1", "127.8.9.10", "::1", "[::1]", "0.0.0.0",
        "::ffff:127.0.0.1"]  # fmt: skip
ELSEWHERE = ["localhost.example", "10.0.0.1", "128.0.0.1", "::2", "model.example", "127.0.0.1.example"]


@pytest.mark.parametrize("host", HERE)
def test_this_machine_is_known_by_all_its_names(host: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ALL_PROXY", "http://127.0.0.1:1")
    monkeypatch.setenv("http_proxy", "http://127.0.0.1:1")
    assert is_loopback(host)
    url = f"http://[{host.strip('[]')}]/v1" if ":" in host else f"http://{host}/v1"
    assert proxy_for(url) is None
    assert not sends_openly(url)


@pytest.mark.parametrize("host", ELSEWHERE)
def test_another_machine_is_not_this_one(host: str) -> None:
    assert not is_loopback(host)


PROXIES = [
    ({"HTTP_PROXY": "http://p:1"}, "http://p:1 (HTTP_PROXY)", None),
    ({"HTTPS_PROXY": "http://p:1"}, None, "http://p:1 (HTTPS_PROXY)"),
    ({"https_proxy": "http://p:1"}, None, "http://p:1 (HTTPS_PROXY)"),
    ({"ALL_PROXY": "http://p:1"}, "http://p:1 (ALL_PROXY)", "http://p:1 (ALL_PROXY)"),
    ({"all_proxy": "p:1"}, "http://p:1 (ALL_PROXY)", "http://p:1 (ALL_PROXY)"),
    ({"ALL_PROXY": "http://p:1", "HTTPS_PROXY": "http://q:2"}, "http://p:1 (ALL_PROXY)", "http://q:2 (HTTPS_PROXY)"),
    ({"ALL_PROXY": "http://p:1", "NO_PROXY": "model.example"}, None, None),
    ({"ALL_PROXY": "http://p:1", "no_proxy": ".example"}, None, None),
    ({"ALL_PROXY": "http://p:1", "NO_PROXY": "*"}, None, None),
    ({"ALL_PROXY": "http://p:1", "NO_PROXY": "other.example"}, "http://p:1 (ALL_PROXY)", "http://p:1 (ALL_PROXY)"),
    ({"HTTP_PROXY": "http://me:secret@p:1"}, "http://p:1 (HTTP_PROXY)", None),
    ({"ALL_PROXY": "socks5://p:1"}, "socks5://p:1 (ALL_PROXY)", "socks5://p:1 (ALL_PROXY)"),
    ({}, None, None),
]


@pytest.mark.parametrize(("environment", "http", "https"), PROXIES)
def test_an_endpoint_elsewhere_is_reached_through_the_proxy_that_the_environment_names(
    environment: dict[str, str], http: str | None, https: str | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name, value in environment.items():
        monkeypatch.setenv(name, value)
    found = [proxy_for(f"{scheme}://model.example/v1") for scheme in ("http", "https")]
    assert [str(proxy) if proxy else None for proxy in found] == [http, https]


BAD_PROXIES = [
    ("ftp://p:1", "ALL_PROXY: a proxy of the kind 'ftp' cannot be used: http, https, socks5, socks5h"),
    ("socks4://p:1", "ALL_PROXY: a proxy of the kind 'socks4' cannot be used: http, https, socks5, socks5h"),
    ("http://p:port", "ALL_PROXY: this is not a proxy's URL"),
]


@pytest.mark.parametrize(("value", "text"), BAD_PROXIES)
def test_a_proxy_that_cannot_be_used_is_one_clear_sentence(
    value: str, text: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ALL_PROXY", value)
    with pytest.raises(ConfigError) as caught:
        HttpEndpoint("https://model.example/v1")
    assert str(caught.value) == text
    HttpEndpoint("http://127.0.0.1:1/v1")  # which needs none


def test_a_socks_proxy_without_its_package_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("HTTPS_PROXY", "socks5://p:1")
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    with pytest.raises(ConfigError) as caught:
        proxy_for("https://model.example/v1")
    assert str(caught.value) == (
        "HTTPS_PROXY: a SOCKS proxy needs a package that is not installed: `pip install 'khala-sc2[socks]'`"
    )


# --- through it ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("variable", ["HTTP_PROXY", "http_proxy", "ALL_PROXY", "all_proxy"])
async def test_a_proxy_is_used_except_for_this_machine(variable: str, monkeypatch: pytest.MonkeyPatch) -> None:
    async with Canned(GOOD) as proxy, Canned(GOOD) as here:
        monkeypatch.setenv(variable, proxy.root)
        await ask("http://model.invalid/v1")
        await ask(here.base_url)
        await ask(here.base_url.replace("127.0.0.1", "localhost"))
    assert [asked.headers["host"] for asked in proxy.asked] == ["model.invalid"]
    assert len(here.asked) == 2


@contextlib.asynccontextmanager
async def serving(answer: bytes) -> AsyncIterator[tuple[int, list[bytes]]]:
    """Serve these bytes to whoever says something; yield the port and what was said."""
    heard: list[bytes] = []

    async def serve(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        heard.append(await reader.readuntil(b"\r\n\r\n"))
        writer.write(answer)
        await writer.drain()
        writer.close()

    server = await asyncio.start_server(serve, "127.0.0.1", 0)
    async with server:
        yield server.sockets[0].getsockname()[1], heard


async def test_a_proxy_that_refuses_is_named_without_its_password_and_nothing_was_sent(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    refusal = b"HTTP/1.1 407 Proxy Authentication Required\r\nContent-Length: 0\r\n\r\n"
    async with serving(refusal) as (port, heard):
        monkeypatch.setenv("HTTPS_PROXY", f"http://me:hidden@127.0.0.1:{port}")
        with pytest.raises(Unreachable) as caught:
            await ask("https://model.invalid/v1")
    assert heard[0].startswith(b"CONNECT model.invalid:443 ")
    assert b"Proxy-Authorization: Basic bWU6aGlkZGVu" in heard[0]
    assert str(caught.value) == (
        f"https://model.invalid/v1 cannot be reached through the proxy http://127.0.0.1:{port} (HTTPS_PROXY): "
        "the proxy refused the connection: http 407 (ProxyError)"
    )
    assert not caught.value.may_be_billed


async def test_a_proxy_that_is_away_is_named_and_nothing_was_sent(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ALL_PROXY", "http://127.0.0.1:1")
    with pytest.raises(Unreachable, match=r"through the proxy http://127\.0\.0\.1:1 \(ALL_PROXY\)") as caught:
        await ask("https://model.invalid/v1")
    assert not caught.value.may_be_billed


@contextlib.asynccontextmanager
async def socks(target: str) -> AsyncIterator[tuple[int, list[bytes]]]:
    """Serve SOCKS5: every connection leads to `target`; yield the port and the hosts that were asked for."""
    hosts: list[bytes] = []
    port = int(target.rpartition(":")[2])

    async def copy(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        with contextlib.suppress(ConnectionError):
            while piece := await reader.read(65536):
                writer.write(piece)
                await writer.drain()
        writer.close()

    async def serve(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        _, methods = await reader.readexactly(2)
        await reader.readexactly(methods)
        writer.write(b"\x05\x00")  # no password
        *_, length = await reader.readexactly(5)
        hosts.append(await reader.readexactly(length))
        await reader.readexactly(2)
        writer.write(b"\x05\x00\x00\x01\x7f\x00\x00\x01\x00\x00")
        there = await asyncio.open_connection("127.0.0.1", port)
        await asyncio.gather(copy(reader, there[1]), copy(there[0], writer))

    server = await asyncio.start_server(serve, "127.0.0.1", 0)
    async with server:
        yield server.sockets[0].getsockname()[1], hosts


async def test_a_socks_proxy_is_gone_through_and_asked_for_the_name(monkeypatch: pytest.MonkeyPatch) -> None:
    async with Canned(GOOD) as there, socks(there.root) as (port, hosts):
        monkeypatch.setenv("ALL_PROXY", f"socks5h://127.0.0.1:{port}")
        assert await ask("http://model.invalid/v1") == "go"
    assert hosts == [b"model.invalid"]


SOCKS_BODIES = [
    (Given(bytes(9 * 2**20)), "the answer is larger than 8 MB"),
    (Given(b"packed", headers={"Content-Encoding": "gzip"}), "a body that cannot be unpacked"),
]


@pytest.mark.parametrize(("answer", "words"), SOCKS_BODIES)
async def test_a_body_through_a_socks_proxy_is_limited_as_well(
    answer: Given, words: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    async with Canned(answer) as there, socks(there.root) as (port, _):
        monkeypatch.setenv("ALL_PROXY", f"socks5h://127.0.0.1:{port}")
        with pytest.raises(MalformedCompletion, match=words):
            await ask("http://model.invalid/v1")


# --- whether a request may have arrived ---------------------------------------------------------------


async def test_a_connection_that_is_refused_was_never_billed() -> None:
    with pytest.raises(Unreachable) as caught:
        await ask("http://127.0.0.1:1/v1")
    assert not caught.value.may_be_billed


async def test_a_name_that_nobody_knows_was_never_billed(monkeypatch: pytest.MonkeyPatch) -> None:
    def know_nobody(*asked: object, **options: object) -> None:
        raise socket.gaierror(socket.EAI_NONAME, "Name or service not known")

    monkeypatch.setattr(socket, "getaddrinfo", know_nobody)
    with pytest.raises(Unreachable) as caught:
        await ask("http://model.invalid/v1")
    assert not caught.value.may_be_billed


async def test_a_server_that_speaks_no_tls_was_never_sent_anything() -> None:
    async with Canned(GOOD) as server:
        with pytest.raises(Unreachable) as caught:
            await ask(server.base_url.replace("http:", "https:"))
        assert server.asked == []
    assert not caught.value.may_be_billed


@pytest.mark.parametrize("answer", [b"", b"HTTP/1.1 200 OK\r\nContent-Length: 100\r\n\r\nhalf"])
async def test_a_connection_that_breaks_after_the_request_may_be_billed(answer: bytes) -> None:
    async with serving(answer) as (port, _):
        with pytest.raises(Unreachable) as caught:
            await ask(f"http://127.0.0.1:{port}/v1")
    assert caught.value.may_be_billed


async def test_an_answer_that_is_no_http_shows_no_query() -> None:
    async with serving(b"nonsense\r\n\r\n") as (port, _):
        http = HttpEndpoint(f"http://127.0.0.1:{port}/v1", query={"key": "a/b c"})
        with pytest.raises(Unreachable, match=r"cannot be reached: that is not HTTP: ") as caught:
            await http.post("/chat/completions", b"{}")
        await http.close()
    assert "key" not in str(caught.value)
    assert caught.value.may_be_billed


async def test_a_gateway_may_send_long_headers() -> None:
    async with Canned(Given(GOOD.body, headers={"X-Model-Info": "a" * 20_000})) as server:
        assert await ask(server.base_url) == "go"


async def test_a_connection_that_was_dropped_while_idle_is_made_again() -> None:
    body = b'{"choices": [{"message": {"content": "go"}}]}'
    async with serving(b"HTTP/1.1 200 OK\r\nContent-Length: %d\r\n\r\n%s" % (len(body), body)) as (port, heard):
        model = OpenAICompatible(
            PROFILES["compatible"], model="m", base_url=f"http://127.0.0.1:{port}/v1", prices=Prices()
        )
        at_once = RetryRule(base_s=0, jitter_s=0)
        for _ in range(3):
            request = Request((ChatMessage(role="user", content="Game"),), timeout_s=5.0)
            tried = await with_retries(partial(model.complete, request), at_once, deadline=None, rng=random.Random(1))
            assert tried.text == "go"
        await model.close()
    assert len(heard) == 3


# --- certificates -------------------------------------------------------------------------------------


@pytest.mark.parametrize("variable", CERTIFICATES)
def test_certificates_are_taken_from_the_first_variable_that_is_set(variable: str, tmp_path: Path) -> None:
    named = {name: str(tmp_path) for name in CERTIFICATES[CERTIFICATES.index(variable) :]}
    assert str(find_trust(named)) == f"{variable}={tmp_path}"


def test_no_variable_means_the_certificates_that_httpx_brings() -> None:
    assert find_trust({}) is None


@pytest.mark.parametrize("variable", CERTIFICATES)
async def test_certificates_that_are_not_there_are_one_clear_sentence(
    variable: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(variable, str(tmp_path / "none.pem"))
    with pytest.raises(ConfigError) as caught:
        HttpEndpoint("https://model.example/v1")
    assert str(caught.value) == f"{variable}: there is no file or directory '{tmp_path}/none.pem' with certificates"
    HttpEndpoint("http://127.0.0.1:1/v1")  # which needs none


async def test_a_file_without_certificates_is_one_clear_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "empty.pem").write_text("no certificate", encoding="utf-8")
    monkeypatch.setenv("REQUESTS_CA_BUNDLE", str(tmp_path / "empty.pem"))
    with pytest.raises(RequestRefused, match=f"REQUESTS_CA_BUNDLE={tmp_path}/empty.pem holds no certificates"):
        await ask("https://127.0.0.1:1/v1")


@pytest.mark.parametrize("variable", ["SSL_CERT_FILE", "REQUESTS_CA_BUNDLE", None])
async def test_an_endpoint_with_a_certificate_of_a_company_is_trusted_if_it_is_named(
    variable: str | None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    make_authority(tmp_path, ["localhost"])
    router = tmp_path / "router"
    if variable:
        monkeypatch.setenv(variable, str(router / "ca.pem"))
    context = ssl.create_default_context(ssl.Purpose.CLIENT_AUTH)
    context.load_cert_chain(router / "certificate.pem", router / "key.pem")
    body = b'{"choices": [{"message": {"content": "go"}}]}'

    async def serve(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        await reader.readuntil(b"\r\n\r\n")
        writer.write(b"HTTP/1.1 200 OK\r\nContent-Length: %d\r\n\r\n%s" % (len(body), body))
        await writer.drain()
        writer.close()

    server = await asyncio.start_server(serve, "127.0.0.1", 0, ssl=context)
    async with server:
        url = f"https://localhost:{server.sockets[0].getsockname()[1]}/v1"
        if variable:
            assert await ask(url) == "go"
        else:
            with pytest.raises(LLMError, match="name the company's own in SSL_CERT_FILE"):
                await ask(url)


# --- addresses ----------------------------------------------------------------------------------------


def test_an_address_with_a_query_says_where_a_query_goes() -> None:
    with pytest.raises(ValueError, match="write a query such as api-version under `query`"):
        checked_address("https://x.example/openai/deployments/d/chat/completions?api-version=1")
