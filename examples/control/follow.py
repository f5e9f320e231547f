"""The tip follows places by a fast model: a controller without feedback, and a ROS 2 node around it.

    pneumorph model runs/arm                      # writes runs/arm/model.npz
    python follow.py runs/arm/model.npz           # where ROS 2 is installed

The node listens to `target`, where the tip is to go from where it is without pressure, in metres along the axes of
the body, and publishes `pressures` in Pa, 50 times a second. It needs NumPy and pneumorph's `surrogate/reader.py`,
which may lie beside this file.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping

import numpy as np

try:
    from reader import Model, ModelError  # pyright: ignore[reportMissingImports]
except ImportError:
    from pneumorph.surrogate.reader import Model, ModelError

PERIOD = 0.02
"""Seconds between two messages."""

FASTEST = 0.05
"""MPa per second by which a pressure changes at most: what the valves can do, and the body follows without swinging."""


class Follower:
    """Pressures that lead the tip to one place after another.

    Parameters
    ----------
    model : of the body.
    fastest : largest change of a pressure, MPa per second.
    """

    def __init__(self, model: Model, fastest: float = FASTEST) -> None:
        self.model, self.fastest = model, fastest
        self.pressures = np.clip(0.0, *model.bounds[: len(model.chambers)].T)
        self.goal = self.pressures.copy()
        self.missed = 0.0

    def aim(self, place: Mapping[str, float]) -> None:
        """Go on to a place: some of `shift_x`, `shift_y` and `extension`, mm, or turns, rad.

        What is out of reach is approached as far as the domain of the model goes; `missed` is how far it is off then.
        """
        near = dict(zip(self.model.chambers, self.goal.tolist(), strict=True))
        found = self.model.pressures_for(place, near)
        self.goal = np.array([found.pressures[name] for name in self.model.chambers])
        self.missed = found.missed

    def step(self, seconds: float) -> dict[str, float]:
        """The pressures after so many seconds, MPa by chamber."""
        most = self.fastest * seconds
        change = self.goal - self.pressures
        # All of them on one straight way, so that the tip does not stray.
        self.pressures = self.pressures + change * min(1.0, most / max(float(np.abs(change).max()), 1e-12))
        return dict(zip(self.model.chambers, self.pressures.tolist(), strict=True))


def main() -> None:
    """The node."""
    import rclpy  # pyright: ignore[reportMissingImports]
    from geometry_msgs.msg import PointStamped  # pyright: ignore[reportMissingImports]
    from std_msgs.msg import Float64MultiArray  # pyright: ignore[reportMissingImports]

    follower = Follower(Model(sys.argv[1]))
    rclpy.init()
    node = rclpy.create_node("pneumorph_follow")
    publisher = node.create_publisher(Float64MultiArray, "pressures", 10)

    def aim(message: PointStamped) -> None:
        point = message.point
        try:
            follower.aim({"shift_x": 1e3 * point.x, "shift_y": 1e3 * point.y, "extension": 1e3 * point.z})
        except ModelError as error:
            node.get_logger().error(str(error))
            return
        if follower.missed > 0.1:
            node.get_logger().warning(f"the target is out of reach by {follower.missed:.2g} mm")

    def publish() -> None:
        publisher.publish(Float64MultiArray(data=[1e6 * each for each in follower.step(PERIOD).values()]))

    node.create_subscription(PointStamped, "target", aim, 10)
    node.create_timer(PERIOD, publish)
    try:
        rclpy.spin(node)
    except KeyboardInterrupt:
        pass
    finally:
        node.destroy_node()
        rclpy.try_shutdown()


if __name__ == "__main__":
    main()
