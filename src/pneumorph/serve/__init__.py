"""Runs in a browser on this machine: their page, live while they go on, and equilibria at any pressures."""
