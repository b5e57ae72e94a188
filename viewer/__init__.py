"""The program: command line, window, panels, worker and GPU renderer around iibr_core."""
