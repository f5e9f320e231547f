"""Layouts for a motion: bodies are drawn, designed a little, and the best of them designed further."""

from pneumorph.proposals.candidates import Candidate, draw_candidates
from pneumorph.proposals.proposal import Plan, Proposal
from pneumorph.proposals.search import propose
from pneumorph.proposals.target import Target, load_target

__all__ = ["Candidate", "Plan", "Proposal", "Target", "draw_candidates", "load_target", "propose"]
