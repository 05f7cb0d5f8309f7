"""Names that Windows lacks stand in the modules for platforms alone, and in each of them behind a fallback."""

import ast
from collections.abc import Iterator
from pathlib import Path

import mypy
import pytest

ROOT = Path(__file__).parents[2]
PACKAGES = ("khala_sc2", "agents", "bridge", "configs", "orchestrator", "protocol", "simulator/khala_simulator")
PLACES = {"protocol/khala_protocol/platforms.py"}
STUBS = Path(mypy.__file__).with_name("typeshed") / "stdlib"
STUB_OF = {"os": "os/__init__.pyi", "signal": "signal.pyi", "socket": "socket.pyi", "asyncio": "asyncio/streams.pyi"}
MODULES = {"fcntl", "grp", "posix", "pty", "pwd", "resource", "syslog", "termios", "tty"}
LOOP = {"add_reader", "add_signal_handler", "add_writer", "connect_read_pipe", "connect_write_pipe"}


def _holds(test: ast.expr, platform: str) -> bool:
    """Return whether a condition of a stub holds; one that asks for anything but the platform does."""
    match test:
        case ast.BoolOp(op=ast.And(), values=values):
            return all(_holds(value, platform) for value in values)
        case ast.BoolOp(op=ast.Or(), values=values):
            return any(_holds(value, platform) for value in values)
        case ast.Compare(
            left=ast.Attribute(attr="platform"), ops=[operator], comparators=[ast.Constant(value=str(named))]
        ):
            return (platform == named) is isinstance(operator, ast.Eq)
    return True


def _defined(body: list[ast.stmt], platform: str) -> Iterator[str]:
    for statement in body:
        match statement:
            case ast.If(test=test, body=then, orelse=otherwise):
                yield from _defined(then if _holds(test, platform) else otherwise, platform)
            case ast.FunctionDef(name=name) | ast.AsyncFunctionDef(name=name) | ast.ClassDef(name=name):
                yield name
                if isinstance(statement, ast.ClassDef):  # signals are members of an enumeration
                    yield from _defined(statement.body, platform)
            case ast.AnnAssign(target=ast.Name(id=name)):
                yield name
            case ast.Assign(targets=[ast.Name(id=name)]):
                yield name
            case ast.ImportFrom(names=names):
                yield from (alias.asname or alias.name for alias in names)


def _lacking(module: str) -> set[str]:
    """Return what a module has on Linux or macOS, and not on Windows."""
    body = ast.parse((STUBS / STUB_OF[module]).read_text("utf-8")).body
    elsewhere = {*_defined(body, "linux"), *_defined(body, "darwin")}
    return {name for name in elsewhere - {*_defined(body, "win32")} if not name.startswith("__")}


LACKING = {module: _lacking(module) for module in STUB_OF}


def names_that_windows_lacks(code: str) -> list[str]:
    """Return uses of such names, guarded or not."""
    found = []
    for node in ast.walk(ast.parse(code)):
        match node:
            case ast.Attribute(value=ast.Name(id=module), attr=name) if name in LACKING.get(module, ()):
                found.append(f"{module}.{name}")
            case ast.Attribute(attr=name) if name in LOOP:
                found.append(name)
            case ast.Call(
                func=ast.Name(id="hasattr" | "getattr"), args=[ast.Name(id=module), ast.Constant(str(name)), *_]
            ):
                found += [f"{module}.{name}"] if name in LACKING.get(module, ()) else []
            case ast.Import(names=names):
                found += [alias.name for alias in names if alias.name in MODULES]
            case ast.ImportFrom(module=str(module), names=names):
                found += [module] if module in MODULES else []
                found += [f"{module}.{alias.name}" for alias in names if alias.name in LACKING.get(module, ())]
    return found


@pytest.mark.parametrize(
    ("code", "name"),
    [
        ("os.getuid()", "os.getuid"),
        ("hasattr(os, 'sched_getaffinity')", "os.sched_getaffinity"),
        ("process.send_signal(signal.SIGKILL)", "signal.SIGKILL"),
        ("socket.socket(socket.AF_UNIX)", "socket.AF_UNIX"),
        ("from os import mkfifo", "os.mkfifo"),
        ("import fcntl", "fcntl"),
        ("loop.add_signal_handler(2, end)", "add_signal_handler"),
        ("asyncio.open_unix_connection(path)", "asyncio.open_unix_connection"),
    ],
)
def test_a_name_that_windows_lacks_is_found(code: str, name: str) -> None:
    assert names_that_windows_lacks(code) == [name]


def test_a_name_that_windows_has_is_not() -> None:
    assert not names_that_windows_lacks("os.getppid(), os.kill(1, signal.SIGTERM), socket.AF_INET6, os.link(a, b)")


def test_no_module_but_those_for_platforms_names_what_windows_lacks() -> None:
    paths = [path for package in PACKAGES for path in sorted((ROOT / package).rglob("*.py"))]
    uses = {path.relative_to(ROOT).as_posix(): names_that_windows_lacks(path.read_text("utf-8")) for path in paths}
    assert {name for name, names in uses.items() if names} == PLACES
