"""Training of the ray transformer: procedural light fields with exact answers, losses, and the loop itself."""
