"""How limits on tubes are certified: enclosures on knot spans, by Taylor models, control nets, and branch and bound."""
