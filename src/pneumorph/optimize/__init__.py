"""The design loop: proxy, sub-problem, trust region (the paper's Sections V and VI)."""
