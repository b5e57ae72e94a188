"""What each action does to the state: pure functions."""
