"""Speed against error: what every switch costs and what it brings, and how cost grows with what a scene asks for."""
