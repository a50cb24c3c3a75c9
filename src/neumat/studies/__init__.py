"""What only tables and charts need: comparisons, judges, speed-accuracy sweeps."""
