"""The `iibr` command: one file a command, one line for each in `main`."""
