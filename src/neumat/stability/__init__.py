"""What drives methods to where they break: stresses, what must happen, what does, and which guard caught it."""
