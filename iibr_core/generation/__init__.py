"""All views of a light field, and what making them takes."""
