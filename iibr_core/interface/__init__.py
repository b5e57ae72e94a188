"""The public Python interface, in parts: scenes, light fields in memory, figures. `iibr_core` offers its names."""
