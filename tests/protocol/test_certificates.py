"""Keys and certificates: who they name, who can read them, and how long they are valid."""

from __future__ import annotations

import shutil
import ssl
import subprocess
from datetime import UTC, datetime, timedelta
from typing import TYPE_CHECKING

import pytest
from cryptography import x509
from cryptography.hazmat.primitives.serialization import Encoding

from khala_protocol.bus import certificate
from khala_protocol.bus.config import BusConfig, check
from khala_protocol.certificates import (
    certificates,
    certify_agent,
    certify_observer,
    files_of,
    issue,
    make_authority,
)
from khala_protocol.common_names import agent_name
from khala_protocol.errors import BusError, ConfigError, WrongKey

if TYPE_CHECKING:
    from pathlib import Path


@pytest.fixture
def keys(tmp_path: Path) -> Path:
    make_authority(tmp_path / "keys", ["router.example", "10.0.0.5", "::1"])
    return tmp_path / "keys"


def test_each_certificate_names_its_holder_and_only_a_router_listens(keys: Path) -> None:
    certify_agent(keys, "blue", "Stalkers")
    certify_observer(keys, "screen")
    assert {one.path.parent.name: (one.name, one.hosts) for one in certificates(keys)} == {
        "ca": ("authority", ()),
        "router": ("router", ("router.example", "10.0.0.5", "::1")),
        "host": ("host", ()),
        "agent.blue.Stalkers": ("agent:blue/Stalkers", ()),
        "observer.screen": ("observer", ()),
    }


def test_only_their_owner_can_read_them(keys: Path) -> None:
    modes = {path.stat().st_mode & 0o777 for path in keys.rglob("*") if path.is_file()}
    assert modes == {0o600}
    assert {path.stat().st_mode & 0o777 for path in (keys, *keys.iterdir())} == {0o700}


def test_a_folder_is_enough_on_another_machine_and_has_no_authority(keys: Path, tmp_path: Path) -> None:
    certify_agent(keys, "blue", "Stalkers")
    there = tmp_path / "there"
    shutil.copytree(keys / "agent.blue.Stalkers", there)
    assert sorted(path.name for path in there.iterdir()) == ["ca.pem", "certificate.pem", "key.pem"]
    files = files_of(there, agent_name("blue", "Stalkers"))
    check(BusConfig(connect=("tls/router.example:7447",), tls=files))
    assert certificates(there)[0].name == "agent:blue/Stalkers"


@pytest.mark.skipif(shutil.which("openssl") is None, reason="asks openssl for its judgement")
def test_another_library_finds_them_good(keys: Path) -> None:
    for role, purpose in (("router", "sslserver"), ("router", "sslclient"), ("host", "sslclient")):
        command = ["openssl", "verify", "-x509_strict", "-purpose", purpose, "-CAfile", "ca.pem", "certificate.pem"]
        subprocess.run(command, cwd=keys / role, check=True, capture_output=True)
    command = ["openssl", "verify", "-purpose", "sslserver", "-CAfile", "ca.pem", "certificate.pem"]
    assert subprocess.run(command, cwd=keys / "host", check=False, capture_output=True).returncode


def test_an_authority_stays_and_others_are_made_again(keys: Path) -> None:
    before = {one.name: one.path.read_bytes() for one in certificates(keys)}
    make_authority(keys, ["elsewhere.example"])
    after = {one.name: one.path.read_bytes() for one in certificates(keys)}
    assert [name for name in after if after[name] == before[name]] == ["authority"]


def test_given_again_without_hosts_the_router_keeps_its_addresses(keys: Path) -> None:
    make_authority(keys)
    (router,) = (one for one in certificates(keys) if one.name == "router")
    assert router.hosts == ("router.example", "10.0.0.5", "::1")


@pytest.mark.parametrize("lost", ["ca", "ca/key.pem"])
def test_no_new_authority_is_made_where_certificates_of_another_one_are(keys: Path, lost: str) -> None:
    (keys / lost).rename(keys.parent / "elsewhere")
    before = {path: path.read_bytes() for path in keys.rglob("*.pem")}
    with pytest.raises(ConfigError, match=r"but not the key of their authority, ca/key\.pem: put the key back"):
        make_authority(keys)
    assert {path: path.read_bytes() for path in keys.rglob("*.pem")} == before


def test_without_hosts_the_router_is_found_at_this_machine(tmp_path: Path) -> None:
    make_authority(tmp_path)
    (router,) = (one for one in certificates(tmp_path) if one.name == "router")
    assert {"localhost", "127.0.0.1", "::1"} <= set(router.hosts)


def test_an_expired_certificate_is_refused_with_the_command_for_a_new_one(
    keys: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    certify_agent(keys, "red", "A", days=40)
    files = files_of(keys, "agent:red/A")
    (agent,) = (one for one in certificates(keys) if one.name == "agent:red/A")
    assert (agent.days_left, agent.warning) == (40, "")
    later = datetime.now(UTC)
    remedy = "`khala keys agent A DIR --side red` makes a new one where the authority is"

    class Clock(datetime):
        @classmethod
        def now(cls, tz: object = None) -> datetime:  # type: ignore[override]
            return later

    monkeypatch.setattr(certificate, "datetime", Clock)
    later += timedelta(days=20)
    assert agent.warning == f"the certificate of agent:red/A expires in 20 days ({files.certificate}): {remedy}"
    check(BusConfig(tls=files))
    later += timedelta(days=21)
    with pytest.raises(BusError) as error:
        check(BusConfig(tls=files))
    assert str(error.value) == (
        f"the certificate of agent:red/A expired on {agent.ends:%Y-%m-%d} ({files.certificate}): {remedy}"
    )
    later += timedelta(days=3650)
    with pytest.raises(BusError, match=r"the certificate of authority expired .*: `khala keys init DIR` in a new dir"):
        check(BusConfig(tls=files))
    later -= timedelta(days=3750)
    with pytest.raises(BusError, match=r"is valid from .* on: is the clock right here"):
        check(BusConfig(tls=files))


def test_a_certificate_with_a_serial_number_below_zero_is_none(keys: Path) -> None:
    path = files_of(keys, "host").certificate
    found = x509.load_pem_x509_certificate(path.read_bytes())
    serial = found.serial_number.to_bytes((found.serial_number.bit_length() + 8) // 8, "big")
    der = found.public_bytes(Encoding.DER).replace(serial, bytes([serial[0] | 0x80]) + serial[1:])
    path.write_text(ssl.DER_cert_to_PEM_cert(der))
    with pytest.raises(BusError, match="holds no certificate in PEM: is the file whole"):
        certificate.read(path)


def test_what_cannot_be_made_is_refused(keys: Path, tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"has 71 characters of 64"):
        certify_agent(keys, "blue", "A" * 60)
    with pytest.raises(WrongKey, match="agent 'A/B' cannot stand in a key"):
        certify_agent(keys, "blue", "A/B")
    with pytest.raises(ConfigError, match=r"it holds the certificate of host"):
        issue(keys, "router", "host")
    with pytest.raises(ConfigError, match="holds no authority: make one with `khala keys init DIR`"):
        certify_agent(tmp_path / "nowhere", "blue", "A")
    with pytest.raises(ConfigError, match="'ä' is neither a host name in ASCII"):
        make_authority(keys, ["ä"])
    with pytest.raises(ConfigError) as error:
        files_of(keys, "agent:blue/A")
    assert str(error.value) == (
        f"{keys}: no certificate of agent:blue/A, there are host, router: make it with "
        "`khala keys agent A DIR --side blue`, and copy its folder"
    )
