"""What may be spent on models, and what was: a cap that holds whatever becomes of a request.

    async with budget.holding(0.02) as bill:      # raises `LimitExceeded` where less is left
        completion = await client.complete(request)
        bill.settle(0.004)                  # what it cost; without this line it has cost the 0.02

A request is booked at the most that it may cost before it is sent. Once its cost is known, the rest is given back. A
request that was cancelled, whose connection broke, or whose answer does not say what it cost keeps what was booked: the
provider may have charged it. So a sum never lags behind what was charged, also if this process is killed.

Sums stand in a `Ledger`. In a file, it is shared by the processes of a match, and a resumed match finds it again.
Several budgets may share a ledger: each has an account there.
"""

from __future__ import annotations

import asyncio
import os
import sqlite3
import weakref
from contextlib import asynccontextmanager, closing, contextmanager, suppress
from typing import TYPE_CHECKING, Self

from khala_agents.llm.client import LimitExceeded
from khala_protocol.errors import ConfigError
from khala_protocol.transaction import transaction

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Iterator
    from pathlib import Path

SUFFIX = ".ledger"
"""Of the file beside a recording."""
PATIENCE_S = 10.0
"""How long a process waits for another that writes to the same file, which takes some 0.1 ms."""
LEAST_USD = 1e-9
"""Sums of money are not exact: a cap is not exceeded by less."""
_SCHEMA = """
create table paid (account text primary key, usd real not null);
create table held (entry integer primary key autoincrement, account text not null, usd real not null);
"""


class MoneyLedger:
    """Sums of money in US dollars by account, in memory or in a file, which is closed with the last use of the ledger.

    Args:
        path: of the file, which is made when something is booked; None to keep the sums in memory.

    Raises:
        ConfigError: at any method, if the file cannot be read or written.
    """

    def __init__(self, path: Path | None = None) -> None:
        self.path = path
        self._database: sqlite3.Connection | None = None

    @property
    def exists(self) -> bool:
        """Whether anything was ever booked in its file."""
        return self.path is not None and self.path.exists()

    def booked_usd(self, account: str | None = None) -> float:
        """Return what an account has paid, and the most that its requests under way may cost; None for all accounts."""
        if self.path is not None and not self.exists:
            return 0.0
        with self._writing() as database:
            return _sum(database, "paid", account) + _sum(database, "held", account)

    def paid_usd(self, account: str) -> float:
        """Return what an account has paid."""
        if self.path is not None and not self.exists:
            return 0.0
        with self._writing() as database:
            return _sum(database, "paid", account)

    def hold(self, account: str, usd: float, limit_usd: float | None) -> int:
        """Book the most that a request may cost, and return the number of the entry.

        Raises:
            Overdrawn: the account would have more booked than its limit.
        """
        with self._writing() as database:
            paid_usd, held_usd = _sum(database, "paid", account), _sum(database, "held", account)
            if limit_usd is not None and paid_usd + held_usd + usd > limit_usd + LEAST_USD:
                raise Overdrawn(paid_usd, held_usd)
            entry = database.execute("insert into held (account, usd) values (?, ?)", (account, usd)).lastrowid
        assert entry is not None
        return entry

    def settle(self, entry: int, usd: float) -> None:
        """Replace what was held for a request by what it has cost."""
        with self._writing() as database:
            row = database.execute("delete from held where entry = ? returning account", (entry,)).fetchone()
            if row is not None:
                _pay(database, row[0], usd)

    def pay(self, account: str, usd: float) -> None:
        """Add what was paid without an entry."""
        with self._writing() as database:
            _pay(database, account, usd)

    def close(self) -> None:
        """Close the file. May be called twice, and the ledger be used again."""
        database, self._database = self._database, None
        if database is not None:
            database.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    @contextmanager
    def _writing(self) -> Iterator[sqlite3.Connection]:
        """Give the database for one step that no other process sees in part."""
        try:
            if self._database is None:
                self._database = self._open()
                weakref.finalize(self, self._database.close)
            with transaction(self._database):
                yield self._database
        except (sqlite3.Error, OSError) as error:
            fault = f"this ledger of what was spent cannot be kept, and no model is asked without it ({error}): remove "
            fault += "it if you know what was spent, or record elsewhere with --out"
            raise ConfigError(fault, source=str(self.path)) from None

    def _open(self) -> sqlite3.Connection:
        if self.path is None:
            database = sqlite3.connect(":memory:", isolation_level=None, check_same_thread=False)
            database.executescript(_SCHEMA)
            return database
        if not self.path.exists():
            _create(self.path)
        database = sqlite3.connect(self.path, timeout=PATIENCE_S, isolation_level=None, check_same_thread=False)
        try:
            database.execute("select 1 from paid, held limit 1")  # an empty file, or another one, has no such tables
            # Without a sync, a killed process loses nothing, only a power failure may. With a log, a request takes
            # 0.2 ms.
            database.executescript("pragma journal_mode = wal; pragma synchronous = off;")
        except BaseException:
            database.close()
            raise
        return database


