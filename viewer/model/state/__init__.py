"""The state of the application, as frozen records."""
