"""PySC2's own tools on the install that SC2PATH names: run by `test_pysc2_tools.py`, each in a process of its own.

The tools define flags of the same names, so one process can't hold two of them. What they found goes to a file as JSON.
"""

import importlib
import json
import runpy
import sys
from pathlib import Path
from typing import Any

from absl import flags

import khala_bridge.compat  # noqa: F401  # makes PySC2 importable on Python of today


class _Nobody:
    """Takes the news of a worker process that this is not."""

    def put(self, news: object) -> None:
        """Take news."""


def replay_actions(replay: Path) -> dict[str, Any]:
    """Return what `replay_actions` counts in a replay, seen by either player.

    Its worker asks for replays of the ladder first: by both players' ratings, which games over the API do not have.
    """
    from pysc2 import run_configs
    from pysc2.bin import replay_actions as tool

    flags.FLAGS(["replay_actions", f"--replays={replay.parent}"])
    run_config, data, found = run_configs.get(), replay.read_bytes(), {}
    for player in (1, 2):
        worker = tool.ReplayProcessor(0, run_config, None, _Nobody())
        with run_config.start(want_rgb=False) as controller:
            info = controller.replay_info(data)
            worker.process_replay(controller, data, run_config.map_data(info.local_map_path), player)
            stats = worker.stats.replay_stats
            again = controller.replay_info(data)  # as it asks before the next replay, in the state of this one
        found[str(player)] = {
            "steps": stats.steps,
            "units": sorted(stats.unit_ids),
            "made": {str(number): count for number, count in sorted(stats.made_abilities.items())},
            "loops": again.game_duration_loops,
        }
    return found


def check_apm() -> dict[str, Any]:
    """Return the actions a minute of two games that `check_apm` plays: without actions, and with an order a step."""
    from pysc2.bin import check_apm as tool

    flags.FLAGS(["check_apm"])
    env = tool.Env()
    for _ in env.check_apm("nothing"):
        pass
    for _, obs in env.check_apm("stop"):
        probes = tool.get_units(obs, unit_type=84)
        env.raw_unit_command(4, next(iter(probes)))
    return {name: info.player_info[0].player_apm for name, info in env._summary}


def play(replay: Path, player: str) -> None:
    """Watch a replay with `play`, without a window.

    In PySC2 4.0.0 a package hides the module of the same name from which it takes a function.
    """
    package = importlib.import_module("pysc2.lib.replay")
    hidden = Path(str(package.__file__)).parent.with_suffix(".py")
    package.get_replay_version = runpy.run_path(str(hidden))["get_replay_version"]  # type: ignore[attr-defined]  # see above
    sys.argv = ["play", "--norender", f"--replay={replay}", f"--observed_player={player}", "--fps=100000"]
    runpy.run_module("pysc2.bin.play", run_name="__main__")


def main(tool: str, out: Path, *arguments: str) -> None:
    """Run a tool, and write what it found."""
    match tool:
        case "replay_actions":
            out.write_text(json.dumps(replay_actions(Path(arguments[0]))))
        case "check_apm":
            out.write_text(json.dumps(check_apm()))
        case "play":
            play(Path(arguments[0]), arguments[1])
        case _:
            raise ValueError(tool)


if __name__ == "__main__":
    main(sys.argv[1], Path(sys.argv[2]), *sys.argv[3:])
