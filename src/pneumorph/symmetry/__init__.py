"""The symmetry of a body: its operations, images under them, and what part of the body is meshed and solved."""
