"""What is limited: curvature, skew, stretch, area element and distances, on samples and at points of surfaces."""
