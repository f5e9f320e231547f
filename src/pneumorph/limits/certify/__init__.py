"""How limits are certified: enclosures on whole surfaces, by Taylor models, control nets, and branch and bound."""
