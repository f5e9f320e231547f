"""Contact of a body with rigid obstacles and with itself: distances, energies, poses, friction, and what is pressed."""
