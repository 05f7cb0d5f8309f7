"""Real time, with a clock that the test turns."""

import pytest
from s2clientprotocol import common_pb2
from s2clientprotocol import sc2api_pb2 as sc

from khala_simulator.process import clock as clocks
from khala_simulator.process.client import Client, ResponseError, interface


class Wall:
    """A wall clock that only moves when a task sleeps."""

    def __init__(self) -> None:
        self.now_s = 100.0

    def now(self) -> float:
        return self.now_s

    async def sleep(self, duration_s: float) -> None:
        self.now_s += duration_s


@pytest.fixture
def wall(monkeypatch: pytest.MonkeyPatch) -> Wall:
    wall = Wall()
    real = clocks.RealtimeClock
    monkeypatch.setattr("khala_simulator.process.joining.RealtimeClock", lambda game: real(game, wall.now, wall.sleep))
    return wall


@pytest.fixture
def client(wall: Wall) -> Client:  # the clock must be in place first
    client = Client()
    request = sc.RequestCreateGame(
        local_map=sc.LocalMap(map_path="2s3z"), realtime=True, player_setup=[sc.PlayerSetup(type=sc.Participant)]
    )
    client.ask(create_game=request)
    client.ask(join_game=sc.RequestJoinGame(race=common_pb2.Protoss, options=interface(screen=0)))
    return client


def test_the_game_runs_by_the_clock_on_the_wall(client: Client, wall: Wall) -> None:
    assert client.observe().observation.game_loop == 0
    wall.now_s += 1.0
    assert client.observe().observation.game_loop == 22
    wall.now_s += 1.0
    assert client.observe().observation.game_loop == 44


def test_an_observation_waits_for_its_loop(client: Client, wall: Wall) -> None:
    seen = client.ask(observation=sc.RequestObservation(game_loop=56)).observation
    assert seen.observation.game_loop == 56
    assert wall.now_s == pytest.approx(102.5, abs=0.05)


def test_nobody_waits_beyond_the_end(client: Client) -> None:
    response = client.ask(observation=sc.RequestObservation(game_loop=100_000))
    assert response.status == sc.ended
    assert response.observation.player_result


def test_stepping_is_an_error_of_usage(client: Client) -> None:
    with pytest.raises(ResponseError, match="step is not possible in a game in real time"):
        client.step()
