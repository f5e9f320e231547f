"""The example of a controller: it leads the tip to places, and its node says in ROS 2's units what it does.

ROS 2 is not installed by pip: the node runs with stand-ins for the few of its functions that it calls.
"""

import importlib.util
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest
from models import model_file

from pneumorph.surrogate.reader import Model

FILE = Path(__file__).parents[2] / "examples" / "control" / "follow.py"


@pytest.fixture(scope="module")
def follow():
    spec = importlib.util.spec_from_file_location("follow", FILE)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def path(tmp_path):
    return model_file(tmp_path / "model.npz")


def test_the_tip_arrives_and_pressures_change_no_faster_than_asked(follow, path):
    model = Model(path)
    goal = model.pose([0.03, 0.01]).translation
    follower = follow.Follower(model, fastest=0.05)
    follower.aim({"shift_x": goal[0], "shift_y": goal[1]})
    ways = [np.array(list(follower.step(0.0).values()))]
    ways += [np.array(list(follower.step(0.02).values())) for _ in range(100)]
    assert np.abs(np.diff(ways, axis=0)).max() <= 0.05 * 0.02 * (1 + 1e-9)
    assert model.pose(ways[-1]).translation[:2] == pytest.approx(goal[:2], abs=1e-3)
    assert follower.missed < 1e-3
    # On a straight way: all pressures arrive together.
    way, whole = ways[10] - ways[0], ways[-1] - ways[0]
    assert way[0] * whole[1] == pytest.approx(way[1] * whole[0], abs=1e-12)


def test_what_is_out_of_reach_is_approached_within_the_domain(follow, path):
    model = Model(path)
    follower = follow.Follower(model)
    follower.aim({"shift_x": 300.0})
    assert follower.missed > 100.0
    assert model.inside(follower.step(1e3))


def ros(messages, heard):
    """Stand-ins: a node that gets targets in turn, with a tick of the timer after each."""
    node = SimpleNamespace(
        create_publisher=lambda kind, topic, depth: SimpleNamespace(publish=lambda sent: heard.append(sent.data)),
        create_subscription=lambda kind, topic, call, depth: setattr(node, "aim", call),
        create_timer=lambda period, call: setattr(node, "tick", call),
        get_logger=lambda: SimpleNamespace(warning=heard.append, error=heard.append),
        destroy_node=lambda: None,
    )

    def spin(of):
        for each in messages:
            of.aim(SimpleNamespace(point=SimpleNamespace(**dict(zip("xyz", each, strict=True)))))
            of.tick()
        raise KeyboardInterrupt

    parts = {"rclpy": ModuleType("rclpy"), "geometry_msgs.msg": ModuleType("m"), "std_msgs.msg": ModuleType("m")}
    vars(parts["rclpy"]).update(init=lambda: None, create_node=lambda name: node, spin=spin, try_shutdown=lambda: None)
    vars(parts["geometry_msgs.msg"]).update(PointStamped=SimpleNamespace)
    vars(parts["std_msgs.msg"]).update(Float64MultiArray=SimpleNamespace)
    return parts | {name: ModuleType(name) for name in ("geometry_msgs", "std_msgs")}


def test_the_node_speaks_in_metres_and_pascals(follow, path, monkeypatch):
    goal = Model(path).pose([0.03, 0.01]).translation / 1e3
    heard = []
    for name, module in ros([goal, (3.0, 0.0, 0.0), (np.nan, 0.0, 0.0)], heard).items():
        monkeypatch.setitem(sys.modules, name, module)
    monkeypatch.setattr(sys, "argv", ["follow.py", str(path)])
    follow.main()
    first, warning, _, mistake, _ = heard
    assert max(first) == pytest.approx(1e6 * follow.FASTEST * follow.PERIOD)
    assert "out of reach" in warning and "is no number" in mistake
