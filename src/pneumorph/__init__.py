"""pneumorph: automatic morphological design of pneumatic soft robots."""

__version__ = "0.1.0"