def _create(path: Path) -> None:
    """Make an empty ledger, whole or not at all; one that another process makes meanwhile stays."""
    part = path.with_name(f".{path.name}.{os.getpid()}")
    part.unlink(missing_ok=True)
    part.touch(0o600)
    try:
        with closing(sqlite3.connect(part)) as database:
            database.executescript(_SCHEMA)
        with suppress(FileExistsError):
            os.link(part, path)
    finally:
        part.unlink()


class Overdrawn(Exception):
    """An account has too little left.

    Attributes:
        paid_usd: what it has paid.
        held_usd: the most that its requests under way may cost.
    """

    def __init__(self, paid_usd: float, held_usd: float) -> None:
        self.paid_usd, self.held_usd = paid_usd, held_usd
        super().__init__(f"{paid_usd:.4f} USD are paid and {held_usd:.4f} held")


class Bill:
    """What one request costs."""

    def __init__(self, most_usd: float) -> None:
        self.usd = most_usd

    def settle(self, usd: float) -> None:
        """Say what it cost."""
        self.usd = usd


class SharedBudget:
    """What some agents may spend together.

    Args:
        limit_usd: None for no limit.
        ledger: where the sums stand; None: in memory.
        account: of these agents in the ledger.
        source: where the limit was set, for errors.
    """

    def __init__(
        self,
        limit_usd: float | None,
        *,
        ledger: MoneyLedger | None = None,
        account: str = "",
        source: str = "the budget",
    ) -> None:
        self.limit_usd = limit_usd
        self.source = source
        self._ledger = ledger or MoneyLedger()
        self._account = account
        self._under_way = 0
        self._settled = asyncio.Event()

    @property
    def booked_usd(self) -> float:
        """What was spent, and the most that requests under way may cost."""
        return self._ledger.booked_usd(self._account)

    def check(self) -> None:
        """Raise `LimitExceeded` if all is spent."""
        if self.limit_usd is not None and (paid_usd := self._ledger.paid_usd(self._account)) >= self.limit_usd:
            words = f"{self.source} is {self.limit_usd:g} USD, and {paid_usd:.4f} are spent"
            raise LimitExceeded("budget_usd", value=paid_usd, limit=self.limit_usd, source=self.source, words=words)

    @asynccontextmanager
    async def holding(self, most_usd: float, deadline: float | None = None) -> AsyncIterator[Bill]:
        """Book the most that a request may cost, and what its bill says afterwards.

        Where others of this process hold the money, wait until they give back what they do not spend.

        Args:
            most_usd: of the request; 0 for a model that costs nothing.
            deadline: until when it is worth waiting, on the clock of the running loop; None for ever.

        Raises:
            LimitExceeded: there is not so much left.
        """
        if not most_usd:
            yield Bill(0.0)
            return
        entry = await self._hold(most_usd, deadline)
        self._under_way += 1
        bill = Bill(most_usd)
        try:
            yield bill
        finally:
            self._under_way -= 1
            self._ledger.settle(entry, bill.usd)
            settled, self._settled = self._settled, asyncio.Event()
            settled.set()

    async def _hold(self, most_usd: float, deadline: float | None) -> int:
        while True:
            try:
                return self._ledger.hold(self._account, most_usd, self.limit_usd)
            except Overdrawn as error:
                assert self.limit_usd is not None
                refused = LimitExceeded(
                    "budget_usd",
                    value=error.paid_usd + error.held_usd + most_usd,
                    limit=self.limit_usd,
                    source=self.source,
                    words=f"{self.source} is {self.limit_usd:g} USD, of which {error.paid_usd:.4f} are spent and "
                    f"{error.held_usd:.4f} held for requests under way: the next request may cost {most_usd:.4f}",
                )
            if not self._under_way:
                raise refused
            try:
                async with asyncio.timeout_at(deadline):
                    await self._settled.wait()
            except TimeoutError:
                raise refused from None


def _sum(database: sqlite3.Connection, table: str, account: str | None) -> float:
    whose, values = ("", ()) if account is None else (" where account = ?", (account,))
    return float(database.execute(f"select total(usd) from {table}{whose}", values).fetchone()[0])  # noqa: S608  # ours


def _pay(database: sqlite3.Connection, account: str, usd: float) -> None:
    database.execute(
        "insert into paid values (?, ?) on conflict (account) do update set usd = usd + excluded.usd", (account, usd)
    )
