"""The command line of the simulator: install it, look at what it has, run it by hand.

Mounted as `khala sc2`. Listings have `--json`: one object on stdout, everything else on stderr.
"""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Annotated, Any

import typer

from khala_simulator.process.install import InstallError, install, installed_version, link_maps
from khala_simulator.tables.versions import BUILD_OF_VERSION, DEFAULT_VERSION

app = typer.Typer(
    help="A headless StarCraft II that PySC2 and python-sc2 start and play as if it were the game.",
    no_args_is_help=True,
    add_completion=False,
)

Json = Annotated[bool, typer.Option("--json", help="Print one JSON object instead of text.")]
OwnMaps = Annotated[
    Path | None,
    typer.Option("--maps", help="Your own .SC2Map files: a directory of them, or a StarCraft II with a folder Maps."),
]
Version = Annotated[str, typer.Option(help=f"Version of the game: {' or '.join(BUILD_OF_VERSION)}.")]
Directory = Annotated[Path, typer.Argument(help="Made if it does not exist. Never one with a real StarCraft II.")]


@app.command("install")
def install_command(
    directory: Directory, maps: OwnMaps = None, version: Version = DEFAULT_VERSION, as_json: Json = False
) -> None:
    """Set up DIRECTORY like a StarCraft II install.

    Clients find it by the environment variable SC2PATH:

        khala sc2 install ~/khala-sc2

        export SC2PATH=~/khala-sc2

    Run it again to repair the install and update its maps; your additions stay. Your own maps are linked: terrain and
    units are read from the file, their scripts are not run. An install is one version of the game; with another
    --version it becomes that one.
    """
    try:
        root = install(directory, version)
        own = [] if maps is None else link_maps(root, maps)
    except InstallError as error:
        _say(f"Not installed: {error}.", err=True)
        raise typer.Exit(1) from error
    from khala_simulator.maps.game_map import map_names  # noqa: PLC0415  # numpy: 0.1 s of any --help

    linked = [entry.path for entry in own if not entry.trouble]
    if as_json:
        left_out = {str(entry.source): entry.trouble for entry in own if entry.trouble}
        facts = {"path": str(root), "version": version, "maps": list(map_names())}
        typer.echo(json.dumps({**facts, "linked": linked, "left_out": left_out}))
        return
    for entry in own:
        if entry.trouble:
            _say(f"Left out {entry.source}: {entry.trouble}.", err=True)
    and_yours = f" and {len(linked)} of yours" if maps is not None else ""
    _say(f"Installed version {version} with {len(map_names())} maps{and_yours}. Now: export SC2PATH={root}")


@app.command()
def info(as_json: Json = False) -> None:
    """Show which game this is, which maps it has, and where SC2PATH points."""
    facts = _facts()
    if as_json:
        typer.echo(json.dumps(facts))
        return
    _say(f"StarCraft II {facts['version']} (build {facts['build']}), simulated")
    _say(f"SC2PATH: {facts['sc2path'] or 'not set'} ({facts['sc2path_is']})")
    for entry in facts["maps"]:
        _say(f"  {entry['name']:<40} {entry['title']}")


def _say(text: str, *, err: bool = False) -> None:
    """Print a line; names and titles of map files come from anywhere, and none of their characters is obeyed."""
    typer.echo("".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text), err=err)


def _facts() -> dict[str, Any]:
    from khala_simulator.maps.game_map import map_names, map_title  # noqa: PLC0415  # numpy: 0.1 s of any --help

    path = os.environ.get("SC2PATH")
    version = None if not path else installed_version(path)
    if not path:
        kind = "run khala sc2 install DIRECTORY first"
    elif version is not None:
        kind = "this simulator"
    elif Path(path).is_dir():
        kind = "not an install of this simulator"
    else:
        kind = "no such directory"
    maps = [{"name": name, "title": map_title(name)} for name in map_names()]
    shown = version or DEFAULT_VERSION
    return {"version": shown, "build": BUILD_OF_VERSION[shown], "sc2path": path, "sc2path_is": kind, "maps": maps}


@app.command()
def serve(
    port: Annotated[int, typer.Option(help="Port of the websocket /sc2api.", min=1, max=65535)] = 5000,
    host: Annotated[str, typer.Option(help="Address to listen on, IPv4 or IPv6.")] = "127.0.0.1",
    data_dir: Annotated[Path, typer.Option(help="An install, for its maps and replays.")] = Path(),
) -> None:
    """Run one game process in the foreground, for debugging.

    PySC2 attaches to it with --sc2_port; it ends when a client says quit, or with Ctrl+C.
    """
    from khala_simulator.__main__ import main  # noqa: PLC0415  # it takes over signals and sockets

    _say(f"Listening on ws://{host}:{port}/sc2api", err=True)
    main(["-listen", host, "-port", str(port), "-dataDir", str(data_dir)])
