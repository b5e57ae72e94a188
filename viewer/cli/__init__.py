"""The `iibr` command: one file a command."""
