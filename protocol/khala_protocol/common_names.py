"""The common names of certificates: `khala_protocol.certificates` writes them, `khala_protocol.access` has their rules.

Apart from both, because a host that counts what agents send needs no library for certificates.
"""

from __future__ import annotations

from khala_protocol.keys import check_name

AUTHORITY, ROUTER, HOST, OBSERVER = "authority", "router", "host", "observer"


def agent_name(side: str, agent: str) -> str:
    """Return the common name of an agent's certificate."""
    return f"agent:{check_name(side, 'side')}/{check_name(agent, 'agent')}"


def adviser_name(side: str, adviser: str) -> str:
    """Return the common name of an adviser's certificate."""
    return f"adviser:{check_name(side, 'side')}/{check_name(adviser, 'adviser')}"
