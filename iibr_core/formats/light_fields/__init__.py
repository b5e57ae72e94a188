"""Light fields on disk: one file a layout."""
