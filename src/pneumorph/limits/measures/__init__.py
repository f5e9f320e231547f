"""What is limited: distances, curvature, skew, stretch and area element, on samples and at points of surfaces."""
