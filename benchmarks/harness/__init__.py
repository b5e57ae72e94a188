"""The shared parts of benchmarks: scenes, timing, reports and how they are called, plots; each once."""
