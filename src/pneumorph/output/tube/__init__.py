"""What is drawn of tubes alone."""
