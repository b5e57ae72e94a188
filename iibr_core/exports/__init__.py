"""What a scene can be exported as: one file a kind, one line each in `kinds.py`."""
